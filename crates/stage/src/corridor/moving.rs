//! The base in the hall, and the rotation of the virtual world around the person.

use super::hall::Room;
use super::visits::{BEFORE_M, Visit};
use super::walker::{Body, shorter};
use crate::input::place::BEHIND_M;
use crate::run::logs::snapshots::BoardFace;
use glam::{DVec2, DVec3, dvec2};
use hwall::arrival::base::{
    BaseChoiceConfig, BaseChooser, BaseDrive, BaseHypothesis, BaseLimits, BasePart, BasePose,
    BaseSafety, BaseState, KeepOutArea, SeenHand, Surroundings,
};
use hwall_hand::Pose;
use hwall_haptics::render::ProximityConfig;
use hwall_haptics::{Board, ContactLimits};
use hwall_redirection::{AvatarTurn, PersonMotion, TurnConfig};
use std::collections::VecDeque;

/// Radius of the base on the floor plan, m: a platform of half a metre.
const CHASSIS_M: f64 = 0.35;
/// Radius of the links, m.
const LINK_M: f64 = 0.1;
/// The axis of the base stays this far outside a room, m: less than its distance behind the wall of a shelf.
const OUTSIDE_M: f64 = 0.45;
/// A base that leaves a room goes this much farther, m.
const CLEAR_M: f64 = 0.1;
/// Lower speeds count as rest, m/s.
const RESTS_M_PER_S: f64 = 1e-3;

/// Largest acceleration of a person, m/s²: an assumption; the simulated walker stays below it. People who start to walk reach 1 to 1.5 m/s
/// in about 1 s.
pub(super) const PERSON_M_PER_S2: f64 = 2.0;
/// Error of the velocity measured over 0.1 s, m/s: it lags by 0.05 s, 0.1 m/s at that acceleration; 0.7 mm of noise make 0.03 m/s (3 sd).
const VELOCITY_ERROR_M_PER_S: f64 = 0.13;
/// Refusals of steps are counted over this time, s.
const HELD_S: f64 = 1.5;
/// Number of instants during braking at which a step is evaluated.
const JUDGED: usize = 20;

/// Largest speed at which the base may meet a free hand at rest, m/s: base and board, which approaches at up to 0.1 m/s near a hand, then
/// press the hand with no more than `v √(μ k)` = 65 N, below which a hand counts as free. The mass of the base counts as infinite.
pub(super) fn hand_meets_m_per_s() -> f64 {
    let limits = ContactLimits::default();
    let mass_kg = limits.reduced_mass_kg(f64::INFINITY);
    let most = limits.relaxed_n / (mass_kg * limits.hand_stiffness_n_per_m).sqrt();
    most - ProximityConfig::default().crawl_m_per_s
}

/// Measured and true state, in the frame of the corridor or of the base.
pub(super) struct Seen<'a> {
    pub(super) person_m: DVec2,
    /// The person's measured velocity, m/s, and the age of position and velocity, s.
    pub(super) person_m_per_s: DVec2,
    pub(super) person_age_s: f64,
    pub(super) hands: Vec<SeenHand>,
    pub(super) truth: Truth,
    pub(super) skeleton_m: &'a [DVec3],
    pub(super) board: &'a Board,
    pub(super) base_from_board: Pose,
    pub(super) touched: bool,
    pub(super) arm: ArmMay,
}

/// What the arm may do. Either the base drives or the arm reaches out, because an arm that reaches out while the base brakes shortens the
/// distance to a hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ArmMay {
    Wait,
    /// It may reach out, and the base creeps.
    Reach,
    /// A hand is about to touch, or the board is on its way to a place: the base stands.
    BeTouched,
}

/// Reason for refusing a step of the base.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Held {
    Body,
    Hand,
}

/// The person without measurement errors, on the floor plan.
#[derive(Clone)]
pub(super) struct Truth {
    /// The head, m, and its velocity, m/s.
    pub(super) person_m: DVec2,
    pub(super) person_m_per_s: DVec2,
    pub(super) hands_m: Vec<DVec2>,
}

/// Log of the base.
#[derive(Debug, Clone, Copy)]
pub(super) struct BaseRecord {
    /// Driven distance, m, and time in motion, s.
    pub(super) way_m: f64,
    pub(super) moves_s: f64,
    /// While it moves: least distance between the surfaces of robot and body, m, and how far, at that moment, a person at the largest speed
    /// would come before it stands.
    pub(super) closest_m: f64,
    pub(super) asked_m: f64,
    /// The same distance also while it stands, and that between robot and hand, from above, while it moves and the board
    /// is not touched; negative where they overlap.
    pub(super) closest_standing_m: f64,
    pub(super) hand_closest_m: f64,
    /// Least margins beyond the distance that body and hands can move before the base stands, m.
    pub(super) margin_m: f64,
    pub(super) hand_margin_m: f64,
    /// Steps in motion with a negative margin, and while the board was touched; the largest speed in the latter, m/s.
    pub(super) too_near: u64,
    pub(super) moved_touched: u64,
    pub(super) touched_m_per_s: f64,
}

impl Default for BaseRecord {
    fn default() -> Self {
        Self {
            way_m: 0.0,
            moves_s: 0.0,
            closest_m: f64::INFINITY,
            asked_m: f64::NAN,
            closest_standing_m: f64::INFINITY,
            hand_closest_m: f64::INFINITY,
            margin_m: f64::INFINITY,
            hand_margin_m: f64::INFINITY,
            too_near: 0,
            moved_touched: 0,
            touched_m_per_s: 0.0,
        }
    }
}

/// The base, and the pose of the corridor in the hall.
pub(super) struct MovingBase {
    drive: BaseDrive,
    safety: BaseSafety,
    /// The pose that it goes to, in the frame of the corridor.
    goal: Option<BasePose>,
    hall_from_corridor: Pose,
    turn: AvatarTurn,
    /// Wanted turn of the world, rad, and the person's last heading in the hall.
    wanted_rad: f64,
    last_yaw_rad: Option<f64>,
    /// The refusals of the latest steps, the parts of the robot in the last one, and the time for which the base has stood, s.
    held: VecDeque<Option<Held>>,
    last_parts: Vec<BasePart>,
    rested_s: f64,
    pub(super) record: BaseRecord,
}

impl MovingBase {
    /// A base behind the place of the first visit.
    pub(super) fn new(first: &Visit, hand_meets_m_per_s: f64) -> anyhow::Result<Self> {
        let start = BasePose {
            at_m: first.stands_m + first.facing * (BEFORE_M + BEHIND_M),
            yaw_rad: (-first.facing).to_angle(),
        };
        let safety = BaseSafety {
            velocity_error_m_per_s: VELOCITY_ERROR_M_PER_S,
            person_m_per_s2: PERSON_M_PER_S2,
            hand_meets_m_per_s,
            ..BaseSafety::default()
        };
        safety.validate()?;
        Ok(Self {
            drive: BaseDrive::new(BaseLimits::default(), start)?,
            safety,
            goal: None,
            hall_from_corridor: Pose::IDENTITY,
            // The hall is as large as the corridor, so the total turn does not matter.
            turn: AvatarTurn::new(TurnConfig {
                most_rad: f64::MAX,
                ..TurnConfig::default()
            })?,
            wanted_rad: 0.0,
            last_yaw_rad: None,
            held: VecDeque::new(),
            last_parts: Vec::new(),
            rested_s: f64::INFINITY,
            record: BaseRecord::default(),
        })
    }

    /// The place of the base in the frame of the corridor.
    fn place(&self) -> BasePose {
        let here = self.drive.state().pose();
        here.seen_from(&self.hall_from_corridor)
    }

    /// Its motion in the frame of the corridor, without its route.
    pub(super) fn in_corridor(&self) -> BaseDrive {
        self.drive.seen_from(&self.hall_from_corridor)
    }

    pub(super) const fn safety(&self) -> &BaseSafety {
        &self.safety
    }

    /// Is it so slow that a hand may meet it?
    pub(super) fn may_meet_hand(&self) -> bool {
        let state = self.drive.state();
        self.safety
            .may_meet_hand(&self.drive, state, &self.last_parts)
    }

    /// Where it stops if it brakes now, in the frame of the corridor.
    pub(super) fn stops_at(&self) -> BasePose {
        let state = self.drive.state();
        let stopped = self.drive.braked(state, self.drive.stop_s(state));
        stopped.pose().seen_from(&self.hall_from_corridor)
    }

    /// The pose of the world for the session.
    pub(super) fn base_from_corridor(&self) -> anyhow::Result<Pose> {
        Ok(self.place().floor_from_base()?.inverse())
    }

    /// Is it outside an area, with a margin?
    pub(super) fn is_out_of(&self, area: &KeepOutArea) -> bool {
        !area.grown(OUTSIDE_M).contains(self.place().at_m)
    }

    /// Time for which it has stood, s.
    pub(super) const fn rested_s(&self) -> f64 {
        self.rested_s
    }

    /// The most frequent reason of the latest refusals, if at least a quarter of the steps were refused.
    pub(super) fn held_by(&self) -> Option<Held> {
        let count = |cause| {
            self.held
                .iter()
                .filter(|held| **held == Some(cause))
                .count()
        };
        let counts = [Held::Body, Held::Hand].map(|cause| (count(cause), cause));
        let most = counts.into_iter().max_by_key(|(count, _)| *count)?;
        (4 * most.0 > self.held.len()).then_some(most.1)
    }

    pub(super) fn forget_goal(&mut self) {
        self.goal = None;
    }

    /// Chooses a goal for the possible touches. `next`: the room behind a closed door at which the person waits.
    pub(super) fn choose(
        &mut self,
        room: &Room,
        next: Option<&Room>,
        hypotheses: &[BaseHypothesis],
    ) -> anyhow::Result<()> {
        let area = keep_out(room, next);
        let here = self.in_corridor();
        let at_m = here.state().pose().at_m;
        let chosen = match next {
            // Leave the room behind the door on the nearer side, and go to a pose that serves its first wall.
            Some(next) if area.contains(at_m) => {
                let y = match at_m.y < 0.5 * (area.low_m.y + area.high_m.y) {
                    true => area.low_m.y - CLEAR_M,
                    false => area.high_m.y + CLEAR_M,
                };
                let to = BasePose {
                    at_m: dvec2(next.area.low_m.x - BEHIND_M, y),
                    yaw_rad: 0.0,
                };
                Some((to, vec![dvec2(at_m.x, y), to.at_m]))
            }
            Some(_) => None,
            None => {
                let config = BaseChoiceConfig::default();
                let chooser = BaseChooser::new(config, &room.inversion, area)?;
                chooser.choose(&here, self.goal, hypotheses)
            }
        };
        let Some((goal, way)) = chosen else {
            return Ok(());
        };
        self.goal = Some(goal);
        let hall = &self.hall_from_corridor;
        let hall_m = |at_m: &DVec2| hall.transform_point(at_m.extend(0.0)).truncate();
        let way: Vec<DVec2> = way.iter().map(hall_m).collect();
        let yaw_rad = goal.placed(hall).yaw_rad;
        self.drive.set_route(&way, yaw_rad)?;
        Ok(())
    }

    /// Turns the world around a walking person, within the limit that people do not notice, so that the goal comes nearer to the base.
    pub(super) fn turn_avatar(&mut self, body: &Body, dt_s: f64) -> anyhow::Result<()> {
        let x = self.hall_from_corridor.rotation().x_axis;
        let yaw_rad = body.yaw_rad + x.y.atan2(x.x);
        let last_rad = self.last_yaw_rad.replace(yaw_rad).unwrap_or(yaw_rad);
        let turned_rad = shorter(yaw_rad - last_rad);
        if let Some(goal) = self.goal {
            let angle = |at_m: DVec2| (at_m - body.at_m).to_angle();
            // The world turns about the person, opposite to the avatar.
            let towards = shorter(angle(self.place().at_m) - angle(goal.at_m));
            self.wanted_rad = self.turn.turned_rad() - towards;
        }
        let motion = PersonMotion {
            turn_rad_per_s: turned_rad / dt_s,
            speed_m_per_s: body.speed_m_per_s,
            ..PersonMotion::default()
        };
        let by = -self.turn.step(self.wanted_rad, &motion, dt_s)?.injected_rad;
        let about_m = body.at_m.extend(0.0);
        let turn = Pose::from_yaw(by, DVec3::ZERO)?;
        let fixed = Pose::from_yaw(by, about_m - turn.transform_point(about_m))?;
        let turned = self.hall_from_corridor.to_affine() * fixed.to_affine();
        self.hall_from_corridor = Pose::from_affine(&turned)?;
        self.last_yaw_rad = self.last_yaw_rad.map(|yaw| yaw + by);
        Ok(())
    }

    /// Moves the base for this time, s, if permitted.
    pub(super) fn step(&mut self, dt_s: f64, seen: &Seen<'_>) -> anyhow::Result<()> {
        let mut parts = parts(seen.skeleton_m, seen.board, &seen.base_from_board);
        for (part, last) in parts.iter_mut().zip(&self.last_parts) {
            let moved = part.ends_m.iter().zip(last.ends_m);
            let moved_m = moved.map(|(now_m, last_m)| now_m.distance(last_m));
            part.m_per_s = moved_m.fold(0.0, f64::max) / dt_s;
        }
        self.last_parts.clone_from(&parts);
        let hall = &self.hall_from_corridor;
        let place = |m: DVec2| hall.transform_point(m.extend(0.0)).truncate();
        let velocity = |v: DVec2| hall.transform_vector(v.extend(0.0)).truncate();
        let hands = seen.hands.iter().map(|hand| SeenHand {
            at_m: place(hand.at_m),
            ..*hand
        });
        let hands: Vec<SeenHand> = hands.collect();
        let around = Surroundings {
            person_m: place(seen.person_m),
            person_m_per_s: velocity(seen.person_m_per_s),
            person_age_s: seen.person_age_s,
            hands: &hands,
            // The walker has one hand.
            unseen_hand: false,
            touched: seen.touched,
            parts: &parts,
        };
        let truth = Truth {
            person_m: place(seen.truth.person_m),
            person_m_per_s: velocity(seen.truth.person_m_per_s),
            hands_m: seen.truth.hands_m.iter().map(|m| place(*m)).collect(),
        };
        let before_m = self.drive.state().pose().at_m;
        let mut held = None;
        self.drive.step(dt_s, |drive, state| {
            let [body_m, hands_m] = self.safety.margins_m(drive, state, &around);
            let arm_allows = match seen.arm {
                ArmMay::Wait => true,
                ArmMay::Reach => self.safety.may_meet_hand(drive, state, &parts),
                ArmMay::BeTouched => false,
            };
            let near = [is_too_near(body_m), is_too_near(hands_m) || !arm_allows];
            held = match near {
                [true, _] => Some(Held::Body),
                [_, true] => Some(Held::Hand),
                _ => None,
            };
            !around.touched && held.is_none()
        })?;
        self.held.push_back(held);
        if self.held.len() as f64 > HELD_S / dt_s {
            self.held.pop_front();
        }
        let moves = !self.drive.state().is_at_rest();
        self.rested_s = if moves { 0.0 } else { self.rested_s + dt_s };
        self.keep(dt_s, before_m, &around, &truth);
        Ok(())
    }

    fn keep(&mut self, dt_s: f64, before_m: DVec2, around: &Surroundings<'_>, truth: &Truth) {
        let state = *self.drive.state();
        let pose = state.pose();
        let record = &mut self.record;
        let gap_m = nearest_m(around.parts, &pose, truth.person_m) - self.safety.person_radius_m;
        record.closest_standing_m = record.closest_standing_m.min(gap_m);
        record.way_m += pose.at_m.distance(before_m);
        let speed = state.velocity_m_per_s().length();
        if speed < RESTS_M_PER_S && state.turning()[0].abs() < RESTS_M_PER_S {
            return;
        }
        let [margin_m, hand_margin_m] = self.margins_m(&state, around.parts, truth);
        let hands_m = truth.hands_m.iter();
        let hands_m = hands_m.map(|m| nearest_m(around.parts, &pose, *m));
        let hand_gap_m = hands_m.fold(f64::INFINITY, least_m) - self.safety.hand_radius_m;
        let record = &mut self.record;
        record.moves_s += dt_s;
        record.margin_m = least_m(record.margin_m, margin_m);
        record.hand_margin_m = least_m(record.hand_margin_m, hand_margin_m);
        record.too_near += u64::from(is_too_near(least_m(margin_m, hand_margin_m)));
        if around.touched {
            record.moved_touched += 1;
            record.touched_m_per_s = record.touched_m_per_s.max(speed);
        } else {
            record.hand_closest_m = least_m(record.hand_closest_m, hand_gap_m);
        }
        if gap_m < record.closest_m {
            record.closest_m = gap_m;
            record.asked_m = self.safety.person_m_per_s * self.drive.stop_s(&state);
        }
    }

    /// Distances between the robot and body and hands while it brakes from a state, m, for the worst motion that is assumed of them.
    /// Evaluated at single instants from the true places and velocities, independently of the formula that decides. Weaker than that: without
    /// latency, clearance and error of the velocity, and the arm stands still.
    fn margins_m(&self, state: &BaseState, parts: &[BasePart], truth: &Truth) -> [f64; 2] {
        let safety = &self.safety;
        let stop_s = self.drive.stop_s(state);
        let ends = parts.iter().flat_map(|part| part.ends_m);
        let reach_m = ends.map(DVec2::length).fold(0.0, f64::max);
        let at = |i: usize| {
            let t_s = stop_s * i as f64 / JUDGED as f64;
            let state = self.drive.braked(state, t_s);
            let pose = state.pose();
            let speed = state.velocity_m_per_s().length() + reach_m * state.turning()[0].abs();
            let away_m = |m: DVec2| nearest_m(parts, &pose, m);
            let onwards_m = truth.person_m + truth.person_m_per_s * t_s;
            let faster_m = 0.5 * PERSON_M_PER_S2 * t_s.powi(2);
            let accelerates_m = away_m(onwards_m) - faster_m;
            let runs_m = away_m(truth.person_m) - safety.person_m_per_s * t_s;
            let hands = truth.hands_m.iter().map(|m| away_m(*m));
            let hand_m = match speed <= safety.hand_meets_m_per_s {
                true => f64::INFINITY,
                false => hands.fold(f64::INFINITY, least_m) - safety.hand_m_per_s * t_s,
            };
            [
                accelerates_m.max(runs_m) - safety.person_radius_m,
                hand_m - safety.hand_radius_m,
            ]
        };
        let least = |a: [f64; 2], b: [f64; 2]| [least_m(a[0], b[0]), least_m(a[1], b[1])];
        (0..=JUDGED).map(at).fold([f64::INFINITY; 2], least)
    }
}

/// Distance of a place from the nearest part of the robot, m.
fn nearest_m(parts: &[BasePart], base: &BasePose, place_m: DVec2) -> f64 {
    let away_m = parts.iter().map(|part| part.distance_m(base, place_m));
    away_m.fold(f64::INFINITY, least_m)
}

/// Is a margin negative or unknown?
const fn is_too_near(margin_m: f64) -> bool {
    margin_m.is_nan() || margin_m < 0.0
}

/// The minimum; NaN counts as the least.
fn least_m(a_m: f64, b_m: f64) -> f64 {
    match a_m.is_nan() || a_m < b_m {
        true => a_m,
        false => b_m,
    }
}

/// What the axis of the base stays out of, up to 5 cm: a room, and the one behind a door that is about to open.
pub(super) fn keep_out(room: &Room, next: Option<&Room>) -> KeepOutArea {
    let area = KeepOutArea {
        low_m: room.area.low_m,
        high_m: next.map_or(room.area.high_m, |next| next.area.high_m),
    };
    area.grown(OUTSIDE_M)
}

/// The robot on the floor plan: platform, links and the edges of the board.
pub(super) fn parts(skeleton_m: &[DVec3], board: &Board, base_from_board: &Pose) -> Vec<BasePart> {
    let part = |from_m: DVec2, to_m: DVec2, radius_m| BasePart {
        ends_m: [from_m, to_m],
        radius_m,
        m_per_s: 0.0,
    };
    let platform = part(DVec2::ZERO, DVec2::ZERO, CHASSIS_M);
    let links = skeleton_m.windows(2);
    let links = links.map(|link| part(link[0].truncate(), link[1].truncate(), LINK_M));
    let corners = BoardFace::new(board, base_from_board).corners_m;
    let corners = corners.map(DVec3::truncate);
    let edges = (0..4).map(|i| part(corners[i], corners[(i + 1) % 4], board.thickness_m));
    std::iter::once(platform)
        .chain(links)
        .chain(edges)
        .collect()
}
