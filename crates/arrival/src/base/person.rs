//! Speed and separation: does the base stand before a person can reach it?

use super::drive::{BaseDrive, BaseState};
use crate::error::ArrivalError;
use glam::{DVec2, DVec3};
use hwall_numeric::check::non_negative;

/// How a moving base keeps away from a person, by the rule of `hwall_haptics::body::SeparationConfig`: while it reacts and brakes, it is always
/// farther from the person than the person can come by then.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseSafety {
    /// Approach speed of a person, m/s; default 1.6, that of [ISO 13855] for walking.
    pub person_m_per_s: f64,
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
            person_radius_m: 0.25,
            latency_s: 0.045,
            clearance_m: 0.02,
            hand_m_per_s: 1.6,
            hand_m: 0.15,
        }
    }
}

/// A part of the robot from above, in the frame of the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Middle, m.
    pub at_m: DVec2,
    /// Radius, m.
    pub radius_m: f64,
}

/// What the base knows of person and arm.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// The person's head from above, floor frame, m.
    pub person_m: DVec2,
    /// Hands, floor frame with z up from the base, m.
    pub hands_m: &'a [DVec3],
    /// The middle of the board, base frame, m.
    pub board_m: DVec3,
    /// Is the board touched?
    pub touched: bool,
    /// The parts of the robot, base frame.
    pub parts: &'a [Circle],
}

/// Intervals of the braking time.
const PIECES: usize = 6;

impl BaseSafety {
    /// Rejects settings below zero.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), ArrivalError> {
        for (what, value) in [
            ("person_m_per_s", self.person_m_per_s),
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
            && self.left_m(drive, state, around.person_m, around.parts) >= 0.0
    }

    /// Least distance that is left to the person beyond the required one while the base reacts and brakes, m: a lower bound. NaN for NaN.
    ///
    /// Between two instants a part is at least as far as their mean distance less what it covers in half of the time.
    #[must_use]
    pub fn left_m(
        &self,
        drive: &BaseDrive,
        state: &BaseState,
        person_m: DVec2,
        parts: &[Circle],
    ) -> f64 {
        let piece_s = drive.stop_s(state) / PIECES as f64;
        let [speed_m_per_s, rate] = drive.fastest(state);
        let poses: [_; PIECES + 1] =
            std::array::from_fn(|i| drive.braked(state, i as f64 * piece_s).pose());
        let mut least_m = f64::INFINITY;
        for part in parts {
            let covers_m = piece_s * (speed_m_per_s + rate * part.at_m.length());
            let away_m = |i: usize| poses[i].floor_m(part.at_m).distance(person_m);
            for piece in 1..=PIECES {
                let apart_m = 0.5 * (away_m(piece - 1) + away_m(piece) - covers_m);
                let comes_m = self.person_m_per_s * (self.latency_s + piece as f64 * piece_s);
                let radii_m = part.radius_m + self.person_radius_m;
                let left_m = apart_m - radii_m - self.clearance_m - comes_m;
                // NaN is the least.
                if left_m.is_nan() || left_m < least_m {
                    least_m = left_m;
                }
            }
        }
        least_m
    }

    /// The largest speed of a base that keeps this distance from the person beyond the radii, m/s: without jerk, and at most `most`.
    ///
    /// The person comes `person_m_per_s (latency + v/a)` and the base goes `v²/2a` while it brakes; a quadratic in v.
    #[must_use]
    pub fn speed_at_m_per_s(&self, gap_m: f64, acceleration_m_per_s2: f64, most: f64) -> f64 {
        let room_m = gap_m - self.clearance_m - self.person_m_per_s * self.latency_s;
        let a = acceleration_m_per_s2;
        let p = self.person_m_per_s;
        let speed = -p + (p * p + 2.0 * a * room_m.max(0.0)).sqrt();
        speed.clamp(0.0, most)
    }
}
