//! One touch as the session measures it: arm state, estimated force and tracked hand.

use super::ending::{is_stopped_by_person, of_hold, of_safe, takes_over};
use crate::error::StudyError;
use crate::present::stimulus::{Fault, LEAST_SPEED_SHARE, Rendered, Stimulus, Surface};
use hwall::contact::Predictor;
use hwall::glam::DVec3;
use hwall::hand::Tracking;
use hwall::haptics::ContactState;
use hwall::kinematics::JointPositions;
use hwall::numeric::check::{positive, that};
use hwall::scene::{SlidingPart, SurfaceId, SurfaceKind};
use hwall::{Cycle, Event, EventKind, Session};

/// Averages start this long after the touch, s, when the motion has settled. As on the simulated arm.
const SETTLED_S: f64 = 0.2;
/// Below this finger speed the scan direction is undefined, m/s.
const SCANS_M_PER_S: f64 = 0.02;
/// Step for the velocity of the face, s.
const STEP_S: f64 = 1e-4;
/// Upper bound of a cycle's weight, s: the motion between cycles further apart is unknown.
const LONGEST_S: f64 = 0.05;

/// Time limits of a trial on an arm, on the clock of the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmTrialConfig {
    /// A trial without a touch within this time after the board is requested is spoilt, s; default 30.
    pub touch_within_s: f64,
    /// Duration of the settled texture, over which means are taken, s; default 1.
    pub felt_s: f64,
    /// A shorter touch does not count, s; default 0.3.
    pub least_felt_s: f64,
    /// A hand that stays on the board longer than this after `felt_s`, or before a trial, spoils the trial, s; default 10.
    pub release_within_s: f64,
    /// A tracked hand lost for this long spoils the trial, s; default 1.
    pub hand_lost_s: f64,
}

impl Default for ArmTrialConfig {
    fn default() -> Self {
        Self {
            touch_within_s: 30.0,
            felt_s: 1.0,
            least_felt_s: 0.3,
            release_within_s: 10.0,
            hand_lost_s: 1.0,
        }
    }
}

impl ArmTrialConfig {
    pub(super) fn validate(&self) -> Result<(), StudyError> {
        for (what, value_s) in [
            ("touch_within_s", self.touch_within_s),
            ("felt_s", self.felt_s),
            ("least_felt_s", self.least_felt_s),
            ("release_within_s", self.release_within_s),
            ("hand_lost_s", self.hand_lost_s),
        ] {
            positive(what, value_s)?;
            that(value_s <= 3600.0, what, value_s, "at most an hour")?;
        }
        let least_s = self.least_felt_s;
        let holds = least_s <= self.felt_s;
        that(holds, "least_felt_s", least_s, "at most felt_s")?;
        Ok(())
    }

    /// Longest duration of a trial, s.
    pub(super) fn longest_s(&self) -> f64 {
        self.touch_within_s + SETTLED_S + self.felt_s + 2.0 * self.release_within_s
    }
}

/// Outcome of a touch.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Observed {
    pub(super) rendered: Rendered,
    /// Details of a fault.
    pub(super) because: Option<String>,
    /// The session latched a fault not requested by a person: no trial follows.
    pub(super) is_last: bool,
}

impl Observed {
    /// A touch without anything felt.
    pub(super) fn nothing(fault: Fault, because: Option<String>) -> Self {
        Self {
            rendered: Rendered {
                fault,
                ..Rendered::default()
            },
            because,
            is_last: false,
        }
    }
}

/// The study's kind of a surface; `None` for drawers, buttons and untouchable surfaces.
pub(super) const fn kind_of(kind: &SurfaceKind) -> Option<Surface> {
    match kind {
        SurfaceKind::Static => Some(Surface::Wall),
        SurfaceKind::RevolvingDoor { .. } => Some(Surface::Door),
        SurfaceKind::Sliding {
            part: SlidingPart::Panel,
            ..
        } => Some(Surface::Panel),
        _ => None,
    }
}

/// Is the board pressed?
pub(super) fn is_touched<P: Predictor>(session: &Session<P>) -> bool {
    let contact = session.control().renderer().contact();
    matches!(contact, ContactState::Contact { .. })
}

/// Time-weighted sums over the felt part of a touch.
#[derive(Debug, Clone, Copy, Default)]
struct Felt {
    seconds: f64,
    /// Part of `seconds` in which the finger scans, s.
    scanned_s: f64,
    along_m: f64,
    across_m: f64,
    board_m: f64,
    finger_m: f64,
    force_n_s: f64,
    /// Direction of the first scan.
    first: Option<DVec3>,
}

/// A running touch.
#[derive(Debug, Clone)]
pub(super) struct ObservedTouch {
    stimulus: Stimulus,
    config: ArmTrialConfig,
    began_s: f64,
    last_s: f64,
    /// Time at which the hand was last tracked, s; `None`: not yet.
    seen_s: Option<f64>,
    /// The surface that the board was sent to.
    surface: Option<SurfaceId>,
    touched_s: Option<f64>,
    late: bool,
    started: bool,
    ended: bool,
    /// Reason for a takeover of the arm during the touch.
    taken_over: Option<String>,
    contact_s: f64,
    moved: Option<f64>,
    felt: Felt,
}

impl ObservedTouch {
    pub(super) fn new(stimulus: Stimulus, config: ArmTrialConfig, now_s: f64) -> Self {
        Self {
            stimulus,
            config,
            began_s: now_s,
            last_s: now_s,
            seen_s: None,
            surface: None,
            touched_s: None,
            late: false,
            started: false,
            ended: false,
            taken_over: None,
            contact_s: 0.0,
            moved: None,
            felt: Felt::default(),
        }
    }

    pub(super) fn event(&mut self, event: &Event) {
        let is_touched = self.touched_s.is_some();
        match event.kind {
            EventKind::GoalSet(goal) if !is_touched => self.surface = Some(goal.surface),
            EventKind::Late => self.late |= !is_touched,
            EventKind::Touched { .. } => self.touched_s = self.touched_s.or(Some(event.t_s)),
            EventKind::TextureStarted(touch) => {
                self.started = true;
                self.surface = Some(touch.surface);
            }
            EventKind::TextureEnded => self.ended = true,
            EventKind::Safe(state) if is_touched && takes_over(&state) => {
                self.taken_over.get_or_insert_with(|| of_safe(&state));
            }
            EventKind::Held(reason) if is_touched => {
                self.taken_over.get_or_insert_with(|| of_hold(reason));
            }
            _ => {}
        }
    }

    /// To be called after the events of a cycle: the outcome of the touch, once known.
    pub(super) fn step<P: Predictor>(
        &mut self,
        session: &Session<P>,
        cycle: &Cycle,
    ) -> Option<Observed> {
        let now_s = cycle.t_s;
        let dt_s = (now_s - self.last_s).clamp(0.0, LONGEST_S);
        self.last_s = now_s;
        let hand = session.tracking().and_then(Tracking::state);
        if hand.is_some() {
            self.seen_s = Some(now_s);
        }
        let control = session.control();
        if control.is_latched() {
            return Some(Observed {
                is_last: !is_stopped_by_person(control),
                ..self.spoilt(Fault::Stopped, &of_safe(&control.safety()))
            });
        }
        if let Some(taken_over) = &self.taken_over {
            return Some(self.spoilt(Fault::Stopped, taken_over));
        }
        let lost_s = self.seen_s.map_or(0.0, |seen_s| now_s - seen_s);
        if lost_s > self.config.hand_lost_s {
            return Some(self.spoilt(Fault::HandLost, &format!("not seen for {lost_s:.1} s")));
        }
        let Some(touched_s) = self.touched_s else {
            return self.waited_too_long(now_s);
        };
        if let Some(other) = self.other_surface(session) {
            return Some(self.spoilt(Fault::OtherSurface, other));
        }
        if !is_touched(session) {
            return Some(self.judged());
        }
        self.contact_s += dt_s;
        self.moved = control.moving().find(|o| o.touched).map(|o| o.position);
        let felt_from_s = touched_s + SETTLED_S;
        let felt_until_s = felt_from_s + self.config.felt_s;
        let moves = !self.ended || self.stimulus.speed_mm_per_s == 0.0;
        if now_s >= felt_from_s && now_s <= felt_until_s && moves {
            let velocity_m_per_s = hand.map(|hand| hand.velocity_m_per_s);
            self.feel(session, cycle, velocity_m_per_s, dt_s);
        }
        if now_s > felt_until_s + self.config.release_within_s {
            let within_s = self.config.release_within_s;
            return Some(self.spoilt(Fault::NotReleased, &format!("within {within_s} s")));
        }
        None
    }

    /// Ends the touch from outside.
    pub(super) fn spoilt(&self, fault: Fault, why: &str) -> Observed {
        let word = fault.word().unwrap_or_default();
        // A stop already has its state as text.
        let because = match fault {
            Fault::Stopped => why.to_owned(),
            _ => format!("{word}: {why}"),
        };
        self.observed(fault, Some(because))
    }

    fn observed(&self, fault: Fault, because: Option<String>) -> Observed {
        Observed {
            rendered: self.rendered(fault),
            because,
            is_last: false,
        }
    }

    fn waited_too_long(&self, now_s: f64) -> Option<Observed> {
        let within_s = self.config.touch_within_s;
        if now_s - self.began_s <= within_s {
            return None;
        }
        Some(match (self.seen_s, self.late) {
            (None, _) => self.spoilt(Fault::HandLost, &format!("not seen within {within_s} s")),
            (Some(_), true) => self.observed(Fault::Late, None),
            (Some(_), false) => self.spoilt(Fault::NoTouch, &format!("within {within_s} s")),
        })
    }

    /// The surface that was touched instead of the wanted one.
    fn other_surface<P: Predictor>(&self, session: &Session<P>) -> Option<&'static str> {
        let perception = session.perception();
        let surfaces = perception.scene().surfaces();
        let kind = kind_of(&surfaces.get(self.surface?.0)?.kind);
        match kind {
            Some(kind) if kind == self.stimulus.surface => None,
            Some(kind) => Some(kind.word()),
            None => Some("neither wall nor door nor panel"),
        }
    }

    fn feel<P: Predictor>(
        &mut self,
        session: &Session<P>,
        cycle: &Cycle,
        finger_m_per_s: Option<DVec3>,
        dt_s: f64,
    ) {
        let (control, state) = (session.control(), &cycle.state);
        let pose = control.arm().forward(&state.q);
        let soon = JointPositions(std::array::from_fn(|i| {
            state.q.0[i] + STEP_S * state.qd.0[i]
        }));
        let soon_m = control.arm().forward(&soon).position_m();
        let normal = pose.rotation().z_axis;
        let in_plane = |v: DVec3| v - normal * v.dot(normal);
        let board_m_per_s = in_plane((soon_m - pose.position_m()) / STEP_S);
        let felt = &mut self.felt;
        felt.seconds += dt_s;
        let force_n = control.last_step().and_then(|step| step.normal_force_n);
        felt.force_n_s += dt_s * force_n.unwrap_or(0.0);
        let Some(finger_m_per_s) = finger_m_per_s.map(in_plane) else {
            return;
        };
        let Some(scan) = finger_m_per_s
            .try_normalize()
            .filter(|_| finger_m_per_s.length() >= SCANS_M_PER_S)
        else {
            return;
        };
        let relative = finger_m_per_s - board_m_per_s;
        // Reverse scans count in the direction of the first.
        let first = *felt.first.get_or_insert(scan);
        let way = 1.0_f64.copysign(scan.dot(first));
        felt.scanned_s += dt_s;
        felt.along_m += dt_s * way * relative.dot(pose.rotation().x_axis);
        felt.across_m += dt_s * way * relative.dot(pose.rotation().y_axis);
        felt.board_m -= dt_s * board_m_per_s.dot(scan);
        felt.finger_m += dt_s * relative.length();
    }

    /// Outcome of a finished touch.
    fn judged(&self) -> Observed {
        let (felt, wanted) = (&self.felt, &self.stimulus);
        let least_mm_per_s = LEAST_SPEED_SHARE * wanted.speed_mm_per_s;
        let slow = 1e3 * felt.board_m < least_mm_per_s * felt.scanned_s;
        let moved = self.started && felt.scanned_s > 0.0 && !slow;
        if felt.seconds < self.config.least_felt_s {
            // A texture that ended too soon was felt: no missing touch.
            if self.ended && self.contact_s >= self.config.least_felt_s {
                return self.spoilt(Fault::NoTexture, "it ended too soon");
            }
            let why = format!("in contact for {:.2} s", self.contact_s);
            return self.spoilt(Fault::NoTouch, &why);
        }
        let fault = match wanted.speed_mm_per_s > 0.0 && !moved {
            true => Fault::NoTexture,
            false => Fault::None,
        };
        self.observed(fault, None)
    }

    fn rendered(&self, fault: Fault) -> Rendered {
        let felt = &self.felt;
        let mean = |sum: f64, over_s: f64| {
            let mean = sum / over_s;
            (over_s > 0.0 && mean.is_finite()).then_some(mean)
        };
        let angle_deg = felt.across_m.abs().atan2(felt.along_m.abs()).to_degrees();
        Rendered {
            angle_deg: mean(felt.across_m, felt.scanned_s).map(|_| angle_deg),
            speed_mm_per_s: mean(1e3 * felt.board_m, felt.scanned_s),
            felt_mm_per_s: mean(1e3 * felt.finger_m, felt.scanned_s),
            force_n: mean(felt.force_n_s, felt.seconds),
            contact_s: self.contact_s,
            moved: self.moved,
            patch: self.stimulus.patch,
            fault,
        }
        .rounded()
    }
}
