//! Speed and separation: does the base stand before a person can reach it?

use super::drive::{BaseDrive, BasePose, BaseState};
use crate::error::ArrivalError;
use glam::{DVec2, DVec3};
use hwall_numeric::check::non_negative;

/// How a moving base keeps away from a person, by the rule of `hwall_haptics::body::SeparationConfig`: while it reacts and brakes, it is always
/// farther from the person than the person can come by then.
///
/// A person can come as far as the measured velocity, a bound on the acceleration and a bound on the speed allow: [ISO/TS 15066], 5.5.4.2.3, has a
/// person whose speed is measured keep it, changed in the way that shortens the distance most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseSafety {
    /// Largest speed of a person, m/s; default 1.6, that of [ISO 13855] for walking.
    pub person_m_per_s: f64,
    /// Largest acceleration of a person, m/s²; default 2: people who start to walk reach 1 to 1.5 m/s in about 1 s.
    pub person_m_per_s2: f64,
    /// Error of the measured velocity, m/s; default 0.1: the mean over 0.1 s at 2 m/s².
    pub velocity_error_m_per_s: f64,
    /// Radius of an upright cylinder around the person's head that holds the body without the arms, m; default 0.25.
    pub person_radius_m: f64,
    /// Time from a change of the world until braking begins, s; default 0.045, as for the arm.
    pub latency_s: f64,
    /// Distance left between the person and the stopped base, m; default 0.02, as for the arm.
    pub clearance_m: f64,
    /// Speed of a hand, m/s; default 1.6: reaches of plain people peak at about 1 m/s.
    pub hand_m_per_s: f64,
    /// The base stands while a hand is closer than this to the middle of the board, m, plus what the hand covers until it stands; default 0.15: half a
    /// diagonal of the board and 1 cm.
    pub hand_m: f64,
}

impl Default for BaseSafety {
    fn default() -> Self {
        Self {
            person_m_per_s: 1.6,
            person_m_per_s2: 2.0,
            velocity_error_m_per_s: 0.1,
            person_radius_m: 0.25,
            latency_s: 0.045,
            clearance_m: 0.02,
            hand_m_per_s: 1.6,
            hand_m: 0.15,
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

/// What the base knows of person and arm.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// The person's head from above, floor frame, m.
    pub person_m: DVec2,
    /// Its measured velocity, m/s; NaN if unknown: then it may have the largest speed in any direction.
    pub person_m_per_s: DVec2,
    /// Hands, floor frame with z up from the base, m.
    pub hands_m: &'a [DVec3],
    /// The middle of the board, base frame, m.
    pub board_m: DVec3,
    /// Is the board touched?
    pub touched: bool,
    /// The parts of the robot, base frame.
    pub parts: &'a [BasePart],
}

/// Intervals of the braking time.
const PIECES: usize = 10;

impl BaseSafety {
    /// Rejects settings below zero.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), ArrivalError> {
        for (what, value) in [
            ("person_m_per_s", self.person_m_per_s),
            ("person_m_per_s2", self.person_m_per_s2),
            ("velocity_error_m_per_s", self.velocity_error_m_per_s),
            ("person_radius_m", self.person_radius_m),
            ("latency_s", self.latency_s),
            ("clearance_m", self.clearance_m),
            ("hand_m_per_s", self.hand_m_per_s),
            ("hand_m", self.hand_m),
        ] {
            non_negative(what, value)?;
        }
        Ok(())
    }

    /// May the base be in this state? Nothing is touched, no hand is near the board, and it stands before the person can reach it.
    #[must_use]
    pub fn allows(&self, drive: &BaseDrive, state: &BaseState, around: &Surroundings<'_>) -> bool {
        let stop_s = self.latency_s + drive.stop_s(state);
        let board_m = state
            .pose()
            .floor_from_base()
            .transform_point(around.board_m);
        let hand_m = self.hand_m + self.hand_m_per_s * stop_s;
        let clear = |hand: &DVec3| hand.distance(board_m) >= hand_m;
        !around.touched
            && around.hands_m.iter().all(clear)
            && self.left_m(drive, state, around) >= 0.0
    }

    /// Least distance that is left to the person beyond the required one while the base reacts and brakes, m: a lower bound. NaN for NaN.
    ///
    /// The person is within two discs: around the present place, growing at the largest speed; and around the place that the measured velocity leads
    /// to, growing as acceleration and error of measurement allow. The farther one counts. Between two instants a part is at least as far from the
    /// middle of a disc as their mean distance less what they cover, relative to each other, in half of the time.
    #[must_use]
    pub fn left_m(&self, drive: &BaseDrive, state: &BaseState, around: &Surroundings<'_>) -> f64 {
        let piece_s = drive.stop_s(state) / PIECES as f64;
        let (fastest, rate) = drive.fastest(state);
        let poses: [_; PIECES + 1] =
            std::array::from_fn(|i| drive.braked(state, i as f64 * piece_s).pose());
        let v = around.person_m_per_s;
        let most = self.person_m_per_s.max(v.length());
        // The reaction counts with the first piece.
        let at_s = |i: usize| i as f64 * piece_s + if i == 0 { 0.0 } else { self.latency_s };
        let mut least_m = f64::INFINITY;
        for part in around.parts {
            let turns = rate * part.ends_m[0].length().max(part.ends_m[1].length());
            let apart_m = |piece: usize, v: DVec2| {
                let relative = fastest.map(|base| (base - v).length());
                let relative = relative[0].max(relative[1]).max(v.length());
                let away_m = |i: usize| part.distance_m(&poses[i], around.person_m + v * at_s(i));
                0.5 * (away_m(piece - 1) + away_m(piece)
                    - (at_s(piece) - at_s(piece - 1)) * (relative + turns))
            };
            for piece in 1..=PIECES {
                let t_s = at_s(piece);
                let anywhere_m = apart_m(piece, DVec2::ZERO) - most * t_s;
                let spread = self.velocity_error_m_per_s + 0.5 * self.person_m_per_s2 * t_s;
                let onwards_m = apart_m(piece, v) - spread * t_s;
                let left_m = anywhere_m.max(onwards_m) - self.person_radius_m - self.clearance_m;
                // NaN is the least.
                if left_m.is_nan() || left_m < least_m {
                    least_m = left_m;
                }
            }
        }
        least_m
    }
}
