//! Prediction of place, time and surface of the next touch of a hand.

use crate::arrays::{Floats, array, matrix3, point, vector};
use crate::bip::{read, write};
use crate::error::{OrRaise, one_of};
use crate::hand::{PyFrame, PyReach};
use crate::scene::PyScene;
use hwall::contact::{
    Combination, ContactEstimate, ContactEstimator, ContactPrediction, DeterministicConfig,
    DeterministicPredictor, FusedConfig, FusedPredictor, LearnedConfig, LearnedEstimator,
    LearnedModel, PredictionSource, Predictor, PredictorInput, TimeToContact,
};
use hwall::hand::{GazeFilter, HandFilter, HandFilterConfig, LabelledReach};
use hwall::numeric::check::finite;
use hwall::scene::Scene;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// A predictor of any kind.
pub(crate) type AnyPredictor = Box<dyn Predictor + Send + Sync>;

/// The fused predictor with a model, else the gaze ray.
pub(crate) fn predictor_of(model: Option<&PyLearned>, simulated: bool) -> PyResult<AnyPredictor> {
    Ok(match model {
        None => Box::new(DeterministicPredictor::new(DeterministicConfig::ray_led()).or_raise()?),
        Some(model) => {
            let mut config = FusedConfig::default();
            if simulated {
                config.registration_sd_m = 0.0;
            }
            Box::new(FusedPredictor::new(model.model.estimator(), config).or_raise()?)
        }
    })
}

pub(crate) fn filter_of(simulated: bool) -> HandFilterConfig {
    match simulated {
        true => HandFilterConfig::simulated(),
        false => HandFilterConfig::default(),
    }
}

/// A model of reaching motions, learnt from reaches with a known end; immutable.
#[pyclass(frozen, module = "hwall.contact", name = "LearnedModel")]
pub(crate) struct PyLearned {
    model: LearnedModel,
}

#[pymethods]
impl PyLearned {
    /// Learns from a list of `Reach`; eight are enough for a model, fifty for a good one. `combination`: "both",
    /// "regression" or "primitive"; `gaze`: does the regression use the direction of gaze?
    #[staticmethod]
    #[pyo3(signature = (reaches, *, combination="both", gaze=false))]
    fn fit(
        py: Python<'_>,
        reaches: Vec<PyRef<'_, PyReach>>,
        combination: &str,
        gaze: bool,
    ) -> PyResult<Self> {
        let known = [
            ("both", Combination::Both),
            ("regression", Combination::Regression),
            ("primitive", Combination::Primitive),
        ];
        let config = LearnedConfig {
            combination: one_of("combination", combination, &known)?,
            gaze,
            ..LearnedConfig::default()
        };
        let reaches: Vec<LabelledReach> = reaches.iter().map(|reach| reach.reach.clone()).collect();
        let model = py
            .detach(|| LearnedModel::train(&reaches, &config))
            .or_raise()?;
        Ok(Self { model })
    }

    /// An estimator for new reaches.
    fn estimator(&self) -> Estimator {
        Estimator {
            estimator: self.model.estimator(),
        }
    }

    /// Number of training reaches.
    #[getter]
    fn reaches(&self) -> usize {
        self.model.reaches()
    }

    /// Median duration of the training reaches, s.
    #[getter]
    fn median_duration(&self) -> f64 {
        self.model.median_duration_s()
    }

    /// Writes the model as JSON.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        write(&path, &self.model.to_json())
    }

    /// Reads a model written by `save`.
    #[staticmethod]
    fn load(path: PathBuf) -> PyResult<Self> {
        let model = LearnedModel::from_json(&read(&path)?).or_raise()?;
        Ok(Self { model })
    }
}

fn set_time(found: &Bound<'_, PyDict>, time: Option<TimeToContact>) -> PyResult<()> {
    found.set_item("time_to_contact", time.map(|time| time.mean_s))?;
    found.set_item("time_sd", time.and_then(|time| time.sd_s))
}

fn estimate<'py>(py: Python<'py>, of: &ContactEstimate) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("t", of.t_s)?;
    found.set_item("point", point(py, of.point_m)?)?;
    found.set_item(
        "covariance",
        of.covariance_m2.map(|c| matrix3(py, c)).transpose()?,
    )?;
    found.set_item("normal", of.normal.map(|n| point(py, n)).transpose()?)?;
    set_time(&found, of.time_to_contact_s)?;
    Ok(found)
}

/// A prediction as a dict.
pub(crate) fn prediction<'py>(
    py: Python<'py>,
    scene: &Scene,
    of: &ContactPrediction,
) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("surface", &scene.surface(of.surface).name)?;
    found.set_item("probability", of.probability)?;
    found.set_item("point", point(py, of.point_m)?)?;
    found.set_item("normal", point(py, of.normal)?)?;
    found.set_item(
        "covariance",
        of.covariance_m2.map(|c| matrix3(py, c)).transpose()?,
    )?;
    found.set_item(
        "region_deviations",
        array(
            py,
            [0.5, 0.7, 0.9]
                .map(|p| ContactPrediction::region_squared(p).sqrt())
                .to_vec(),
            &[3],
        )?,
    )?;
    found.set_item("distance", of.distance_m)?;
    set_time(&found, of.time_to_contact_s)?;
    let source = match of.source {
        PredictionSource::Gaze => "gaze",
        PredictionSource::HandDirection => "hand_direction",
        PredictionSource::Nearest => "nearest",
        PredictionSource::Motion => "motion",
        PredictionSource::TouchedBefore => "touched_before",
        _ => "other",
    };
    found.set_item("source", source)?;
    Ok(found)
}

/// Predicts the end of one reach at a time, from the hand only.
#[pyclass(module = "hwall.contact")]
pub(crate) struct Estimator {
    estimator: LearnedEstimator,
}

#[pymethods]
impl Estimator {
    /// Starts a new reach with the next frame.
    fn begin(&mut self) {
        self.estimator.begin();
    }

    /// Takes a frame. Returns a dict of t (s), point (3,) (m), covariance (3, 3) (m2), normal (3,) or None,
    /// time_to_contact and time_sd (s); None without a prediction.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        frame: PyRef<'py, PyFrame>,
    ) -> PyResult<Option<Bound<'py, PyDict>>> {
        let found = self.estimator.step(&frame.frame);
        found.map(|found| estimate(py, &found)).transpose()
    }

    /// Reports a touch at `contact` (3,), m, at `contact_time`, s: the estimator adapts to this person and room.
    fn touched(&mut self, contact: Floats<'_>, contact_time: f64) -> PyResult<()> {
        let at = vector("contact", &contact)?;
        self.estimator
            .touched(at, finite("contact_time", contact_time).or_raise()?);
        Ok(())
    }

    /// Forgets the adaptation by touches.
    fn forget(&mut self) {
        self.estimator.forget();
    }
}

/// Predicts the next contact in a scene from a stream of frames: from motion, gaze, scene and earlier touches with a
/// model, otherwise from the gaze ray. Frames and scene must be in one frame of reference.
#[pyclass(module = "hwall.contact", name = "Predictor")]
pub(crate) struct PyPredictor {
    scene: Scene,
    predictor: AnyPredictor,
    hand: HandFilter,
    gaze: GazeFilter,
}

#[pymethods]
impl PyPredictor {
    /// `simulated`: a hand without tremor does not count as a frozen tracker, and tracker and scene are registered exactly.
    #[new]
    #[pyo3(signature = (scene, model=None, *, simulated=false))]
    fn new(
        scene: PyRef<'_, PyScene>,
        model: Option<PyRef<'_, PyLearned>>,
        simulated: bool,
    ) -> PyResult<Self> {
        Ok(Self {
            scene: scene.scene.clone(),
            predictor: predictor_of(model.as_deref(), simulated)?,
            hand: HandFilter::new(filter_of(simulated)).or_raise()?,
            gaze: GazeFilter::default(),
        })
    }

    /// Takes a frame. Returns the possible next contacts, the most probable first: dicts of surface (name),
    /// probability, point (3,), normal (3,), covariance (3, 3) or None (m2), region_deviations (3,) (size of the regions of
    /// 50, 70 and 90 % in standard deviations), distance (m), time_to_contact and time_sd (s), source.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        frame: PyRef<'py, PyFrame>,
    ) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let frame = &frame.frame;
        let tracking = self.hand.step(frame);
        let gaze = self.gaze.step(frame.t_s, frame.gaze_ray().as_ref());
        let input = PredictorInput {
            frame,
            hand: tracking.state(),
            gaze,
        };
        let ranked = self.predictor.predict(&self.scene, &input);
        ranked
            .iter()
            .map(|found| prediction(py, &self.scene, found))
            .collect()
    }

    /// Reports a touch at `contact` (3,), m, at `contact_time`, s: the predictor learns from it.
    fn touched(&mut self, contact: Floats<'_>, contact_time: f64) -> PyResult<()> {
        let at = vector("contact", &contact)?;
        self.predictor
            .touched(at, finite("contact_time", contact_time).or_raise()?);
        Ok(())
    }

    /// Forgets all frames and the adaptation by touches: for another person.
    fn reset(&mut self) {
        self.hand.reset();
        self.gaze.reset();
        self.predictor.reset();
    }
}
