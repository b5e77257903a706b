//! The strain of a configuration, near limits and singular poses, as a price in seconds.

use hwall_kinematics::{ArmKinematics, JointPositions};
use hwall_numeric::ArgumentError;
use hwall_numeric::check::{non_negative, positive};

/// Prices of being near limits and singular poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrainConfig {
    /// A configuration is strained within this distance of a limit, or with joints 2, 4 or 6 of an S-R-S arm within it of zero, rad; default 0.2.
    pub room_rad: f64,
    /// Price of a joint at its limit, or at zero, s of arrival time; it rises quadratically from zero at `room_rad`. Default 0.1.
    pub price_s: f64,
}

impl Default for StrainConfig {
    fn default() -> Self {
        Self {
            room_rad: 0.2,
            price_s: 0.1,
        }
    }
}

impl StrainConfig {
    /// Rejects settings out of range.
    ///
    /// # Errors
    /// `room_rad` is not positive, `price_s` is negative, or NaN.
    pub fn validate(&self) -> Result<(), ArgumentError> {
        positive("room_rad", self.room_rad)?;
        non_negative("price_s", self.price_s)?;
        Ok(())
    }

    /// The price of a configuration, s.
    pub(crate) fn price_of_s(&self, arm: &dyn ArmKinematics, q: &JointPositions) -> f64 {
        let part = |room: f64| {
            let lacking = (1.0 - room / self.room_rad).max(0.0);
            lacking * lacking
        };
        let limits = arm.limits().iter().zip(q.0).take(arm.joint_count());
        let at_limits: f64 = limits.map(|(l, q)| part(l.distance_rad(q))).sum();
        // For other arms the singular angles are unknown.
        let singular: f64 = match arm.closed_form() {
            Some(_) => [1, 3, 5].map(|joint| part(q[joint].abs())).iter().sum(),
            None => 0.0,
        };
        self.price_s * (at_limits + singular)
    }
}
