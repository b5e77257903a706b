//! How fast the board may move near the person.

use crate::board::Board;
use crate::error::HapticsError;
use glam::DVec3;
use hwall_geometry::Pose;
use hwall_kinematics::Twist;
use hwall_numeric::check::{non_negative, positive};

/// Limits the board's approach speed by the distance of the nearest known point of the person.
///
/// The closing speed counts, as in speed and separation monitoring ([ISO/TS 15066]): a board that slides along behind its wall does not approach
/// a finger in front of it; one that comes out of the wall does. Within [`along_m`](Self::along_m) the speed along the face counts as well, because the
/// face may be touched at any moment; a board that moves away is not slowed for that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProximityConfig {
    /// Distance that the board keeps from the person until it is touched, m; default 0.02.
    pub clearance_m: f64,
    /// Deceleration that would stop the board at the clearance from the allowed speed, m/s²; default 5.
    pub braking_m_per_s2: f64,
    /// Speed allowed at any distance, m/s; default 0.1, the speed at which a face may be touched.
    pub crawl_m_per_s: f64,
    /// Within this distance the speed along the face counts as well, m; default 0.06. A larger distance makes fewer first contacts with a moving
    /// face, and more boards late (docs/FIRST-CONTACTS.md has the curve).
    pub along_m: f64,
}

impl Default for ProximityConfig {
    fn default() -> Self {
        Self {
            clearance_m: 0.02,
            braking_m_per_s2: 5.0,
            crawl_m_per_s: 0.1,
            along_m: 0.06,
        }
    }
}

/// Discrete shares of the full speed; few, so that the motion is seldom planned again.
pub(super) const SHARES: [f64; 8] = [0.09, 0.125, 0.18, 0.25, 0.35, 0.5, 0.7, 1.0];
/// A larger share is taken only if the allowed speed exceeds it by this factor.
const MARGIN: f64 = 1.2;

impl ProximityConfig {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        non_negative("clearance_m", self.clearance_m)?;
        positive("braking_m_per_s2", self.braking_m_per_s2)?;
        positive("crawl_m_per_s", self.crawl_m_per_s)?;
        non_negative("along_m", self.along_m)?;
        Ok(())
    }

    /// Largest approach speed to a point at a distance, m/s.
    #[must_use]
    pub fn allowed_m_per_s(&self, distance_m: f64) -> f64 {
        self.allowed_braking_m_per_s(distance_m, self.braking_m_per_s2)
    }

    /// The same for a board whose joints need `stop_s` to stop from this speed: if they cannot brake as hard as
    /// [`braking_m_per_s2`](Self::braking_m_per_s2), the board has to slow down earlier.
    #[must_use]
    pub fn allowed_stopping_m_per_s(
        &self,
        distance_m: f64,
        closing_m_per_s: f64,
        stop_s: f64,
    ) -> f64 {
        let can_m_per_s2 = closing_m_per_s / stop_s;
        // A board at rest, or moving away, needs no braking.
        let braking_m_per_s2 = match can_m_per_s2 > 0.0 {
            true => self.braking_m_per_s2.min(can_m_per_s2),
            false => self.braking_m_per_s2,
        };
        self.allowed_braking_m_per_s(distance_m, braking_m_per_s2)
    }

    fn allowed_braking_m_per_s(&self, distance_m: f64, braking_m_per_s2: f64) -> f64 {
        let beyond_m = (distance_m - self.clearance_m).max(0.0);
        let can_stop_m_per_s = (2.0 * braking_m_per_s2 * beyond_m).sqrt();
        can_stop_m_per_s.max(self.crawl_m_per_s)
    }

    /// The share of the joint speeds for a moving board and the person's points (base frame, m), given the current share and the stopping time of the
    /// joints, s. A point that is not finite allows the least share.
    #[must_use]
    pub fn speed_share(
        &self,
        board: &Board,
        base_from_board: &Pose,
        (twist, stop_s): (&Twist, f64),
        person_m: &[DVec3],
        in_force: f64,
    ) -> f64 {
        let allowed = person_m
            .iter()
            .map(|point_m| {
                if !point_m.is_finite() {
                    return 0.0;
                }
                let (way_m, velocity) = way_and_velocity(board, base_from_board, twist, *point_m);
                let distance_m = way_m.length();
                let towards = way_m.normalize_or_zero();
                let mut closing_m_per_s = velocity.dot(towards);
                if distance_m < self.along_m {
                    let along = velocity - towards * closing_m_per_s;
                    closing_m_per_s = closing_m_per_s.max(0.0).hypot(along.length());
                }
                let allowed_m_per_s =
                    self.allowed_stopping_m_per_s(distance_m, closing_m_per_s, stop_s);
                let share = in_force * allowed_m_per_s / closing_m_per_s.max(SLOWEST_M_PER_S);
                // Not clamped to 1: the excess over the margin brings a slowed arm back to full speed. But near a person, a board that turns towards
                // them at full speed could not slow down in time.
                match distance_m < NEAR_M {
                    true => share.min(1.0),
                    false => share,
                }
            })
            .fold(f64::INFINITY, f64::min);
        let most = |allowed: f64| {
            let fitting = SHARES.into_iter().filter(|share| *share <= allowed);
            fitting.fold(SHARES[0], f64::max)
        };
        let share = most(allowed);
        if share > in_force {
            most(allowed / MARGIN).max(in_force)
        } else {
            share
        }
    }
}

/// Closer to a person than this a slowed arm does not return to full speed, m.
const NEAR_M: f64 = 0.15;

/// Approach speeds below this are treated as this speed, m/s.
const SLOWEST_M_PER_S: f64 = 1e-3;

/// Distance of a point from the face (m), and the closing speed of a moving face (m/s; negative if it moves away).
pub(crate) fn distance_and_closing(
    board: &Board,
    base_from_board: &Pose,
    twist: &Twist,
    point_m: DVec3,
) -> (f64, f64) {
    let (way_m, velocity) = way_and_velocity(board, base_from_board, twist, point_m);
    (way_m.length(), velocity.dot(way_m.normalize_or_zero()))
}

/// From the nearest point of a moving face to a point (m), and the velocity of the nearest point, m/s.
fn way_and_velocity(
    board: &Board,
    base_from_board: &Pose,
    twist: &Twist,
    point_m: DVec3,
) -> (DVec3, DVec3) {
    let nearest_m = nearest_m(board, base_from_board, point_m);
    let lever = nearest_m - base_from_board.position_m();
    let velocity = twist.linear_m_per_s + twist.angular_rad_per_s.cross(lever);
    (point_m - nearest_m, velocity)
}

/// The point of the board's face nearest to a given point, m.
fn nearest_m(board: &Board, base_from_board: &Pose, point_m: DVec3) -> DVec3 {
    let p = base_from_board.inverse_transform_point(point_m);
    base_from_board.transform_point(DVec3::new(
        p.x.clamp(-board.half_width_m, board.half_width_m),
        p.y.clamp(-board.half_height_m, board.half_height_m),
        0.0,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share for a face at the origin that moves, m/s, and a finger on its normal, m.
    fn share_of(
        config: &ProximityConfig,
        linear_m_per_s: DVec3,
        distance_m: f64,
        in_force: f64,
    ) -> f64 {
        let twist = Twist {
            linear_m_per_s,
            angular_rad_per_s: DVec3::ZERO,
        };
        let (board, moves, finger_m) = (Board::default(), (&twist, 0.0), [DVec3::Z * distance_m]);
        config.speed_share(&board, &Pose::IDENTITY, moves, &finger_m, in_force)
    }

    /// The same for a face that moves along its normal.
    fn share(closing_m_per_s: f64, distance_m: f64, in_force: f64) -> f64 {
        let closing = DVec3::Z * closing_m_per_s;
        share_of(&ProximityConfig::default(), closing, distance_m, in_force)
    }

    #[test]
    fn a_board_that_comes_too_fast_is_slowed_down() {
        let allowed_m_per_s = ProximityConfig::default().allowed_m_per_s(0.1);
        assert_eq!(share(0.9 * allowed_m_per_s, 0.1, 1.0), 1.0);
        assert_eq!(share(2.0 * allowed_m_per_s, 0.1, 1.0), 0.5);
    }

    #[test]
    fn every_share_goes_back_to_full_speed_once_the_board_no_longer_comes_nearer() {
        for in_force in SHARES {
            for closing_m_per_s in [0.0, -1.0] {
                assert_eq!(share(closing_m_per_s, 0.3, in_force), 1.0, "{in_force}");
                assert!(share(closing_m_per_s, 0.1, in_force) < 1.0 || in_force == 1.0);
            }
        }
    }

    #[test]
    fn a_larger_share_needs_a_margin() {
        let allowed_m_per_s = ProximityConfig::default().allowed_m_per_s(0.3);
        // At 0.7 of the speed, full speed would just be allowed, or allowed with a margin.
        assert_eq!(share(0.69 * allowed_m_per_s, 0.3, 0.7), 0.7);
        assert_eq!(share(0.5 * allowed_m_per_s, 0.3, 0.7), 1.0);
    }

    #[test]
    fn close_to_the_face_its_speed_along_itself_counts() {
        for (distance_m, along_m, wanted) in [
            (0.01, 0.0, 1.0),
            (0.01, 0.03, SHARES[0]),
            (0.04, 0.03, 1.0),
            (0.0, 0.03, SHARES[0]),
            // A point that is no number is not left out.
            (f64::NAN, 0.03, SHARES[0]),
            (f64::INFINITY, 0.03, SHARES[0]),
        ] {
            let config = ProximityConfig {
                along_m,
                ..ProximityConfig::default()
            };
            let share = share_of(&config, DVec3::X, distance_m, 1.0);
            assert_eq!(share, wanted, "{distance_m} m, {along_m} m");
        }
    }

    #[test]
    fn joints_that_brake_slowly_make_the_board_slow_sooner() {
        let config = ProximityConfig::default();
        let allowed = |closing, stop_s| config.allowed_stopping_m_per_s(0.12, closing, stop_s);
        assert_eq!(allowed(1.0, 0.1), config.allowed_m_per_s(0.12));
        // 3.2 m/s² over 0.1 m.
        assert!((allowed(1.0, 0.3125) - 0.8).abs() < 1e-12);
        for (closing, stop_s) in [(0.0, 0.0), (-1.0, 0.5), (0.0, 1.0)] {
            assert_eq!(allowed(closing, stop_s), config.allowed_m_per_s(0.12));
        }
    }
}
