//! The H-Wall libraries for Python, exported by `hwall/__init__.py` and its modules.

mod arm;
mod arrays;
mod bip;
mod contact;
mod error;
mod hand;
mod reach;
mod scene;
mod session;
mod sim;
mod texton;

use pyo3::prelude::*;

#[pymodule]
fn _hwall(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add("Error", m.py().get_type::<error::Error>())?;
    m.add_class::<arm::PyArm>()?;
    m.add_class::<arm::Verdict>()?;
    m.add_class::<arm::Verdicts>()?;
    m.add_class::<arm::Nearest>()?;
    m.add_class::<arm::Nearests>()?;
    m.add_class::<scene::PyScene>()?;
    m.add_class::<scene::PyRoom>()?;
    m.add_class::<reach::ReachMap>()?;
    m.add_class::<reach::PyWallMaps>()?;
    m.add_class::<reach::Region>()?;
    m.add_class::<reach::Placements>()?;
    m.add_function(wrap_pyfunction!(reach::reach_map, m)?)?;
    m.add_function(wrap_pyfunction!(reach::wall_maps, m)?)?;
    m.add_function(wrap_pyfunction!(reach::wall_region, m)?)?;
    m.add_function(wrap_pyfunction!(reach::base_placement, m)?)?;
    m.add_function(wrap_pyfunction!(reach::places_on_wall, m)?)?;
    m.add_class::<bip::PyModel>()?;
    m.add_class::<bip::Filter>()?;
    m.add_class::<bip::Prediction>()?;
    m.add_function(wrap_pyfunction!(bip::fit, m)?)?;
    m.add_function(wrap_pyfunction!(bip::load, m)?)?;
    m.add_class::<hand::PyFrame>()?;
    m.add_class::<hand::PyReach>()?;
    m.add_function(wrap_pyfunction!(hand::reaches_from_csv, m)?)?;
    m.add_function(wrap_pyfunction!(hand::recordings_from_csv, m)?)?;
    m.add_function(wrap_pyfunction!(hand::recordings_to_csv, m)?)?;
    m.add_class::<contact::PyLearned>()?;
    m.add_class::<contact::Estimator>()?;
    m.add_class::<contact::PyPredictor>()?;
    m.add_class::<session::PySession>()?;
    m.add_class::<sim::PyServoArm>()?;
    m.add_class::<sim::PyPerson>()?;
    m.add_class::<sim::Touches>()?;
    m.add_function(wrap_pyfunction!(sim::finger_force, m)?)?;
    m.add_class::<texton::PyTexture>()?;
    m.add_class::<texton::PyPatch>()?;
    m.add_function(wrap_pyfunction!(texton::design_texture, m)?)?;
    Ok(())
}
