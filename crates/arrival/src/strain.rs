//! How near a configuration is to limits and singular poses, as a price in seconds.

use hwall_kinematics::{ArmKinematics, JointPositions};
use hwall_numeric::ArgumentError;
use hwall_numeric::check::{non_negative, positive};

/// What nearness to limits and to singular poses is worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrainConfig {
    /// Nearer than this to a limit, or joints 2, 4 and 6 of an S-R-S arm nearer than this to zero, is strained, rad; default 0.2.
    pub room_rad: f64,
    /// Price of a joint at its limit, or at zero, in seconds of arrival; it rises from none at `room_rad` with the
    /// square. Default 0.1.
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
    /// A room that is not positive, a negative price, NaN.
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
        // Of other arms it is not known which angles are singular.
        let singular: f64 = match arm.closed_form() {
            Some(_) => [1, 3, 5].map(|joint| part(q[joint].abs())).iter().sum(),
            None => 0.0,
        };
        self.price_s * (at_limits + singular)
    }
}
