//! A simulated arm and simulated people, seeded.

use crate::arm::PyArm;
use crate::arrays::{Array, Floats, Rows, array, fixed, matrix, one_pose, point, vector};
use crate::error::{OrRaise, one_of};
use crate::hand::PyFrame;
use crate::scene::{at, pairs};
use hwall::haptics::{Arm, ArmCommand};
use hwall::kinematics::Wrench;
use hwall::numeric::check::finite;
use hwall::sim::{
    HandContact, Person, PersonConfig, ServoArm, ServoConfig, TouchPlan, TouchSequence,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// An arm that follows commands after a delay, within limits of speed, acceleration and jerk.
#[pyclass(module = "hwall.sim", name = "ServoArm")]
pub(crate) struct PyServoArm {
    arm: ServoArm,
    model: PyArm,
}

#[pymethods]
impl PyServoArm {
    /// At rest at `q` (joints,), rad, its clock at 0. `torque_noise`: of the torque sensors, N m.
    #[new]
    #[pyo3(signature = (arm, q, *, seed=0, delay=None, torque_noise=None))]
    fn new(
        arm: PyRef<'_, PyArm>,
        q: Floats<'_>,
        seed: u64,
        delay: Option<f64>,
        torque_noise: Option<f64>,
    ) -> PyResult<Self> {
        let nominal = ServoConfig::default();
        let config = ServoConfig {
            seed,
            reaction_delay_s: delay.unwrap_or(nominal.reaction_delay_s),
            torque_noise_n_m: torque_noise.unwrap_or(nominal.torque_noise_n_m),
            ..nominal
        };
        let model = PyArm::carrying(Arc::clone(arm.model()), arm.joint_names());
        let servo = ServoArm::new(Arc::clone(arm.model()), arm.one(&q)?, config).or_raise()?;
        Ok(Self { arm: servo, model })
    }

    /// Applies a command as returned by `hwall.Session.step`: ("position", q) in rad, or ("hold", None).
    fn command(&mut self, command: (String, Option<Floats<'_>>)) -> PyResult<()> {
        let command = match command {
            (kind, Some(q)) if kind == "position" => ArmCommand::Position(self.model.one(&q)?),
            (kind, _) => one_of("command", &kind, &[("hold", ArmCommand::Hold)])?,
        };
        self.arm.command(command).or_raise()
    }

    /// Advances the clock by `dt`, s.
    fn advance(&mut self, dt: f64) -> PyResult<()> {
        self.arm.advance(dt).or_raise()
    }

    /// Sets the external push on the tool: `force` (3,), N, and `moment` (3,), N m, about the tool's origin, base axes.
    #[pyo3(signature = (force, moment=None))]
    fn push(&mut self, force: Floats<'_>, moment: Option<Floats<'_>>) -> PyResult<()> {
        let wrench = Wrench {
            force_n: vector("force", &force)?,
            moment_n_m: moment.map_or(Ok(hwall::glam::DVec3::ZERO), |m| vector("moment", &m))?,
        };
        self.arm.apply_wrench(wrench).or_raise()
    }

    /// Time of its clock, s.
    #[getter]
    fn t(&self) -> f64 {
        self.arm.t_s()
    }

    /// Joint angles, (joints,), rad.
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        self.model.joint_array(py, &self.arm.q().0)
    }

    /// Joint velocities, (joints,), rad/s.
    #[getter]
    fn qd<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        self.model.joint_array(py, &self.arm.qd().0)
    }

    /// External torques from its sensors, (joints,), N m, with noise.
    #[getter]
    fn torque<'py>(&mut self, py: Python<'py>) -> PyResult<Array<'py>> {
        let torque = self
            .arm
            .state()
            .or_raise()?
            .external_torque
            .unwrap_or_default();
        self.model.joint_array(py, &torque.0)
    }

    /// Pose of the tool, (4, 4), base frame, m.
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        array(py, matrix(&self.arm.pose()).to_vec(), &[4, 4])
    }
}

/// Constructor of a kind of people.
type Kind = fn() -> PersonConfig;

/// A simulated person who touches points; the seed determines speed, curvature of the path, gaze and tremor.
#[pyclass(frozen, module = "hwall.sim", name = "Person")]
pub(crate) struct PyPerson {
    person: Person,
}

#[pymethods]
impl PyPerson {
    /// `kind`: "plain", "varied" (with everything that makes prediction hard), "fast", "slow" or "glancing". `head` and `hand`:
    /// positions of head and resting fingertip, (3,), m, base frame of the arm.
    #[new]
    #[pyo3(signature = (seed=0, *, kind="plain", head=None, hand=None))]
    fn new(
        seed: u64,
        kind: &str,
        head: Option<Floats<'_>>,
        hand: Option<Floats<'_>>,
    ) -> PyResult<Self> {
        let kinds: [(&str, Kind); 5] = [
            ("plain", PersonConfig::default),
            ("varied", PersonConfig::varied),
            ("fast", PersonConfig::fast),
            ("slow", PersonConfig::slow),
            ("glancing", PersonConfig::glancing),
        ];
        let mut config = one_of("kind", kind, &kinds)?();
        if let Some(head) = head {
            config.head_m = vector("head", &head)?;
        }
        if let Some(hand) = hand {
            config.hand_rest_m = vector("hand", &hand)?;
        }
        let person = Person::new(config, seed).or_raise()?;
        Ok(Self { person })
    }

    /// Touches `targets` (n, 3), m, one after the other, on surfaces with `normals` (3,) or (n, 3) towards the person.
    fn plan(&self, targets: Floats<'_>, normals: Floats<'_>) -> PyResult<Touches> {
        let (targets, normals) = (
            Rows::new("targets", &targets, &[3])?,
            Rows::new("normals", &normals, &[3])?,
        );
        let plans = (0..pairs(&targets, &normals)?.count).map(|i| TouchPlan {
            target_m: at(&targets, i),
            normal: at(&normals, i),
        });
        let plans: Vec<TouchPlan> = plans.collect();
        let touches = self.person.plan(&plans).or_raise()?;
        Ok(Touches { touches })
    }
}

/// A planned sequence of touches: a function of time, which starts at 0.
#[pyclass(frozen, module = "hwall.sim")]
pub(crate) struct Touches {
    touches: TouchSequence,
}

#[pymethods]
impl Touches {
    /// The tracker's frame at `t`, s.
    fn frame(&self, t: f64) -> PyResult<PyFrame> {
        let frame = self.touches.tracked(finite("t", t).or_raise()?);
        Ok(PyFrame { frame })
    }

    /// True position and velocity of the tip of the index finger at `t` (s): (3,), m; (3,), m/s.
    fn tip<'py>(&self, py: Python<'py>, t: f64) -> PyResult<(Array<'py>, Array<'py>)> {
        let t = finite("t", t).or_raise()?;
        let velocity = self.touches.true_index_velocity_m_per_s(t);
        Ok((
            point(py, self.touches.true_index_tip(t))?,
            point(py, velocity)?,
        ))
    }

    /// End of the last touch, s.
    #[getter]
    fn duration(&self) -> f64 {
        self.touches.duration_s()
    }

    /// Ground truth of each touch: dicts of target (3,), normal (3,), depth (m), and the times look, start, contact, press,
    /// withdraw, release, end (s).
    #[getter]
    fn truth<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let all = self.touches.touches().iter().map(|touch| {
            let found = PyDict::new(py);
            found.set_item("target", point(py, touch.target_m)?)?;
            found.set_item("normal", point(py, touch.normal)?)?;
            found.set_item("depth", touch.depth_m)?;
            for (name, time) in [
                ("look", touch.look_s),
                ("start", touch.start_s),
                ("contact", touch.contact_s),
                ("press", touch.press_s),
                ("withdraw", touch.withdraw_s),
                ("release", touch.release_s),
                ("end", touch.end_s),
            ] {
                found.set_item(name, time)?;
            }
            Ok(found)
        });
        all.collect()
    }
}

/// Force of a fingertip on a square board: force (3,), N, and moment (3,), N m, about the middle of its face, base axes;
/// both 0 without contact. `base_from_board` (4, 4) has z out of the face; `tip` (3,), m, is the position of the tip without
/// the board, `velocity` (3,), m/s, relative to the board. `stiffness`, N/m; `damping`, N s/m; `half_extent` of the board, m.
#[pyfunction]
#[pyo3(signature = (base_from_board, tip, velocity, *, stiffness=500.0, damping=2.0, half_extent=0.1))]
pub(crate) fn finger_force<'py>(
    py: Python<'py>,
    base_from_board: Floats<'py>,
    tip: Floats<'py>,
    velocity: Floats<'py>,
    stiffness: f64,
    damping: f64,
    half_extent: f64,
) -> PyResult<(Array<'py>, Array<'py>)> {
    let finger = HandContact {
        stiffness_n_per_m: stiffness,
        damping_n_s_per_m: damping,
        half_extent_m: half_extent,
        ..HandContact::default()
    };
    let board = one_pose("base_from_board", &base_from_board)?;
    let tip = hwall::glam::DVec3::from_array(fixed("tip", &tip)?);
    let wrench = finger
        .wrench(&board, tip, vector("velocity", &velocity)?)
        .or_raise()?;
    let wrench = wrench.unwrap_or_default();
    Ok((point(py, wrench.force_n)?, point(py, wrench.moment_n_m)?))
}
