//! Gradual, unnoticed turning of the avatar.

use crate::error::Result;
use crate::walking_thresholds::WalkingThresholds;
use hwall_numeric::check::{finite, non_negative, that};

/// Motion of a person at an instant: of the real body, and by joystick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PersonMotion {
    /// Turn of the real body or head about the vertical, rad/s, counter-clockwise from above.
    pub turn_rad_per_s: f64,
    /// Speed of the real body, m/s.
    pub speed_m_per_s: f64,
    /// Turn of the avatar by the joystick, rad/s.
    pub steered_turn_rad_per_s: f64,
    /// Speed of the avatar by the joystick, m/s.
    pub steered_speed_m_per_s: f64,
}

/// Settings of an [`AvatarTurn`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnConfig {
    /// Detection thresholds for a moving person.
    pub thresholds: WalkingThresholds,
    /// Share of a steered movement that counts as real, 0 to 1. Default 1, an assumption: the thresholds were measured
    /// with real movements and none exist for a joystick, but the visual motion is the same. 0 is the conservative
    /// choice.
    pub steered_share: f64,
    /// Largest rate, rad/s; default 15 degrees/s, an assumption.
    pub most_rad_per_s: f64,
    /// Largest total turn beyond the avatar's own heading, rad; default 30 degrees, an assumption: the person has to turn back
    /// the injected turn, and walks in the real room.
    pub most_rad: f64,
}

impl Default for TurnConfig {
    fn default() -> Self {
        Self {
            thresholds: WalkingThresholds::default(),
            steered_share: 1.0,
            most_rad_per_s: 15_f64.to_radians(),
            most_rad: 30_f64.to_radians(),
        }
    }
}

impl TurnConfig {
    /// Rejects settings out of range.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<()> {
        self.thresholds.validate()?;
        let share = self.steered_share;
        that(
            (0.0..=1.0).contains(&share),
            "steered_share",
            share,
            "0 to 1",
        )?;
        non_negative("most_rad_per_s", self.most_rad_per_s)?;
        non_negative("most_rad", self.most_rad)?;
        Ok(())
    }
}

/// Turns the avatar beyond the person's own turn, towards a wanted angle.
///
/// ```
/// use hwall_redirection::{AvatarTurn, PersonMotion, SampledOrientations, TurnConfig};
///
/// let snapped = SampledOrientations::default().snap(0.3)?;
/// let mut turn = AvatarTurn::new(TurnConfig::default())?;
/// let motion = PersonMotion { steered_turn_rad_per_s: -0.5, ..PersonMotion::default() };
/// let step = turn.step(snapped.turn_rad, &motion, 0.01)?;
/// assert!(step.injected_rad.abs() <= 0.5 * 0.33 * 0.01);
/// assert!((step.turned_rad + step.residual_rad - snapped.turn_rad).abs() < 1e-15);
/// # Ok::<(), hwall_redirection::RedirectionError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AvatarTurn {
    config: TurnConfig,
    turned_rad: f64,
}

/// Result of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnStep {
    /// Turn of this step, rad, counter-clockwise from above.
    pub injected_rad: f64,
    /// Turn since the beginning, rad.
    pub turned_rad: f64,
    /// Remaining part of the wanted turn, rad.
    pub residual_rad: f64,
}

impl AvatarTurn {
    /// Starts without a turn.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(config: TurnConfig) -> Result<Self> {
        config.validate()?;
        Ok(Self {
            config,
            turned_rad: 0.0,
        })
    }

    /// The settings.
    #[must_use]
    pub const fn config(&self) -> &TurnConfig {
        &self.config
    }

    /// Turn since the beginning, rad.
    #[must_use]
    pub const fn turned_rad(&self) -> f64 {
        self.turned_rad
    }

    /// Turns towards `wanted_rad` (relative to the avatar's own heading), as far as a movement lasting `dt_s` hides it.
    ///
    /// An error changes nothing. Does not allocate.
    ///
    /// # Errors
    /// NaN, infinity, a negative time.
    pub fn step(&mut self, wanted_rad: f64, motion: &PersonMotion, dt_s: f64) -> Result<TurnStep> {
        finite("wanted_rad", wanted_rad)?;
        non_negative("dt_s", dt_s)?;
        let [least, most] = self.rates_rad_per_s(motion)?;
        let end = wanted_rad.clamp(-self.config.most_rad, self.config.most_rad);
        let injected_rad = (end - self.turned_rad).min(most * dt_s).max(least * dt_s);
        self.turned_rad += injected_rad;
        Ok(TurnStep {
            injected_rad,
            turned_rad: self.turned_rad,
            residual_rad: wanted_rad - self.turned_rad,
        })
    }

    /// Smallest (at most 0) and largest (at least 0) unnoticed rate, rad/s.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn rates_rad_per_s(&self, motion: &PersonMotion) -> Result<[f64; 2]> {
        let share = self.config.steered_share;
        finite("turn_rad_per_s", motion.turn_rad_per_s)?;
        finite("speed_m_per_s", motion.speed_m_per_s)?;
        let steered_turn = share * finite("steered_turn_rad_per_s", motion.steered_turn_rad_per_s)?;
        let steered_speed = share * finite("steered_speed_m_per_s", motion.steered_speed_m_per_s)?;
        let thresholds = &self.config.thresholds;
        let turn = motion.turn_rad_per_s + steered_turn;
        let speed = motion.speed_m_per_s.abs() + steered_speed.abs();
        let [least, most] = thresholds.turn_rates_rad_per_s(turn, speed)?;
        let cap = self.config.most_rad_per_s;
        Ok([least.max(-cap), most.min(cap)])
    }
}
