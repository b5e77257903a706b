//! Joint friction and its compensation.

use hwall_numeric::ArgumentError;
use hwall_numeric::check::{non_negative, positive, that, within};

/// Friction of one joint: breakaway, Stribeck transition to Coulomb friction, viscous friction.
///
/// A joint at rest stays exactly at rest under any torque up to `breakaway_n_m`. In motion, the friction torque
/// is `coulomb + (breakaway − coulomb) exp(−(q̇/v_s)²) + viscous |q̇|`, opposing the motion ([Armstrong 1994]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointFriction {
    /// Dry friction of a moving joint, N m.
    pub coulomb_n_m: f64,
    /// Smallest torque that moves a joint at rest, N m; at least `coulomb_n_m`.
    pub breakaway_n_m: f64,
    /// Stribeck velocity, rad/s.
    pub stribeck_rad_per_s: f64,
    /// Viscous friction coefficient, N m s/rad.
    pub viscous_n_m_s_per_rad: f64,
}

impl JointFriction {
    /// No friction.
    pub const NONE: Self = Self {
        coulomb_n_m: 0.0,
        breakaway_n_m: 0.0,
        stribeck_rad_per_s: 0.01,
        viscous_n_m_s_per_rad: 0.0,
    };

    /// Viscous friction alone, N m s/rad.
    #[must_use]
    pub const fn viscous(viscous_n_m_s_per_rad: f64) -> Self {
        Self {
            viscous_n_m_s_per_rad,
            ..Self::NONE
        }
    }

    /// Dry friction alone, N m, the same at rest and in motion.
    #[must_use]
    pub const fn coulomb(coulomb_n_m: f64) -> Self {
        Self {
            coulomb_n_m,
            breakaway_n_m: coulomb_n_m,
            ..Self::NONE
        }
    }

    /// Rejects NaN, negative friction, and a breakaway torque below the dry friction.
    ///
    /// # Errors
    /// The first invalid value.
    pub fn validate(&self) -> Result<(), ArgumentError> {
        non_negative("coulomb_n_m", self.coulomb_n_m)?;
        non_negative("breakaway_n_m", self.breakaway_n_m)?;
        let holds = self.breakaway_n_m >= self.coulomb_n_m;
        let wanted = "at least coulomb_n_m";
        that(holds, "breakaway_n_m", self.breakaway_n_m, wanted)?;
        positive("stribeck_rad_per_s", self.stribeck_rad_per_s)?;
        non_negative("viscous_n_m_s_per_rad", self.viscous_n_m_s_per_rad)?;
        Ok(())
    }

    /// Magnitude of the dry friction at a speed, N m, without the viscous part.
    #[must_use]
    pub fn dry_n_m(&self, qd_rad_per_s: f64) -> f64 {
        let excess = self.breakaway_n_m - self.coulomb_n_m;
        if excess == 0.0 {
            return self.coulomb_n_m;
        }
        let share = qd_rad_per_s / self.stribeck_rad_per_s;
        self.coulomb_n_m + excess * (-share * share).exp()
    }
}

/// Friction compensation by the arm's controller, which is active only while the joint moves.
///
/// iiwa users report that it is off at standstill, so that a small force does not start a motion ("dithering" by hand
/// helps). It is zero below `off_rad_per_s` and grows linearly up to `full_rad_per_s`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionCompensation {
    /// Fraction of the friction compensated in motion, 0 to 1. Default 0.8, an assumption; 0 disables compensation.
    pub share: f64,
    /// Speed up to which a joint counts as at rest, rad/s. Default 0.01, an assumption.
    pub off_rad_per_s: f64,
    /// Speed from which compensation is full, rad/s; above `off_rad_per_s`. Default 0.05, an assumption.
    pub full_rad_per_s: f64,
}

impl Default for FrictionCompensation {
    fn default() -> Self {
        Self {
            share: 0.8,
            off_rad_per_s: 0.01,
            full_rad_per_s: 0.05,
        }
    }
}

impl FrictionCompensation {
    pub(super) fn validate(&self) -> Result<(), ArgumentError> {
        let what = "friction compensation share";
        within(what, self.share, 0.0..=1.0, "0 to 1")?;
        non_negative("off_rad_per_s", self.off_rad_per_s)?;
        let above = self.full_rad_per_s > self.off_rad_per_s && self.full_rad_per_s.is_finite();
        let wanted = "above off_rad_per_s";
        that(above, "full_rad_per_s", self.full_rad_per_s, wanted)?;
        Ok(())
    }

    /// Torque that the controller adds, N m.
    #[must_use]
    pub fn torque_n_m(&self, friction: &JointFriction, qd_rad_per_s: f64) -> f64 {
        let speed = qd_rad_per_s.abs();
        let reach = (speed - self.off_rad_per_s) / (self.full_rad_per_s - self.off_rad_per_s);
        let known = friction.dry_n_m(speed) + friction.viscous_n_m_s_per_rad * speed;
        (self.share * reach.clamp(0.0, 1.0) * known).copysign(qd_rad_per_s)
    }
}
