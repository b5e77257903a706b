//! Torques that keep joints off their limits.

use crate::error::HapticsError;
use hwall_kinematics::JointLimit;
use hwall_numeric::check::{positive, that};

/// Keeps the joints of a torque-controlled arm off their limits of angle and speed. Nothing else does: an overlay sets only the pose of the face, and
/// a push may turn the joints in unplanned ways.
///
/// Within a margin of a limit a spring and a damper scaled by the joint's own inertia push back, `M (ω² x + 2 ω (x / margin) q̇)`; beyond a share of
/// the largest speed a damper brakes, `M r (|q̇| - share)`. A planned motion there is not resisted: only the excess over it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointGuard {
    /// Width of the margin, rad; default 0.1.
    pub margin_rad: f64,
    /// Angular frequency of spring and damper, rad/s; default 15.
    pub rate_rad_per_s: f64,
    /// Share of the largest speed above which joints are braked; default 0.97, above the speeds for following objects.
    pub speed_share: f64,
    /// Rate of that brake, 1/s; default 30.
    pub brake_per_s: f64,
    /// Largest total torque, N m; default a third of the torque limits of an iiwa 7.
    pub most_n_m: [f64; 7],
}

impl Default for JointGuard {
    fn default() -> Self {
        Self {
            margin_rad: 0.1,
            rate_rad_per_s: 15.0,
            speed_share: 0.97,
            brake_per_s: 30.0,
            most_n_m: [58.0, 58.0, 36.0, 36.0, 36.0, 13.0, 13.0],
        }
    }
}

impl JointGuard {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("margin_rad", self.margin_rad)?;
        positive("rate_rad_per_s", self.rate_rad_per_s)?;
        positive("brake_per_s", self.brake_per_s)?;
        for most in self.most_n_m {
            positive("most_n_m", most)?;
        }
        let share = self.speed_share;
        let valid = (0.0..=1.0).contains(&share);
        that(valid, "speed_share", share, "from 0 to 1")?;
        Ok(())
    }

    /// The torque on a joint of an inertia (kg m²), N m; measured and planned angle and speed, rad and rad/s.
    pub(in crate::render) fn torque_n_m(
        &self,
        joint: usize,
        inertia_kg_m2: f64,
        limit: &JointLimit,
        most_rad_per_s: f64,
        [q, qd]: [f64; 2],
        [planned_q, planned_qd]: [f64; 2],
    ) -> f64 {
        // In a joint with a range below two margins, both end at the centre.
        let margin = self
            .margin_rad
            .min(0.5 * (limit.max_rad - limit.min_rad).max(0.0));
        let above = q - (limit.max_rad - margin).max(planned_q);
        let below = (limit.min_rad + margin).min(planned_q) - q;
        let push = |deep: f64, towards: f64| {
            let rate = self.rate_rad_per_s;
            let share = (deep / self.margin_rad).min(1.0);
            match deep > 0.0 {
                true => rate * rate * deep + 2.0 * rate * share * towards.max(0.0),
                false => 0.0,
            }
        };
        let fastest = (self.speed_share * most_rad_per_s).max(planned_qd.abs());
        let excess = (qd.abs() - fastest).max(0.0).copysign(qd);
        let back = push(below, -qd) - push(above, qd) - self.brake_per_s * excess;
        let most = self.most_n_m[joint];
        (inertia_kg_m2 * back).clamp(-most, most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_testkit::refused;

    const LIMIT: JointLimit = JointLimit {
        min_rad: -1.0,
        max_rad: 1.0,
    };

    #[test]
    fn nothing_in_the_middle_and_back_at_the_ends() {
        let guard = JointGuard::default();
        let at = |q: f64, qd: f64| guard.torque_n_m(0, 2.0, &LIMIT, 2.0, [q, qd], [0.0, 0.0]);
        assert_eq!(at(0.89, 1.9), 0.0);
        assert_eq!(at(-0.89, -1.9), 0.0);
        assert!((at(0.95, 0.0) + 2.0 * 225.0 * 0.05).abs() < 1e-9);
        assert!((at(-0.95, 0.0) - 2.0 * 225.0 * 0.05).abs() < 1e-9);
        // Away from the limit there is no damping; towards it there is.
        assert_eq!(at(0.95, -1.0), at(0.95, 0.0));
        assert!(at(0.95, 1.0) < at(0.95, 0.0));
        assert_eq!(at(5.0, 0.0), -guard.most_n_m[0]);
        assert!((at(0.0, 2.04) + 2.0 * 30.0 * 0.1).abs() < 1e-9);
    }

    #[test]
    fn a_planned_motion_goes_where_it_was_planned() {
        let guard = JointGuard::default();
        let at = |q, planned| guard.torque_n_m(0, 2.0, &LIMIT, 2.0, [q, 0.0], [planned, 0.0]);
        assert_eq!(at(0.97, 0.97), 0.0);
        assert!(at(0.98, 0.97) < 0.0);
        let fast = [0.0, 1.99];
        assert_eq!(guard.torque_n_m(0, 2.0, &LIMIT, 2.0, fast, fast), 0.0);
    }

    #[test]
    fn bad_settings_are_named() {
        refused!(
            JointGuard::default(),
            |guard: JointGuard| guard.validate(),
            {
                margin_rad = f64::NAN;
                speed_share = 1.1;
                most_n_m = [0.0; 7];
            }
        );
    }
}
