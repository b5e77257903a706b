//! The arm's side of a session: states in, commands out.

#[cfg(feature = "texture")]
mod texture;
mod timing;

use super::safety::{Safety, same_fault};
use super::state::SessionState;
use crate::session::event::{Event, EventKind, EventQueue};
use crate::session::handover::{Feeler, Guidance, OpeningSender, Receiver};
use crate::session::response::SHORT_M;
#[cfg(feature = "texture")]
use crate::texture::BoardTexture;
use glam::DVec3;
use hwall_haptics::{
    ArmCommand, ArmState, Board, BoardTarget, ContactState, LinkInFront, Phase, PlaceTolerance,
    PostureTarget, RenderInput, RenderStep, Renderer, SafeReason, SafeState, Supervisor,
};
use hwall_kinematics::{ArmKinematics, ArmScratch};
use hwall_scene::SurfaceId;
use std::sync::Arc;

/// A hand that is overdue by this may not come at all, s.
pub(super) const OVERDUE_S: f64 = 0.3;
/// A board with less motion time left than this has come to rest at its goal, s.
pub(super) const RESTS_S: f64 = 0.02;
/// A board stays short of the surface only if contact is expected within this time, s.
const SOON_S: f64 = 0.3;

/// Answers every state of the arm with a command, at the rate of the control loop. It never allocates, waits for a lock, reads a clock or
/// fails.
///
/// One half of a [`Session`](crate::Session), which can run on its own thread: [`Session::split`](crate::Session::split).
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
    /// The surfaces of the moving objects, in the renderer's order.
    pub(in crate::session) objects: Vec<SurfaceId>,
    /// The object on which the current touch began.
    pub(in crate::session) touched_object: Option<usize>,
    /// Position of that object when the touch began, rad or m.
    #[cfg(feature = "texture")]
    pub(in crate::session) touched_at: f64,
    pub(in crate::session) safety: Safety,
    pub(in crate::session) state: SessionState,
    pub(in crate::session) step: Option<RenderStep>,
    /// The current touch; a hold because of a bad state or clock does not end it.
    pub(in crate::session) contact: Option<Contact>,
    /// The hand was expected at the goal by now.
    pub(in crate::session) late: bool,
    /// The board cannot be at its goal in time and stays short of it.
    pub(in crate::session) short: bool,
    /// The board has come to rest short of this goal once; the remaining motion is short.
    pub(in crate::session) rested_short: bool,
    /// Until this time the board stays where it is, although it was sent to a place that it cannot reach in time, s.
    pub(in crate::session) stays_until_s: Option<f64>,
    /// The goal was reported late; once for each goal.
    pub(in crate::session) late_announced: bool,
    /// As of the last step.
    pub(in crate::session) link_in_front: Option<LinkInFront>,
    /// Guidance older than this no longer moves a touched board, s.
    #[cfg(feature = "texture")]
    pub(in crate::session) max_guidance_age_s: f64,
    /// The goal that was reported unreachable.
    pub(in crate::session) unreachable: Option<BoardTarget>,
}

/// State of a touch.
#[derive(Debug, Clone, Copy)]
pub(in crate::session) struct Contact {
    /// How many times the world had moved before the touch.
    moves_before: u64,
    /// Did the world move since? Stays set, because what is touched is no longer where it is shown.
    world_moved: bool,
}

/// A door, panel, drawer or button at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MovingSurface {
    /// The surface.
    pub surface: SurfaceId,
    /// Opening of the surface, rad or m.
    pub position: f64,
    /// Velocity of the opening, rad/s or m/s.
    pub velocity: f64,
    /// Kinetic energy plus that of springs and latches, J.
    pub energy_j: f64,
    /// Is it under the hand: touched, or the finger still near?
    pub touched: bool,
}

impl Control {
    /// The command for the coming cycle. `now_s` and the stamp of the state are on the clock of the arm.
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
        let mut person_m = [DVec3::ZERO; 3];
        let mut points = 0;
        let tip_m = self.guidance.fingertip.map(|f| f.point_m);
        let (palm_m, other_m) = (self.guidance.palm_m, self.guidance.other_hand_m);
        for point_m in tip_m.into_iter().chain(palm_m).chain(other_m) {
            person_m[points] = point_m;
            points += 1;
        }
        let answer = self
            .guidance
            .answer
            .zip(target)
            // If a person is in the way, use the target instead: the board then stays further behind.
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
                began: self.safety.began(),
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
            // Paths are valid only in a world that has not moved.
            None if self.guidance.world_moves > 0 => None,
            None => match self.guidance.surface {
                Some(surface) => self.objects.iter().position(|object| *object == surface),
                // Between two light pushes the board stays on the object even if the target is lost.
                None => self.renderer.touched_object(),
            },
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

    /// The supervisor; `None` without one.
    #[must_use]
    pub const fn supervisor(&self) -> Option<&Supervisor> {
        self.safety.supervisor()
    }

    /// Is a fault latched? The arm then stands still or yields until [`Control::reset`].
    #[must_use]
    pub const fn is_latched(&self) -> bool {
        self.safety.is_latched()
    }

    /// Ends a latched fault; the board moves again once all inputs have been sound for a while.
    pub fn reset(&mut self) {
        self.safety.reset();
    }

    /// Reports that the arm did not take the last command: it holds from the next step on, until it takes commands again. Without a
    /// supervisor this does nothing.
    pub fn refused(&mut self) {
        self.safety.refused();
    }

    /// Stops the arm with the next step, latched. Without a supervisor this does nothing.
    pub fn stop(&mut self) {
        self.stop_for(SafeReason::Requested);
    }

    pub(in crate::session) fn stop_for(&mut self, reason: SafeReason) {
        self.safety.stop_for(reason);
    }

    /// A link in front of a surface within reach of the person, as of the last step; see [`EventKind::LinkInFront`].
    #[must_use]
    pub const fn link_in_front(&self) -> Option<LinkInFront> {
        self.link_in_front
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

    /// The next event of this half that was not yet taken, in order of time.
    pub fn next_event(&mut self) -> Option<Event> {
        self.events.pop()
    }

    /// Number of events lost because they were not taken in time.
    #[must_use]
    pub const fn missed_events(&self) -> u64 {
        self.events.missed()
    }

    #[cfg(not(feature = "texture"))]
    fn slide(&mut self, _: f64, _: &ArmState) -> Option<hwall_haptics::Slide> {
        None
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
        let link = self.renderer.follower().link_in_front();
        match (std::mem::replace(&mut self.link_in_front, link), link) {
            (None, Some(link)) => events.push(now_s, EventKind::LinkInFront(link)),
            (Some(_), None) => events.push(now_s, EventKind::LinksBehind),
            _ => {}
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
