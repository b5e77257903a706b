//! A connection as bad as users of real arms report.

use crate::codec::ConnectionQuality;
use crate::error::FriError;
use hwall_numeric::check::{non_negative, within};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Faults between a client and the controller, in addition to a [`LinkConfig`](super::LinkConfig). None by default.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FaultConfig {
    /// Share of the cycles that begin a burst of one to four answers that the client sent but that do not reach the controller.
    pub bursts: f64,
    /// Share of the cycles that begin a stall: no answer reaches the controller for 20 to 200 ms, and the quality may fall below good.
    pub stalls: f64,
    /// Largest error of time stamps, in both directions, ms, at most 50.
    pub stamp_jitter_ms: f64,
    /// Share of the cycles whose answer arrives one to three cycles late, unless another one is held back already. How a real controller treats such
    /// an answer is not published. Here it is always acknowledged, and in half of the cases its command takes effect.
    pub late: f64,
    /// Share of the cycles that interrupt commanding: in half of the cases the quality is at most FAIR for 0.1 to 0.5 s, otherwise the application
    /// ends its motion. Commanding begins again by itself.
    pub leaves: f64,
    /// The robot's information contains an undefined number (99) for safety, drives, operation and control.
    pub unknown_enumerations: bool,
    /// Seed of the random generator.
    pub seed: u64,
}

impl FaultConfig {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first of them; NaN is outside every range.
    pub fn validate(&self) -> Result<(), FriError> {
        for (what, share) in [
            ("bursts", self.bursts),
            ("stalls", self.stalls),
            ("late", self.late),
            ("leaves", self.leaves),
        ] {
            within(what, share, 0.0..=1.0, "between 0 and 1")?;
        }
        let jitter = self.stamp_jitter_ms;
        within("stamp_jitter_ms", jitter, ..=50.0, "at most 50")?;
        non_negative("stamp_jitter_ms", jitter)?;
        Ok(())
    }
}

/// Most answers in a burst.
const BURST: u32 = 4;
/// Shortest and longest stall, ms.
const STALL_MS: (u32, u32) = (20, 200);
/// Longest delay of a late answer, cycles.
const LATE: u32 = 3;
/// Shortest and longest drop of the quality, ms.
const FALL_MS: (u32, u32) = (100, 500);

#[derive(Debug)]
pub(super) struct Faults {
    config: FaultConfig,
    generator: Pcg64,
    /// A separate generator for faults added later, so that a seed still gives the same older faults.
    later: Pcg64,
    /// Remaining cycles in which no answer arrives.
    deaf: u32,
    /// Remaining cycles in which the quality is at most FAIR.
    fallen: u32,
    leaves: bool,
    delay: Option<Delay>,
}

/// The fate of a late answer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Delay {
    pub(super) cycles: u32,
    /// Does its command take effect on arrival?
    pub(super) is_used: bool,
}

impl Faults {
    pub(super) fn new(config: FaultConfig) -> Result<Self, FriError> {
        config.validate()?;
        Ok(Self {
            config,
            generator: Pcg64::seed_from_u64(config.seed),
            later: Pcg64::seed_from_u64(config.seed.wrapping_add(1)),
            deaf: 0,
            fallen: 0,
            leaves: false,
            delay: None,
        })
    }

    /// Applies from the next cycle on; the seed stays.
    pub(super) fn set(&mut self, config: FaultConfig) -> Result<(), FriError> {
        config.validate()?;
        self.config = config;
        Ok(())
    }

    /// Draws the faults of one cycle of `period_ms`; returns the error of its message's time stamp, s.
    pub(super) fn cycle(&mut self, period_ms: u32) -> f64 {
        self.deaf = self.deaf.saturating_sub(1);
        let [burst, stall, length, jitter] =
            std::array::from_fn(|_| self.generator.random::<f64>());
        if self.deaf == 0 && burst < self.config.bursts {
            self.deaf = 1 + (length * f64::from(BURST)) as u32;
        }
        if stall < self.config.stalls {
            self.deaf = self.deaf.max(cycles(STALL_MS, length, period_ms));
        }
        self.later_faults(period_ms);
        1e-3 * self.config.stamp_jitter_ms * (2.0 * jitter - 1.0)
    }

    fn later_faults(&mut self, period_ms: u32) {
        let [late, by, used, leave, falls, length] =
            std::array::from_fn(|_| self.later.random::<f64>());
        self.delay = (late < self.config.late).then_some(Delay {
            cycles: 1 + (by * f64::from(LATE)) as u32,
            is_used: used < 0.5,
        });
        let leaves = leave < self.config.leaves;
        self.leaves = leaves && falls < 0.5;
        self.fallen = match leaves && !self.leaves {
            true => cycles(FALL_MS, length, period_ms),
            false => self.fallen.saturating_sub(1),
        };
    }

    /// Do answers fail to arrive in this cycle?
    pub(super) const fn is_deaf(&self) -> bool {
        self.deaf > 0
    }

    /// Is the answer of this cycle late?
    pub(super) const fn delay(&self) -> Option<Delay> {
        self.delay
    }

    /// Does the application end its motion in this cycle?
    pub(super) const fn leaves(&self) -> bool {
        self.leaves
    }

    /// The quality to report instead of this one.
    pub(super) fn said(&self, quality: ConnectionQuality) -> ConnectionQuality {
        match self.fallen {
            0 => quality,
            _ => quality.min(ConnectionQuality::Fair),
        }
    }
}

/// Number of cycles of a random duration between these two, at least one.
fn cycles((least_ms, most_ms): (u32, u32), share: f64, period_ms: u32) -> u32 {
    let ms = f64::from(least_ms) + share * f64::from(most_ms - least_ms);
    (ms / f64::from(period_ms)).ceil() as u32
}
