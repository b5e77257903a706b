//! The tracker's side of a session: frames in, guidance out.

mod guiding;

use super::event::{Event, EventKind, EventQueue, Goal, PredictedContact};
use super::handover::{FeltTouches, Guidance, OpeningReceiver, Sender, WorldBarriers};
use super::policy::{Decision, Explanations, Policy, Presenting, SlackConfig, Stand};
use super::response::kept_response;
use super::waiting::{Presents, Waiting};
use super::world::{World, WorldChange, WorldPose};
use crate::error::SessionError;
use crate::fingertip::Fingertip;
use crate::gesture::{GestureFilter, GestureModel};
use crate::response::Task;
#[cfg(feature = "texture")]
use crate::texture::{Presenter, TextureLevels};
use crate::walls::Walls;
use glam::DVec3;
use hwall_contact::{ContactPrediction, Predictor, PredictorInput};
use hwall_hand::{BodyPoint, GazeFilter, HandFilter, HandFrame, Tracking};
use hwall_haptics::{Board, PlaceTolerance};
use hwall_kinematics::{ArmKinematics, ArmScratch, JointPositions};
use hwall_reachability::{Presented, WallMaps};
use hwall_scene::Scene;
use std::sync::Arc;

/// Takes frames at the rate of the tracker. It keeps only its result for the newest frame; everything else is in its events.
///
/// One half of a [`Session`](crate::Session), which can run on its own thread: [`Session::split`](crate::Session::split).
pub struct Perception<P> {
    #[cfg(feature = "texture")]
    pub(super) presenter: Presenter,
    pub(super) scene: Scene,
    pub(super) walls: Walls,
    pub(super) predictor: P,
    pub(super) hand: HandFilter,
    pub(super) gaze: GazeFilter,
    pub(super) policy: Policy,
    pub(super) slack: SlackConfig,
    /// Where the arm waits for this person.
    pub(super) waiting: Waiting,
    pub(super) arm: Arc<dyn ArmKinematics>,
    pub(super) scratch: ArmScratch,
    pub(super) board: Board,
    pub(super) in_place: PlaceTolerance,
    pub(super) world: World,
    #[cfg(feature = "texture")]
    pub(super) levels: Option<TextureLevels>,
    /// Clock offset: arm time minus tracker time, s.
    pub(super) arm_minus_tracker_s: f64,
    pub(super) sender: Sender,
    pub(super) untold: Option<Guidance>,
    /// The surfaces that the board stays behind.
    pub(super) barriers: WorldBarriers,
    /// Door openings reported by the control half.
    pub(super) openings: OpeningReceiver,
    /// `None` if the session does not adapt.
    pub(super) felt: Option<FeltTouches>,
    /// `None`: every touch is answered alike.
    pub(super) gestures: Option<GestureFilter>,
    pub(super) events: EventQueue,
    pub(super) newest: Newest,
}

/// The results of the newest frame.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Newest {
    tracking: Option<Tracking>,
    /// The contact that the board serves, in the frame of the scene.
    contact: Option<ContactPrediction>,
    intent: Option<Intent>,
    /// Joint configuration that answers the hand, if the predictor gives joints.
    responds_with: Option<JointPositions>,
    /// Person data for the control half, whatever the board does.
    person: Guidance,
    /// The last announced goal.
    goal: Option<Goal>,
    /// Was the last motion unfamiliar to the predictor?
    unfamiliar: bool,
}

/// What the board is to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Intent {
    Wait,
    Preposition,
    Present,
}

/// A hand that presses the board is within this distance of the surface, m: registration error and finger compliance.
const FELT_M: f64 = 0.08;
/// A point from the maps lies on its surface to within this, m.
const LIES_M: f64 = 1e-3;

/// The places that the arm can present, in a scene that may have moved.
struct Presentable<'a> {
    world: &'a World,
    maps: &'a WallMaps,
    waiting: &'a Waiting,
    arm: &'a dyn ArmKinematics,
}

impl Presenting for Presentable<'_> {
    fn waits_at(&self) -> Option<JointPositions> {
        self.waiting.posture()
    }

    fn stand(&self, contact: &ContactPrediction) -> Option<Stand> {
        // The maps are valid only where the walls were when mapped.
        let stands = self.world.world_from_base().is_none();
        let presented = match stands {
            true => self.maps.present(contact.point_m, contact.normal),
            false => Presented::Unknown,
        };
        let point_m = match presented {
            Presented::Nearest(point_m) => point_m,
            _ => contact.point_m,
        };
        let at = ContactPrediction {
            point_m,
            ..*contact
        };
        let at = self.world.contact_in_base(at);
        let (q, is_behind_edge) = match self.waiting.presents(at.point_m, at.normal) {
            Presents::Never => return None,
            Presents::Unknown => (None, false),
            Presents::With(q, is_behind_edge) => (Some(q), is_behind_edge),
        };
        Some(Stand {
            point_m,
            q,
            is_behind_edge,
        })
    }

    fn travel_s(&self, from: &JointPositions, to: &JointPositions) -> Option<f64> {
        self.waiting.travel_s(from, to)
    }

    fn middle_m(&self, q: &JointPositions) -> Option<DVec3> {
        let stands = self.world.world_from_base().is_none();
        stands.then(|| self.arm.forward(q).position_m())
    }
}

impl<P: Predictor> Perception<P> {
    /// Takes one frame of the tracker, with points in the base frame of the arm.
    ///
    /// Frames come in order of time. If a frame is out of order, contains NaN or jumps, the hand counts as lost, with a reason
    /// ([`EventKind::Frame`]); this is never an error. Allocates only if the predictor does, or if the world jumped or tilted since the
    /// last frame.
    pub fn frame(&mut self, frame: &HandFrame) {
        self.listen();
        self.perceive(frame);
        self.tell();
    }

    /// First part of [`frame`](Self::frame): takes door openings and felt touches from the control half.
    pub(super) fn listen(&mut self) {
        self.take_openings();
        if let Some(felt) = &mut self.felt {
            felt.listen();
        }
    }

    /// Second part: processes the frame.
    pub(super) fn perceive(&mut self, frame: &HandFrame) {
        let tracking = self.hand.step(frame);
        let gaze = self.gaze.step(frame.t_s, frame.gaze_ray().as_ref());
        let arm_s = frame.t_s + self.arm_minus_tracker_s;
        self.keep_barriers(arm_s);
        // Surfaces keep their coordinates in the virtual world, so the hand is transformed into it.
        let world_from_base = self.world.world_from_base();
        let (frame_there, hand_there);
        let input = match &world_from_base {
            None => PredictorInput {
                frame,
                hand: tracking.state(),
                gaze,
            },
            Some(pose) => {
                frame_there = frame.transformed(pose);
                hand_there = tracking
                    .state()
                    .map(|state| self.world.hand_in_world(state, pose));
                PredictorInput {
                    frame: &frame_there,
                    hand: hand_there.as_ref(),
                    gaze: gaze.transformed(pose),
                }
            }
        };
        let offset_s = self.arm_minus_tracker_s;
        let felt = self.felt.as_mut();
        let felt = felt.and_then(|felt| felt.step(input.frame, input.hand, offset_s));
        if let Some((at_m, t_s)) = felt.filter(|(at_m, _)| self.is_at_served(*at_m)) {
            self.predictor.touched(at_m, t_s);
        }
        let ranked = self.predictor.predict(&self.scene, &input);
        let first = ranked.first().copied();
        if let Some(gestures) = &mut self.gestures {
            let normal = first.map(|contact| contact.normal);
            if input.frame.is_of_another {
                gestures.reset();
            }
            // After an overflow the reach is forgotten, and its touch is answered as any other.
            let _ = gestures.step(input.frame, input.hand, normal);
        }
        let decided = self.policy.step(
            frame.t_s,
            ranked,
            input.hand,
            &Presentable {
                world: &self.world,
                maps: &self.walls.maps,
                waiting: &self.waiting,
                arm: &*self.arm,
            },
        );
        // Change the waiting posture only while waiting; under way it would change goals.
        if decided.is_none_or(|(_, decision)| decision == Decision::Wait) {
            self.waiting.turn_to(self.policy.budget_s());
        }
        let stands_by = decided.map(|(contact, decision)| match decision {
            Decision::Present(contact) | Decision::Preposition(contact) => contact,
            Decision::Wait => contact,
        });
        let responds_with = kept_response(
            self.predictor.response_rad(),
            first.as_ref(),
            stands_by.as_ref(),
            self.newest.responds_with,
        );
        let fingertip = tracking.state().and_then(|state| {
            Some(Fingertip {
                point_m: frame.contact_point()?.position_m,
                velocity_m_per_s: state.velocity_m_per_s,
            })
        });
        self.newest = Newest {
            tracking: Some(tracking),
            contact: stands_by,
            intent: decided.map(|(_, decision)| match decision {
                Decision::Present(_) => Intent::Present,
                Decision::Preposition(_) => Intent::Preposition,
                Decision::Wait => Intent::Wait,
            }),
            responds_with,
            person: Guidance {
                fingertip,
                palm_m: tracking.state().and_then(|state| state.palm_m),
                head_m: frame.head_m.filter(|m| m.is_finite()),
                elbow_m: frame.body(BodyPoint::Elbow),
                other_hand_m: frame.other_hand_m.filter(|m| m.is_finite()),
                bystanders: self.newest.person.bystanders_after(frame, arm_s),
                people_before: self.newest.person.people_before + u64::from(frame.is_of_another),
                seen_s: arm_s,
                gesture: self.gesture(),
                ..Guidance::default()
            },
            goal: self.newest.goal,
            unfamiliar: self.newest.unfamiliar,
        };
        self.events.push(arm_s, EventKind::Frame(tracking));
        let unfamiliar = self.predictor.is_unfamiliar();
        if unfamiliar && !self.newest.unfamiliar {
            self.events.push(arm_s, EventKind::HandUnfamiliar);
        }
        self.newest.unfamiliar = unfamiliar;
        let predicted = self.predicted();
        self.events.push(arm_s, EventKind::Predicted(predicted));
        self.guide(predicted);
    }

    /// Sets the pose of the virtual world. A person who walks or steers through an environment larger than the room moves it around the
    /// arm; surfaces keep their coordinates in it.
    ///
    /// # Errors
    /// A time stamp (of the tracker's clock) that is NaN, infinite or before the last one; the world then keeps its pose. A clock that was
    /// set back is rejected once and accepted from its new time on.
    ///
    /// After a jump (teleport, snap turn: 0.1 m or 5 degrees at once) the predictor restarts, and the arm brakes until the next frame.
    pub fn world(&mut self, pose: &WorldPose) -> Result<(), SessionError> {
        self.perceive_world(pose)?;
        self.tell();
        Ok(())
    }

    pub(super) fn perceive_world(&mut self, pose: &WorldPose) -> Result<(), SessionError> {
        let arm_s = pose.t_s + self.arm_minus_tracker_s;
        let change = self.world.take(pose).inspect_err(|_| {
            let t_s = if arm_s.is_finite() {
                arm_s
            } else {
                self.newest.person.seen_s
            };
            self.events.push(t_s, EventKind::WorldRefused);
        })?;
        match change {
            WorldChange::None => return Ok(()),
            // The same contact is now elsewhere in the base frame.
            WorldChange::Moved => {}
            // What predictors remember of hand and gaze is now invalid; the next frame starts anew.
            WorldChange::Leapt => {
                self.predictor.reset();
                if let Some(felt) = &mut self.felt {
                    felt.reset();
                }
                if let Some(gestures) = &mut self.gestures {
                    gestures.reset();
                }
                self.policy.reset();
                self.newest.contact = None;
                self.newest.intent = None;
                self.newest.responds_with = None;
            }
        }
        self.keep_barriers(arm_s);
        let predicted = self.predicted();
        self.events.push(arm_s, EventKind::Predicted(predicted));
        self.guide(predicted);
        Ok(())
    }

    /// Applies the door openings to the predictor's scene.
    pub(super) fn take_openings(&mut self) {
        self.openings.take(&mut self.scene);
    }

    /// How many times surfaces were sent to the planner.
    #[must_use]
    pub const fn told_surfaces(&self) -> u64 {
        self.barriers.told()
    }

    /// Moves the barriers to where the surfaces are now, after doors opened or the world moved.
    fn keep_barriers(&mut self, arm_s: f64) {
        let place = self.world.base_from_world();
        let kept = self.barriers.keep(&self.scene, &place, self.world.leaps());
        if kept.is_err() {
            self.events.push(arm_s, EventKind::SurfacesUnknown);
        }
    }

    /// Sets the clock offset, s: arm time minus tracker time.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn set_clock_offset_s(&mut self, arm_minus_tracker_s: f64) -> Result<(), SessionError> {
        hwall_numeric::check::finite("arm_minus_tracker_s", arm_minus_tracker_s)?;
        self.arm_minus_tracker_s = arm_minus_tracker_s;
        Ok(())
    }

    /// The hand, as of the newest frame, in the base frame; `None` before the first.
    #[must_use]
    pub const fn tracking(&self) -> Option<&Tracking> {
        self.newest.tracking.as_ref()
    }

    /// The contact that the board serves, as of the newest frame, in the base frame.
    #[must_use]
    pub fn contact(&self) -> Option<ContactPrediction> {
        let contact = self.newest.contact?;
        Some(self.world.contact_in_base(contact))
    }

    /// The predictor of the contacts.
    #[must_use]
    pub const fn predictor(&self) -> &P {
        &self.predictor
    }

    /// The predictor of the contacts.
    pub const fn predictor_mut(&mut self) -> &mut P {
        &mut self.predictor
    }

    /// The virtual world.
    #[must_use]
    pub const fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The virtual world; its doors may be moved.
    pub const fn scene_mut(&mut self) -> &mut Scene {
        &mut self.scene
    }

    /// Maps of where the arm can present the walls.
    #[must_use]
    pub const fn maps(&self) -> &WallMaps {
        &self.walls.maps
    }

    /// Prior knowledge of the walls: where the arm can present them, from which configuration, and where it waits.
    #[must_use]
    pub const fn walls(&self) -> &Walls {
        &self.walls
    }

    /// From now on, why the policy decides as it does goes there while it is asked for.
    pub fn explain_to(&mut self, explanations: &Explanations) {
        self.policy.explanations = explanations.clone();
    }

    /// From now on, answers what the hand is about to do, each touch as inferred when it begins: the board stands still under a push or a grasp (a
    /// panel or a door still yields), and under a stroke its texture moves against the motion of the hand at once. Other touches are answered
    /// as without this.
    ///
    /// # Errors
    /// As [`GestureModel::filter`].
    pub fn infer_gestures(&mut self, model: &GestureModel) -> Result<(), SessionError> {
        self.gestures = Some(model.filter()?);
        Ok(())
    }

    /// What the hand is about to do, or did last; `None` if unknown.
    #[must_use]
    pub fn gesture(&self) -> Option<Task> {
        self.gestures.as_ref()?.task()
    }

    /// Estimated time that this person leaves the arm from dispatch to touch, s.
    #[must_use]
    pub const fn budget_s(&self) -> f64 {
        self.policy.budget_s()
    }

    /// Waiting posture for this person, rad; `None`: the arm stays where it is.
    #[must_use]
    pub fn waits_at(&self) -> Option<JointPositions> {
        self.waiting.posture()
    }

    /// The levels for the roughnesses of the scene; `None` if no surface has one or the session has no textures.
    #[cfg(feature = "texture")]
    #[must_use]
    pub const fn texture_levels(&self) -> Option<&TextureLevels> {
        self.levels.as_ref()
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

    /// Is the hand, given in the frame of the scene, at the surface that the board represents? Otherwise someone or something else
    /// pressed the board.
    fn is_at_served(&self, at_m: DVec3) -> bool {
        self.newest.contact.is_some_and(|contact| {
            let closest = self.scene.project_on(contact.surface, at_m);
            closest.is_ok_and(|closest| closest.distance_m <= FELT_M)
        })
    }

    /// The contact of the newest frame, at the current pose of the world.
    fn predicted(&self) -> Option<PredictedContact> {
        let contact = self.contact()?;
        let presented = match self.walls.maps.present(contact.point_m, contact.normal) {
            // The maps are valid only where the walls were when mapped.
            Presented::Nearest(point_m) if !self.lies_on(&contact, point_m) => Presented::Unknown,
            Presented::Reachable if self.world.world_from_base().is_some() => Presented::Unknown,
            presented => presented,
        };
        Some(PredictedContact { contact, presented })
    }

    /// Does the surface of a contact still lie where the maps have it, at a point of the base frame?
    ///
    /// In a world that has not moved, a surface disagrees with its map only if its plane has changed, as with an opened door. In a world
    /// that moved, the surface itself must be there.
    fn lies_on(&self, contact: &ContactPrediction, point_m: DVec3) -> bool {
        let off_plane_m = (point_m - contact.point_m).dot(contact.normal);
        let Some(world_from_base) = self.world.world_from_base() else {
            return off_plane_m.abs() <= LIES_M;
        };
        let there_m = world_from_base.transform_point(point_m);
        self.scene
            .project_on(contact.surface, there_m)
            .is_ok_and(|closest| closest.distance_m <= LIES_M && off_plane_m.abs() <= LIES_M)
    }

    /// Last part of [`frame`](Self::frame): sends the result to the control half.
    pub(super) fn tell(&mut self) {
        if let Some(guidance) = self.untold.take() {
            self.sender.send(&guidance);
        }
    }
}
