//! How fast the board may move near the person.

use crate::board::Board;
use crate::error::HapticsError;
use glam::DVec3;
use hwall_geometry::Pose;
use hwall_kinematics::Twist;
use hwall_numeric::check::{non_negative, positive};

/// How fast the face may be near a hand: so that it has slowed down when they meet, if the hand goes on as it goes now.
///
/// What counts is the time until then: a board that moves along under a finger that hovers may be fast, one that a hand is about to meet
/// may not, whichever way it moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProximityConfig {
    /// Distance that the board keeps from the person until it is touched, m; default 0.02.
    pub clearance_m: f64,
    /// Deceleration that is counted on, m/s²; default 5. Joints that cannot brake as hard count with what they can.
    pub braking_m_per_s2: f64,
    /// A face that is no faster than this may meet a hand, m/s; default 0.1.
    pub meets_m_per_s: f64,
}

impl Default for ProximityConfig {
    fn default() -> Self {
        Self {
            clearance_m: 0.02,
            braking_m_per_s2: 5.0,
            meets_m_per_s: 0.1,
        }
    }
}

/// A point of the face of a board as the person's nearest point sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Approach {
    /// How far apart they are, m.
    pub(crate) distance_m: f64,
    /// How fast the face comes nearer, m/s; below zero it goes away.
    pub(crate) closing_m_per_s: f64,
    /// How fast that point of the face is, m/s.
    speed_m_per_s: f64,
    /// How fast the person comes nearer, m/s.
    person_m_per_s: f64,
}

impl Approach {
    /// Of a face that moves, and a person's point (m, base frame) with its velocity, m/s.
    pub(crate) fn of(
        board: &Board,
        base_from_board: &Pose,
        twist: &Twist,
        (point_m, velocity_m_per_s): (DVec3, DVec3),
    ) -> Self {
        let nearest_m = nearest_m(board, base_from_board, point_m);
        let way = point_m - nearest_m;
        let lever = nearest_m - base_from_board.position_m();
        let velocity = twist.linear_m_per_s + twist.angular_rad_per_s.cross(lever);
        let towards = way.normalize_or_zero();
        Self {
            distance_m: way.length(),
            closing_m_per_s: velocity.dot(towards),
            speed_m_per_s: velocity.length(),
            person_m_per_s: -velocity_m_per_s.dot(towards),
        }
    }
}

/// Shares of the full speed that are told apart; few, so that the motion is seldom planned anew.
pub(super) const SHARES: [f64; 8] = [0.09, 0.125, 0.18, 0.25, 0.35, 0.5, 0.7, 1.0];
/// A larger share is taken only if this much more would be allowed.
const MARGIN: f64 = 1.2;

impl ProximityConfig {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        non_negative("clearance_m", self.clearance_m)?;
        positive("braking_m_per_s2", self.braking_m_per_s2)?;
        positive("meets_m_per_s", self.meets_m_per_s)?;
        Ok(())
    }

    /// The share of its motion that a face may keep whose joints need `stop_s` to stop, s; above 1 where it might be faster.
    ///
    /// It brakes to [`meets_m_per_s`](Self::meets_m_per_s) in the time that the hand and, at the mean of both speeds, the face need to
    /// meet.
    pub(crate) fn share(&self, approach: &Approach, stop_s: f64) -> f64 {
        let (speed, meets) = (approach.speed_m_per_s, self.meets_m_per_s);
        let can_m_per_s2 = speed / stop_s;
        // At rest nothing has to be braked.
        let braking_m_per_s2 = match can_m_per_s2 > 0.0 {
            true => self.braking_m_per_s2.min(can_m_per_s2),
            false => self.braking_m_per_s2,
        };
        let mean = 0.5 * (1.0 + meets / speed.max(meets));
        let closing = approach.person_m_per_s.max(0.0) + mean * approach.closing_m_per_s.max(0.0);
        let meet_s = approach.distance_m / closing.max(SLOWEST_M_PER_S);
        (meets + braking_m_per_s2 * meet_s) / speed.max(SLOWEST_M_PER_S)
    }

    /// The share of the joint speeds for a moving board and points of a hand (base frame, m) that moves as a whole (m/s), given the share in
    /// force and the time that the joints need to stop, s.
    #[must_use]
    pub fn speed_share(
        &self,
        board: &Board,
        base_from_board: &Pose,
        (twist, stop_s): (&Twist, f64),
        (person_m, hand_m_per_s): (&[DVec3], DVec3),
        in_force: f64,
    ) -> f64 {
        let allowed = person_m
            .iter()
            .map(|point_m| {
                let point = (*point_m, hand_m_per_s);
                let approach = Approach::of(board, base_from_board, twist, point);
                let share = in_force * self.share(&approach, stop_s);
                // Not cut off at 1: what is left beyond the margin is what brings a slowed arm back to full speed. But near a
                // person a board that turns towards them at full speed could not be slowed down in time.
                match approach.distance_m < NEAR_M {
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

/// Nearer to a person than this a slowed arm does not go back to full speed, m.
const NEAR_M: f64 = 0.15;

/// Slower than this nothing is slowed down, m/s.
const SLOWEST_M_PER_S: f64 = 1e-3;

/// The point of the face of a board that is nearest to a point, m.
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

    /// A face at the origin, and a finger before its middle that comes at a speed, m and m/s.
    fn approach(velocity: DVec3, distance_m: f64, finger_m_per_s: f64) -> Approach {
        let twist = Twist {
            linear_m_per_s: velocity,
            angular_rad_per_s: DVec3::ZERO,
        };
        let finger = (DVec3::Z * distance_m, DVec3::NEG_Z * finger_m_per_s);
        Approach::of(&Board::default(), &Pose::IDENTITY, &twist, finger)
    }

    fn speed_share(velocity: DVec3, distance_m: f64, finger_m_per_s: f64, in_force: f64) -> f64 {
        let twist = Twist {
            linear_m_per_s: velocity,
            angular_rad_per_s: DVec3::ZERO,
        };
        let finger: (&[DVec3], _) = (&[DVec3::Z * distance_m], DVec3::NEG_Z * finger_m_per_s);
        let (config, board) = (ProximityConfig::default(), Board::default());
        config.speed_share(&board, &Pose::IDENTITY, (&twist, 0.0), finger, in_force)
    }

    /// A face that brakes as soon as it has to, along itself or towards the finger, is slow enough when they meet.
    #[test]
    fn a_face_that_keeps_to_its_share_is_slow_when_it_is_met() {
        let config = ProximityConfig::default();
        const DT_S: f64 = 1e-4;
        for direction in [DVec3::X, DVec3::Z, DVec3::new(0.6, 0.0, 0.8)] {
            for (finger_m_per_s, start_m_per_s) in [(0.2, 1.0), (1.0, 0.5), (2.0, 1.2), (0.0, 0.8)]
            {
                let (mut distance_m, mut speed) = (0.5, start_m_per_s);
                for _ in 0..100_000 {
                    let state = approach(direction * speed, distance_m, finger_m_per_s);
                    let braked = speed - config.braking_m_per_s2 * DT_S;
                    speed = (speed * config.share(&state, 0.0).min(1.0)).max(braked);
                    distance_m -= (finger_m_per_s + direction.z * speed) * DT_S;
                    if distance_m <= 0.0 {
                        break;
                    }
                }
                let moves = finger_m_per_s > 0.0 || direction.z > 0.0;
                assert!(distance_m <= 0.0 || !moves);
                assert!(
                    !moves || speed < 0.12,
                    "{direction} {finger_m_per_s}: {speed}"
                );
            }
        }
    }

    #[test]
    fn a_face_under_a_finger_that_hovers_may_be_fast() {
        assert_eq!(speed_share(DVec3::X, 0.02, 0.0, 1.0), 1.0);
        assert!(speed_share(DVec3::X, 0.02, 0.5, 1.0) < 0.5);
        // Its own way is the shorter the slower it becomes.
        assert!(speed_share(DVec3::Z, 0.02, 0.0, 1.0) < 0.5);
    }

    #[test]
    fn every_share_goes_back_to_full_speed_once_nothing_comes_nearer() {
        for in_force in SHARES {
            for away in [DVec3::ZERO, DVec3::NEG_Z] {
                assert_eq!(speed_share(away, 0.3, 0.0, in_force), 1.0, "{in_force}");
                assert_eq!(speed_share(away, 0.3, -1.0, in_force), 1.0, "{in_force}");
            }
        }
    }

    #[test]
    fn joints_that_brake_slowly_make_the_board_slow_sooner() {
        let config = ProximityConfig::default();
        let state = approach(DVec3::X, 0.1, 0.5);
        // 5 m/s² for 0.2 s, and 0.5 m/s² where it takes 2 s to stop.
        assert!((config.share(&state, 0.0) - 1.1).abs() < 1e-12);
        assert!((config.share(&state, 0.1) - 1.1).abs() < 1e-12);
        assert!((config.share(&state, 2.0) - 0.2).abs() < 1e-12);
    }
}
