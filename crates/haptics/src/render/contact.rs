//! When does a force on the board count as a touch?

use crate::error::HapticsError;
use hwall_numeric::check::{finite, non_negative, positive, that};

/// Settings of [`ContactDetector`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactConfig {
    /// A normal force above this begins a contact, N; default 3, as in the dissertation.
    pub on_n: f64,
    /// A normal force below this may end it, N; default 1.5; at most `on_n`.
    pub off_n: f64,
    /// For how long the force must stay below `off_n` to end the contact, s; default 0.05.
    pub dwell_s: f64,
}

impl Default for ContactConfig {
    fn default() -> Self {
        Self {
            on_n: 3.0,
            off_n: 1.5,
            dwell_s: 0.05,
        }
    }
}

impl ContactConfig {
    /// Rejects thresholds that are not positive or in the wrong order, and a negative dwell.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("on_n", self.on_n)?;
        positive("off_n", self.off_n)?;
        non_negative("dwell_s", self.dwell_s)?;
        that(self.off_n <= self.on_n, "off_n", self.off_n, "at most on_n")?;
        Ok(())
    }
}

/// Touched or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ContactState {
    /// Nobody presses the board.
    NonContact,
    /// The board is pressed.
    Contact {
        /// When the force first exceeded the threshold, s.
        since_s: f64,
    },
}

/// The dwell may end this much early, s: Unix times are rounded to 0.2 us, which must not decide in which step it ends.
const ROUNDING_S: f64 = 1e-6;

/// Two thresholds and a dwell: a force that varies around either threshold counts as one contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactDetector {
    config: ContactConfig,
    state: ContactState,
    /// Since when the force has stayed below `off_n`, s.
    below_since_s: Option<f64>,
}

impl ContactDetector {
    /// Starts without contact.
    ///
    /// # Errors
    /// As for [`ContactConfig::validate`].
    pub fn new(config: ContactConfig) -> Result<Self, HapticsError> {
        config.validate()?;
        Ok(Self {
            config,
            state: ContactState::NonContact,
            below_since_s: None,
        })
    }

    /// The state after the last step.
    #[must_use]
    pub const fn state(&self) -> ContactState {
        self.state
    }

    /// Takes the next sample: time in s, force pressing the board in N.
    ///
    /// A clock that runs backwards restarts the dwell and changes nothing else.
    ///
    /// # Errors
    /// NaN or infinity; the state then stays as it was.
    pub fn step(&mut self, t_s: f64, normal_force_n: f64) -> Result<ContactState, HapticsError> {
        finite("t_s", t_s)?;
        finite("normal_force_n", normal_force_n)?;
        match self.state {
            ContactState::NonContact if normal_force_n > self.config.on_n => {
                self.state = ContactState::Contact { since_s: t_s };
                self.below_since_s = None;
            }
            ContactState::Contact { .. } if normal_force_n < self.config.off_n => {
                let since_s = self
                    .below_since_s
                    .filter(|since_s| *since_s <= t_s)
                    .unwrap_or(t_s);
                self.below_since_s = Some(since_s);
                if t_s - since_s + ROUNDING_S >= self.config.dwell_s {
                    self.state = ContactState::NonContact;
                }
            }
            _ => self.below_since_s = None,
        }
        Ok(self.state)
    }
}
