//! A connection as bad as owners of real arms report it.

use crate::error::FriError;
use hwall_numeric::check::{non_negative, that};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// What goes wrong between a client and the controller, beside a [`LinkConfig`](super::LinkConfig). Nothing by default.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FaultConfig {
    /// Share of the cycles in which a burst of one to four answers begins that do not reach the controller. The client has sent them.
    pub bursts: f64,
    /// Share of the cycles that begin a stall: no answer reaches the controller for 20 to 200 ms, and the quality may fall below good.
    pub stalls: f64,
    /// Time stamps are off by at most this, either way, ms, at most 50.
    pub stamp_jitter_ms: f64,
    /// Seed.
    pub seed: u64,
}

/// Most answers of a burst.
const BURST: u32 = 4;
/// Shortest and longest stall, ms.
const STALL_MS: (u32, u32) = (20, 200);

#[derive(Debug)]
pub(super) struct Faults {
    config: FaultConfig,
    generator: Pcg64,
    /// Cycles in which no answer arrives any more.
    deaf: u32,
}

impl Faults {
    pub(super) fn new(config: FaultConfig) -> Result<Self, FriError> {
        for (what, share) in [("bursts", config.bursts), ("stalls", config.stalls)] {
            let in_range = (0.0..=1.0).contains(&share);
            that(in_range, what, share, "between 0 and 1")?;
        }
        let jitter = config.stamp_jitter_ms;
        that(jitter <= 50.0, "stamp_jitter_ms", jitter, "at most 50")?;
        non_negative("stamp_jitter_ms", jitter)?;
        Ok(Self {
            config,
            generator: Pcg64::seed_from_u64(config.seed),
            deaf: 0,
        })
    }

    /// One cycle of `period_ms`; the time stamp of its message is off by what is returned, s.
    pub(super) fn cycle(&mut self, period_ms: u32) -> f64 {
        self.deaf = self.deaf.saturating_sub(1);
        let [burst, stall, length, jitter] =
            std::array::from_fn(|_| self.generator.random::<f64>());
        if self.deaf == 0 && burst < self.config.bursts {
            self.deaf = 1 + (length * f64::from(BURST)) as u32;
        }
        if stall < self.config.stalls {
            let (least, most) = STALL_MS;
            let stall_ms = f64::from(least) + length * f64::from(most - least);
            self.deaf = self
                .deaf
                .max((stall_ms / f64::from(period_ms)).ceil() as u32);
        }
        1e-3 * self.config.stamp_jitter_ms * (2.0 * jitter - 1.0)
    }

    /// Do answers arrive in this cycle?
    pub(super) const fn is_deaf(&self) -> bool {
        self.deaf > 0
    }
}
