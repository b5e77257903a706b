//! One control step: check the inputs, detect touches, move or hold.

mod diversions;
mod inputs;

use super::aim::aimed_at;
use super::config::{ForceConfig, RendererConfig, WatchdogConfig};
use super::contact::{ContactDetector, ContactState};
use super::hold::HoldReason;
use super::object::object_rendering::{
    ObjectCommand, ObjectRendering, ObjectRenderingConfig, RenderedObject,
};
use super::object::objects::Objects;
use super::proximity::ProximityConfig;
use super::recess::clear_of;
use super::step::{Phase, RenderInput, RenderStep};
use super::supervised::{SpeedCap, Withdrawal};
use crate::arm::{ArmCommand, ArmState};
use crate::board::{Board, BoardTarget};
use crate::body::Separation;
use crate::error::HapticsError;
use crate::motion::{BarrierTree, Follower, Planner};
use crate::nominal_step::NominalStep;
use crate::safety::SafeRequest;
use glam::DVec3;
use hwall_kinematics::{ArmKinematics, JointPositions, Unreachable};
use hwall_numeric::check::{non_negative, positive};
use std::sync::Arc;

/// A board that can stop within this time counts as at rest, s: it may follow an object, or be commanded again after a hold.
const AT_REST_S: f64 = 0.02;

/// Outcome of an aim.
#[derive(Debug, Clone, Copy, Default)]
struct Aimed {
    unreachable: Option<Unreachable>,
    obstructed: bool,
}

/// Converts board targets and arm states into arm commands.
///
/// Time, targets and states are arguments, all on one clock; nothing is allocated after construction. A [`Planner`], which runs in
/// [`plan`](Self::plan) between two steps, finds goals and paths.
#[derive(Debug)]
pub struct Renderer {
    force: ForceConfig,
    watchdog: WatchdogConfig,
    proximity: ProximityConfig,
    board: Board,
    speed_share: f64,
    /// Filtered normal force, N.
    felt_n: f64,
    detector: ContactDetector,
    objects: Option<Objects>,
    follower: Follower,
    /// The arm does not follow commands: it has not started yet, or brakes by itself.
    is_detached: bool,
    last_s: Option<f64>,
    steps: NominalStep,
    /// The retreat that a supervisor requested.
    withdrawal: Withdrawal,
    /// The speed limit that a supervisor requested.
    cap: SpeedCap,
}

impl Renderer {
    /// For an arm that carries the board; the board's face replaces the arm's own tool.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(
        arm: &dyn ArmKinematics,
        board: &Board,
        config: RendererConfig,
    ) -> Result<Self, HapticsError> {
        let RendererConfig {
            contact,
            follower,
            force,
            watchdog,
            proximity,
        } = config;
        non_negative("damping_m", force.damping_m)?;
        positive("moment_length_m", force.moment_length_m)?;
        non_negative("filter_s", force.filter_s)?;
        proximity.validate()?;
        positive("max_target_age_s", watchdog.max_target_age_s)?;
        positive("max_state_age_s", watchdog.max_state_age_s)?;
        positive("max_step_s", watchdog.max_step_s)?;
        let arm = arm.carrying(board.flange_from_board_face()?);
        let approach = follower.approach;
        Ok(Self {
            force,
            watchdog,
            proximity,
            board: *board,
            speed_share: 1.0,
            felt_n: 0.0,
            detector: ContactDetector::new(contact)?,
            follower: Follower::new(Arc::clone(&arm), follower, &JointPositions::default())?
                .with_board(approach, *board),
            objects: None,
            is_detached: true,
            last_s: None,
            steps: NominalStep::default(),
            withdrawal: Withdrawal::new(arm),
            cap: SpeedCap::default(),
        })
    }

    /// The arm with the board's face as its tool.
    #[must_use]
    pub const fn arm(&self) -> &Arc<dyn ArmKinematics> {
        self.follower.arm()
    }

    /// Touched or not, at the last usable state: a hold without a usable state does not change it.
    #[must_use]
    pub const fn contact(&self) -> ContactState {
        self.detector.state()
    }

    /// One control step. It never fails: any bad input leads to [`Phase::Hold`] with its reason, and following resumes once the inputs are good
    /// again.
    ///
    /// With a missing or bad target the command comes to rest; during a touch the target is ignored. With a bad or stale state, or a bad clock, the
    /// arm is commanded to brake by itself ([`ArmCommand::Hold`]). An arm without torque sensors never reports a touch; one that loses them during a
    /// touch stays in the touch.
    pub fn step(
        &mut self,
        now_s: f64,
        state: &ArmState,
        target: Option<&BoardTarget>,
    ) -> RenderStep {
        let input = RenderInput {
            target,
            ..RenderInput::default()
        };
        self.step_with(now_s, state, &input)
    }

    /// Runs the renderer's own planner, between two steps; see [`Planner::plan`].
    pub fn plan(&mut self) -> bool {
        self.follower.plan()
    }

    /// Hands over the planner, to run on its own thread or for a caller that moves the surfaces.
    pub fn take_planner(&mut self) -> Option<Planner> {
        self.follower.take_planner()
    }

    /// From now on paths keep clear of the arm itself, the room and the person, see [`Follower::keep_clear`]. Call before taking the planner.
    pub fn keep_clear(&mut self, separation: Separation) {
        self.follower.keep_clear(separation);
    }

    /// Sets surfaces that the board stays behind on its path, besides the one that it presents. A planner on its own needs its own call. While it
    /// knows no surfaces ([`Planner::lose_barriers`]) the board comes to rest and holds ([`HoldReason::UnknownSurfaces`]); a touch continues.
    pub fn set_barriers(&mut self, barriers: impl Into<BarrierTree>) {
        self.follower.set_barriers(barriers);
    }

    /// Sets the moving objects of the scene, base frame, and how the arm moves along with a touched one. They also move by themselves: a door with a
    /// spring closes when it is released.
    ///
    /// # Errors
    /// Settings outside their range, dynamics of another arm.
    pub fn set_objects(
        &mut self,
        command: ObjectCommand,
        config: ObjectRenderingConfig,
        objects: Vec<RenderedObject>,
    ) -> Result<(), HapticsError> {
        let rendering = ObjectRendering::new(Arc::clone(self.arm()), command, config)?;
        self.objects = Some(Objects::new(rendering, objects));
        Ok(())
    }

    /// The moving objects, after the last step.
    #[must_use]
    pub fn objects(&self) -> &[RenderedObject] {
        self.objects.as_ref().map_or(&[], Objects::all)
    }

    /// The object that the board is on: it is touched, or was touched and the finger is still near.
    #[must_use]
    pub fn touched_object(&self) -> Option<usize> {
        self.objects.as_ref().and_then(Objects::touched)
    }

    /// The follower, which turns targets into joint motion.
    #[must_use]
    pub const fn follower(&self) -> &Follower {
        &self.follower
    }

    /// One control step with all inputs; otherwise as [`Renderer::step`]. Non-finite points of the person are ignored.
    pub fn step_with(
        &mut self,
        now_s: f64,
        state: &ArmState,
        input: &RenderInput<'_>,
    ) -> RenderStep {
        let nominal_s = self.steps.nominal_s();
        let mut dt_s = match self.tick(now_s) {
            Ok(dt_s) => dt_s,
            Err(reason) => return self.hand_over(reason, 0.0),
        };
        if let Err(reason) = self.check_state(now_s, state) {
            return self.hand_over(reason, dt_s);
        }
        let was_detached = self.is_detached;
        let request = match self.attach(state) {
            Ok(true) => input.request,
            Ok(false) => Some(SafeRequest::Hold),
            Err(reason) => return self.hand_over(reason, dt_s),
        };
        if was_detached {
            // The first command has no lag to catch up with.
            dt_s = dt_s.min(nominal_s.unwrap_or(dt_s));
        }
        let felt = match self.felt(state) {
            Ok(felt) => felt,
            Err(reason) => return self.hand_over(reason, dt_s),
        };
        let wrench = felt.map(|(wrench, _)| wrench);
        let normal_force_n = felt.map(|(_, force_n)| self.filtered(force_n, dt_s));
        let contact = match normal_force_n {
            Some(force_n) => self
                .detector
                .step(now_s, force_n)
                .unwrap_or(self.detector.state()),
            None => self.detector.state(),
        };
        let (mut unreachable, mut obstructed) = (None, false);
        let is_asked_to = !matches!(request, None | Some(SafeRequest::Go { .. }));
        let rides = contact == ContactState::NonContact && self.rides(input, state);
        if contact == ContactState::NonContact && !rides {
            // Before planning: the motion continues from where the object has carried the board.
            self.let_go(Some(state));
        }
        let phase = match contact {
            ContactState::Contact { since_s } => Phase::Contact { since_s },
            ContactState::NonContact => {
                match aimed_at(now_s, input, &self.watchdog, self.follower.knows_surfaces()) {
                    Err(reason) => Phase::Hold(reason),
                    Ok(()) if is_asked_to => Phase::NonContact,
                    Ok(()) => match self.aim(input) {
                        Ok(aimed) => {
                            (unreachable, obstructed) = (aimed.unreachable, aimed.obstructed);
                            Phase::NonContact
                        }
                        Err(reason) => Phase::Hold(reason),
                    },
                }
            }
        };
        let mut sliding = false;
        let command = if is_asked_to {
            self.stop_objects(Some(state), dt_s);
            self.supervised(request, state.external_torque.as_ref(), dt_s)
        } else {
            self.end_withdrawal();
            let asked = match request {
                Some(SafeRequest::Go { speed_share }) => speed_share,
                _ => 1.0,
            };
            let has_slowed = self.follower.has_slowed();
            let most = self.cap.step(asked, self.speed_share, has_slowed, dt_s);
            self.keep_distance(input.person_m, most);
            let slide = input.slide.filter(|s| {
                matches!(phase, Phase::Contact { .. })
                    && s.validate().is_ok()
                    && !self.comes_to_rest(input)
            });
            if matches!(phase, Phase::Hold(_)) {
                self.let_go(Some(state));
            }
            let moved = match (phase, slide) {
                (Phase::NonContact, _) => self.follower.step(dt_s),
                (_, None) => self.follower.brake(dt_s),
                (_, Some(slide)) => self.follower.slide(dt_s, slide).map(|verdict| {
                    unreachable = verdict;
                    sliding = verdict.is_none();
                    self.follower.commanded()
                }),
            };
            let command = moved.map_or(ArmCommand::Hold, ArmCommand::Position);
            match self.along_with_object(phase, input, state, wrench, dt_s) {
                Some(with_object) => {
                    (unreachable, sliding) = (with_object.1, with_object.2);
                    with_object.0
                }
                None => command,
            }
        };
        if command == ArmCommand::Hold && !self.is_detached {
            self.let_go(None);
            self.is_detached = true;
        }
        RenderStep {
            wrench,
            normal_force_n,
            unreachable,
            sliding,
            obstructed,
            object_port: self.objects.as_ref().and_then(Objects::ledger),
            ..self.report(command, phase)
        }
    }

    /// The result of a step without further information.
    fn report(&self, command: ArmCommand, phase: Phase) -> RenderStep {
        RenderStep {
            command,
            phase,
            wrench: None,
            normal_force_n: None,
            unreachable: None,
            goal: self.follower.goal(),
            sliding: false,
            left_s: self.follower.left_s(),
            obstructed: false,
            object_port: None,
            blocked: self.follower.is_blocked(),
        }
    }

    /// Would the board have to move back for a person at this target?
    #[must_use]
    pub fn recedes_for(&self, target: &BoardTarget, person_m: &[DVec3]) -> bool {
        let face = self.follower.commanded_pose();
        let clearance_m = self.proximity.clearance_m;
        clear_of(target, person_m, &self.board, &face, clearance_m).is_some()
    }

    fn aim(&mut self, input: &RenderInput<'_>) -> Result<Aimed, HoldReason> {
        self.follower.set_person(input.body);
        self.follower.set_began(input.began);
        let mut aimed = Aimed::default();
        let set = match (input.target, input.posture) {
            (Some(target), _) => {
                let face = self.follower.commanded_pose();
                let clearance_m = self.proximity.clearance_m;
                let clear = clear_of(target, input.person_m, &self.board, &face, clearance_m);
                aimed.obstructed = clear.is_some();
                self.follower
                    .set_target(clear.as_ref().unwrap_or(target))
                    .map(|unreachable| aimed.unreachable = unreachable)
            }
            (None, Some(posture)) => {
                let prepositions_to = posture.prepositions_to.as_ref();
                self.follower.set_posture(&posture.q, prepositions_to)
            }
            (None, None) => Ok(()),
        };
        set.map(|()| aimed).map_err(|_| HoldReason::InvalidTarget)
    }

    /// Slows the board down near the person.
    fn keep_distance(&mut self, person_m: &[DVec3], most: f64) {
        let share = if person_m.is_empty() {
            1.0
        } else {
            let (face, twist) = self.follower.commanded_motion();
            // A motion that has not slowed down yet still has the previous speed, and would be cut again in every step.
            let in_force = self.speed_share.max(self.follower.present_share());
            let moves = (&twist, self.follower.stop_s());
            self.proximity
                .speed_share(&self.board, &face, moves, person_m, in_force)
        };
        let share = share.min(most);
        // If no slower motion is found, the current one continues; the next step tries again.
        if self.follower.set_speed_share(share).is_ok() {
            self.speed_share = share;
        }
    }

    /// The arm brakes by itself; the command comes to rest beside it.
    fn hand_over(&mut self, reason: HoldReason, dt_s: f64) -> RenderStep {
        // Without contact, restart the filter from zero, since a single raw value may be all noise. During contact keep it, so that occasional bad
        // states do not end the touch.
        if self.detector.state() == ContactState::NonContact {
            self.felt_n = 0.0;
        }
        // A motion along an object's path, or a retreat, ends here; the next one starts from the arm's position then.
        self.end_withdrawal();
        self.stop_objects(None, dt_s);
        self.is_detached = true;
        // The step is finite and not negative, so braking cannot fail.
        let _ = self.follower.brake(dt_s);
        self.report(ArmCommand::Hold, Phase::Hold(reason))
    }
}
