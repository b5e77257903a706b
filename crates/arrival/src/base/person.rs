//! Speed and separation: does the base stand before a person can reach it?

use super::drive::{BaseDrive, BasePose, BaseState};
use crate::error::ArrivalError;
use glam::DVec2;
use hwall_numeric::check::{non_negative, that};

/// How a moving base keeps away from a person, by the rule of `hwall_haptics::body::SeparationConfig`: while it reacts and brakes, it is always
/// farther from body and hands than they can come by then.
///
/// The body can come as far as the measured velocity, a bound on the acceleration and a bound on the speed allow: [ISO/TS 15066], 5.5.4.2.3, has a
/// person whose speed is measured keep it, changed in the way that shortens the distance most. A hand comes at its largest speed at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseSafety {
    /// Largest speed of a person, m/s; default 1.6, that of [ISO 13855] for walking.
    pub person_m_per_s: f64,
    /// Largest acceleration of a person, m/s²; default infinity: anybody may come at the largest speed at once, as in [ISO 13855], and the measured
    /// velocity does not count.
    pub person_m_per_s2: f64,
    /// Error of the measured velocity, m/s; default 0. It counts with a bound on the acceleration only.
    pub velocity_error_m_per_s: f64,
    /// Radius of an upright cylinder around the person's head that holds the body without the arms, m; default 0.25.
    pub person_radius_m: f64,
    /// Time from a change of the world until braking begins, s; default 0.045, as for the arm.
    pub latency_s: f64,
    /// Distance left between the person and the stopped base, m; default 0.02, as for the arm.
    pub clearance_m: f64,
    /// Speed of a hand, m/s; default 2, that of [ISO 13855].
    pub hand_m_per_s: f64,
    /// Radius of an upright cylinder around a tracked point of the hand that holds what is not tracked of it, m; default 0.05: half the breadth of a
    /// palm.
    pub hand_radius_m: f64,
    /// A base whose parts move no faster than this with it counts as standing for hands, m/s; default 0. The speed of the arm itself comes on top.
    pub hand_meets_m_per_s: f64,
    /// A hand that is not seen may be this far from the person's head from above, m; default 0.85, the length of an arm in [ISO 13855].
    pub hand_reach_m: f64,
}

impl Default for BaseSafety {
    fn default() -> Self {
        Self {
            person_m_per_s: 1.6,
            person_m_per_s2: f64::INFINITY,
            velocity_error_m_per_s: 0.0,
            person_radius_m: 0.25,
            latency_s: 0.045,
            clearance_m: 0.02,
            hand_m_per_s: 2.0,
            hand_radius_m: 0.05,
            hand_meets_m_per_s: 0.0,
            hand_reach_m: 0.85,
        }
    }
}

/// A part of the robot from above, in the frame of the base: what is within a radius of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BasePart {
    /// Ends of the line, m.
    pub ends_m: [DVec2; 2],
    /// Radius, m.
    pub radius_m: f64,
    /// Its own speed in the frame of the base, m/s: an arm that moves while the base brakes may go on towards a hand.
    pub m_per_s: f64,
}

impl BasePart {
    /// Distance of its line's farther end from the axis of the base, m.
    fn reach_m(&self) -> f64 {
        let [a_m, b_m] = self.ends_m.map(DVec2::length);
        a_m.max(b_m)
    }

    /// Distance of a place from this part of a base at a pose, m; negative inside.
    #[must_use]
    pub fn distance_m(&self, base: &BasePose, place_m: DVec2) -> f64 {
        let [from_m, to_m] = self.ends_m.map(|end_m| base.floor_m(end_m));
        let line_m = to_m - from_m;
        let share = (place_m - from_m).dot(line_m) / line_m.length_squared().max(f64::MIN_POSITIVE);
        from_m.lerp(to_m, share.clamp(0.0, 1.0)).distance(place_m) - self.radius_m
    }
}

/// A point of a hand where it was last seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenHand {
    /// From above, floor frame, m.
    pub at_m: DVec2,
    /// Time since then, s. The older, the further the hand may have come.
    pub age_s: f64,
}

/// What the base knows of a person and the arm. Of several people each has its own; the base may do what all of them allow.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// The person's head from above, floor frame, m.
    pub person_m: DVec2,
    /// Time since the head was seen there, s.
    pub person_age_s: f64,
    /// Its measured velocity, m/s; NaN if unknown: then it may have the largest speed in any direction.
    pub person_m_per_s: DVec2,
    /// Points of the hands, also those that are not seen any more.
    pub hands: &'a [SeenHand],
    /// May there be another hand, anywhere within reach of the person? It counts in any case if `hands` is empty.
    pub unseen_hand: bool,
    /// Is the board touched?
    pub touched: bool,
    /// The parts of the robot, base frame. Without any no distance is known, and nothing is allowed.
    pub parts: &'a [BasePart],
}

/// Intervals of the braking time, and halvings of it: to 1/2048 of it.
const PIECES: usize = 10;
const HALVINGS: usize = 11;

/// A base that brakes from a state for a time: its poses at equal intervals, and bounds on the motion that is left.
struct Braking {
    poses: [BasePose; PIECES + 1],
    /// Velocities, m/s, and the turning rate, rad/s.
    left: [([DVec2; 2], f64); PIECES + 1],
    piece_s: f64,
    latency_s: f64,
}

impl BaseSafety {
    /// Rejects settings below zero.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range. Only the acceleration may be infinite.
    pub fn validate(&self) -> Result<(), ArrivalError> {
        for (what, value) in [
            ("person_m_per_s", self.person_m_per_s),
            ("velocity_error_m_per_s", self.velocity_error_m_per_s),
            ("person_radius_m", self.person_radius_m),
            ("latency_s", self.latency_s),
            ("clearance_m", self.clearance_m),
            ("hand_m_per_s", self.hand_m_per_s),
            ("hand_radius_m", self.hand_radius_m),
            ("hand_meets_m_per_s", self.hand_meets_m_per_s),
            ("hand_reach_m", self.hand_reach_m),
        ] {
            non_negative(what, value)?;
        }
        let most = self.person_m_per_s2;
        that(most >= 0.0, "person_m_per_s2", most, "at least 0")?;
        Ok(())
    }

    /// May the base be in this state? Nothing is touched, and it stands before body or hands can reach it.
    #[must_use]
    pub fn allows(&self, drive: &BaseDrive, state: &BaseState, around: &Surroundings<'_>) -> bool {
        !around.touched && self.left_m(drive, state, around) >= 0.0
    }

    /// Least distance that is left to body and hands beyond the required one while the base reacts and brakes, m: a lower bound. NaN for NaN, and
    /// without parts.
    #[must_use]
    pub fn left_m(&self, drive: &BaseDrive, state: &BaseState, around: &Surroundings<'_>) -> f64 {
        let [body_m, hands_m] = self.margins_m(drive, state, around);
        least_m(body_m, hands_m)
    }

    /// [`left_m`](Self::left_m) to the body, and to the hands.
    #[must_use]
    pub fn margins_m(
        &self,
        drive: &BaseDrive,
        state: &BaseState,
        around: &Surroundings<'_>,
    ) -> [f64; 2] {
        let braking = |time_s| Braking::new(drive, state, time_s, self.latency_s);
        let stops = braking(drive.stop_s(state));
        let slows = self.slow_s(drive, state, around.parts).map(braking);
        let of = |part: &BasePart, piece: usize| {
            let hand_m = |hand: &SeenHand, radius_m: f64| {
                // An age or a speed below zero is none.
                match (
                    hand.at_m.is_nan() || !(hand.age_s >= 0.0 && part.m_per_s >= 0.0),
                    &slows,
                ) {
                    (true, _) => f64::NAN,
                    (false, None) => f64::INFINITY,
                    (false, Some(slows)) => {
                        let (t_s, arm_m_per_s) = (slows.at_s(piece), part.m_per_s);
                        let came_m = self.hand_m_per_s * (t_s + hand.age_s) + arm_m_per_s * t_s;
                        slows.apart_m(part, piece, hand.at_m, DVec2::ZERO) - came_m - radius_m
                    }
                }
            };
            let seen = around.hands.iter();
            let seen = seen.map(|hand| hand_m(hand, self.hand_radius_m));
            let unseen = SeenHand {
                at_m: around.person_m,
                age_s: around.person_age_s,
            };
            let is_unseen = around.unseen_hand || around.hands.is_empty();
            let unseen = is_unseen.then(|| hand_m(&unseen, self.hand_reach_m));
            [
                self.left_to_body_m(&stops, part, piece, around),
                seen.chain(unseen).fold(f64::INFINITY, least_m),
            ]
        };
        let pieces = |part| (1..=PIECES).map(move |piece| (part, piece));
        let left = around.parts.iter().flat_map(pieces);
        let left = left.map(|(part, piece)| of(part, piece));
        let least = left.reduce(|a, b| [least_m(a[0], b[0]), least_m(a[1], b[1])]);
        least.map_or([f64::NAN; 2], |least| {
            least.map(|left_m| left_m - self.clearance_m)
        })
    }

    /// Are all parts so slow, until the base stands, that a hand may meet them? An arm that moves may come farther from the axis of a turn until then.
    /// Without parts the base has to stand.
    #[must_use]
    pub fn may_meet_hand(&self, drive: &BaseDrive, state: &BaseState, parts: &[BasePart]) -> bool {
        let (v, turning) = drive.fastest(state);
        let speed = v[0].length().max(v[1].length());
        let stop_s = drive.stop_s(state);
        let is_slow = |part: &BasePart| {
            let reach_m = part.reach_m() + part.m_per_s * stop_s;
            speed + turning * reach_m <= self.hand_meets_m_per_s
        };
        match parts.is_empty() {
            true => state.is_at_rest(),
            false => parts.iter().all(is_slow),
        }
    }

    /// Time until a braking base is so slow that a hand may meet it, s; `None`: it is.
    fn slow_s(&self, drive: &BaseDrive, state: &BaseState, parts: &[BasePart]) -> Option<f64> {
        let is_slow = |time_s| self.may_meet_hand(drive, &drive.braked(state, time_s), parts);
        if is_slow(0.0) {
            return None;
        }
        let (mut fast_s, mut slow_s) = (0.0, drive.stop_s(state));
        for _ in 0..HALVINGS {
            let middle_s = 0.5 * (fast_s + slow_s);
            match is_slow(middle_s) {
                true => slow_s = middle_s,
                false => fast_s = middle_s,
            }
        }
        Some(slow_s)
    }

    /// What is left between a part and the body in a piece, m.
    ///
    /// The body is within two discs: around its place, growing at the largest speed; and around the place that its velocity leads to, growing as
    /// acceleration and error of measurement allow. The farther one counts.
    fn left_to_body_m(
        &self,
        braking: &Braking,
        part: &BasePart,
        piece: usize,
        around: &Surroundings<'_>,
    ) -> f64 {
        let (age_s, v) = (around.person_age_s, around.person_m_per_s);
        if age_s.is_nan() || age_s < 0.0 {
            return f64::NAN;
        }
        let t_s = braking.at_s(piece) + age_s;
        let most = self.person_m_per_s.max(v.length());
        let spread = self.velocity_error_m_per_s + 0.5 * self.person_m_per_s2 * t_s;
        let apart_m = |v| braking.apart_m(part, piece, around.person_m + v * age_s, v);
        let anywhere_m = apart_m(DVec2::ZERO) - most * t_s;
        // An unknown velocity does not count.
        anywhere_m.max(apart_m(v) - spread * t_s) - self.person_radius_m
    }
}

/// NaN is the least.
fn least_m(a_m: f64, b_m: f64) -> f64 {
    match a_m.is_nan() || a_m < b_m {
        true => a_m,
        false => b_m,
    }
}

impl Braking {
    fn new(drive: &BaseDrive, state: &BaseState, time_s: f64, latency_s: f64) -> Self {
        let piece_s = time_s / PIECES as f64;
        let states: [_; PIECES + 1] =
            std::array::from_fn(|i| drive.braked(state, i as f64 * piece_s));
        Self {
            poses: states.map(|state| state.pose()),
            left: states.map(|state| drive.fastest(&state)),
            piece_s,
            latency_s,
        }
    }

    /// End of a piece, s. The reaction counts with the first piece.
    fn at_s(&self, piece: usize) -> f64 {
        match piece {
            0 => 0.0,
            _ => piece as f64 * self.piece_s + self.latency_s,
        }
    }

    /// Least distance of a part in a piece from a place that moves, m: a lower bound. It is at least the mean of that at both ends less what part and
    /// place cover, relative to each other, in half of the time.
    fn apart_m(&self, part: &BasePart, piece: usize, place_m: DVec2, v: DVec2) -> f64 {
        let (fastest, turning) = self.left[piece - 1];
        let turns = turning * part.reach_m();
        let relative = fastest.map(|base| (base - v).length());
        let relative = relative[0].max(relative[1]).max(v.length());
        let away_m = |i: usize| part.distance_m(&self.poses[i], place_m + v * self.at_s(i));
        let time_s = self.at_s(piece) - self.at_s(piece - 1);
        0.5 * (away_m(piece - 1) + away_m(piece) - time_s * (relative + turns))
    }
}
