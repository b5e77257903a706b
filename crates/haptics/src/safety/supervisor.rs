//! Between renderer and arm: checks every input, limits every command, turns every fault into a named safe state.

mod limited;

use super::cycle::{Sent, SupervisorInput, SupervisorStep};
use super::fault::{Condition, Fault, FaultMachine, Severity, Stage};
use super::limits::braking::Braking;
use super::limits::motion_guard::GuardLimits;
use super::limits::person::PersonPart;
use super::state::{SafeReason, SafeRequest, SafeState};
use super::supervisor_config::SupervisorConfig;
use super::watch::agreement::Agreement;
use super::watch::clock::Clock;
use super::watch::face_pushes::FacePushes;
use super::watch::inspection::Inspection;
use super::watch::torque_bias::TorqueBias;
use crate::arm::ArmCommand;
use crate::board::Board;
use crate::body::{ArmBody, PersonBody, Separation};
use crate::error::HapticsError;
use glam::DVec2;
use hwall_kinematics::{ArmKinematics, JointPositions, JointTorques};
use std::sync::Arc;

/// A held arm whose joints are slower than this is at rest, rad/s: above the sensor noise of a resting arm.
const RESTS_RAD_PER_S: f64 = 0.05;

/// Takes each command and returns the one to send.
///
/// It never fails or blocks, and does not allocate after construction.
#[derive(Debug, Clone)]
pub struct Supervisor {
    arm: Arc<dyn ArmKinematics>,
    board: Board,
    config: SupervisorConfig,
    guard: GuardLimits,
    inspection: Inspection,
    separation: Separation,
    clock: Clock,
    faults: FaultMachine,
    agreement: Agreement,
    began: Option<JointPositions>,
    bias: Option<TorqueBias>,
    face_pushes: FacePushes,
    /// A contact that began while nobody could reach the board still lasts.
    lasts: bool,
    /// An unexpected contact was found in the last cycle.
    is_pushed: bool,
    out_of_reach: bool,
    /// At the last known positions.
    person: PersonBody,
    /// The arm did not take the last command.
    refused: bool,
    sent: Sent,
    /// How the sent positions follow the wanted ones; `None` while none are sent.
    braking: Option<Braking>,
    /// Why the sent positions lag behind, if they do.
    cut_for: Option<SafeReason>,
    /// Does the arm take torques?
    torque_level: bool,
    speed_cap_m_per_s: f64,
}

impl Supervisor {
    /// For an arm that carries the board; the board's face replaces the arm's own tool, as in the renderer.
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
        let room = config.room.clone().unwrap_or_default();
        let body = ArmBody::new(Arc::clone(&arm), *board, config.body)?.in_room(room)?;
        let speed_cap_m_per_s = config.contact.speed_cap_m_per_s(config.effective_mass_kg)?;
        Ok(Self {
            inspection: Inspection::new(arm.clone(), *board, guard, &config)?,
            separation: Separation::new(body, config.separation, guard.acceleration_rad_per_s2)?,
            arm,
            board: *board,
            guard,
            clock: Clock::default(),
            faults: FaultMachine::default(),
            agreement: Agreement::default(),
            began: None,
            bias: config.bias.map(TorqueBias::new),
            face_pushes: FacePushes::default(),
            lasts: false,
            is_pushed: false,
            out_of_reach: false,
            person: PersonBody::default(),
            refused: false,
            sent: Sent::Nothing,
            braking: None,
            cut_for: None,
            torque_level: false,
            speed_cap_m_per_s,
            config,
        })
    }

    /// The settings.
    #[must_use]
    pub const fn config(&self) -> &SupervisorConfig {
        &self.config
    }

    /// The arm with the board's face as its tool.
    #[must_use]
    pub const fn arm(&self) -> &Arc<dyn ArmKinematics> {
        &self.arm
    }

    /// Keeps the arm away from itself, the room and the person.
    #[must_use]
    pub const fn separation(&self) -> &Separation {
        &self.separation
    }

    /// The configuration in which the arm was first free to move, rad: [`separation`](Self::separation) is [fitted](Separation::fit) to it.
    #[must_use]
    pub const fn began(&self) -> Option<JointPositions> {
        self.began
    }

    /// The person and bystanders at their last known positions.
    #[must_use]
    pub const fn person(&self) -> &PersonBody {
        &self.person
    }

    /// Sets the effective mass at the board, kg, see [`effective_mass_kg`](crate::passivity::effective_mass_kg).
    ///
    /// # Errors
    /// A mass that is not positive.
    pub fn set_effective_mass_kg(&mut self, mass_kg: f64) -> Result<(), HapticsError> {
        self.speed_cap_m_per_s = self.config.contact.speed_cap_m_per_s(mass_kg)?;
        self.config.effective_mass_kg = mass_kg;
        Ok(())
    }

    /// This part of the person is deliberately no longer tracked, or this bystander has left. Until it is tracked again, it is not missed and the arm does
    /// not keep away from it.
    pub fn forget(&mut self, part: PersonPart) {
        self.person.forget(part);
        self.inspection.forget(part);
    }

    /// The tracked person has left: none of their parts is missed, and the arm waits until all [required](SupervisorConfig::required) parts of a
    /// person are tracked again. Bystanders stay.
    pub fn forget_person(&mut self) {
        self.person.forget(PersonPart::Head);
        self.inspection.forget_person();
    }

    /// Is the board known to be out of everybody's reach? Then the torque readings of a resting arm are sensor bias. Default: not known.
    pub fn set_out_of_reach(&mut self, out_of_reach: bool) {
        self.out_of_reach = out_of_reach;
    }

    /// Torque readings without a push, N m: those of the first rest out of everybody's reach, which then follow the sensors as slowly as
    /// [`BiasConfig::drift_s`](super::BiasConfig::drift_s) says. `None` before the first.
    #[must_use]
    pub fn torque_bias(&self) -> Option<JointTorques> {
        self.bias.and_then(|bias| bias.bias())
    }

    /// Ends a latched fault; commands go through again after the recovery time if inputs are sound. The measured position is then trusted, and the
    /// torque bias is estimated anew, unless the arm gave way to a force. No effect without a latched fault.
    pub fn reset(&mut self) {
        let latched = (self.faults.trouble).filter(|trouble| trouble.is_latched(self.config.latch));
        let Some(trouble) = latched else {
            return;
        };
        self.faults.reset(self.clock.elapsed_s);
        self.inspection.believe();
        // The hand that is let go is still felt; otherwise somebody may have changed the board.
        if trouble.fault.severity != Severity::Caught {
            self.bias = self.config.bias.map(TorqueBias::new);
        }
    }

    /// The arm rejected the last command: it holds until it accepts commands again, and then continues from rest.
    pub const fn refused(&mut self) {
        self.refused = true;
    }

    /// Stops the arm, latched.
    pub fn stop(&mut self) {
        self.stop_for(SafeReason::Requested);
    }

    /// Stops the arm, latched, for a reason of the caller.
    pub fn stop_for(&mut self, reason: SafeReason) {
        self.faults.stop(reason, self.clock.elapsed_s);
    }

    /// One cycle.
    pub fn step(&mut self, input: &SupervisorInput<'_>) -> SupervisorStep {
        let tick = self.clock.tick(input.now_s, &self.config);
        let dt_s = tick.as_ref().map_or(0.0, |dt_s| *dt_s);
        match input.command {
            ArmCommand::Torque(_) => self.torque_level = true,
            ArmCommand::Position(_) => self.torque_level = false,
            _ => {}
        }
        let found = match tick {
            Err(reason) => Some(Fault::new(reason, Severity::Blind)),
            Ok(_) => {
                let (body, now_s) = (self.separation.body(), self.clock.elapsed_s);
                let found = self.inspection.look(input, self.sent, body, now_s);
                Fault::worse(found.worst, self.biased(input, found.arm_is_sound, dt_s))
            }
        };
        let refused = Fault::new(SafeReason::Refused, Severity::Blind);
        let refused = std::mem::take(&mut self.refused).then_some(refused);
        let found = Fault::worse(found, refused);
        let timing = &self.config.timing;
        let qd = &input.state.qd.0;
        let relaxed_n = self.config.contact.relaxed_n;
        let condition = Condition {
            rests: qd.iter().all(|qd| qd.abs() <= RESTS_RAD_PER_S),
            torque_level: self.torque_level,
            is_pressed: (input.force).is_some_and(|wrench| wrench.force_n.length() > relaxed_n)
                || (self.guard)
                    .check_torque(self.arm.joint_count(), input.state)
                    .is_err(),
            is_pushed: self.is_pushed,
        };
        let now_s = self.clock.elapsed_s;
        self.faults
            .advance(found, condition, now_s, timing, self.config.latch);
        let joints = self.arm.joint_count();
        let agreeing = self.agreement.step(joints, input.state, &self.guard);
        let is_unproven = self.sent == Sent::Nothing && agreeing < self.config.agreeing_states;
        let unseen = self.inspection.unseen();
        let reason = match is_unproven {
            true => Some(SafeReason::Unproven),
            false => unseen.map(SafeReason::Unseen),
        };
        let person = PersonBody::of(input.person, &self.config.separation.person);
        self.person.renew(&person);
        let trouble = self.faults.trouble;
        let moves = trouble.is_none_or(|trouble| trouble.stage == Stage::Retreat);
        if moves && let Some(reason) = reason {
            self.remember(input, ArmCommand::Hold);
            let reason = trouble.map_or(reason, |trouble| trouble.fault.reason);
            return SupervisorStep {
                command: ArmCommand::Hold,
                state: SafeState::Holding { reason },
                request: SafeRequest::Hold,
                latched: trouble.is_some_and(|trouble| trouble.is_latched(self.config.latch)),
            };
        }
        if self.began.is_none() && self.faults.trouble.is_none() {
            self.separation.fit(&input.state.q);
            self.began = Some(input.state.q);
        }
        let (command, slowed) = self.command(input, dt_s);
        self.remember(input, command);
        self.answer(command, slowed)
    }

    /// Is the torque bias of a resting arm too large? Checked regardless of other faults, as long as the arm's own state is sound.
    fn biased(
        &mut self,
        input: &SupervisorInput<'_>,
        arm_is_sound: bool,
        dt_s: f64,
    ) -> Option<Fault> {
        let bias = self.bias.as_mut()?;
        let is_out_of_reach = self.out_of_reach && arm_is_sound;
        // A contact lasts until the torque is gone, even if a hand comes near the board meanwhile.
        let is_any = is_out_of_reach || self.lasts;
        let (arm, q) = (&*self.arm, &input.state.q);
        let half_m = DVec2::new(self.board.half_width_m, self.board.half_height_m);
        let pushes = &mut self.face_pushes;
        let contact = arm_is_sound.then(|| {
            bias.contact(
                input.state,
                &self.guard,
                dt_s,
                |torque, unit_n_m| match is_any {
                    true => *torque,
                    false => pushes.unexplained(arm, half_m, q, torque, unit_n_m),
                },
            )
        });
        let contact = contact.flatten();
        // Without a bias it is not known which way the arm is pushed.
        self.is_pushed = contact.is_some() && bias.bias().is_some();
        // A bad state gives no information about the contact.
        if arm_is_sound {
            self.lasts = is_any && contact.is_some();
        }
        let is_free = is_out_of_reach && contact.is_none();
        bias.step(input.state, &self.guard, is_free, dt_s);
        if let Some((joint, torque_n_m)) = contact {
            let reason = SafeReason::UnexpectedContact { joint, torque_n_m };
            return Some(Fault::new(reason, Severity::Unsure));
        }
        let (joint, bias_n_m) = bias.beyond(self.arm.joint_count(), &self.guard)?;
        // A hand may be near by now, and a touch would be hidden: a person has to check.
        let reason = SafeReason::TorqueBias { joint, bias_n_m };
        Some(Fault::new(reason, Severity::Broken))
    }

    /// The command to send, and the reason for cutting it.
    fn command(
        &mut self,
        input: &SupervisorInput<'_>,
        dt_s: f64,
    ) -> (ArmCommand, Option<(f64, SafeReason)>) {
        match self.faults.trouble.map(|trouble| trouble.stage) {
            None => self.limited(input, dt_s, None),
            Some(Stage::Retreat) => {
                self.limited(input, dt_s, Some(self.config.timing.retreat_m_per_s))
            }
            Some(Stage::Compliant) => {
                let (torque, _) = self.limited_torque(&JointTorques::default(), dt_s);
                (ArmCommand::Torque(torque), None)
            }
            Some(Stage::Hold | Stage::Stop) => (ArmCommand::Hold, None),
        }
    }

    fn remember(&mut self, input: &SupervisorInput<'_>, command: ArmCommand) {
        self.sent = match command {
            ArmCommand::Position(q) => Sent::Position(q),
            ArmCommand::Torque(torque) => Sent::Torque(torque),
            _ => Sent::Nothing,
        };
        if !matches!(self.sent, Sent::Position(_)) {
            (self.braking, self.cut_for) = (None, None);
        }
        let held = command == ArmCommand::Hold;
        let now_s = self.clock.elapsed_s;
        self.inspection
            .remember(input.state, self.sent, held, now_s);
    }

    /// The bias beyond which torques are a push, N m: none once a clamp is certain, although no bias was measured.
    fn push_bias(&self, fault: &Fault) -> Option<JointTorques> {
        let is_caught = fault.severity == Severity::Caught;
        let bias = self.torque_bias();
        bias.or(is_caught.then(JointTorques::default))
    }

    fn answer(&self, command: ArmCommand, slowed: Option<(f64, SafeReason)>) -> SupervisorStep {
        let timing = &self.config.timing;
        let share = slowed.map_or(1.0, |(share, _)| share.clamp(0.01, 1.0));
        let go = SafeRequest::Go { speed_share: share };
        let Some(trouble) = self.faults.trouble else {
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
        let bias = self.push_bias(&trouble.fault);
        let (state, request) = match trouble.stage {
            Stage::Hold => (SafeState::Holding { reason }, SafeRequest::Hold),
            Stage::Retreat if trouble.fault.severity == Severity::Caught || self.is_pushed => (
                SafeState::Retreating { reason },
                SafeRequest::Yield {
                    speed_m_per_s: timing.yield_m_per_s,
                    bias,
                },
            ),
            Stage::Retreat => (
                SafeState::Retreating { reason },
                SafeRequest::Retreat {
                    behind_m: timing.retreat_m,
                    speed_m_per_s: timing.retreat_m_per_s,
                    bias,
                },
            ),
            Stage::Compliant => (SafeState::Compliant { reason }, SafeRequest::Hold),
            Stage::Stop => (SafeState::Stopped { reason }, SafeRequest::Hold),
        };
        SupervisorStep {
            command,
            state,
            request,
            latched: trouble.is_latched(self.config.latch),
        }
    }
}
