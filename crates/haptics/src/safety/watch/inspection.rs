//! Checks every input of a cycle and names the worst fault.

use super::obedience::Obedience;
use super::state_consistency::{Doubt, StateConsistency};
use super::target_leaps::{LeapLimits, TargetLeaps};
use super::watchdog::{Watch, WatchFault};
use crate::arm::{ArmCommand, ArmState};
use crate::board::Board;
use crate::body::ArmBody;
use crate::error::HapticsError;
use crate::low_pass;
use crate::safety::cycle::{Sent, SupervisorInput};
use crate::safety::fault::{Fault, Severity};
use crate::safety::limits::contact_limits::ContactLimits;
use crate::safety::limits::load::{BoardLoad, LoadLimits};
use crate::safety::limits::motion_guard::GuardLimits;
use crate::safety::limits::person::PersonPart;
use crate::safety::state::{Channel, SafeReason};
use crate::safety::supervisor_config::SupervisorConfig;
use hwall_geometry::Wrench;
use hwall_kinematics::{ArmKinematics, JointPositions, MOST_JOINTS};
use std::sync::Arc;

/// Largest lever of a force about a joint, m: about the reach of an arm.
const LARGEST_LEVER_M: f64 = 1.0;
/// Angles that jump further than this need a person, rad.
const LOST_RAD: f64 = 0.3;

/// A commanded arm starts to move within this time, s: 0.022 s reaction of an iiwa, up to 0.01 s for a period of its interface, and 0.02 s for four
/// lost answers at 5 ms. Only after that its angles can count as frozen.
const SETS_OFF_S: f64 = 0.05;

/// Friction may hold a joint this far from its commanded angle, rad.
const STICKS_RAD: f64 = 1e-3;

#[derive(Debug, Clone)]
struct Watches {
    position: Watch,
    velocity: Watch,
    torque: Watch,
    /// In the order of [`PersonPart::ALL`].
    person: [Watch; PersonPart::ALL.len()],
    target: Watch,
    force: Watch,
}

/// Result of the checks in a cycle.
#[derive(Debug, Clone, Copy)]
pub(in crate::safety) struct Found {
    /// The worst fault.
    pub(in crate::safety) worst: Option<Fault>,
    /// Is the arm's own state trusted?
    pub(in crate::safety) arm_is_sound: bool,
}

/// All checked inputs, with their last values.
#[derive(Debug, Clone)]
pub(in crate::safety) struct Inspection {
    arm: Arc<dyn ArmKinematics>,
    board: Board,
    guard: GuardLimits,
    contact: ContactLimits,
    load: LoadLimits,
    watches: Watches,
    consistency: StateConsistency,
    obedience: Option<Obedience>,
    leaps: LeapLimits,
    leapt: TargetLeaps,
    /// Since when the force has been above the lasting limit, s.
    pressed_since_s: Option<f64>,
    last_q: Option<JointPositions>,
    /// The last command sent, and whether it differed from the one before. A command that the supervisor cuts to nothing moves nothing.
    last_sent: Sent,
    told_to_move: bool,
    /// Since when the arm has not been at its commanded position, s.
    away_since_s: Option<f64>,
    /// Filtered force and moment, and the last time stamp, s.
    located: Option<(Wrench, f64)>,
    /// Parts of the person that have been seen.
    seen: [bool; PersonPart::ALL.len()],
    required: Vec<PersonPart>,
    /// Must external torques have been seen?
    requires_torque: bool,
}

impl Inspection {
    /// `arm` carries the board's face.
    pub(in crate::safety) fn new(
        arm: Arc<dyn ArmKinematics>,
        board: Board,
        guard: GuardLimits,
        config: &SupervisorConfig,
    ) -> Result<Self, HapticsError> {
        let (hand, head) = (Watch::new(config.hand)?, Watch::new(config.head)?);
        Ok(Self {
            arm,
            board,
            guard,
            contact: config.contact,
            load: config.load,
            watches: Watches {
                position: Watch::new(config.position)?,
                velocity: Watch::new(config.velocity)?,
                torque: Watch::new(config.torque)?,
                person: PersonPart::ALL.map(|part| match part {
                    PersonPart::Head => head,
                    part if part.is_bystander() => head,
                    _ => hand,
                }),
                target: Watch::new(config.target)?,
                force: Watch::new(config.force)?,
            },
            consistency: StateConsistency::default(),
            obedience: config.obedience.map(Obedience::new),
            leaps: config.leaps,
            leapt: TargetLeaps::default(),
            pressed_since_s: None,
            last_q: None,
            last_sent: Sent::Nothing,
            told_to_move: false,
            away_since_s: None,
            located: None,
            seen: [false; PersonPart::ALL.len()],
            required: config.required.clone(),
            requires_torque: config.requires_torque,
        })
    }

    /// A required channel that was never seen.
    pub(in crate::safety) fn unseen(&self) -> Option<Channel> {
        let unseen = |part: &&PersonPart| !self.seen[**part as usize];
        let part = self.required.iter().find(unseen).copied();
        let felt = !self.requires_torque || self.watches.torque.last_stamp_s().is_some();
        part.map(PersonPart::channel)
            .or((!felt).then_some(Channel::Torque))
    }

    /// The part is not missed until it is seen again.
    pub(in crate::safety) fn forget(&mut self, part: PersonPart) {
        self.watches.person[part as usize].forget();
    }

    /// No part of the person is missed, and none has been seen. Bystanders stay.
    pub(in crate::safety) fn forget_person(&mut self) {
        let of_person = PersonPart::ALL
            .into_iter()
            .filter(|part| !part.is_bystander());
        for part in of_person {
            self.forget(part);
            self.seen[part as usize] = false;
        }
    }

    /// A person has checked the arm: its measured position is trusted.
    pub(in crate::safety) fn believe(&mut self) {
        self.consistency.believe();
    }

    /// Stores the angles for the next comparison, and the command sent. `held`: the arm was commanded to hold.
    pub(in crate::safety) fn remember(
        &mut self,
        state: &ArmState,
        sent: Sent,
        held: bool,
        elapsed_s: f64,
    ) {
        self.told_to_move = match (self.last_sent, sent) {
            (Sent::Position(from), Sent::Position(to)) => to.max_abs_difference(&from) > 1e-5,
            _ => false,
        };
        self.last_sent = sent;
        if let Some(obedience) = &mut self.obedience {
            obedience.remember(sent, held, &state.q, elapsed_s);
        }
        if state.q.0.iter().all(|v| v.is_finite()) {
            self.last_q = Some(state.q);
        }
    }

    /// Checks all inputs.
    pub(in crate::safety) fn look(
        &mut self,
        input: &SupervisorInput<'_>,
        sent: Sent,
        body: &ArmBody,
        elapsed_s: f64,
    ) -> Found {
        let arm = self.look_at_arm(input);
        let command = self.look_at_command(input, sent, body);
        let arm_is_sound = arm.is_none();
        let found = Fault::worse(arm, command);
        let found = Fault::worse(found, self.look_at_person(input, elapsed_s));
        let worst = match arm_is_sound {
            true => Fault::worse(found, self.look_at_forces(input, elapsed_s)),
            false => found,
        };
        Found {
            worst,
            arm_is_sound,
        }
    }

    /// Checks that need a sound arm state: torques and force, and whether the arm obeys.
    fn look_at_forces(&mut self, input: &SupervisorInput<'_>, elapsed_s: f64) -> Option<Fault> {
        let force = self.look_at_force(input, elapsed_s);
        let joints = self.arm.joint_count();
        let obeys = self
            .obedience
            .as_mut()
            .is_none_or(|o| o.holds(&input.state.q, joints, elapsed_s));
        let astray = Fault::new(SafeReason::NotObeyed, Severity::Broken);
        let found = Fault::worse(force, (!obeys).then_some(astray));
        // Whatever turns a joint harder than its own motor can may clamp a person; a torque that no force exerts is a fault of the sensor.
        let most_n_m = self.contact.implausible_n * LARGEST_LEVER_M;
        let torque = input.state.external_torque.unwrap_or_default();
        let severity = match torque.0.iter().all(|n_m| n_m.abs() <= most_n_m) {
            true => Severity::Caught,
            false => Severity::Broken,
        };
        let beyond = self.guard.check_torque(joints, input.state).err();
        Fault::worse(beyond.map(|reason| Fault::new(reason, severity)), found)
    }

    fn look_at_arm(&mut self, input: &SupervisorInput<'_>) -> Option<Fault> {
        let SupervisorInput { now_s, state, .. } = *input;
        // Friction may hold an arm that is nearly there.
        let is_there = match self.last_sent {
            Sent::Position(to) => to.max_abs_difference(&state.q) <= STICKS_RAD,
            _ => false,
        };
        // Standing still is no fault before the servo has had time to react.
        self.away_since_s = (!is_there).then(|| self.away_since_s.unwrap_or(now_s));
        let reacted = self
            .away_since_s
            .is_some_and(|since_s| now_s - since_s > SETS_OFF_S);
        let turned = self.last_q.is_some_and(|last| last != state.q);
        let moving = turned || state.qd.0.iter().any(|qd| qd.abs() > 0.01);
        let q = &mut self.watches.position;
        let should_move = self.told_to_move && reacted || moving;
        if let Err(fault) = q.check(now_s, state.t_s, &state.q.0, should_move) {
            // Check the velocity as well, so that both start from the same sample afterwards.
            let _ = self
                .watches
                .velocity
                .check(now_s, state.t_s, &state.qd.0, false);
            let frozen_s = match fault {
                WatchFault::Frozen { for_s } => Some(for_s),
                _ => None,
            };
            let aged_s = match fault {
                WatchFault::Stale { age_s } => age_s,
                _ => 0.0,
            };
            self.consistency.lose(state, frozen_s, aged_s);
            // After such a jump the position is unknown, even if the reading is right again.
            let severity = match fault {
                WatchFault::Jump { by } if by > LOST_RAD => Severity::Broken,
                _ => Severity::Blind,
            };
            return Some(Fault::new(reason_of(fault, Channel::Position), severity));
        }
        let (ticked, shown) = (
            state.qd.0.iter().any(|v| *v != 0.0),
            self.moved_otherwise(state),
        );
        let qd = &mut self.watches.velocity;
        if let Err(fault) = qd.check(now_s, state.t_s, &state.qd.0, ticked && shown) {
            let reason = reason_of(fault, Channel::Velocity);
            return Some(Fault::new(reason, Severity::Blind));
        }
        // Uses velocities that are sound: they limit how far the arm may have moved.
        let joints = self.arm.joint_count();
        if let Err(doubt) = self.consistency.find(state) {
            let channel = Channel::Position;
            let beyond = self.guard.check_motion(joints, state).err();
            let reason = beyond.unwrap_or(match doubt {
                Doubt::StillFrozen(for_s) => SafeReason::Frozen { channel, for_s },
                Doubt::Elsewhere(by) => SafeReason::Jump { channel, by },
            });
            // Only a person can say where the arm is.
            return Some(Fault::new(reason, Severity::Broken));
        }
        let torque = match state.external_torque {
            Some(torque) => {
                // Without noise an arm in free air may read exactly zero forever.
                let something = torque.0.iter().any(|v| *v != 0.0);
                let watch = &mut self.watches.torque;
                watch.check(now_s, state.t_s, &torque.0, turned && something)
            }
            None => self.watches.torque.missing(now_s),
        };
        if let Err(fault) = torque {
            let reason = reason_of(fault, Channel::Torque);
            return Some(Fault::new(reason, Severity::Unsure));
        }
        let beyond = self.guard.check_motion(joints, state).err();
        beyond.map(|reason| Fault::new(reason, Severity::Broken))
    }

    /// Do the angles change differently from the velocities?
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

    fn look_at_command(
        &self,
        input: &SupervisorInput<'_>,
        sent: Sent,
        body: &ArmBody,
    ) -> Option<Fault> {
        let blind = |reason| Some(Fault::new(reason, Severity::Blind));
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
        let from = match sent {
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
            // Returning into the box is always allowed.
            if !inside.contains(pose.position_m()) && inside.contains(now.position_m()) {
                return blind(SafeReason::Workspace);
            }
        }
        let nearest = body.comes_too_near(&from, &wanted)?;
        blind(SafeReason::met(&nearest))
    }

    fn look_at_person(&mut self, input: &SupervisorInput<'_>, elapsed_s: f64) -> Option<Fault> {
        let mut found = None;
        let unsure = |reason| Some(Fault::new(reason, Severity::Unsure));
        for part in PersonPart::ALL {
            let newest = input.person.iter().find(|point| point.part == part);
            if !part.is_missed() && !self.required.contains(&part) {
                self.seen[part as usize] |= newest.is_some_and(|p| p.position_m.is_finite());
                continue;
            }
            let watch = &mut self.watches.person[part as usize];
            let checked = match newest {
                Some(point) => {
                    let position = point.position_m.to_array();
                    let checked = watch.check(input.now_s, point.stamp_s, &position, true);
                    self.seen[part as usize] |= checked.is_ok();
                    checked
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
            let leapt_m = self.leapt.step(point_m, elapsed_s, &self.leaps);
            if let (Some(by), None) = (leapt_m, found) {
                let channel = Channel::Target;
                found = unsure(SafeReason::Jump { channel, by });
            }
        }
        found
    }

    fn look_at_force(&mut self, input: &SupervisorInput<'_>, elapsed_s: f64) -> Option<Fault> {
        let fault = |reason, severity| Some(Fault::new(reason, severity));
        let Some(wrench) = input.force else {
            return match self.watches.force.missing(input.now_s) {
                Ok(()) => None,
                Err(stale) => fault(reason_of(stale, Channel::Force), Severity::Unsure),
            };
        };
        let watch = &mut self.watches.force;
        let checked = watch.check(input.now_s, input.state.t_s, &wrench.to_array(), true);
        let limits = &self.contact;
        let force_n = wrench.force_n.length();
        if let Err(bad @ WatchFault::NonFinite) = checked {
            return fault(reason_of(bad, Channel::Force), Severity::Unsure);
        }
        if force_n > limits.implausible_n {
            return fault(SafeReason::ImplausibleForce { force_n }, Severity::Broken);
        }
        let pressed = |limit_n| fault(SafeReason::Force { force_n, limit_n }, Severity::Caught);
        if force_n > limits.impact_force_n() {
            return pressed(limits.impact_force_n());
        }
        if force_n > limits.lasting_force_n() {
            let since_s = *self.pressed_since_s.get_or_insert(elapsed_s);
            if elapsed_s - since_s > limits.transient_s {
                return pressed(limits.lasting_force_n());
            }
        } else {
            self.pressed_since_s = None;
        }
        if let Err(bad) = checked {
            return fault(reason_of(bad, Channel::Force), Severity::Unsure);
        }
        let wrench = self.located(&wrench, input.state.t_s);
        let load = BoardLoad::new(&self.arm.forward(&input.state.q), &wrench);
        if load.exceeds(&self.load, &self.board) {
            let moment_n_m = load.moment_n_m;
            return fault(SafeReason::BoardEdge { moment_n_m }, Severity::Unsure);
        }
        None
    }
}

impl Inspection {
    /// First-order low-pass; restarts from zero after a gap.
    fn located(&mut self, wrench: &Wrench, stamp_s: f64) -> Wrench {
        const GAP_S: f64 = 0.1;
        let (last, last_s) = self.located.unwrap_or((Wrench::default(), stamp_s));
        let dt_s = stamp_s - last_s;
        let last = match (0.0..=GAP_S).contains(&dt_s) {
            true => last,
            false => Wrench::default(),
        };
        let share = low_pass::share(dt_s.clamp(0.0, GAP_S), self.load.filter_s);
        let filtered = Wrench {
            force_n: last.force_n.lerp(wrench.force_n, share),
            moment_n_m: last.moment_n_m.lerp(wrench.moment_n_m, share),
        };
        self.located = Some((filtered, stamp_s));
        filtered
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
