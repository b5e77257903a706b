//! Tracked hands: samples, reaches with a known end, recordings.

use crate::arrays::{Array, Floats, Rows, list, point, points, vector};
use crate::error::{Error, OrRaise, one_of, refuse};
use hwall::glam::DVec3;
use hwall::hand::{
    HandFrame, HandPoint, LabelConfig, LabelledReach, NamedPoint, Quantity, Recording, Sample,
    labelled_reaches, read_recordings, write_recordings,
};
use hwall::numeric::check::finite;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};

fn hand_point(name: &str) -> PyResult<HandPoint> {
    one_of(
        "point",
        name,
        &HandPoint::ALL.map(|point| (point.name(), point)),
    )
}

/// One sample of a tracked hand; missing arguments mean not seen. Points (3,) in m, `gaze` a unit vector, `t` in s.
#[pyclass(frozen, module = "hwall", name = "Frame")]
pub(crate) struct PyFrame {
    pub(crate) frame: HandFrame,
}

#[pymethods]
impl PyFrame {
    /// `points`: palm, thumb, index, middle, ring, little, wrist, forearm, elbow, shoulder, grip, aim.
    #[new]
    #[pyo3(signature = (t, *, head=None, gaze=None, other_hand=None, **points))]
    fn new(
        t: f64,
        head: Option<Floats<'_>>,
        gaze: Option<Floats<'_>>,
        other_hand: Option<Floats<'_>>,
        points: Option<Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let mut frame = HandFrame::empty(finite("t", t).or_raise()?);
        frame.head_m = head.map(|p| vector("head", &p)).transpose()?;
        frame.gaze = gaze.map(|p| vector("gaze", &p)).transpose()?;
        frame.other_hand_m = other_hand.map(|p| vector("other_hand", &p)).transpose()?;
        for (name, value) in points.iter().flatten() {
            let name: String = name.extract()?;
            let known = NamedPoint::ALL.map(|point| (point.name(), point));
            let point = one_of("point", &name, &known)?;
            if !value.is_none() {
                let at = vector(point.name(), &value.extract::<Floats<'_>>()?)?;
                frame.set_named(point, Some(at));
            }
        }
        Ok(Self { frame })
    }

    /// Time, s.
    #[getter]
    fn t(&self) -> f64 {
        self.frame.t_s
    }

    /// The seen points by name, (3,), m, with head and gaze.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let seen = PyDict::new(py);
        for which in NamedPoint::ALL {
            if let Some(at) = self.frame.named(which) {
                seen.set_item(which.name(), point(py, at)?)?;
            }
        }
        for (name, at) in [("head", self.frame.head_m), ("gaze", self.frame.gaze)] {
            if let Some(at) = at {
                seen.set_item(name, point(py, at)?)?;
            }
        }
        Ok(seen)
    }

    fn __repr__(&self) -> String {
        format!("<hwall.Frame at {} s>", self.frame.t_s)
    }
}

/// Rows of an optional argument, one for each of `count` samples.
fn rows_of<'a>(
    what: &str,
    values: Option<&'a Floats<'_>>,
    count: usize,
) -> PyResult<Option<Rows<'a>>> {
    let Some(values) = values else {
        return Ok(None);
    };
    let rows = Rows::new(what, values, &[3])?;
    match rows.many && rows.count == count {
        true => Ok(Some(rows)),
        false => refuse(format!("{count} times and {} rows of {what}", rows.count)),
    }
}

/// The row, or `None` for a row of NaN (not seen).
fn seen(rows: Option<&Rows<'_>>, index: usize) -> Option<DVec3> {
    let at = DVec3::from_slice(rows?.row(index));
    (!at.to_array().iter().all(|x| x.is_nan())).then_some(at)
}

/// One reach from the start of the movement to its contact.
#[pyclass(frozen, module = "hwall.contact", name = "Reach")]
pub(crate) struct PyReach {
    pub(crate) reach: LabelledReach,
}

#[pymethods]
impl PyReach {
    /// `t` (n,), s; `position` (n, 3) of the touching `point`, m; `head` and `gaze` (n, 3). A row of NaN means not seen. The
    /// contact is the last sample unless `contact` (3,) and `contact_time` are given. `normal` (3,) of the surface.
    #[new]
    #[pyo3(signature = (t, position, *, contact=None, contact_time=None, point="index", head=None, gaze=None, normal=None, person=None, trial=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        t: Floats<'_>,
        position: Floats<'_>,
        contact: Option<Floats<'_>>,
        contact_time: Option<f64>,
        point: &str,
        head: Option<Floats<'_>>,
        gaze: Option<Floats<'_>>,
        normal: Option<Floats<'_>>,
        person: Option<String>,
        trial: Option<String>,
    ) -> PyResult<Self> {
        let (t, point) = (list("t", &t)?, hand_point(point)?);
        let position = rows_of("position", Some(&position), t.len())?;
        let head = rows_of("head", head.as_ref(), t.len())?;
        let gaze = rows_of("gaze", gaze.as_ref(), t.len())?;
        let frames = t.iter().enumerate().map(|(i, &t_s)| {
            let mut frame = HandFrame::empty(t_s);
            frame.set_point(point, seen(position.as_ref(), i));
            frame.head_m = seen(head.as_ref(), i);
            frame.gaze = seen(gaze.as_ref(), i);
            frame
        });
        let frames: Vec<HandFrame> = frames.collect();
        // Checks as for a file: finite numbers, increasing times.
        Recording::from_frames(frames.iter().copied()).or_raise()?;
        let last = frames.iter().rev().find_map(|frame| frame.point(point));
        let contact_m =
            contact.map_or(Ok(last.unwrap_or(DVec3::NAN)), |p| vector("contact", &p))?;
        let contact_s = contact_time
            .or_else(|| t.last().copied())
            .unwrap_or(f64::NAN);
        let mut reach = LabelledReach::new(point, frames, contact_m, contact_s);
        reach.normal = normal.map(|n| vector("normal", &n)).transpose()?;
        (reach.person, reach.trial) = (person, trial);
        reach.validate().or_raise()?;
        Ok(Self { reach })
    }

    /// The samples.
    #[getter]
    fn frames(&self) -> Vec<PyFrame> {
        let frames = self.reach.frames.iter();
        frames.map(|&frame| PyFrame { frame }).collect()
    }

    /// Times of the samples, (n,), s.
    #[getter]
    fn t<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let t: Vec<f64> = self.reach.frames.iter().map(|frame| frame.t_s).collect();
        let count = t.len();
        crate::arrays::array(py, t, &[count])
    }

    /// The touching point, (n, 3), m; NaN if not seen.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let at = |frame: &HandFrame| frame.point(self.reach.point).unwrap_or(DVec3::NAN);
        points(py, self.reach.frames.iter().map(at))
    }

    /// The point of contact, (3,), m.
    #[getter]
    fn contact<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        point(py, self.reach.contact_m)
    }

    /// The time of contact, s.
    #[getter]
    fn contact_time(&self) -> f64 {
        self.reach.contact_s
    }

    /// The person; None if unknown.
    #[getter]
    fn person(&self) -> Option<&str> {
        self.reach.person.as_deref()
    }
}

fn recordings_of(path: &Path) -> PyResult<Vec<Recording>> {
    let file = std::fs::File::open(path)
        .map_err(|e| Error::new_err(format!("{}: {e}", path.display())))?;
    read_recordings(file).or_raise()
}

/// Reaches with a known end, extracted from a CSV file of recorded hands (columns `t, palm_x, ...`).
#[pyfunction]
pub(crate) fn reaches_from_csv(py: Python<'_>, path: PathBuf) -> PyResult<Vec<PyReach>> {
    let recordings = recordings_of(&path)?;
    let labelled = py.detach(|| labelled_reaches(&recordings, &LabelConfig::default()));
    let reaches = labelled.or_raise()?.reaches.into_iter();
    Ok(reaches.map(|reach| PyReach { reach }).collect())
}

/// Recorded hands of a CSV file, one dict per trial: person, trial, t (n,) in s, and (n, 3) arrays in m by the names of their
/// columns (palm, index, head, gaze, target, ...), NaN if not seen.
#[pyfunction]
#[pyo3(name = "read_recordings")]
pub(crate) fn recordings_from_csv<'py>(
    py: Python<'py>,
    path: PathBuf,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let all = recordings_of(&path)?.into_iter().map(|recording| {
        let found = PyDict::new(py);
        found.set_item("person", &recording.person)?;
        found.set_item("trial", &recording.trial)?;
        let t: Vec<f64> = recording.frames().map(|frame| frame.t_s).collect();
        found.set_item(
            "t",
            crate::arrays::array(py, t, &[recording.samples.len()])?,
        )?;
        for quantity in Quantity::ALL {
            let rows = || recording.samples.iter().map(|sample| sample.get(quantity));
            if rows().any(|row| row.is_some()) {
                found.set_item(
                    quantity.name(),
                    points(py, rows().map(|row| row.unwrap_or(DVec3::NAN)))?,
                )?;
            }
        }
        Ok(found)
    });
    all.collect()
}

/// Writes recorded hands, dicts as from `read_recordings`, to a CSV file.
#[pyfunction]
#[pyo3(name = "write_recordings")]
pub(crate) fn recordings_to_csv(path: PathBuf, recordings: Vec<Bound<'_, PyDict>>) -> PyResult<()> {
    let mut all = Vec::new();
    for given in recordings {
        let Some(t) = given.get_item("t")? else {
            return refuse("a recording needs its times t");
        };
        let t = list("t", &t.extract()?)?;
        let mut recording = Recording {
            samples: t
                .iter()
                .map(|&t_s| Sample {
                    frame: HandFrame::empty(t_s),
                    ..Sample::default()
                })
                .collect(),
            ..Recording::default()
        };
        for (name, value) in given.iter() {
            let name: String = name.extract()?;
            match &*name {
                "t" => {}
                "person" => recording.person = value.extract()?,
                "trial" => recording.trial = value.extract()?,
                name => {
                    let quantity = one_of("column", name, &Quantity::ALL.map(|q| (q.name(), q)))?;
                    let values = value.extract::<Floats<'_>>()?;
                    let rows = rows_of(quantity.name(), Some(&values), t.len())?;
                    for (i, sample) in recording.samples.iter_mut().enumerate() {
                        sample.set(quantity, seen(rows.as_ref(), i));
                    }
                }
            }
        }
        recording.validate().or_raise()?;
        all.push(recording);
    }
    let mut text = Vec::new();
    write_recordings(&mut text, &all).or_raise()?;
    crate::bip::write(&path, &String::from_utf8_lossy(&text))
}
