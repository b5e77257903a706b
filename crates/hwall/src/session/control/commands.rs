//! The arm's side of a session: states in, commands out.

use super::safety::{Safety, same_fault};
use super::state::SessionState;
use crate::session::event::{Event, EventKind, EventQueue};
use crate::session::handover::{Feeler, Guidance, OpeningSender, Receiver};
use crate::session::response::SHORT_M;
#[cfg(feature = "texture")]
use crate::texture::{BoardTexture, SurfaceMotion, TextureInput};
use glam::DVec3;
#[cfg(feature = "texture")]
use hwall_haptics::ObjectPath;
use hwall_haptics::{
    ArmCommand, ArmState, Board, BoardTarget, ContactState, Phase, PlaceTolerance, PostureTarget,
    RenderInput, RenderStep, Renderer, SafeState, Slide,
};
use hwall_kinematics::{ArmKinematics, ArmScratch};
use hwall_scene::SurfaceId;
use std::sync::Arc;

/// Answers every state of the arm with a command, at the rate of the control loop: nothing is allocated, no lock is waited for,
/// no clock is read, and no input makes it fail.
///
/// One half of a [`Session`](crate::Session), for a thread of its own: [`Session::split`](crate::Session::split).
pub struct Control {
    pub(in crate::session) renderer: Renderer,
    pub(in crate::session) board: Board,
    pub(in crate::session) in_place: PlaceTolerance,
    #[cfg(feature = "texture")]
    pub(in crate::session) texture: Option<BoardTexture>,
    pub(in crate::session) receiver: Receiver,
    pub(in crate::session) openings: OpeningSender,
    pub(in crate::session) feeler: Feeler,
    pub(in crate::session) guidance: Guidance,
    pub(in crate::session) scratch: ArmScratch,
    pub(in crate::session) events: EventQueue,
    /// The surfaces of the moving objects, in the order in which the renderer has them.
    pub(in crate::session) objects: Vec<SurfaceId>,
    /// Which of them the touch under way began on.
    pub(in crate::session) touched_object: Option<usize>,
    /// Its position then, rad or m.
    #[cfg(feature = "texture")]
    pub(in crate::session) touched_at: f64,
    pub(in crate::session) safety: Safety,
    pub(in crate::session) state: SessionState,
    pub(in crate::session) step: Option<RenderStep>,
    /// The touch under way; a hold for want of a good state or clock does not end it.
    pub(in crate::session) contact: Option<Contact>,
    /// The hand was expected at the goal by now.
    pub(in crate::session) late: bool,
    /// The board cannot be at its goal in time, and stays short of it.
    pub(in crate::session) short: bool,
    /// It has come to rest short of this goal once: from there on the way is short.
    pub(in crate::session) rested_short: bool,
    /// Until when the board stays where it is although it was sent to a place that it cannot reach in time, s.
    pub(in crate::session) stays_until_s: Option<f64>,
    /// The goal was announced late; once for each goal.
    pub(in crate::session) late_announced: bool,
    /// Guidance older than this no longer moves a touched board, s.
    #[cfg(feature = "texture")]
    pub(in crate::session) max_guidance_age_s: f64,
    /// The goal that was announced unreachable.
    pub(in crate::session) unreachable: Option<BoardTarget>,
}

/// What a touch began with, and what became of it.
#[derive(Debug, Clone, Copy)]
pub(in crate::session) struct Contact {
    /// How often the world had moved before.
    moves_before: u64,
    /// Once moved it stays so: what is touched is no longer where it is shown.
    world_moved: bool,
}

/// A door, panel, drawer or button at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MovingSurface {
    /// The surface.
    pub surface: SurfaceId,
    /// Its opening, rad or m.
    pub position: f64,
    /// Velocity of the same, rad/s or m/s.
    pub velocity: f64,
    /// Kinetic energy and that of springs and latches, J.
    pub energy_j: f64,
    /// Is it under the hand: touched, or the finger still near?
    pub touched: bool,
}

impl Control {
    /// The command for the coming cycle. `now_s` and the stamp of the state are on one clock, that of the arm.
    ///
    /// If an input is missing or wrong, the state is [`SessionState::Holding`] with the reason
    /// ([`HoldReason`](hwall_haptics::HoldReason)); motion resumes once the inputs are good again.
    pub fn step(&mut self, now_s: f64, state: &ArmState) -> ArmCommand {
        if let Some(mut guidance) = self.receiver.newest() {
            self.stay_if_other_is_too_far(now_s, &mut guidance);
            let same = same_place(self.guidance.target, guidance.target);
            self.late &= same;
            self.late_announced &= same;
            let comes = guidance
                .contact_s
                .is_some_and(|due_s| due_s - now_s <= SOON_S);
            self.short &= same && comes;
            self.rested_short &= same;
            self.guidance = guidance;
        }
        let slide = self.slide(now_s, state);
        // After the board has come to rest short of its goal, the remaining motion is short and slow.
        let left_s = self.step.and_then(|step| step.left_s);
        let rests = left_s.is_some_and(|left_s| left_s <= RESTS_S);
        // Without this, a board that is late for a hovering hand would be sent back again and again.
        self.rested_short |= self.short && rests;
        self.short =
            (self.short && !rests) || (!self.rested_short && self.will_be_late(now_s, state));
        let target = self.guidance.target.map(|target| BoardTarget {
            behind_m: match self.short {
                true => target.behind_m.max(SHORT_M),
                false => target.behind_m,
            },
            slack_m: self.slack_m(now_s, &target),
            sooner_within_m: self.sooner_within_m(now_s, &target),
            ..target
        });
        let mut person_m = [DVec3::ZERO; 2];
        let mut points = 0;
        let tip_m = self.guidance.fingertip.map(|f| f.point_m);
        for point_m in tip_m.into_iter().chain(self.guidance.palm_m) {
            person_m[points] = point_m;
            points += 1;
        }
        let answer = self
            .guidance
            .answer
            .zip(target)
            // Where a person is in the way, the board stays further behind.
            .filter(|(_, target)| !self.renderer.recedes_for(target, &person_m[..points]))
            .map(|(answer, target)| PostureTarget {
                q: answer.q(self.short),
                prepositions_to: None,
                stamp_s: target.stamp_s,
            });
        let posture = answer.or(self.guidance.waits);
        let is_touched = matches!(self.renderer.contact(), ContactState::Contact { .. });
        let mut step = self.renderer.step_with(
            now_s,
            state,
            &RenderInput {
                target: target.as_ref().filter(|_| answer.is_none()),
                posture: posture.as_ref(),
                slide: slide.as_ref(),
                object: self.object(),
                person_m: &person_m[..points],
                body: self.safety.person(),
                request: self.safety.request(is_touched),
            },
        );
        let is_touched = matches!(self.renderer.contact(), ContactState::Contact { .. });
        step.command = self
            .safety
            .step(now_s, state, &self.guidance, is_touched, &step);
        self.openings.tell(self.renderer.objects());
        self.report(now_s, state, &step);
        self.step = Some(step);
        step.command
    }

    /// The moving object that is touched, or would be.
    fn object(&self) -> Option<usize> {
        match self.contact {
            Some(contact) if contact.world_moved => None,
            Some(_) => self.touched_object,
            // Paths are those of a world that stands where it stood.
            None if self.guidance.world_moves > 0 => None,
            None => {
                let surface = self.guidance.surface?;
                self.objects.iter().position(|object| *object == surface)
            }
        }
    }

    /// The moving surfaces, as of the last step.
    pub fn moving(&self) -> impl Iterator<Item = MovingSurface> + Clone + '_ {
        let all = self.objects.iter().zip(self.renderer.objects());
        all.enumerate()
            .map(|(index, (surface, rendered))| MovingSurface {
                surface: *surface,
                position: rendered.object.position(),
                velocity: rendered.object.velocity(),
                energy_j: rendered.object.energy_j(),
                touched: self.renderer.touched_object() == Some(index),
            })
    }

    /// What the board is doing, as of the last step.
    #[must_use]
    pub const fn state(&self) -> SessionState {
        self.state
    }

    /// The last step in full: force, goal configuration, verdict; `None` before the first.
    #[must_use]
    pub const fn last_step(&self) -> Option<&RenderStep> {
        self.step.as_ref()
    }

    /// Where the board is sent, as of the last step, in the base frame.
    #[must_use]
    pub const fn target(&self) -> Option<&BoardTarget> {
        self.guidance.target.as_ref()
    }

    /// The arm, with the face of the board as its tool.
    #[must_use]
    pub const fn arm(&self) -> &Arc<dyn ArmKinematics> {
        self.renderer.arm()
    }

    /// What the supervisor lets the arm do, and why, as of the last step.
    #[must_use]
    pub const fn safety(&self) -> SafeState {
        self.safety.state()
    }

    /// Is a fault latched? Then the arm stands, or gives way, until [`Control::reset`].
    #[must_use]
    pub const fn is_latched(&self) -> bool {
        self.safety.is_latched()
    }

    /// Ends a latched fault; the board moves again once all inputs have been sound for a while.
    pub fn reset(&mut self) {
        self.safety.reset();
    }

    /// The arm did not take the last command: it holds with the next step, until commands are taken again. Without a supervisor it does
    /// nothing.
    pub fn refused(&mut self) {
        self.safety.refused();
    }

    /// Stops the arm with the next step, latched. Without a supervisor it does nothing.
    pub fn stop(&mut self) {
        self.safety.stop();
    }

    /// The renderer, which turns targets and states into commands.
    #[must_use]
    pub const fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// The board.
    #[must_use]
    pub const fn board(&self) -> &Board {
        &self.board
    }

    /// The texture that the touched board presents; `None` in a session without textures.
    #[cfg(feature = "texture")]
    #[must_use]
    pub const fn texture(&self) -> Option<&BoardTexture> {
        self.texture.as_ref()
    }

    /// The next event of this half that was not taken yet, in order of time.
    pub fn next_event(&mut self) -> Option<Event> {
        self.events.pop()
    }

    /// Number of events lost because nobody took them in time.
    #[must_use]
    pub const fn missed_events(&self) -> u64 {
        self.events.missed()
    }

    /// How a touched board moves within its plane, judged by the state after the last step.
    #[cfg(feature = "texture")]
    fn slide(&mut self, now_s: f64, state: &ArmState) -> Option<Slide> {
        // A lost hand, or guidance that is too old, ends the slide.
        let heard = self
            .guidance
            .target
            .is_some_and(|target| (now_s - target.stamp_s).abs() <= self.max_guidance_age_s);
        let touched = heard && self.contact.is_some_and(|contact| !contact.world_moved);
        // While the arm brakes, the slide waits.
        let stands = |s| matches!(s, SessionState::Holding(_) | SessionState::Safe(_));
        let holds = |step: hwall_haptics::RenderStep| step.command == ArmCommand::Hold;
        let braking = touched && (stands(self.state) || self.step.is_some_and(holds));
        let surface_motion = self.surface_motion();
        let guidance = &self.guidance;
        let texture = self.texture.as_mut()?;
        if braking || !now_s.is_finite() || state.validate().is_err() {
            return None;
        }
        let step = texture.step(
            now_s,
            &state.q,
            &self.renderer.arm().forward(&state.q),
            &TextureInput {
                touched,
                surface: guidance.surface,
                roughness: guidance.roughness,
                fingertip: guidance.fingertip,
                surface_motion,
            },
        );
        if let Some(touch) = step.started {
            self.events.push(now_s, EventKind::TextureStarted(touch));
        }
        if step.ended {
            self.events.push(now_s, EventKind::TextureEnded);
        }
        step.slide
    }

    /// How the touched panel or drawer moves, as of the last step. A door turns its board with it.
    #[cfg(feature = "texture")]
    fn surface_motion(&self) -> SurfaceMotion {
        let renderer = &self.renderer;
        let touched = renderer.touched_object();
        let Some(rendered) = touched.and_then(|index| renderer.objects().get(index)) else {
            return SurfaceMotion::default();
        };
        let ObjectPath::Sliding { direction } = rendered.path else {
            return SurfaceMotion::default();
        };
        SurfaceMotion {
            by_m: direction * (rendered.object.position() - self.touched_at),
            velocity_m_per_s: direction * rendered.object.velocity(),
        }
    }

    #[cfg(not(feature = "texture"))]
    fn slide(&mut self, _: f64, _: &ArmState) -> Option<Slide> {
        None
    }

    /// The slack of a target. If there is no time to correct the goal before the hand arrives, the whole face is slack: a goal that
    /// still covers the touch is better than a better one that is reached too late.
    fn slack_m(&self, now_s: f64, target: &BoardTarget) -> [f64; 2] {
        let left_s = self.step.and_then(|step| step.left_s);
        let (Some(contact_s), Some(left_s)) = (self.guidance.contact_s, left_s) else {
            return target.slack_m;
        };
        let has_time = contact_s - now_s > left_s + MOVES_ON_S;
        let Some(goal) = self.renderer.follower().goal().filter(|_| !has_time) else {
            return target.slack_m;
        };
        // An overdue hand leaves time enough.
        if now_s > contact_s + OVERDUE_S {
            return target.slack_m;
        }
        let half_m = self.board.half_width_m.min(self.board.half_height_m);
        let widest_m = half_m - self.in_place.inset_m - EDGE_M;
        let off_m = self.renderer.arm().forward(&goal).position_m() - target.point_m;
        let holds = off_m.length() <= widest_m && off_m.dot(target.normal).abs() <= SAME_PLANE_M;
        match holds {
            // Without slack the point is too uncertain to stay.
            true => target.slack_m.map(|slack_m| match slack_m > 0.0 {
                true => slack_m.max(widest_m),
                false => slack_m,
            }),
            false => target.slack_m,
        }
    }

    /// The slack of a target, m, if the hand is expected before the board: within it, the goal may move to where the board arrives
    /// sooner.
    fn sooner_within_m(&self, now_s: f64, target: &BoardTarget) -> Option<[f64; 2]> {
        let left_s = self.step?.left_s?;
        let due_s = self.guidance.contact_s?;
        let is_free = target.slack_m.iter().all(|m| *m > 0.0);
        let is_first = self.contact.is_none() && hand_is_first(now_s, due_s, left_s);
        (is_free && is_first).then_some(target.slack_m)
    }

    /// Will the hand clearly arrive before the board?
    fn will_be_late(&self, now_s: f64, state: &ArmState) -> bool {
        let (Some(target), Some(contact_s)) = (self.guidance.target, self.guidance.contact_s)
        else {
            return false;
        };
        let left_s = self.step.and_then(|step| step.left_s);
        let presents = target.behind_m == 0.0 && self.contact.is_none();
        // A board on its surface does not go back for a small correction.
        let face = self.renderer.arm().forward(&state.q);
        let off_m = face.position_m() - target.point_m;
        let is_on_surface = off_m.length() <= self.board.half_width_m
            && off_m.dot(target.normal).abs() <= ON_SURFACE_M
            && face.rotation().z_axis.angle_between(target.normal) <= ON_SURFACE_RAD;
        let is_there = self.state == SessionState::InPlace || is_on_surface;
        let near = contact_s - now_s <= SOON_S;
        let is_late = |left_s: f64| left_s > SLOW_S && now_s + left_s > contact_s + LATE_S;
        presents && !is_there && near && left_s.is_some_and(is_late)
    }

    /// Sets the state after a step, and reports what changed.
    fn report(&mut self, now_s: f64, state: &ArmState, step: &RenderStep) {
        let (before, contact_before) = (self.state, self.contact);
        let is_first = self.step.is_none();
        if contact_before.is_none() {
            self.touched_object = self.object();
            #[cfg(feature = "texture")]
            {
                let touched = self.touched_object;
                let rendered = touched.and_then(|index| self.renderer.objects().get(index));
                self.touched_at = rendered.map_or(0.0, |rendered| rendered.object.position());
            }
        }
        self.contact = self.contact_now();
        let world_moved = self.contact.is_some_and(|contact| contact.world_moved);
        let after = match (self.safety.in_force(step.phase), step.phase) {
            (Some(in_force), _) => in_force,
            (None, Phase::Hold(reason)) => SessionState::Holding(reason),
            (None, Phase::Contact { .. }) if world_moved => SessionState::TouchedInMovingWorld,
            (None, Phase::Contact { .. }) => SessionState::Touched,
            (None, Phase::NonContact) => self.on_the_way(now_s, state, step),
        };
        self.state = after;
        let events = &mut self.events;
        let is_held = |s| matches!(s, SessionState::Holding(_) | SessionState::Safe(_));
        match (before, after) {
            (SessionState::Safe(was), SessionState::Safe(is)) if same_fault(was, is) => {}
            (_, SessionState::Safe(safe)) => events.push(now_s, EventKind::Safe(safe)),
            (SessionState::Holding(was), SessionState::Holding(is))
                if was.name() == is.name() && !is_first => {}
            (_, SessionState::Holding(reason)) => events.push(now_s, EventKind::Held(reason)),
            _ if is_held(before) && !is_first => events.push(now_s, EventKind::Resumed),
            _ => {}
        }
        match (contact_before, self.contact) {
            (None, Some(_)) => {
                let normal_force_n = step.normal_force_n.unwrap_or(0.0);
                events.push(now_s, EventKind::Touched { normal_force_n });
                // A press during a fault, or in a world that has moved, is no evidence of where the person reaches.
                if after == SessionState::Touched {
                    self.feeler.felt(now_s);
                }
            }
            (Some(_), None) => events.push(now_s, EventKind::Released),
            _ => {}
        }
        if world_moved && !contact_before.is_some_and(|contact| contact.world_moved) {
            events.push(now_s, EventKind::WorldMovedWhileTouched);
        }
        if before != after {
            match after {
                SessionState::InPlace => events.push(now_s, EventKind::Arrived),
                SessionState::Late if !self.late_announced => {
                    self.late_announced = true;
                    events.push(now_s, EventKind::Late);
                }
                _ => {}
            }
        }
        // During a touch, `unreachable` is about a slide, not about the goal.
        if matches!(step.phase, Phase::NonContact) {
            let target = self.guidance.target;
            if let Some(reason) = step.unreachable {
                if !same_place(self.unreachable, target) {
                    events.push(now_s, EventKind::Unreachable(reason));
                }
                self.unreachable = target;
            } else {
                self.unreachable = None;
            }
        }
    }

    /// The touch as the renderer knows it.
    fn contact_now(&self) -> Option<Contact> {
        let moves = self.guidance.world_moves;
        match (self.renderer.contact(), self.contact) {
            (ContactState::NonContact, _) => None,
            (ContactState::Contact { .. }, None) => Some(Contact {
                moves_before: moves,
                world_moved: false,
            }),
            (ContactState::Contact { .. }, Some(contact)) => Some(Contact {
                world_moved: contact.world_moved || moves != contact.moves_before,
                ..contact
            }),
        }
    }

    fn on_the_way(&mut self, now_s: f64, state: &ArmState, step: &RenderStep) -> SessionState {
        let Some(target) = self.guidance.target else {
            return SessionState::Waiting;
        };
        if target.behind_m > 0.0 {
            return SessionState::GettingReady;
        }
        let base_from_board = self.renderer.arm().forward(&state.q);
        if self
            .in_place
            .holds(&self.board, &base_from_board, target.point_m, target.normal)
        {
            self.late = false;
            return SessionState::InPlace;
        }
        if step.obstructed {
            return SessionState::Obstructed;
        }
        self.late |= self.guidance.contact_s.is_some_and(|due_s| now_s >= due_s);
        if self.late || self.short || step.blocked {
            SessionState::Late
        } else {
            SessionState::Approaching
        }
    }
}

/// A board that arrives later than this after the expected contact is late, s: the error of the expectation.
const LATE_S: f64 = 0.2;
/// A face within this distance and angle of its surface is on it, m and rad.
const ON_SURFACE_M: f64 = 0.01;
const ON_SURFACE_RAD: f64 = 0.1;
/// A hand that is overdue by this may not come at all, s.
pub(super) const OVERDUE_S: f64 = 0.3;
/// Time to correct the goal by a small distance during the motion, s.
const MOVES_ON_S: f64 = 0.15;
/// A face serves a touch this far outside the area that counts as in place, m.
const EDGE_M: f64 = 0.005;
/// A goal within this distance of a target's plane is on it, m.
const SAME_PLANE_M: f64 = 1e-3;
/// A board this close to its goal in time is slow, and goes on, s.
const SLOW_S: f64 = 0.2;
/// A board this close to its goal in time has come to rest there, s.
pub(super) const RESTS_S: f64 = 0.02;
/// A board stays short of the surface only if contact is expected within this time, s.
const SOON_S: f64 = 0.3;

/// Does a hand that is due at `due_s` arrive before a board that needs `left_s`? A board at rest is not late, and an overdue hand may
/// not come at all.
fn hand_is_first(now_s: f64, due_s: f64, left_s: f64) -> bool {
    now_s <= due_s + OVERDUE_S && (due_s - now_s).max(RESTS_S) < left_s
}

/// Targets within this distance are the same place, m.
const SAME_M: f64 = 0.05;
/// Largest distance between the normals of such targets: targets from predicted joint angles are noisy.
const SAME_NORMAL: f64 = 0.02;

/// Are two targets the same place?
fn same_place(a: Option<BoardTarget>, b: Option<BoardTarget>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => {
            a.normal.distance(b.normal) <= SAME_NORMAL && a.point_m.distance(b.point_m) <= SAME_M
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_is_first_while_it_comes_and_the_board_is_under_way() {
        for (due_s, left_s, is_first) in [
            (10.2, 0.5, true),
            (10.5, 0.2, false),
            // Overdue, and not come at all.
            (9.9, 0.5, true),
            (9.9 - OVERDUE_S, 0.5, false),
            // The board rests, or nearly.
            (9.9, 0.0, false),
            (9.9, RESTS_S, false),
            // Nobody knows.
            (f64::NAN, 0.5, false),
            (10.2, f64::NAN, false),
        ] {
            assert_eq!(
                hand_is_first(10.0, due_s, left_s),
                is_first,
                "{due_s} {left_s}"
            );
        }
    }
}
