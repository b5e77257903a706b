//! Textured boards: bumps, plates to print, predicted roughness, and designs. Lengths in mm, angles in degrees.

use crate::arrays::{Array, array};
use crate::error::{OrRaise, one_of};
use hwall::texton::{
    DesignRequest, HeightField, Layout, Patch, PatchSpec, Prediction, PrintProcess, Printer, Radii,
    ScanAngle, StlFormat, Tessellation, Texton, Texture, Vibration, design, roughness_models,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// Bumps of one shape on a grid. Angles count from the long axis of the bumps.
#[pyclass(frozen, module = "hwall.texton", name = "Texture")]
pub(crate) struct PyTexture {
    texture: Texture,
}

#[pymethods]
impl PyTexture {
    /// Half-ellipsoids with half axes `radii` (long, short) and `height`, `pitch` (long, short) apart, mm; `staggered`:
    /// every other row shifted by half a pitch.
    #[new]
    #[pyo3(signature = (radii, height, pitch, *, staggered=false))]
    fn new(radii: [f64; 2], height: f64, pitch: [f64; 2], staggered: bool) -> PyResult<Self> {
        let [long_mm, short_mm] = radii;
        let texton = Texton::hemiellipsoid(Radii { long_mm, short_mm }, height).or_raise()?;
        let [long_mm, short_mm] = pitch;
        let layout = match staggered {
            true => Layout::Staggered { long_mm, short_mm },
            false => Layout::Rectangular { long_mm, short_mm },
        };
        let texture = Texture::new(texton, layout).or_raise()?;
        Ok(Self { texture })
    }

    /// The texture of the board that was released with the studies.
    #[staticmethod]
    fn released() -> Self {
        Self {
            texture: Texture::released(),
        }
    }

    /// Half the axes of a bump, (long, short), mm.
    #[getter]
    fn radii(&self) -> [f64; 2] {
        self.texture.texton().radii().to_array()
    }

    /// Height of a bump, mm.
    #[getter]
    fn height(&self) -> f64 {
        self.texture.texton().height_mm()
    }

    /// Distances of neighbouring bumps, (long, short), mm.
    #[getter]
    fn pitch(&self) -> [f64; 2] {
        self.texture.layout().pitch_mm()
    }

    /// Least gap between bumps, mm.
    #[getter]
    fn gap(&self) -> f64 {
        self.texture.gap_mm()
    }

    /// Share of the plate that bumps cover.
    #[getter]
    fn coverage(&self) -> f64 {
        self.texture.coverage()
    }

    /// Bumps passing a finger per second, Hz, at `speed`, mm/s, in the direction `angle`, degrees.
    fn frequency(&self, angle: f64, speed: f64) -> PyResult<f64> {
        let scan = ScanAngle::from_deg(angle).or_raise()?;
        hwall::numeric::check::finite("speed", speed).or_raise()?;
        Ok(self.texture.encounter_frequency_hz(scan, speed))
    }

    /// Roughness at `angle` (degrees) and `speed` (mm/s) by every published model: dicts of model, value (None
    /// if the model does not apply), within (its range), quantity, source.
    fn roughness<'py>(
        &self,
        py: Python<'py>,
        angle: f64,
        speed: f64,
    ) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let scan = ScanAngle::from_deg(angle).or_raise()?;
        let all = roughness_models().into_iter().map(|model| {
            let prediction: Prediction = model.predict(&self.texture, scan, speed).or_raise()?;
            let (info, found) = (model.info(), PyDict::new(py));
            found.set_item("model", info.name)?;
            found.set_item("value", prediction.value())?;
            found.set_item("within", prediction.is_within())?;
            found.set_item("quantity", info.quantity)?;
            found.set_item("source", info.source)?;
            Ok(found)
        });
        all.collect()
    }
}

/// A plate with bumps, from (0, 0) to `size`, its top at z = 0, x along the long axis of the bumps.
#[pyclass(frozen, module = "hwall.texton", name = "Patch")]
pub(crate) struct PyPatch {
    patch: Patch,
}

impl PyPatch {
    fn field(&self, py: Python<'_>, pitch: f64) -> PyResult<HeightField> {
        py.detach(|| self.patch.height_field(pitch)).or_raise()
    }
}

#[pymethods]
impl PyPatch {
    /// `size` along x and y and thickness `plate`, mm.
    #[new]
    #[pyo3(signature = (texture, size=[50.0, 50.0], *, plate=1.0))]
    fn new(texture: PyRef<'_, PyTexture>, size: [f64; 2], plate: f64) -> PyResult<Self> {
        let spec = PatchSpec {
            size_mm: size,
            plate_mm: plate,
            ..PatchSpec::default()
        };
        let patch = Patch::new(texture.texture, spec).or_raise()?;
        Ok(Self { patch })
    }

    /// The patch that was released with the studies: 200 x 200 mm in four tiles.
    #[staticmethod]
    fn released() -> Self {
        Self {
            patch: Patch::released(),
        }
    }

    /// Middles of the bumps, (n, 2), mm.
    #[getter]
    fn centres<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let centres = self.patch.centres_mm();
        let count = centres.len();
        array(
            py,
            centres.flat_map(|c| c.to_array()).collect(),
            &[count, 2],
        )
    }

    /// Volume of plate and bumps, mm3.
    #[getter]
    fn volume(&self) -> f64 {
        self.patch.volume_mm3()
    }

    /// Heights above the plate, (rows, columns) float32, mm, the row of least y first, pixels `pitch` mm apart: for
    /// `imshow(..., origin="lower")`.
    #[pyo3(signature = (pitch=0.1))]
    fn heights<'py>(&self, py: Python<'py>, pitch: f64) -> PyResult<Array<'py, f32>> {
        let field = self.field(py, pitch)?;
        let [columns, rows] = field.size();
        array(py, field.heights_mm().to_vec(), &[rows, columns])
    }

    /// Closed mesh, no further than `accuracy` mm from the true surface: points (n, 3), mm, and triangles (m, 3) uint32.
    #[pyo3(signature = (accuracy=0.01))]
    fn mesh<'py>(&self, py: Python<'py>, accuracy: f64) -> PyResult<(Array<'py>, Array<'py, u32>)> {
        let mesh = py
            .detach(|| self.patch.mesh(&Tessellation::with_accuracy_mm(accuracy)))
            .or_raise()?;
        let (points, triangles) = (mesh.points_mm(), mesh.triangles());
        Ok((
            array(py, points.as_flattened().to_vec(), &[points.len(), 3])?,
            array(py, triangles.as_flattened().to_vec(), &[triangles.len(), 3])?,
        ))
    }

    /// Writes the mesh as binary STL (or OBJ, by the file extension), mm.
    #[pyo3(signature = (path, accuracy=0.01))]
    fn write_mesh(&self, py: Python<'_>, path: PathBuf, accuracy: f64) -> PyResult<()> {
        py.detach(|| {
            let mesh = self.patch.mesh(&Tessellation::with_accuracy_mm(accuracy))?;
            match path
                .extension()
                .is_some_and(|end| end.eq_ignore_ascii_case("obj"))
            {
                true => mesh.write_obj(&path),
                false => mesh.write_stl(&path, StlFormat::Binary),
            }
        })
        .or_raise()
    }

    /// Writes the heights as a 32-bit OpenEXR picture, mm.
    #[pyo3(signature = (path, pitch=0.1))]
    fn write_exr(&self, py: Python<'_>, path: PathBuf, pitch: f64) -> PyResult<()> {
        self.field(py, pitch)?.write_exr(path).or_raise()
    }

    /// Check for a typical printer: pairs of (is it a fault, finding).
    fn print_check(&self) -> Vec<(bool, String)> {
        let findings = self.patch.print_check(&Printer::default());
        findings
            .iter()
            .map(|f| (f.is_fault(), f.to_string()))
            .collect()
    }
}

/// Textures and levels with these ratios of roughness, for a printing `process` ("fdm", "sla" or "polyjet"), the best
/// first: dicts of texture, levels (dicts of wanted, angle in degrees, speed in mm/s, magnitude), worst_error (in just
/// noticeable differences) and given_up (compromises, as text). An impossible request is an error that states the nearest
/// possible one.
#[pyfunction]
#[pyo3(name = "design", signature = (ratios, process="sla"))]
pub(crate) fn design_texture<'py>(
    py: Python<'py>,
    ratios: Vec<f64>,
    process: &str,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let known = [
        ("fdm", PrintProcess::Fdm),
        ("sla", PrintProcess::Sla),
        ("polyjet", PrintProcess::PolyJet),
    ];
    let (process, model) = (one_of("process", process, &known)?, Vibration::default());
    let candidates = py
        .detach(|| design(&DesignRequest::of_ratios(ratios, &model, process)))
        .or_raise()?;
    let all = candidates.into_iter().map(|candidate| {
        let levels = candidate.levels.iter().map(|level| {
            let found = PyDict::new(py);
            found.set_item("wanted", level.wanted)?;
            found.set_item("angle", level.scan.deg())?;
            found.set_item("speed", level.speed_mm_per_s)?;
            found.set_item("magnitude", level.magnitude)?;
            Ok(found)
        });
        let given_up = candidate.given_up.iter().map(ToString::to_string);
        let found = PyDict::new(py);
        found.set_item("levels", levels.collect::<PyResult<Vec<_>>>()?)?;
        found.set_item("worst_error", candidate.worst_error_jnd)?;
        found.set_item("given_up", given_up.collect::<Vec<_>>())?;
        let texture = candidate.texture;
        found.set_item("texture", Bound::new(py, PyTexture { texture })?)?;
        Ok(found)
    });
    all.collect()
}
