//! One walk through the corridor: person, session, simulated arm and base on one clock.

use super::belief::Belief;
use super::hall::Hall;
use super::moving::{ArmMay, MovingBase, Seen, Truth, parts};
use super::possible::Oracle;
use super::sight::Sight;
use super::touches::{CorridorTouch, TouchWatch};
use super::visits::Visit;
use super::walker::Walker;
use crate::console::note;
use crate::input::arms::BoardArm;
use crate::input::base_flag::BaseKind;
use crate::live::holds::tell_left_out;
use crate::person::kinds::PersonKind;
use crate::person::predictors::{PredictorKind, Predictors, TrainingPeople};
use crate::person::responses::Scenery;
use crate::person::touches::{FAR_M, facing};
use crate::run::logs::view_log::ViewLog;
use crate::run::simulated_arm::{ArmLevel, Finger, SimulatedArm};
use crate::run::stage::SessionSettings;
use anyhow::Context;
use glam::{DVec2, DVec3};
use hwall::arrival::base::BasePart;
use hwall::haptics::{Arm, ArmState};
use hwall::response::EndToEnd;
use hwall::{Session, WorldPose};
use hwall_hand::{HandFrame, Pose};
use hwall_sim::TouchTruth;
use hwall_view::ViewHand;
use std::sync::Arc;

/// Periods of the control loop, the tracker and the base, and between choices of the base, s.
const PERIOD_S: f64 = 1e-3;
const TRACKER_S: f64 = 1.0 / 90.0;
const BASE_EVERY: u64 = 4;
const BASE_S: f64 = BASE_EVERY as f64 * PERIOD_S;
const CHOICE_S: f64 = 0.1;
/// Half of the time over which the true velocity of a person is taken, s.
const DIFFERENCE_S: f64 = 1e-4;
/// A hand this near to a surface is about to touch it, m. Hands rest at 0.33 m and cover the last 0.28 m in about 0.4 s, in which a
/// creeping base stops.
const TOUCHES_SOON_M: f64 = 0.28;
/// Largest mean duration of a visit, s; after that the walk counts as stuck.
const LONGEST_S: f64 = 60.0;

/// Trains the predictor on people in the built-in room. Only the leader is asked here, and rays learn nothing.
pub(super) fn trained(
    arm: &BoardArm,
    predictor: Option<PredictorKind>,
) -> anyhow::Result<(TrainingPeople, Predictors)> {
    let people = TrainingPeople {
        elsewhere: true,
        ..TrainingPeople::default()
    };
    if let Some(kind @ (PredictorKind::RayLed | PredictorKind::RayCast)) = predictor {
        return Ok((people, Predictors::of(None::<EndToEnd>, kind)?));
    }
    let (built_in, _) = crate::setting::load_scene(None)?;
    let (predictors, learnt) = Predictors::train(&built_in, arm, &people, predictor)?;
    note(learnt);
    Ok((people, predictors))
}

/// Common data of all walks.
pub(super) struct Corridor<'a> {
    pub(super) hall: &'a Hall,
    pub(super) visits: &'a [Visit],
    pub(super) arm: &'a BoardArm,
    pub(super) people: &'a TrainingPeople,
    pub(super) predictors: &'a Predictors,
    pub(super) person: PersonKind,
    pub(super) seed: u64,
    /// Largest speed of the base at which it may meet a hand, m/s.
    pub(super) hand_meets_m_per_s: f64,
    /// The walk of this base keeps frames for a replay.
    pub(super) shown: Option<BaseKind>,
}

/// Positions of person and base at a time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) t_s: f64,
    /// In the frame of the corridor, m.
    pub(super) person_m: DVec2,
    pub(super) base_m: DVec2,
    pub(super) visit: usize,
}

/// A walk.
pub(super) struct Walked {
    pub(super) kind: BaseKind,
    pub(super) touches: Vec<CorridorTouch>,
    pub(super) samples: Vec<Sample>,
    pub(super) base: super::moving::BaseRecord,
    /// Time, and time before closed doors, s.
    pub(super) duration_s: f64,
    pub(super) waited_s: f64,
    pub(super) view: Option<ViewLog>,
}

impl Walked {
    /// Number of rooms up to the last touched one, at least 1.
    pub(super) fn rooms(&self) -> usize {
        let rooms = self.touches.iter().map(|touch| touch.room + 1);
        rooms.max().unwrap_or(1)
    }
}

impl Corridor<'_> {
    fn session(&self, room: usize) -> anyhow::Result<Session<Predictors>> {
        let (scene, walls) = (&self.hall.rooms[room].scene, &self.hall.walls);
        let scenery = Scenery::of(scene, self.arm, walls, self.people).textured(false);
        SessionSettings::of(scenery).session(self.predictors.for_another_person())
    }

    /// Walks through all rooms.
    pub(super) fn walk(
        &self,
        kind: BaseKind,
        mut progress: impl FnMut(f64),
    ) -> anyhow::Result<Walked> {
        let mut rig = Rig::new(self, kind)?;
        let most_s = LONGEST_S * (1 + self.visits.len()) as f64;
        let mut step = 0_u64;
        while !rig.walker.is_done() {
            let t_s = step as f64 * PERIOD_S;
            anyhow::ensure!(t_s < most_s, "the walk does not end");
            rig.cycle(step, t_s)?;
            step += 1;
            if step.is_multiple_of(1000) {
                progress(rig.walker.number() as f64 / self.visits.len() as f64);
            }
        }
        Ok(Walked {
            kind,
            touches: rig.watch.touches,
            samples: rig.samples,
            base: rig.base.record,
            duration_s: step as f64 * PERIOD_S,
            waited_s: rig.waited_s,
            view: rig.view,
        })
    }
}

/// All moving parts.
struct Rig<'a> {
    corridor: &'a Corridor<'a>,
    kind: BaseKind,
    walker: Walker<'a>,
    session: Session<Predictors>,
    /// Predicts touches; leads no arm.
    foresight: Session<Predictors>,
    room: usize,
    arm: SimulatedArm,
    finger: Finger,
    base: MovingBase,
    belief: Belief,
    watch: TouchWatch,
    oracle: Oracle,
    /// The robot while it waits.
    waiting: Vec<BasePart>,
    sight: Sight,
    frames: u64,
    next_choice_s: f64,
    is_touched: bool,
    arm_may: ArmMay,
    waited_s: f64,
    samples: Vec<Sample>,
    view: Option<ViewLog>,
    /// The newest frame of the tracker, for the view.
    seen: Option<HandFrame>,
}

impl<'a> Rig<'a> {
    fn new(corridor: &'a Corridor<'a>, kind: BaseKind) -> anyhow::Result<Self> {
        let session = corridor.session(0)?;
        let model = Arc::clone(session.control().arm());
        let start = corridor.hall.walls.waiting.unwrap_or(corridor.arm.start());
        let walker = Walker::new(corridor.visits, corridor.person, corridor.seed)?;
        let waits_at = corridor.arm.kinematics().forward(&start);
        let skeleton = corridor.arm.skeleton_m(&start);
        let arm = SimulatedArm::new(ArmLevel::Servo, corridor.arm, model, start, corridor.seed)?;
        Ok(Self {
            corridor,
            kind,
            base: MovingBase::new(walker.visit(), corridor.hand_meets_m_per_s)?,
            walker,
            session,
            foresight: corridor.session(0)?,
            room: 0,
            arm,
            finger: Finger::new(corridor.arm.board()),
            belief: Belief::default(),
            watch: TouchWatch::default(),
            oracle: Oracle::default(),
            waiting: parts(&skeleton, corridor.arm.board(), &waits_at),
            sight: Sight::default(),
            frames: 0,
            next_choice_s: 0.0,
            is_touched: false,
            arm_may: ArmMay::Wait,
            waited_s: 0.0,
            samples: Vec::new(),
            view: (corridor.shown == Some(kind)).then(ViewLog::default),
            seen: None,
        })
    }

    fn cycle(&mut self, step: u64, t_s: f64) -> anyhow::Result<()> {
        self.advance_walker(t_s)?;
        if t_s >= self.frames as f64 * TRACKER_S {
            self.take_frame(self.frames as f64 * TRACKER_S)?;
            self.frames += 1;
        }
        if step.is_multiple_of(BASE_EVERY) && self.kind.drives() {
            self.step_base(t_s)?;
        }
        let state = self.arm.state()?;
        let command = self.session.step(t_s, &state);
        self.arm.command(command)?;
        self.session.plan();
        while let Some(event) = self.session.next_event() {
            if let Some(view) = &mut self.view {
                view.event(event.t_s, &event);
            }
        }
        tell_left_out(self.session.control());
        self.arm.advance(PERIOD_S)?;
        let base_from_corridor = self.base.base_from_corridor()?;
        let (base, tip) = (&base_from_corridor, self.walker.tip(t_s));
        let tip = tip.map(|(m, per_s)| (base.transform_point(m), base.transform_vector(per_s)));
        let force_n = self.finger.press(&mut self.arm, tip)?;
        self.is_touched = force_n != DVec3::ZERO;
        self.show(&state, &base_from_corridor, force_n);
        let corridor_from_base = base_from_corridor.inverse();
        let corridor_from_board =
            Pose::from_affine(&(corridor_from_base.to_affine() * self.arm.pose().to_affine()))?;
        let poses = [&corridor_from_board, &corridor_from_base];
        let (walker, arm, hall) = (&self.walker, self.corridor.arm, self.corridor.hall);
        let possible = |touch: &TouchTruth| {
            let (room, waiting) = (&hall.rooms[self.room], (&*self.waiting, BASE_S));
            self.oracle
                .possible(touch, hall, room, self.base.safety(), waiting)
        };
        self.watch
            .see(t_s, walker, arm, &self.base, poses, possible)
    }

    /// Keeps a frame for the replay, at the time of a state of the arm.
    fn show(&mut self, state: &ArmState, base_from_corridor: &Pose, force_n: DVec3) {
        let seen = self.seen.map(|seen| seen.transformed(base_from_corridor));
        let Some(view) = &mut self.view else { return };
        let frame = view.step(state.t_s, &self.session, state, seen.as_ref(), force_n);
        let Some(frame) = frame else { return };
        let place = base_from_corridor.inverse();
        let x = place.rotation().x_axis;
        frame.base = Some((place.position_m(), x.y.atan2(x.x)));
        // The session is not given every hand, and knows the surfaces of its room only.
        frame.hand = seen.as_ref().map_or(ViewHand::LOST, ViewHand::from_frame);
        let before = self.corridor.hall.rooms[..self.room].iter();
        let before: usize = before.map(|room| room.scene.surfaces().len()).sum();
        let predicted = frame.predicted.as_mut();
        if let Some(surface) = predicted.and_then(|predicted| predicted.surface.as_mut()) {
            *surface += before as u32;
        }
    }

    fn advance_walker(&mut self, t_s: f64) -> anyhow::Result<()> {
        let opens = !self.walker.waits() || self.next_room_is_free();
        self.waited_s += if self.walker.waits() { PERIOD_S } else { 0.0 };
        self.walker.advance(t_s, opens)?;
        let room = self.walker.visit().room;
        if room != self.room {
            self.room = room;
            self.session = self.corridor.session(room)?;
            self.foresight = self.corridor.session(room)?;
            self.belief.forget();
            self.base.forget_goal();
        }
        Ok(())
    }

    /// The door opens once the base is out of the room behind it. This is strict: a route may lead up to 5 cm inside an edge.
    fn next_room_is_free(&self) -> bool {
        let next = self.corridor.hall.rooms.get(self.room + 1);
        !self.kind.drives() || next.is_none_or(|next| self.base.is_out_of(&next.area))
    }

    fn take_frame(&mut self, t_s: f64) -> anyhow::Result<()> {
        let frame = self.walker.frame(t_s)?;
        self.sight.see(&frame);
        self.seen = Some(frame);
        let room = &self.corridor.hall.rooms[self.room];
        let body = self.walker.body(t_s);
        if self.kind.redirects() {
            self.base.turn_avatar(&body, TRACKER_S)?;
        }
        let base_from_world = self.base.base_from_corridor()?;
        let world = WorldPose {
            t_s,
            base_from_world,
        };
        // A session would take a carried hand for a reaching one.
        let walks = self.belief.walks(&frame);
        let seen = if walks { without_hand(frame) } else { frame };
        self.foresight.world(&world)?;
        self.foresight.frame(&seen.transformed(&base_from_world));
        {
            let perception = self.foresight.perception();
            let ranked = perception.predictor().ranked();
            self.belief.see(&frame, walks, ranked, room)?;
        }
        self.arm_may = match self.kind.drives() && !self.walker.waits() {
            true => self.arm_may(&seen)?,
            false => ArmMay::Wait,
        };
        let waits = self.arm_may == ArmMay::Wait || !self.base.may_meet_hand();
        let told = match self.kind.drives() && waits {
            true => without_hand(seen),
            false => seen,
        };
        self.session.world(&world)?;
        self.session.frame(&told.transformed(&base_from_world));
        if t_s >= self.next_choice_s {
            self.next_choice_s += CHOICE_S;
            let hypotheses = self.belief.hypotheses(room, body.at_m);
            let next = self.corridor.hall.rooms.get(self.room + 1);
            let next = next.filter(|_| self.walker.waits());
            self.base.choose(room, next, &hypotheses)?;
            let sample = self.sample(t_s, body.at_m)?;
            self.samples.push(sample);
        }
        Ok(())
    }

    /// It may reach out if it can present, from where the base stops, the place that the hand is before; it does once the base is slow.
    fn arm_may(&self, seen: &HandFrame) -> anyhow::Result<ArmMay> {
        let scene = &self.corridor.hall.rooms[self.room].scene;
        let Some(hand) = seen.contact_point() else {
            return Ok(ArmMay::Wait);
        };
        let Some(before) = scene.closest_touchable(hand.position_m, FAR_M)? else {
            return Ok(ArmMay::Wait);
        };
        let base = self.base.stops_at().floor_from_base()?;
        let point_m = base.inverse_transform_point(before.point_m);
        let normal = facing(before.normal, hand.position_m - before.point_m);
        let normal = base.inverse_transform_vector(normal);
        let serves = self.corridor.arm.unreachable(point_m, normal)?.is_none();
        Ok(match serves {
            true if before.distance_m < TOUCHES_SOON_M => ArmMay::BeTouched,
            true => ArmMay::Reach,
            false => ArmMay::Wait,
        })
    }

    fn sample(&self, t_s: f64, person_m: DVec2) -> anyhow::Result<Sample> {
        let corridor_from_base = self.base.base_from_corridor()?.inverse();
        Ok(Sample {
            t_s,
            person_m,
            base_m: corridor_from_base.position_m().truncate(),
            visit: self.walker.number(),
        })
    }

    fn step_base(&mut self, t_s: f64) -> anyhow::Result<()> {
        let (truth, visit) = (self.truth(t_s)?, self.walker.number());
        self.oracle.see(visit, &self.base, truth.clone());

        let skeleton = self.corridor.arm.skeleton_m(&self.arm.q());
        let ([person_m, person_m_per_s], person_age_s) = self.sight.person(t_s);
        let seen = Seen {
            person_m,
            person_m_per_s,
            person_age_s,
            hands: self.sight.hands(t_s),
            truth,
            skeleton_m: &skeleton,
            board: self.corridor.arm.board(),
            base_from_board: self.arm.pose(),
            touched: self.is_touched,
            arm: self.arm_may,
        };
        self.base.step(BASE_S, &seen)
    }

    fn truth(&self, t_s: f64) -> anyhow::Result<Truth> {
        let head_m = |t_s: f64| {
            let head_m = self.walker.truth(t_s)?.head_m;
            anyhow::Ok(head_m.context("a walker without a head")?.truncate())
        };
        let moved_m = head_m(t_s + DIFFERENCE_S)? - head_m(t_s - DIFFERENCE_S)?;
        let hands = self.walker.truth(t_s)?.points();
        Ok(Truth {
            person_m: head_m(t_s)?,
            person_m_per_s: moved_m / (2.0 * DIFFERENCE_S),
            hands_m: hands.iter().flatten().map(|m| m.truncate()).collect(),
        })
    }
}

/// The frame without the hand.
fn without_hand(frame: HandFrame) -> HandFrame {
    HandFrame {
        palm_m: None,
        tips_m: [None; 5],
        ..frame
    }
}
