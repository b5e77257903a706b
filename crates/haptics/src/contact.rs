//! Is the board being touched? A state machine on the normal force.

use crate::HapticsError;

/// Thresholds of [`ContactDetector`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactConfig {
    /// A press above this begins a contact, N. Default 3 (dissertation, III.E).
    pub on_n: f64,
    /// A press below this may end it, N. Default 1.5; at most `on_n`.
    pub off_n: f64,
    /// It ends after staying below for this long, s. Default 0.05: a trembling finger is one touch.
    pub dwell_s: f64,
}

impl Default for ContactConfig {
    fn default() -> Self {
        Self { on_n: 3.0, off_n: 1.5, dwell_s: 0.05 }
    }
}

impl ContactConfig {
    fn validate(&self) -> Result<(), HapticsError> {
        let check = |what: &'static str, value: f64, good: bool, wanted: &'static str| {
            if good { Ok(()) } else { Err(HapticsError::Parameter { what, value, wanted }) }
        };
        check("on_n", self.on_n, self.on_n > 0.0 && self.on_n.is_finite(), "positive")?;
        check("off_n", self.off_n, self.off_n >= 0.0 && self.off_n <= self.on_n, "in [0, on_n]")?;
        check("dwell_s", self.dwell_s, self.dwell_s >= 0.0 && self.dwell_s.is_finite(), "at least 0")
    }
}

/// Hysteresis and dwell between free and touched.
#[derive(Debug, Clone, Copy)]
pub struct ContactDetector {
    config: ContactConfig,
    since_s: Option<f64>,
    below_since_s: Option<f64>,
}

impl ContactDetector {
    /// Starts untouched.
    ///
    /// # Errors
    /// Thresholds that are NaN, negative or in the wrong order.
    pub fn new(config: ContactConfig) -> Result<Self, HapticsError> {
        config.validate()?;
        Ok(Self { config, since_s: None, below_since_s: None })
    }

    /// Takes the force that presses the board (N, positive into it) and says since when it is
    /// touched, s. A force that is NaN changes nothing.
    pub fn step(&mut self, now_s: f64, normal_force_n: f64) -> Option<f64> {
        if normal_force_n > self.config.on_n {
            self.since_s.get_or_insert(now_s);
        }
        if normal_force_n < self.config.off_n {
            let below_since = *self.below_since_s.get_or_insert(now_s);
            if now_s - below_since >= self.config.dwell_s {
                self.since_s = None;
            }
        } else if normal_force_n >= self.config.off_n {
            self.below_since_s = None;
        }
        self.since_s
    }

    /// Since when the board is touched, s.
    #[must_use]
    pub const fn since_s(&self) -> Option<f64> {
        self.since_s
    }
}
