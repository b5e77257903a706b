//! The whole system for a user's own loop: frames in, commands out, events as dicts.

use crate::arm::PyArm;
use crate::arrays::{Array, Floats, array, one_pose, point};
use crate::contact::{AnyPredictor, PyLearned, filter_of, prediction, predictor_of};
use crate::error::{OrRaise, one_of, refuse};
use crate::hand::PyFrame;
use crate::scene::{PyRoom, PyScene};
use hwall::hand::Tracking;
use hwall::haptics::safety::{PersonPart, SupervisorConfig};
use hwall::haptics::{ArmCommand, ArmState, Board};
use hwall::kinematics::{ArmKinematics, JointPositions, JointTorques, JointVelocities};
use hwall::reachability::Presented;
use hwall::scene::Scene;
use hwall::{
    Event, EventKind, Session, SessionConfig, SessionState, Walls, WallsConfig, WorldPose,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Names of the parts of the person.
const PARTS: [(&str, PersonPart); 5] = [
    ("fingertip", PersonPart::Fingertip),
    ("palm", PersonPart::Palm),
    ("head", PersonPart::Head),
    ("elbow", PersonPart::Elbow),
    ("other_hand", PersonPart::OtherHand),
];

/// Joint values of a command: ("position" or "torque", (joints,)), or ("hold", None).
type Command<'py> = (&'static str, Option<Array<'py>>);

/// Moves a board on an arm to the predicted touch of a hand. Base frame of the arm, m, rad, s.
///
/// Call `frame` at the rate of the tracker, `step` at the rate of the arm, and `plan` after each step.
#[pyclass(frozen, module = "hwall", name = "Session")]
pub(crate) struct PySession {
    // Sessions are used by one thread at a time.
    session: Mutex<Session<AnyPredictor>>,
    arm: Arc<dyn ArmKinematics>,
    joint_names: Vec<String>,
    /// For surface names.
    scene: Scene,
}

impl PySession {
    fn session(&self) -> MutexGuard<'_, Session<AnyPredictor>> {
        self.session.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn padded<const N: usize>(
        &self,
        what: &'static str,
        values: &Floats<'_>,
    ) -> PyResult<[f64; N]> {
        let values = crate::arrays::in_order(values);
        let joints = self.arm.joint_count();
        if values.len() != joints {
            return refuse(format!(
                "{what} has {} values, the arm has {joints} joints",
                values.len()
            ));
        }
        let mut padded = [0.0; N];
        padded[..joints].copy_from_slice(&values);
        Ok(padded)
    }
}

#[pymethods]
impl PySession {
    /// `scene` in the base frame of the arm; the tool of `arm` is replaced by the face of the board. With a `model` the
    /// fused predictor predicts touches, without one the gaze ray. `board`: half width, half height, thickness, m.
    /// `simulated`: a hand without tremor does not count as a frozen tracker. `prepared`: precompute arrival times and the waiting
    /// posture (a second for a room); otherwise the arm waits where it is. `arm_minus_tracker`: offset of the clocks, s.
    /// `supervised`: stop, retreat or slow down on faulty inputs and hard pushes; no safety rating. `requires_torque`: hold until external
    /// torques were measured; without them neither touches nor clamped hands are felt. `room`: default a floor below scene and arm. `required`: parts
    /// of the person without which the arm does not move: "fingertip", "palm", "head", "elbow", "other_hand"; default fingertip and head.
    #[new]
    #[pyo3(signature = (arm, scene, *, model=None, board=None, simulated=false, prepared=true, arm_minus_tracker=0.0, supervised=true, requires_torque=true, room=None, required=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        arm: PyRef<'_, PyArm>,
        scene: PyRef<'_, PyScene>,
        model: Option<PyRef<'_, PyLearned>>,
        board: Option<[f64; 3]>,
        simulated: bool,
        prepared: bool,
        arm_minus_tracker: f64,
        supervised: bool,
        requires_torque: bool,
        room: Option<PyRef<'_, PyRoom>>,
        required: Option<Vec<String>>,
    ) -> PyResult<Self> {
        let board = board_of(board);
        let mut config = SessionConfig {
            hand: filter_of(simulated),
            arm_minus_tracker_s: arm_minus_tracker,
            ..SessionConfig::default()
        };
        config.supervisor = match config.supervisor.filter(|_| supervised) {
            Some(supervisor) => Some(SupervisorConfig {
                requires_torque,
                room: room.map_or(supervisor.room, |given| Some(given.room.clone())),
                required: match required {
                    Some(names) => (names.iter())
                        .map(|name| one_of("part", name, &PARTS))
                        .collect::<PyResult<_>>()?,
                    None => supervisor.required,
                },
                ..supervisor
            }),
            None if room.is_some() || required.is_some() => {
                return refuse("room and required belong to a supervised session");
            }
            None => None,
        };
        let predictor = predictor_of(model.as_deref(), simulated)?;
        let (model, joint_names) = (Arc::clone(arm.model()), arm.joint_names());
        let scene = scene.scene.clone();
        py.detach(|| {
            let model = model.carrying(board.flange_from_board_face().or_raise()?);
            let walls = match (prepared, model.closed_form()) {
                (true, _) => {
                    Walls::of(&scene, &*model, &board, &WallsConfig::default()).or_raise()?
                }
                (false, Some(arm)) => hwall::maps_of(&scene, arm).or_raise()?.into(),
                (false, None) => Walls::default(),
            };
            let session = Session::new(&*model, &board, scene.clone(), walls, predictor, config)
                .or_raise()?;
            Ok(Self {
                session: Mutex::new(session),
                arm: model,
                joint_names,
                scene,
            })
        })
    }

    /// Takes a frame of the tracker.
    fn frame(&self, py: Python<'_>, frame: PyRef<'_, PyFrame>) {
        let frame = frame.frame;
        py.detach(|| self.session().frame(&frame));
    }

    /// Takes the state of the arm at `now` (s), and returns its command: ("position", q) in rad, ("torque", tau) in
    /// N m, or ("hold", None): brake and stand. `q` (joints,), rad; `qd`, rad/s; `torque`: external torques,
    /// N m, for feeling touches; `t`: time of the state, s, default `now`. NaN is not an error here: the session holds
    /// and gives the reason.
    #[pyo3(signature = (now, q, qd, torque=None, t=None))]
    fn step<'py>(
        &self,
        py: Python<'py>,
        now: f64,
        q: Floats<'py>,
        qd: Floats<'py>,
        torque: Option<Floats<'py>>,
        t: Option<f64>,
    ) -> PyResult<Command<'py>> {
        let state = ArmState {
            t_s: t.unwrap_or(now),
            q: JointPositions(self.padded("q", &q)?),
            qd: JointVelocities(self.padded("qd", &qd)?),
            external_torque: torque
                .map(|torque| self.padded("torque", &torque).map(JointTorques))
                .transpose()?,
        };
        let joints = self.arm.joint_count();
        let command = py.detach(|| self.session().step(now, &state));
        let values = |values: [f64; 7]| array(py, values[..joints].to_vec(), &[joints]);
        Ok(match command {
            ArmCommand::Position(q) => ("position", Some(values(q.0)?)),
            ArmCommand::Torque(torque) => ("torque", Some(values(torque.0)?)),
            _ => ("hold", None),
        })
    }

    /// Plans goals and paths, which takes longer than a step: call it after sending the command.
    fn plan(&self, py: Python<'_>) {
        py.detach(|| self.session().plan());
    }

    /// Events since the last call: dicts of t (s), event (a name such as "goal_set", "arrived", "touched") and its
    /// data. `every_frame`: also "frame" and "predicted", which come with every frame.
    #[pyo3(signature = (every_frame=false))]
    fn events<'py>(&self, py: Python<'py>, every_frame: bool) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let happened: Vec<Event> = std::iter::from_fn(|| self.session().next_event()).collect();
        let of_frame =
            |event: &Event| matches!(event.kind, EventKind::Frame(_) | EventKind::Predicted(_));
        let told = happened
            .iter()
            .filter(|event| every_frame || !of_frame(event));
        told.map(|event| event_dict(py, &self.scene, event))
            .collect()
    }

    /// State of the board: "waiting", "getting_ready", "approaching", "late", "obstructed", "in_place", "touched",
    /// "touched_in_moving_world", "holding" or "safe".
    #[getter]
    fn state(&self) -> &'static str {
        match self.session().state() {
            SessionState::Holding(_) => "holding",
            SessionState::Waiting => "waiting",
            SessionState::GettingReady => "getting_ready",
            SessionState::Approaching => "approaching",
            SessionState::Late => "late",
            SessionState::Obstructed => "obstructed",
            SessionState::InPlace => "in_place",
            SessionState::Touched => "touched",
            SessionState::TouchedInMovingWorld => "touched_in_moving_world",
            SessionState::Safe(_) => "safe",
            _ => "other",
        }
    }

    /// Why the arm holds, or why the supervisor has taken over; None otherwise.
    #[getter]
    fn reason(&self) -> Option<String> {
        match self.session().state() {
            SessionState::Holding(reason) => Some(reason.name().into()),
            SessionState::Safe(state) => state.reason().map(|reason| reason.to_string()),
            _ => None,
        }
    }

    /// The contact that the board serves, a dict as from `hwall.contact.Predictor.step`; None without a prediction.
    #[getter]
    fn contact<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let found = self.session().contact();
        found
            .map(|found| prediction(py, &self.scene, &found))
            .transpose()
    }

    /// The waiting posture, (joints,), rad; None if the arm waits where it is.
    #[getter]
    fn waits_at<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py>>> {
        let (waits, joints) = (
            self.session().perception().waits_at(),
            self.arm.joint_count(),
        );
        waits
            .map(|q| array(py, q.0[..joints].to_vec(), &[joints]))
            .transpose()
    }

    /// The arm with the board as its tool.
    #[getter]
    fn arm(&self) -> PyArm {
        PyArm::carrying(Arc::clone(&self.arm), self.joint_names.clone())
    }

    /// Sets the pose of the virtual world, `base_from_world` (4, 4), m, as of `t`, s.
    fn world(&self, t: f64, base_from_world: Floats<'_>) -> PyResult<()> {
        let pose = WorldPose {
            t_s: t,
            base_from_world: one_pose("base_from_world", &base_from_world)?,
        };
        self.session().world(&pose).or_raise()
    }

    /// Sets the offset from the tracker's time to the arm's, s.
    fn set_clock_offset(&self, arm_minus_tracker: f64) -> PyResult<()> {
        self.session()
            .set_clock_offset_s(arm_minus_tracker)
            .or_raise()
    }

    /// Stops the arm until `reset`.
    fn stop(&self) {
        self.session().stop();
    }

    /// Resets latched states: a stop, a broken sensor, a push that was too hard.
    fn reset(&self) {
        self.session().reset();
    }

    fn __repr__(&self) -> String {
        format!("<hwall.Session, {}>", self.state())
    }
}

/// The board from half width, half height and thickness, m; the default board without them.
pub(crate) fn board_of(board: Option<[f64; 3]>) -> Board {
    board.map_or_else(
        Board::default,
        |[half_width_m, half_height_m, thickness_m]| Board {
            half_width_m,
            half_height_m,
            thickness_m,
        },
    )
}

fn presented(found: &Bound<'_, PyDict>, of: Presented) -> PyResult<()> {
    let py = found.py();
    match of {
        Presented::Reachable => found.set_item("presented", "reachable"),
        Presented::Unknown => found.set_item("presented", "unknown"),
        Presented::Nearest(place) => {
            found.set_item("presented", "nearest")?;
            found.set_item("nearest", point(py, place)?)
        }
    }
}

fn event_dict<'py>(py: Python<'py>, scene: &Scene, event: &Event) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("t", event.t_s)?;
    let name = match &event.kind {
        EventKind::Frame(Tracking::Tracked(hand)) => {
            found.set_item("point", point(py, hand.point_m)?)?;
            found.set_item("velocity", point(py, hand.velocity_m_per_s)?)?;
            "frame"
        }
        EventKind::Frame(Tracking::Lost { reason, .. }) => {
            found.set_item("reason", reason.to_string())?;
            "frame"
        }
        EventKind::Predicted(predicted) => {
            let contact = predicted.map(|predicted| prediction(py, scene, &predicted.contact));
            found.set_item("contact", contact.transpose()?)?;
            if let Some(predicted) = predicted {
                presented(&found, predicted.presented)?;
            }
            "predicted"
        }
        EventKind::GoalSet(goal) => {
            found.set_item("surface", &scene.surface(goal.surface).name)?;
            found.set_item("point", point(py, goal.target.point_m)?)?;
            found.set_item("normal", point(py, goal.target.normal)?)?;
            presented(&found, goal.presented)?;
            "goal_set"
        }
        EventKind::Arrived => "arrived",
        EventKind::Late => "late",
        EventKind::Unreachable(reason) => {
            found.set_item("reason", reason.to_string())?;
            "unreachable"
        }
        EventKind::Touched { normal_force_n } => {
            found.set_item("force", normal_force_n)?;
            "touched"
        }
        EventKind::Released => "released",
        EventKind::Held(reason) => {
            found.set_item("reason", reason.name())?;
            "held"
        }
        EventKind::Safe(state) => {
            found.set_item("state", state.name())?;
            found.set_item("reason", state.reason().map(|reason| reason.to_string()))?;
            "safe"
        }
        EventKind::Resumed => "resumed",
        EventKind::WorldMovedWhileTouched => "world_moved_while_touched",
        EventKind::HandUnfamiliar => "hand_unfamiliar",
        EventKind::WorldRefused => "world_refused",
        EventKind::SurfacesUnknown => "surfaces_unknown",
        EventKind::LinkInFront(link) => {
            found.set_item("link", link.link)?;
            found.set_item("in_front", link.in_front_m)?;
            "link_in_front"
        }
        EventKind::LinksBehind => "links_behind",
        EventKind::TextureStarted(touch) => {
            found.set_item("surface", &scene.surface(touch.surface).name)?;
            found.set_item("roughness", touch.roughness)?;
            found.set_item("angle_deg", touch.level.scan.deg())?;
            found.set_item("speed_mm_per_s", touch.level.speed_mm_per_s)?;
            "texture_started"
        }
        EventKind::TextureEnded => "texture_ended",
        _ => "other",
    };
    found.set_item("event", name)?;
    Ok(found)
}
