//! Is an input still credible?

use crate::error::HapticsError;
use hwall_kinematics::MOST_JOINTS;
use hwall_numeric::check::{positive, that};

/// When an input no longer counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelWatch {
    /// Largest age, s, into the past and into the future.
    pub max_age_s: f64,
    /// Largest change of any value between two samples, in addition to `rate_per_s`; in the input's unit, infinite for none.
    pub jump: f64,
    /// Fastest possible change, unit/s.
    pub rate_per_s: f64,
    /// New samples that stay bit-identical for longer than this are frozen, s; `None`: no check.
    pub frozen_s: Option<f64>,
}

impl ChannelWatch {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("max_age_s", self.max_age_s)?;
        that(self.jump > 0.0, "jump", self.jump, "positive")?;
        let valid = self.rate_per_s >= 0.0;
        that(valid, "rate_per_s", self.rate_per_s, "at least 0")?;
        if let Some(frozen_s) = self.frozen_s {
            positive("frozen_s", frozen_s)?;
        }
        Ok(())
    }
}

/// What is wrong with an input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WatchFault {
    /// NaN or an infinity, in the values or the stamp.
    NonFinite,
    /// Too old, or from the future.
    Stale {
        /// s; negative from the future.
        age_s: f64,
    },
    /// It jumped.
    Jump {
        /// By how much, in the input's unit.
        by: f64,
    },
    /// It does not change although it should.
    Frozen {
        /// For how long, s.
        for_s: f64,
    },
}

/// Watches one input of at most seven numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Watch {
    limits: ChannelWatch,
    last: Option<Sample>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Sample {
    values: [f64; MOST_JOINTS],
    stamp_s: f64,
    /// Time stamp of the first of the identical samples.
    same_since_s: f64,
}

impl Watch {
    /// Nothing seen so far.
    ///
    /// # Errors
    /// As [`ChannelWatch::validate`].
    pub fn new(limits: ChannelWatch) -> Result<Self, HapticsError> {
        limits.validate()?;
        Ok(Self { limits, last: None })
    }

    /// Forgets the last sample: the next one may have any value.
    pub fn forget(&mut self) {
        self.last = None;
    }

    /// Time stamp of the newest finite sample, s.
    #[must_use]
    pub fn last_stamp_s(&self) -> Option<f64> {
        self.last.map(|sample| sample.stamp_s)
    }

    /// Checks a sample. `should_change`: does something move that this input would show? Only then can it be frozen.
    ///
    /// Every finite sample is stored, also a faulty one: an input that jumps and then stays is sound again. A sample handed in again (same stamp)
    /// ages, but is not frozen.
    ///
    /// # Errors
    /// The first fault found: not finite, stale, jumped, frozen. Values beyond the seventh are only checked to be finite.
    pub fn check(
        &mut self,
        now_s: f64,
        stamp_s: f64,
        values: &[f64],
        should_change: bool,
    ) -> Result<(), WatchFault> {
        if !stamp_s.is_finite() || values.iter().any(|v| !v.is_finite()) {
            return Err(WatchFault::NonFinite);
        }
        let mut new = Sample {
            values: [0.0; MOST_JOINTS],
            stamp_s,
            same_since_s: stamp_s,
        };
        for (to, from) in new.values.iter_mut().zip(values) {
            *to = *from;
        }
        let age_s = now_s - stamp_s;
        let mut fault = None;
        if let Some(last) = self.last {
            let elapsed_s = stamp_s - last.stamp_s;
            let by = (0..MOST_JOINTS).fold(0.0, |most: f64, i| {
                most.max((new.values[i] - last.values[i]).abs())
            });
            if by > self.limits.jump + self.limits.rate_per_s * elapsed_s.max(0.0) {
                fault = Some(WatchFault::Jump { by });
            }
            let same =
                (0..MOST_JOINTS).all(|i| new.values[i].to_bits() == last.values[i].to_bits());
            if same && should_change && elapsed_s >= 0.0 {
                new.same_since_s = last.same_since_s;
            }
        }
        self.last = Some(new);
        if age_s.is_nan() || age_s.abs() > self.limits.max_age_s {
            return Err(WatchFault::Stale { age_s });
        }
        if let Some(fault) = fault {
            return Err(fault);
        }
        let for_s = new.stamp_s - new.same_since_s;
        match self.limits.frozen_s {
            Some(most_s) if for_s > most_s => Err(WatchFault::Frozen { for_s }),
            _ => Ok(()),
        }
    }

    /// The input is missing in this cycle: once seen, it ages.
    ///
    /// # Errors
    /// Stale.
    pub fn missing(&self, now_s: f64) -> Result<(), WatchFault> {
        let Some(last) = self.last else {
            return Ok(());
        };
        let age_s = now_s - last.stamp_s;
        if age_s.abs() <= self.limits.max_age_s {
            Ok(())
        } else {
            Err(WatchFault::Stale { age_s })
        }
    }
}
