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
    /// Speed of a hand, m/s; default 1.6: reaches of plain people peak at about 1 m/s.
    pub hand_m_per_s: f64,
    /// Radius of an upright cylinder around a tracked point of the hand that holds what is not tracked of it, m; default 0.05: half the breadth of a
    /// palm.
    pub hand_radius_m: f64,
    /// A hand that was never seen may be this far from the person's head from above, m; default 0.85, the length of an arm in [ISO 13855].
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
            hand_m_per_s: 1.6,
            hand_radius_m: 0.05,
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
}

impl BasePart {
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

/// What the base knows of person and arm.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// The person's head from above, floor frame, m.
    pub person_m: DVec2,
    /// Its measured velocity, m/s; NaN if unknown: then it may have the largest speed in any direction.
    pub person_m_per_s: DVec2,
    /// Points of the hands, also those that are not seen any more. Without any, a hand may be anywhere within reach of the person.
    pub hands: &'a [SeenHand],
    /// Is the board touched?
    pub touched: bool,
    /// The parts of the robot, base frame.
    pub parts: &'a [BasePart],
}

/// Intervals of the braking time.
const PIECES: usize = 10;

/// Somebody, or a hand, from above.
struct Comer {
    at_m: DVec2,
    /// NaN if unknown.
    velocity: DVec2,
    /// Largest speed, m/s, and acceleration, m/s², and the error of the velocity, m/s.
    most: [f64; 2],
    error: f64,
    /// Distance to keep from the place, m.
    keep_m: f64,
}

/// A base that brakes from a state: its poses at equal intervals, and bounds on its motion.
struct Braking<'a> {
    parts: &'a [BasePart],
    poses: [BasePose; PIECES + 1],
    piece_s: f64,
    latency_s: f64,
    fastest: [DVec2; 2],
    turning: f64,
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

    /// Least distance that is left to body and hands beyond the required one while the base reacts and brakes, m: a lower bound. NaN for NaN.
    #[must_use]
    pub fn left_m(&self, drive: &BaseDrive, state: &BaseState, around: &Surroundings<'_>) -> f64 {
        let piece_s = drive.stop_s(state) / PIECES as f64;
        let (fastest, turning) = drive.fastest(state);
        let braking = Braking {
            parts: around.parts,
            poses: std::array::from_fn(|i| drive.braked(state, i as f64 * piece_s).pose()),
            piece_s,
            latency_s: self.latency_s,
            fastest,
            turning,
        };
        let body = Comer {
            at_m: around.person_m,
            velocity: around.person_m_per_s,
            most: [self.person_m_per_s, self.person_m_per_s2],
            error: self.velocity_error_m_per_s,
            keep_m: self.person_radius_m + self.clearance_m,
        };
        let hand = |at_m: DVec2, keep_m: f64| Comer {
            at_m,
            velocity: DVec2::NAN,
            most: [self.hand_m_per_s, f64::INFINITY],
            error: 0.0,
            keep_m: keep_m + self.clearance_m,
        };
        let seen = |seen: &SeenHand| {
            // An age below zero is no age.
            let age_s = if seen.age_s < 0.0 {
                f64::NAN
            } else {
                seen.age_s
            };
            hand(seen.at_m, self.hand_radius_m + self.hand_m_per_s * age_s)
        };
        let unseen = around.hands.is_empty();
        let unseen = unseen.then(|| hand(around.person_m, self.hand_reach_m));
        let hands = around.hands.iter().map(seen).chain(unseen);
        let left = hands.chain([body]).map(|comer| braking.left_m(&comer));
        left.fold(f64::INFINITY, least_m)
    }
}

/// NaN is the least.
fn least_m(a_m: f64, b_m: f64) -> f64 {
    match a_m.is_nan() || a_m < b_m {
        true => a_m,
        false => b_m,
    }
}

impl Braking<'_> {
    /// The comer is within two discs: around the present place, growing at the largest speed; and around the place that the measured velocity leads to,
    /// growing as acceleration and error of measurement allow. The farther one counts. Between two instants a part is at least as far from the middle
    /// of a disc as their mean distance less what they cover, relative to each other, in half of the time.
    fn left_m(&self, comer: &Comer) -> f64 {
        let v = comer.velocity;
        let most = comer.most[0].max(v.length());
        // The reaction counts with the first piece.
        let at_s = |i: usize| i as f64 * self.piece_s + if i == 0 { 0.0 } else { self.latency_s };
        let of_part = |part: &BasePart| {
            let turns = self.turning * part.ends_m[0].length().max(part.ends_m[1].length());
            let apart_m = |piece: usize, v: DVec2| {
                let relative = self.fastest.map(|base| (base - v).length());
                let relative = relative[0].max(relative[1]).max(v.length());
                let away_m = |i: usize| part.distance_m(&self.poses[i], comer.at_m + v * at_s(i));
                0.5 * (away_m(piece - 1) + away_m(piece)
                    - (at_s(piece) - at_s(piece - 1)) * (relative + turns))
            };
            let of_piece = |piece: usize| {
                let t_s = at_s(piece);
                let anywhere_m = apart_m(piece, DVec2::ZERO) - most * t_s;
                let spread = comer.error + 0.5 * comer.most[1] * t_s;
                anywhere_m.max(apart_m(piece, v) - spread * t_s) - comer.keep_m
            };
            (1..=PIECES).map(of_piece).fold(f64::INFINITY, least_m)
        };
        let left = self.parts.iter().map(of_part);
        left.fold(f64::INFINITY, least_m)
    }
}
