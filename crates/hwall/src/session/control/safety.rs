//! The supervisor within a session.

use super::state::SessionState;
use crate::session::handover::Guidance;
use glam::DVec3;
use hwall_haptics::body::{PersonBody, Separation};
use hwall_haptics::safety::{PersonPart, PersonPoint, SafeReason, SupervisorConfig};
use hwall_haptics::{
    ArmCommand, ArmState, Board, HapticsError, HoldReason, Phase, RenderStep, SafeRequest,
    SafeState, Supervisor, SupervisorInput, SupervisorStep,
};
use hwall_kinematics::{ArmKinematics, JointPositions};

/// The supervisor, if there is one, and its last result.
pub(in crate::session) struct Safety {
    supervisor: Option<Supervisor>,
    last: Option<SupervisorStep>,
    /// The fault as reported by the renderer and by the supervisor.
    named: Option<(HoldReason, SafeState)>,
    /// How many people were tracked before, as of the last guidance.
    people_before: u64,
}

impl Safety {
    pub(in crate::session) const fn none() -> Self {
        Self {
            supervisor: None,
            last: None,
            named: None,
            people_before: 0,
        }
    }

    pub(in crate::session) fn new(
        arm: &dyn ArmKinematics,
        board: &Board,
        config: SupervisorConfig,
    ) -> Result<Self, HapticsError> {
        Ok(Self {
            supervisor: Some(Supervisor::new(arm, board, config)?),
            last: None,
            named: None,
            people_before: 0,
        })
    }

    /// What paths keep clear of.
    pub(in crate::session) fn separation(&self) -> Option<Separation> {
        Some(self.supervisor.as_ref()?.separation().clone())
    }

    pub(super) const fn supervisor(&self) -> Option<&Supervisor> {
        self.supervisor.as_ref()
    }

    /// The person and bystanders as last seen.
    pub(super) fn person(&self) -> PersonBody {
        let supervisor = self.supervisor.as_ref();
        supervisor.map_or(PersonBody::default(), |supervisor| *supervisor.person())
    }

    /// The configuration in which the arm was first free to move, rad.
    pub(super) fn began(&self) -> Option<JointPositions> {
        self.supervisor.as_ref().and_then(Supervisor::began)
    }

    /// What the renderer is asked to do in the coming step. A touched board stands still instead of withdrawing from under a hand, unless
    /// that hand presses too hard or something else pushes the arm.
    pub(super) fn request(&self, is_touched: bool) -> Option<SafeRequest> {
        let last = self.last?;
        let withdraws = matches!(last.request, SafeRequest::Retreat { .. });
        Some(match withdraws && is_touched && !last.latched {
            true => SafeRequest::Hold,
            false => last.request,
        })
    }

    pub(super) const fn state(&self) -> SafeState {
        match self.last {
            Some(last) => last.state,
            None => SafeState::Normal,
        }
    }

    pub(super) const fn is_latched(&self) -> bool {
        matches!(self.last, Some(SupervisorStep { latched: true, .. }))
    }

    pub(super) fn reset(&mut self) {
        if let Some(supervisor) = &mut self.supervisor {
            supervisor.reset();
        }
    }

    pub(super) fn refused(&mut self) {
        if let Some(supervisor) = &mut self.supervisor {
            supervisor.refused();
        }
    }

    pub(super) fn stop_for(&mut self, reason: SafeReason) {
        if let Some(supervisor) = &mut self.supervisor {
            supervisor.stop_for(reason);
        }
    }

    /// The command to send instead of the renderer's.
    ///
    /// During a touch the tracked hand is ignored: the contact force locates it, and the board stands still under it or moves with the
    /// pushed object. The board stops under the hand when the head is lost.
    pub(super) fn step(
        &mut self,
        now_s: f64,
        state: &ArmState,
        guidance: &Guidance,
        is_touched: bool,
        step: &RenderStep,
    ) -> ArmCommand {
        let Some(supervisor) = &mut self.supervisor else {
            return step.command;
        };
        if self.people_before != guidance.people_before {
            self.people_before = guidance.people_before;
            supervisor.forget_person();
        }
        let face_m = supervisor.arm().forward(&state.q).position_m();
        let mut out_of_reach = false;
        let of_person = [
            (
                PersonPart::Fingertip,
                guidance.fingertip.map(|tip| tip.point_m),
            ),
            (PersonPart::Palm, guidance.palm_m),
            (PersonPart::Head, guidance.head_m),
            (PersonPart::Elbow, guidance.elbow_m),
            (PersonPart::OtherHand, guidance.other_hand_m),
        ];
        let of_person = of_person.map(|(part, at_m)| (part, at_m.map(|m| (m, guidance.seen_s))));
        let bystanders = PersonPart::BYSTANDERS.into_iter().zip(guidance.bystanders);
        let mut person = [PersonPoint {
            part: PersonPart::Head,
            position_m: DVec3::ZERO,
            stamp_s: 0.0,
        }; PersonPart::ALL.len()];
        let mut points = 0;
        for (part, seen) in of_person.into_iter().chain(bystanders) {
            let touches = matches!(part, PersonPart::Fingertip | PersonPart::Palm);
            let heeded = !(is_touched && touches);
            let has_left = part.is_bystander() && seen.is_none();
            if !heeded || has_left {
                supervisor.forget(part);
            }
            if let Some((at_m, stamp_s)) = seen {
                let fresh = (now_s - stamp_s).abs() <= supervisor.config().head.max_age_s;
                // A bystander's hands are not tracked.
                let arm_m = if part.is_bystander() { ARM_M } else { 0.0 };
                let far = fresh && at_m.distance(face_m) > OUT_OF_REACH_M + arm_m;
                out_of_reach = far && (out_of_reach || part == PersonPart::Fingertip);
            }
            if let Some((position_m, stamp_s)) = seen.filter(|_| heeded) {
                person[points] = PersonPoint {
                    part,
                    position_m,
                    stamp_s,
                };
                points += 1;
            }
        }
        supervisor.set_out_of_reach(out_of_reach);
        let target = guidance.target.filter(|_| !is_touched);
        let mut said = supervisor.step(&SupervisorInput {
            now_s,
            state,
            person: &person[..points],
            target: target.map(|target| (target.point_m, target.stamp_s)),
            force: step.wrench,
            command: step.command,
        });
        // A retreat without motion is a hold.
        if let (SafeState::Retreating { reason }, ArmCommand::Hold) = (said.state, said.command) {
            said.state = SafeState::Holding { reason };
        }
        self.last = Some(said);
        said.command
    }

    /// The state that replaces the session's; `None` while commands go through. A fault that the renderer has reported keeps its name until
    /// the arm stands still because of another one.
    pub(super) fn in_force(&mut self, phase: Phase) -> Option<SessionState> {
        let last = self.last?;
        // At the start, too few states of the arm agree, or an input has not been seen yet. If the renderer holds anyway, its own reason is
        // reported.
        let begins = matches!(
            last.state.reason(),
            Some(SafeReason::Unproven | SafeReason::Unseen(_))
        );
        if matches!(phase, Phase::Hold(_)) && begins {
            return None;
        }
        let stands = match last.state {
            SafeState::Normal | SafeState::Slowed { .. } => {
                self.named = None;
                return None;
            }
            // Without a sound state of the arm, the renderer cannot withdraw: it stands still.
            _ => !last.latched && last.command == ArmCommand::Hold,
        };
        if let Phase::Hold(reason) = phase
            && reason != HoldReason::NoTarget
        {
            self.named = Some((reason, last.state));
        }
        let named = self
            .named
            .filter(|(_, state)| stands && same_reason(*state, last.state));
        Some(match named {
            Some((reason, _)) => SessionState::Holding(reason),
            None => SessionState::Safe(last.state),
        })
    }
}

/// A board further than this from fingertip, palm and head is out of the person's reach, m.
const OUT_OF_REACH_M: f64 = 0.3;
/// A hand reaches this far from the head, m.
const ARM_M: f64 = 0.85;

/// Does the supervisor do the same for the same fault? Numbers may differ.
pub(super) fn same_fault(a: SafeState, b: SafeState) -> bool {
    a.name() == b.name() && same_reason(a, b)
}

fn same_reason(a: SafeState, b: SafeState) -> bool {
    let reason = |state: SafeState| {
        let reason = state.reason();
        let channel = reason.and_then(|reason| reason.channel());
        (reason.map(|reason| reason.name()), channel)
    };
    reason(a) == reason(b)
}
