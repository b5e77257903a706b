//! The direction of a finger's scan.

use crate::error::Result;
use glam::DVec2;
use hwall_numeric::check::{finite, non_negative, positive};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Settings of [`ScanEstimator`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScanConfig {
    /// Time constant of the low pass on the finger's velocity, s; default 0.02. Above `least_speed_m_per_s` it is shorter, in inverse proportion to
    /// the speed.
    pub time_constant_s: f64,
    /// Below this speed the finger counts as resting and the direction is kept, m/s; default 0.01.
    pub least_speed_m_per_s: f64,
    /// Fastest turn of the direction, rad/s; default 6: a circle of 33 mm diameter at 0.1 m/s.
    pub turn_rad_per_s: f64,
}

impl Default for ScanConfig {
    fn default() -> Self {
        Self {
            time_constant_s: 0.02,
            least_speed_m_per_s: 0.01,
            turn_rad_per_s: 6.0,
        }
    }
}

impl ScanConfig {
    /// Rejects settings that are not positive.
    ///
    /// # Errors
    /// The first such setting.
    pub fn validate(&self) -> Result<()> {
        positive("time_constant_s", self.time_constant_s)?;
        positive("least_speed_m_per_s", self.least_speed_m_per_s)?;
        positive("turn_rad_per_s", self.turn_rad_per_s)?;
        Ok(())
    }
}

/// The direction of a scan in the plane of a surface, from the finger's velocity.
///
/// Low-passed, so that one bad sample does not turn it; limited in its rate; constant while the finger rests.
/// When the finger reverses, the direction flips at once instead of turning through half a circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScanEstimator {
    config: ScanConfig,
    direction_rad: f64,
    velocity_m_per_s: DVec2,
}

impl ScanEstimator {
    /// Expects a scan in this direction, rad from the plane's x axis towards its y axis.
    ///
    /// # Errors
    /// As [`ScanConfig::validate`]; a direction that is not finite.
    pub fn new(config: ScanConfig, direction_rad: f64) -> Result<Self> {
        config.validate()?;
        let mut estimator = Self {
            config,
            direction_rad: 0.0,
            velocity_m_per_s: DVec2::ZERO,
        };
        estimator.expect(direction_rad)?;
        Ok(estimator)
    }

    /// Starts anew with an expected direction, rad.
    ///
    /// # Errors
    /// A direction that is not finite; the estimate then stays as it was.
    pub fn expect(&mut self, direction_rad: f64) -> Result<()> {
        finite("direction_rad", direction_rad)?;
        self.direction_rad = wrapped(direction_rad);
        self.velocity_m_per_s = DVec2::ZERO;
        Ok(())
    }

    /// Starts anew with the tangential velocity of the approach, unless it is below `least_speed_m_per_s`.
    ///
    /// # Errors
    /// A velocity that is not finite; the estimate then stays as it was.
    pub fn expect_from_approach(&mut self, velocity_m_per_s: DVec2) -> Result<()> {
        finite("speed of the approach", velocity_m_per_s.length())?;
        if velocity_m_per_s.length() >= self.config.least_speed_m_per_s {
            self.expect(velocity_m_per_s.to_angle())?;
        }
        Ok(())
    }

    /// Updates with the finger's velocity over the last `dt_s`; returns the direction, rad, from -π to π.
    ///
    /// # Errors
    /// NaN, infinity or a negative step; the estimate then stays as it was.
    pub fn step(&mut self, dt_s: f64, velocity_m_per_s: DVec2) -> Result<f64> {
        finite("speed of the finger", velocity_m_per_s.length())?;
        non_negative("dt_s", dt_s)?;
        // Noise turns a fast finger's direction less than a slow one's.
        let times = (self.velocity_m_per_s.length() / self.config.least_speed_m_per_s).max(1.0);
        let share = -(-dt_s * times / self.config.time_constant_s).exp_m1();
        self.velocity_m_per_s += share * (velocity_m_per_s - self.velocity_m_per_s);
        if self.velocity_m_per_s.length() >= self.config.least_speed_m_per_s {
            let mut turn = wrapped(self.velocity_m_per_s.to_angle() - self.direction_rad);
            if turn.abs() > FRAC_PI_2 {
                self.direction_rad = wrapped(self.direction_rad + PI);
                turn = wrapped(turn - PI);
            }
            let most = self.config.turn_rad_per_s * dt_s;
            self.direction_rad = wrapped(self.direction_rad + turn.clamp(-most, most));
        }
        Ok(self.direction_rad)
    }

    /// The finger's velocity with the noise of a resting finger removed, m/s: Wiener's estimate, for a noise of half the least speed.
    pub(super) fn velocity_m_per_s(&self) -> DVec2 {
        let noise = 0.5 * self.config.least_speed_m_per_s;
        let power = self.velocity_m_per_s.length_squared();
        self.velocity_m_per_s * (power / (power + noise * noise))
    }

    /// The direction, rad, from -π to π.
    #[must_use]
    pub const fn direction_rad(&self) -> f64 {
        self.direction_rad
    }
}

/// The angle wrapped to -π to π.
pub(super) fn wrapped(angle_rad: f64) -> f64 {
    angle_rad - TAU * (angle_rad / TAU).round()
}
