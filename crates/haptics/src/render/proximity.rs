//! How fast the board may move near the person.

use crate::board::Board;
use crate::error::HapticsError;
use glam::DVec3;
use hwall_geometry::Pose;
use hwall_numeric::check::{non_negative, positive, that};

/// The speed of the board falls with its distance from the nearest known point of the person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProximityConfig {
    /// Distance that the board keeps from the person until it is touched, m; default 0.02.
    pub clearance_m: f64,
    /// Deceleration at which the board, at the speed that is allowed, would stop at the clearance, m/s²; default 5.
    pub braking_m_per_s2: f64,
    /// Speed that is allowed at any distance, m/s; default 0.25, that of reduced speed of an industrial robot
    /// ([ISO 10218-1]).
    pub crawl_m_per_s: f64,
    /// Speed of the board when all joints may use their full speed, m/s; default 1.6.
    pub full_m_per_s: f64,
}

impl Default for ProximityConfig {
    fn default() -> Self {
        Self {
            clearance_m: 0.02,
            braking_m_per_s2: 5.0,
            crawl_m_per_s: 0.25,
            full_m_per_s: 1.6,
        }
    }
}

/// Shares of the full speed that are told apart; few, so that the motion is seldom planned anew.
const SHARES: [f64; 8] = [0.09, 0.125, 0.18, 0.25, 0.35, 0.5, 0.7, 1.0];
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
        positive("crawl_m_per_s", self.crawl_m_per_s)?;
        positive("full_m_per_s", self.full_m_per_s)?;
        let slower = self.crawl_m_per_s <= self.full_m_per_s;
        that(
            slower,
            "crawl_m_per_s",
            self.crawl_m_per_s,
            "at most full_m_per_s",
        )?;
        Ok(())
    }

    /// The share of the joint speeds for a board and the person's points (base frame, m), given the share in force.
    #[must_use]
    pub fn speed_share(
        &self,
        board: &Board,
        base_from_board: &Pose,
        person_m: &[DVec3],
        in_force: f64,
    ) -> f64 {
        let nearest_m = person_m
            .iter()
            .map(|point| distance_m(board, base_from_board, *point))
            .fold(f64::INFINITY, f64::min);
        let beyond_m = (nearest_m - self.clearance_m).max(0.0);
        let can_stop_m_per_s = (2.0 * self.braking_m_per_s2 * beyond_m).sqrt();
        let allowed = can_stop_m_per_s.max(self.crawl_m_per_s) / self.full_m_per_s;
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

/// Distance of a point from the face of a board, m.
fn distance_m(board: &Board, base_from_board: &Pose, point_m: DVec3) -> f64 {
    let p = base_from_board.inverse_transform_point(point_m);
    let beside = |x: f64, half: f64| (x.abs() - half).max(0.0);
    DVec3::new(
        beside(p.x, board.half_width_m),
        beside(p.y, board.half_height_m),
        p.z,
    )
    .length()
}
