//! Between renderer and arm: every input watched, every command limited, every fault a named safe state.

use super::capsule::{ArmCapsules, CapsuleConfig};
use super::contact_limits::ContactLimits;
use super::load::{BoardLoad, LoadLimits};
use super::motion_guard::GuardLimits;
use super::person::{PersonLimits, PersonPart, PersonPoint};
use super::state::{Channel, SafeReason, SafeRequest, SafeState};
use super::watchdog::{ChannelWatch, Watch, WatchFault};
use crate::arm::{ArmCommand, ArmState};
use crate::board::Board;
use crate::error::HapticsError;
use crate::render::distance_and_closing;
use glam::DVec3;
use hwall_geometry::{Pose, Twist, Wrench};
use hwall_kinematics::{ArmKinematics, JointPositions, JointTorques, JointVelocities, MOST_JOINTS};
use hwall_numeric::check::{non_negative, positive};
use std::sync::Arc;

/// How long the states last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimingConfig {
    /// A fault that lasts longer than this turns holding into retreating (or stopped), s; default 0.3.
    pub hold_s: f64,
    /// A fault that lasts longer than this turns retreating into stopped, s; default 1.5.
    pub retreat_s: f64,
    /// Inputs must have been sound for this long before commands go through again, s; default 0.25.
    pub recovery_s: f64,
    /// Way of a retreat, m; default 0.1.
    pub retreat_m: f64,
    /// Speed of a retreat, m/s; default 0.1.
    pub retreat_m_per_s: f64,
    /// Longest step of time by which a command may go on, s; default 0.05.
    pub max_step_s: f64,
}

impl Default for TimingConfig {
    fn default() -> Self {
        Self {
            hold_s: 0.3,
            retreat_s: 1.5,
            recovery_s: 0.25,
            retreat_m: 0.1,
            retreat_m_per_s: 0.1,
            max_step_s: 0.05,
        }
    }
}

/// Settings of [`Supervisor`].
#[derive(Debug, Clone, PartialEq)]
pub struct SupervisorConfig {
    /// What a hand may meet.
    pub contact: ContactLimits,
    /// How fast near the person.
    pub person: PersonLimits,
    /// Pushes near the edge.
    pub load: LoadLimits,
    /// What joints may do; `None`: [`GuardLimits::of_arm`].
    pub guard: Option<GuardLimits>,
    /// The arm's body.
    pub capsules: CapsuleConfig,
    /// Mass that a push on the board feels, kg; default 5, an assumption.
    /// [`Supervisor::set_effective_mass_kg`] follows the configuration.
    pub effective_mass_kg: f64,
    /// The arm's state: angles, rad.
    pub position: ChannelWatch,
    /// The arm's state: velocities, rad/s.
    pub velocity: ChannelWatch,
    /// The arm's state: external torques, N m.
    pub torque: ChannelWatch,
    /// Fingertip and palm, m.
    pub hand: ChannelWatch,
    /// Head, m.
    pub head: ChannelWatch,
    /// Target, m. May leap and stand still by default: it is the renderer's to go there smoothly.
    pub target: ChannelWatch,
    /// Estimated force, N.
    pub force: ChannelWatch,
    /// Steps of the clock that may repeat the same time; default 20.
    pub repeated_times: usize,
    /// Largest step of the clock, s; default 0.2.
    pub largest_tick_s: f64,
    /// How long the states last.
    pub timing: TimingConfig,
}

impl Default for SupervisorConfig {
    fn default() -> Self {
        let watch = |max_age_s, jump, rate_per_s, frozen_s| ChannelWatch {
            max_age_s,
            jump,
            rate_per_s,
            frozen_s,
        };
        Self {
            contact: ContactLimits::default(),
            person: PersonLimits::default(),
            load: LoadLimits::default(),
            guard: None,
            capsules: CapsuleConfig::default(),
            effective_mass_kg: 5.0,
            // The fastest joint of an iiwa turns at 3.1 rad/s.
            position: watch(0.1, 0.02, 5.0, Some(0.1)),
            velocity: watch(0.1, 1.0, 200.0, Some(0.2)),
            torque: watch(0.1, 250.0, 2e4, Some(0.2)),
            // A hand moves at up to 5 m/s or so; a tracker that recovers leaps.
            hand: watch(0.25, 0.1, 8.0, Some(1.0)),
            head: watch(0.25, 0.1, 4.0, Some(1.0)),
            target: watch(0.25, f64::INFINITY, 0.0, None),
            force: watch(0.1, 500.0, 1e5, None),
            repeated_times: 20,
            largest_tick_s: 0.2,
            timing: TimingConfig::default(),
        }
    }
}

impl SupervisorConfig {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        self.contact.validate()?;
        self.person.validate()?;
        self.load.validate()?;
        self.capsules.validate()?;
        if let Some(guard) = &self.guard {
            guard.validate()?;
        }
        positive("effective_mass_kg", self.effective_mass_kg)?;
        positive("largest_tick_s", self.largest_tick_s)?;
        let timing = &self.timing;
        non_negative("hold_s", timing.hold_s)?;
        non_negative("retreat_s", timing.retreat_s)?;
        non_negative("recovery_s", timing.recovery_s)?;
        non_negative("retreat_m", timing.retreat_m)?;
        positive("retreat_m_per_s", timing.retreat_m_per_s)?;
        positive("max_step_s", timing.max_step_s)?;
        Ok(())
    }

    /// From the cycle in which a fault is seen the arm stands, floats or withdraws; no later than this after it the
    /// supervisor is in its last state, stopped or compliant, if the fault lasts, s: `hold + retreat`, and one more hold if
    /// the arm's state fails meanwhile.
    #[must_use]
    pub fn longest_to_last_state_s(&self) -> f64 {
        2.0 * self.timing.hold_s + self.timing.retreat_s
    }
}

/// All that the supervisor looks at in a cycle.
#[derive(Debug, Clone, Copy)]
pub struct SupervisorInput<'a> {
    /// Now, s.
    pub now_s: f64,
    /// The arm's state.
    pub state: &'a ArmState,
    /// The person's points that are known, base frame. A part that was seen once must keep coming, until
    /// [`Supervisor::forget`].
    pub person: &'a [PersonPoint],
    /// Where the board shall be, base frame (m), and since when that is known (s); `None`: nowhere.
    pub target: Option<(DVec3, f64)>,
    /// Estimated wrench on the board about the middle of its face, base axes; `None` without torque sensors.
    pub force: Option<Wrench>,
    /// The command about to be sent.
    pub command: ArmCommand,
}

/// What the supervisor says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupervisorStep {
    /// The command to send instead.
    pub command: ArmCommand,
    /// What is in force, and why.
    pub state: SafeState,
    /// What the renderer is asked to do next.
    pub request: SafeRequest,
    /// Is the fault latched? Then [`Supervisor::reset`] is needed.
    pub latched: bool,
}

/// How a fault is answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Severity {
    /// Hold, then withdraw.
    Unsure,
    /// Hold, then stop: a command that is bad, or an arm whose state is not known, cannot withdraw.
    Blind,
    /// Withdraw or give way at once, latched: a hand may be caught.
    Pressed,
    /// Hold, then stop, latched.
    Broken,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Fault {
    reason: SafeReason,
    severity: Severity,
}

/// What the fault machine is in.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Trouble {
    fault: Fault,
    stage: Stage,
    /// When the stage began, s of sound time.
    since_s: f64,
    /// Since when all inputs are sound.
    sound_since_s: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Hold,
    Retreat,
    Compliant,
    Stop,
}

/// What was sent last.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Sent {
    Nothing,
    Position(JointPositions),
    Torque(JointTorques),
}

/// Takes each command and gives back the one to send.
///
/// Nothing in here fails, blocks or allocates after construction.
#[derive(Debug, Clone)]
pub struct Supervisor {
    arm: Arc<dyn ArmKinematics>,
    board: Board,
    config: SupervisorConfig,
    guard: GuardLimits,
    watches: Watches,
    clock: Clock,
    trouble: Option<Trouble>,
    sent: Sent,
    /// Does the arm take torques?
    torque_level: bool,
    speed_cap_m_per_s: f64,
    /// Since when the force is above what may last, s.
    pressed_since_s: Option<f64>,
    last_q: Option<JointPositions>,
}

#[derive(Debug, Clone)]
struct Watches {
    position: Watch,
    velocity: Watch,
    torque: Watch,
    person: [Watch; 3],
    target: Watch,
    force: Watch,
}

#[derive(Debug, Clone, Copy, Default)]
struct Clock {
    last_s: Option<f64>,
    repeated: usize,
    /// Sum of the sound steps, s: states last by this, whatever the clock shows.
    elapsed_s: f64,
}

impl Supervisor {
    /// For an arm that carries the board; the arm's own tool is replaced by the board's face, as for the renderer.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(
        arm: &dyn ArmKinematics,
        board: &Board,
        config: SupervisorConfig,
    ) -> Result<Self, HapticsError> {
        config.validate()?;
        let arm = arm.carrying(board.flange_from_board_face()?);
        let guard = config.guard.unwrap_or_else(|| GuardLimits::of_arm(&*arm));
        guard.validate()?;
        let hand = Watch::new(config.hand)?;
        let watches = Watches {
            position: Watch::new(config.position)?,
            velocity: Watch::new(config.velocity)?,
            torque: Watch::new(config.torque)?,
            person: [hand, hand, Watch::new(config.head)?],
            target: Watch::new(config.target)?,
            force: Watch::new(config.force)?,
        };
        let speed_cap_m_per_s = config.contact.speed_cap_m_per_s(config.effective_mass_kg)?;
        Ok(Self {
            arm,
            board: *board,
            guard,
            watches,
            clock: Clock::default(),
            trouble: None,
            sent: Sent::Nothing,
            torque_level: false,
            speed_cap_m_per_s,
            pressed_since_s: None,
            last_q: None,
            config,
        })
    }

    /// The settings.
    #[must_use]
    pub const fn config(&self) -> &SupervisorConfig {
        &self.config
    }

    /// The mass that a push on the board feels now, kg, see [`effective_mass_kg`](crate::passivity::effective_mass_kg).
    ///
    /// # Errors
    /// A mass that is not positive.
    pub fn set_effective_mass_kg(&mut self, mass_kg: f64) -> Result<(), HapticsError> {
        self.speed_cap_m_per_s = self.config.contact.speed_cap_m_per_s(mass_kg)?;
        self.config.effective_mass_kg = mass_kg;
        Ok(())
    }

    /// This part of the person is no longer tracked on purpose; it is not missed until it comes again.
    pub fn forget(&mut self, part: PersonPart) {
        self.watches.person[part as usize].forget();
    }

    /// Ends a latched fault; commands go through again after the recovery time, if inputs are sound.
    pub fn reset(&mut self) {
        if let Some(trouble) = &mut self.trouble {
            trouble.fault.severity = Severity::Blind;
        }
    }

    /// Stops the arm, latched.
    pub fn stop(&mut self) {
        self.trouble = Some(Trouble {
            fault: Fault {
                reason: SafeReason::Requested,
                severity: Severity::Broken,
            },
            stage: Stage::Stop,
            since_s: self.clock.elapsed_s,
            sound_since_s: None,
        });
    }

    /// One cycle.
    pub fn step(&mut self, input: &SupervisorInput<'_>) -> SupervisorStep {
        let tick = self.clock.tick(input.now_s, &self.config);
        let dt_s = tick.as_ref().map_or(0.0, |dt_s| *dt_s);
        let dt_s = dt_s.min(self.config.timing.max_step_s);
        match input.command {
            ArmCommand::Torque(_) => self.torque_level = true,
            ArmCommand::Position(_) => self.torque_level = false,
            _ => {}
        }
        let found = match tick {
            Err(reason) => Some(Fault {
                reason,
                severity: Severity::Blind,
            }),
            Ok(_) => self.look(input, dt_s),
        };
        self.advance(found);
        let (command, slowed) = self.command(input, dt_s);
        self.remember(input, command);
        self.answer(command, slowed)
    }

    /// All faults, the worst first.
    fn look(&mut self, input: &SupervisorInput<'_>, dt_s: f64) -> Option<Fault> {
        let worse = |a: Option<Fault>, b: Option<Fault>| match (a, b) {
            (Some(a), Some(b)) if b.severity > a.severity => Some(b),
            (None, b) => b,
            (a, _) => a,
        };
        let arm = self.look_at_arm(input);
        let command = self.look_at_command(input, dt_s);
        let arm_is_known = arm.is_none();
        let found = worse(arm, command);
        let found = worse(found, self.look_at_person(input));
        if !arm_is_known {
            return found;
        }
        let force = self.look_at_force(input);
        worse(found, force)
    }

    fn look_at_arm(&mut self, input: &SupervisorInput<'_>) -> Option<Fault> {
        let SupervisorInput { now_s, state, .. } = *input;
        let blind = |reason| Fault {
            reason,
            severity: Severity::Blind,
        };
        let commanded_to_move = match (input.command, self.sent) {
            (ArmCommand::Position(to), Sent::Position(from)) => to.max_abs_difference(&from) > 1e-5,
            _ => false,
        };
        let turned = self.last_q.is_some_and(|last| last != state.q);
        let moving = turned || state.qd.0.iter().any(|qd| qd.abs() > 0.01);
        let q = &mut self.watches.position;
        let should_move = commanded_to_move || moving;
        if let Err(fault) = q.check(now_s, state.t_s, &state.q.0, should_move) {
            // The velocity is watched all the same, so that both start from the same sample afterwards.
            let _ = self
                .watches
                .velocity
                .check(now_s, state.t_s, &state.qd.0, false);
            return Some(blind(reason_of(fault, Channel::Position)));
        }
        let (ticked, shown) = (
            state.qd.0.iter().any(|v| *v != 0.0),
            self.moved_otherwise(state),
        );
        let qd = &mut self.watches.velocity;
        if let Err(fault) = qd.check(now_s, state.t_s, &state.qd.0, ticked && shown) {
            return Some(blind(reason_of(fault, Channel::Velocity)));
        }
        let torque = match state.external_torque {
            Some(torque) => {
                // Without noise an arm in free air feels exactly nothing, as long as it likes.
                let something = torque.0.iter().any(|v| *v != 0.0);
                let watch = &mut self.watches.torque;
                watch.check(now_s, state.t_s, &torque.0, turned && something)
            }
            None => self.watches.torque.missing(now_s),
        };
        if let Err(fault) = torque {
            return Some(Fault {
                reason: reason_of(fault, Channel::Torque),
                severity: Severity::Unsure,
            });
        }
        let joints = self.arm.joint_count();
        self.guard
            .check_state(joints, state)
            .err()
            .map(|reason| Fault {
                reason,
                severity: Severity::Broken,
            })
    }

    /// Do the angles change in another way than the velocities say?
    fn moved_otherwise(&self, state: &ArmState) -> bool {
        const APART_RAD_PER_S: f64 = 0.1;
        let (Some(last), Some(before_s)) = (self.last_q, self.watches.velocity.last_stamp_s())
        else {
            return false;
        };
        let dt_s = state.t_s - before_s;
        dt_s > 0.0
            && (0..MOST_JOINTS)
                .any(|i| ((state.q[i] - last[i]) / dt_s - state.qd[i]).abs() > APART_RAD_PER_S)
    }

    fn look_at_command(&mut self, input: &SupervisorInput<'_>, _dt_s: f64) -> Option<Fault> {
        let blind = |reason| {
            Some(Fault {
                reason,
                severity: Severity::Blind,
            })
        };
        let values = match &input.command {
            ArmCommand::Position(q) => q.0,
            ArmCommand::Torque(torque) => torque.0,
            ArmCommand::Hold => return None,
        };
        if values.iter().any(|v| !v.is_finite()) {
            return blind(SafeReason::NonFinite(Channel::Command));
        }
        let ArmCommand::Position(wanted) = input.command else {
            return None;
        };
        let from = match self.sent {
            Sent::Position(q) => q,
            _ if input.state.q.0.iter().all(|v| v.is_finite()) => input.state.q,
            _ => return None,
        };
        let by = wanted.max_abs_difference(&from);
        if by > self.guard.leap_rad {
            return blind(SafeReason::Jump {
                channel: Channel::Command,
                by,
            });
        }
        let pose = self.arm.forward(&wanted);
        if let Some(inside) = self.guard.workspace {
            let now = self.arm.forward(&from);
            // Back into the box is always allowed.
            if !inside.contains(pose.position_m()) && inside.contains(now.position_m()) {
                return blind(SafeReason::Workspace);
            }
        }
        let clearance_m = self.config.capsules.clearance_m;
        let least_m = |q| ArmCapsules::new(&*self.arm, q, &self.config.capsules).least_distance_m();
        let distance_m = least_m(&wanted);
        // Out of a collision is always allowed.
        if distance_m < clearance_m && distance_m < least_m(&from) {
            return blind(SafeReason::SelfCollision { distance_m });
        }
        None
    }

    fn look_at_person(&mut self, input: &SupervisorInput<'_>) -> Option<Fault> {
        let mut found = None;
        let unsure = |reason| {
            Some(Fault {
                reason,
                severity: Severity::Unsure,
            })
        };
        for part in PersonPart::ALL {
            let watch = &mut self.watches.person[part as usize];
            let newest = input.person.iter().find(|point| point.part == part);
            let checked = match newest {
                Some(point) => {
                    let position = point.position_m.to_array();
                    watch.check(input.now_s, point.stamp_s, &position, true)
                }
                None => watch.missing(input.now_s),
            };
            if let (Err(fault), None) = (checked, found) {
                found = unsure(reason_of(fault, part.channel()));
            }
        }
        if let Some((point_m, stamp_s)) = input.target {
            let watch = &mut self.watches.target;
            let checked = watch.check(input.now_s, stamp_s, &point_m.to_array(), true);
            if let (Err(fault), None) = (checked, found) {
                found = unsure(reason_of(fault, Channel::Target));
            }
        }
        found
    }

    fn look_at_force(&mut self, input: &SupervisorInput<'_>) -> Option<Fault> {
        let fault = |reason, severity| Some(Fault { reason, severity });
        let Some(wrench) = input.force else {
            return match self.watches.force.missing(input.now_s) {
                Ok(()) => None,
                Err(stale) => fault(reason_of(stale, Channel::Force), Severity::Unsure),
            };
        };
        let watch = &mut self.watches.force;
        let checked = watch.check(input.now_s, input.state.t_s, &wrench.to_array(), true);
        let limits = &self.config.contact;
        let force_n = wrench.force_n.length();
        if let Err(bad @ WatchFault::NonFinite) = checked {
            return fault(reason_of(bad, Channel::Force), Severity::Unsure);
        }
        if force_n > limits.implausible_n {
            return fault(SafeReason::ImplausibleForce { force_n }, Severity::Broken);
        }
        let pressed = |limit_n| fault(SafeReason::Force { force_n, limit_n }, Severity::Pressed);
        if force_n > limits.impact_force_n() {
            return pressed(limits.impact_force_n());
        }
        if force_n > limits.lasting_force_n() {
            let now_s = self.clock.elapsed_s;
            let since_s = *self.pressed_since_s.get_or_insert(now_s);
            if now_s - since_s > limits.transient_s {
                return pressed(limits.lasting_force_n());
            }
        } else {
            self.pressed_since_s = None;
        }
        if let Err(bad) = checked {
            return fault(reason_of(bad, Channel::Force), Severity::Unsure);
        }
        let load = BoardLoad::new(&self.arm.forward(&input.state.q), &wrench);
        if load.exceeds(&self.config.load, &self.board) {
            let moment_n_m = load.moment_n_m;
            return fault(SafeReason::BoardEdge { moment_n_m }, Severity::Unsure);
        }
        None
    }

    /// The fault machine.
    fn advance(&mut self, found: Option<Fault>) {
        let now_s = self.clock.elapsed_s;
        let timing = self.config.timing;
        let Some(fault) = found else {
            let Some(trouble) = &mut self.trouble else {
                return;
            };
            let since_s = *trouble.sound_since_s.get_or_insert(now_s);
            let latched = trouble.fault.severity >= Severity::Pressed;
            if !latched && now_s - since_s >= timing.recovery_s {
                self.trouble = None;
                // The motion goes on from where the arm is.
                self.sent = Sent::Nothing;
                return;
            }
            self.escalate(now_s);
            return;
        };
        let stage = match (fault.severity, self.torque_level) {
            (Severity::Pressed, true) => Stage::Compliant,
            (Severity::Pressed, false) => Stage::Retreat,
            _ => Stage::Hold,
        };
        match &mut self.trouble {
            Some(trouble) if fault.severity <= trouble.fault.severity => {
                trouble.sound_since_s = None;
                // The newest numbers of the same fault, and the newest fault of the same kind.
                if fault.severity == trouble.fault.severity {
                    trouble.fault = fault;
                }
            }
            Some(trouble) if trouble.stage == Stage::Stop => {
                trouble.fault = fault;
                trouble.sound_since_s = None;
            }
            _ => {
                self.trouble = Some(Trouble {
                    fault,
                    stage,
                    since_s: now_s,
                    sound_since_s: None,
                });
            }
        }
        // An arm that is not known cannot withdraw or float.
        if let (Some(trouble), Severity::Blind | Severity::Broken) =
            (&mut self.trouble, fault.severity)
            && matches!(trouble.stage, Stage::Retreat | Stage::Compliant)
        {
            (trouble.stage, trouble.since_s) = (Stage::Hold, now_s);
        }
        self.escalate(now_s);
    }

    /// From holding to withdrawing, from withdrawing to stopped.
    fn escalate(&mut self, now_s: f64) {
        let timing = self.config.timing;
        let Some(trouble) = &mut self.trouble else {
            return;
        };
        let lasted_s = now_s - trouble.since_s;
        let can_move = trouble.fault.severity == Severity::Unsure
            || trouble.fault.severity == Severity::Pressed;
        let next = match trouble.stage {
            Stage::Hold if lasted_s > timing.hold_s && trouble.sound_since_s.is_none() => {
                if can_move {
                    Stage::Retreat
                } else {
                    Stage::Stop
                }
            }
            Stage::Retreat if lasted_s > timing.retreat_s => Stage::Stop,
            stage => stage,
        };
        if next != trouble.stage {
            (trouble.stage, trouble.since_s) = (next, now_s);
        }
    }

    /// The command to send, and what it was cut by.
    fn command(
        &mut self,
        input: &SupervisorInput<'_>,
        dt_s: f64,
    ) -> (ArmCommand, Option<(f64, SafeReason)>) {
        match self.trouble.map(|trouble| trouble.stage) {
            None => self.limited(input, dt_s, None),
            Some(Stage::Retreat) => {
                self.limited(input, dt_s, Some(self.config.timing.retreat_m_per_s))
            }
            Some(Stage::Compliant) => {
                let last = match self.sent {
                    Sent::Torque(torque) => torque,
                    _ => JointTorques::default(),
                };
                let (torque, _) = self
                    .guard
                    .limited_torque(&last, &JointTorques::default(), dt_s);
                (ArmCommand::Torque(torque), None)
            }
            Some(Stage::Hold | Stage::Stop) => (ArmCommand::Hold, None),
        }
    }

    /// The renderer's command within all limits. `retreat`: the speed of one, m/s.
    fn limited(
        &self,
        input: &SupervisorInput<'_>,
        dt_s: f64,
        retreat: Option<f64>,
    ) -> (ArmCommand, Option<(f64, SafeReason)>) {
        match input.command {
            ArmCommand::Position(wanted) => self.limited_position(input, &wanted, dt_s, retreat),
            ArmCommand::Torque(wanted) => {
                let last = match self.sent {
                    Sent::Torque(torque) => torque,
                    _ => JointTorques::default(),
                };
                let (torque, cut) = self.guard.limited_torque(&last, &wanted, dt_s);
                let near = self.near(input, &input.state.q, &input.state.qd, retreat);
                let slowed = near.or(cut.map(|reason| (1.0, reason)));
                (ArmCommand::Torque(torque), slowed)
            }
            other => (other, None),
        }
    }

    fn limited_position(
        &self,
        input: &SupervisorInput<'_>,
        wanted: &JointPositions,
        dt_s: f64,
        retreat: Option<f64>,
    ) -> (ArmCommand, Option<(f64, SafeReason)>) {
        let from = match self.sent {
            Sent::Position(q) => q,
            _ => input.state.q,
        };
        let (wanted, mut cut) = self.guard.within(wanted);
        let mut slowed = cut.map(|reason| (1.0, reason));
        let (mut share, joint_cut) = self.guard.share_of_step(&from, &wanted, dt_s);
        if joint_cut.is_some() {
            cut = joint_cut;
            slowed = cut.map(|reason| (share, reason));
        }
        if dt_s > 0.0 {
            let rate = share / dt_s;
            let qd = JointVelocities(std::array::from_fn(|i| (wanted[i] - from[i]) * rate));
            if let Some((less, reason)) = self.near(input, &from, &qd, retreat) {
                share *= less;
                slowed = Some((share, reason));
            }
        }
        let mut out = wanted;
        if share < 1.0 {
            for i in 0..MOST_JOINTS {
                out[i] = from[i] + share * (wanted[i] - from[i]);
            }
        }
        (ArmCommand::Position(out), slowed)
    }

    /// Share of a joint motion that the person's points (and a retreat) allow, and the tightest reason; `None`: all of it.
    fn near(
        &self,
        input: &SupervisorInput<'_>,
        q: &JointPositions,
        qd: &JointVelocities,
        retreat: Option<f64>,
    ) -> Option<(f64, SafeReason)> {
        /// Slower than this nothing is slowed down, m/s.
        const SLOWEST_M_PER_S: f64 = 1e-3;
        if input.person.is_empty() && retreat.is_none() {
            return None;
        }
        let face: Pose = self.arm.forward(q);
        let twist: Twist = self.arm.jacobian(q).twist(qd);
        let limits = &self.config.person;
        let mut tightest: Option<(f64, SafeReason)> = None;
        let mut cap = |allowed: f64, speed: f64, reason: SafeReason| {
            let share = allowed / speed.max(SLOWEST_M_PER_S);
            if share < tightest.map_or(1.0, |(share, _)| share) {
                tightest = Some((share, reason));
            }
        };
        for point in input
            .person
            .iter()
            .filter(|point| point.position_m.is_finite())
        {
            let (distance_m, closing) =
                distance_and_closing(&self.board, &face, &twist, point.position_m);
            let reason = SafeReason::PersonNear {
                part: point.part.channel(),
                distance_m,
            };
            cap(
                limits.separation.allowed_m_per_s(distance_m),
                closing,
                reason,
            );
            if point.part == PersonPart::Head {
                if distance_m <= limits.head_zone_m {
                    let corner_m = self.board.half_width_m.hypot(self.board.half_height_m);
                    let turning = twist.angular_rad_per_s.length() * corner_m;
                    let speed = twist.linear_m_per_s.length() + turning;
                    cap(limits.head_speed_m_per_s, speed, reason);
                }
            } else if distance_m <= limits.contact_zone_m {
                cap(self.speed_cap_m_per_s, closing, reason);
            }
        }
        if let (Some(speed), Some(trouble)) = (retreat, self.trouble) {
            let outward = twist.linear_m_per_s.dot(face.rotation().z_axis);
            let reason = trouble.fault.reason;
            cap(speed, twist.linear_m_per_s.length(), reason);
            // A retreat goes back, not forward.
            cap(
                0.0,
                if outward > SLOWEST_M_PER_S {
                    outward
                } else {
                    0.0
                },
                reason,
            );
        }
        tightest
    }

    fn remember(&mut self, input: &SupervisorInput<'_>, command: ArmCommand) {
        self.sent = match command {
            ArmCommand::Position(q) => Sent::Position(q),
            ArmCommand::Torque(torque) => Sent::Torque(torque),
            _ => Sent::Nothing,
        };
        if input.state.q.0.iter().all(|v| v.is_finite()) {
            self.last_q = Some(input.state.q);
        }
    }

    fn answer(&self, command: ArmCommand, slowed: Option<(f64, SafeReason)>) -> SupervisorStep {
        let timing = &self.config.timing;
        let share = slowed.map_or(1.0, |(share, _)| share.clamp(0.01, 1.0));
        let go = SafeRequest::Go { speed_share: share };
        let Some(trouble) = self.trouble else {
            return SupervisorStep {
                command,
                state: slowed.map_or(SafeState::Normal, |(_, reason)| SafeState::Slowed {
                    reason,
                }),
                request: go,
                latched: false,
            };
        };
        let reason = trouble.fault.reason;
        let (state, request) = match trouble.stage {
            Stage::Hold => (SafeState::Holding { reason }, SafeRequest::Hold),
            Stage::Retreat => (
                SafeState::Retreating { reason },
                SafeRequest::Retreat {
                    behind_m: timing.retreat_m,
                    speed_m_per_s: timing.retreat_m_per_s,
                },
            ),
            Stage::Compliant => (SafeState::Compliant { reason }, SafeRequest::Hold),
            Stage::Stop => (SafeState::Stopped { reason }, SafeRequest::Hold),
        };
        SupervisorStep {
            command,
            state,
            request,
            latched: trouble.fault.severity >= Severity::Pressed,
        }
    }
}

impl Clock {
    /// The time since the last step, s.
    fn tick(&mut self, now_s: f64, config: &SupervisorConfig) -> Result<f64, SafeReason> {
        let channel = Channel::Time;
        // A clock that is none goes on at the longest step: a state that lasts must still end.
        let fault_s = config.timing.max_step_s;
        if !now_s.is_finite() {
            self.elapsed_s += fault_s;
            return Err(SafeReason::NonFinite(channel));
        }
        let dt_s = now_s - self.last_s.replace(now_s).unwrap_or(now_s);
        if dt_s < 0.0 || dt_s > config.largest_tick_s {
            self.elapsed_s += fault_s;
            return Err(SafeReason::Jump { channel, by: dt_s });
        }
        self.elapsed_s += dt_s;
        self.repeated = if dt_s == 0.0 { self.repeated + 1 } else { 0 };
        if self.repeated > config.repeated_times {
            self.elapsed_s += fault_s;
            let for_s = 0.0;
            return Err(SafeReason::Frozen { channel, for_s });
        }
        Ok(dt_s)
    }
}

fn reason_of(fault: WatchFault, channel: Channel) -> SafeReason {
    match fault {
        WatchFault::NonFinite => SafeReason::NonFinite(channel),
        WatchFault::Stale { age_s } => SafeReason::Stale { channel, age_s },
        WatchFault::Jump { by } => SafeReason::Jump { channel, by },
        WatchFault::Frozen { for_s } => SafeReason::Frozen { channel, for_s },
    }
}
