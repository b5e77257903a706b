//! Between renderer and arm: every input watched, every command limited, every fault a named safe state.

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

/// A held arm whose joints are slower than this has come to rest, rad/s: above what the noise of sensors makes of a resting arm.
const RESTS_RAD_PER_S: f64 = 0.05;

/// Takes each command and gives back the one to send.
///
/// Nothing in here fails, blocks or allocates after construction.
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
    /// A contact that began while nobody could reach the board.
    lasts: bool,
    out_of_reach: bool,
    /// As last seen.
    person: PersonBody,
    /// The arm did not take the last command.
    refused: bool,
    sent: Sent,
    /// How the positions that are sent follow what is wanted; `None` while none are.
    braking: Option<Braking>,
    /// Why they are behind it, if they are.
    cut_for: Option<SafeReason>,
    /// Does the arm take torques?
    torque_level: bool,
    speed_cap_m_per_s: f64,
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

    /// What keeps the arm away from itself, the room and the person.
    #[must_use]
    pub const fn separation(&self) -> &Separation {
        &self.separation
    }

    /// Where the arm stood when it was first free to move: [`separation`](Self::separation) is [fitted](Separation::fit) to that, rad.
    #[must_use]
    pub const fn began(&self) -> Option<JointPositions> {
        self.began
    }

    /// The person as last seen.
    #[must_use]
    pub const fn person(&self) -> &PersonBody {
        &self.person
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

    /// This part of the person is no longer tracked on purpose. It is not missed, nor kept away from, until it is tracked again.
    pub fn forget(&mut self, part: PersonPart) {
        if part == PersonPart::Head {
            self.person = PersonBody::default();
        }
        self.inspection.forget(part);
    }

    /// Whoever was tracked is gone: nothing of them is missed, and the arm waits until all
    /// [required](SupervisorConfig::required) parts of a person are tracked again.
    pub fn forget_person(&mut self) {
        self.person = PersonBody::default();
        self.inspection.forget_person();
    }

    /// Is the board known to be out of everybody's reach? Then what the torque sensors say of a resting arm is their error. Not known
    /// by default.
    pub fn set_out_of_reach(&mut self, out_of_reach: bool) {
        self.out_of_reach = out_of_reach;
    }

    /// What the torque sensors said when the arm last rested out of everybody's reach, N m; `None` if it has not so far.
    #[must_use]
    pub fn torque_bias(&self) -> Option<JointTorques> {
        self.bias.and_then(|bias| bias.bias())
    }

    /// Ends a latched fault; commands go through again after the recovery time, if inputs are sound. The arm is believed to be where it
    /// says it is, and what its torque sensors say at rest is found anew. Without a latched fault nothing changes.
    pub fn reset(&mut self) {
        let trouble = self.faults.trouble.as_ref();
        if !trouble.is_some_and(|trouble| trouble.is_latched(self.config.latch)) {
            return;
        }
        self.faults.reset(self.clock.elapsed_s);
        self.inspection.believe();
        self.person = PersonBody::default();
        self.bias = self.config.bias.map(TorqueBias::new);
    }

    /// The arm did not take the last command: it holds until it takes them again, and goes on from where it rests.
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
            is_pressed: input
                .force
                .is_some_and(|wrench| wrench.force_n.length() > relaxed_n),
        };
        let now_s = self.clock.elapsed_s;
        self.faults
            .advance(found, condition, now_s, timing, self.config.latch);
        let joints = self.arm.joint_count();
        let agreeing = self.agreement.step(joints, input.state, &self.guard);
        let is_unproven = self.sent == Sent::Nothing && agreeing < self.config.agreeing_states;
        let unseen = self.inspection.unseen().map(PersonPart::channel);
        let reason = match is_unproven {
            true => Some(SafeReason::Unproven),
            false => unseen.map(SafeReason::Unseen),
        };
        let person = PersonBody::of(input.person, &self.config.separation.person);
        if !person.is_empty() {
            self.person = person;
        }
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

    /// Do the torque sensors of a resting arm say more than they may? Whatever else is wrong, as long as the arm's own state is
    /// sound.
    fn biased(
        &mut self,
        input: &SupervisorInput<'_>,
        arm_is_sound: bool,
        dt_s: f64,
    ) -> Option<Fault> {
        let bias = self.bias.as_mut()?;
        let is_out_of_reach = self.out_of_reach && arm_is_sound;
        // A contact lasts until nothing is felt any more, whoever comes near the board meanwhile.
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
        // A bad state says nothing about the contact.
        if arm_is_sound {
            self.lasts = is_any && contact.is_some();
        }
        bias.step(input.state, is_out_of_reach && contact.is_none(), dt_s);
        if let Some((joint, torque_n_m)) = contact {
            let reason = SafeReason::UnexpectedContact { joint, torque_n_m };
            return Some(Fault::new(reason, Severity::Unsure));
        }
        let (joint, bias_n_m) = bias.beyond(self.arm.joint_count(), &self.guard)?;
        // A hand may be near by now, and a touch would be hidden: somebody has to look.
        let reason = SafeReason::TorqueBias { joint, bias_n_m };
        Some(Fault::new(reason, Severity::Broken))
    }

    /// The command to send, and what it was cut by.
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
        let bias = self.torque_bias();
        let (state, request) = match trouble.stage {
            Stage::Hold => (SafeState::Holding { reason }, SafeRequest::Hold),
            Stage::Retreat if trouble.fault.severity == Severity::Caught => (
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
