//! A connection as bad as owners of real arms report it.

use crate::codec::ConnectionQuality;
use crate::error::FriError;
use hwall_numeric::check::{non_negative, within};
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
    /// Share of the cycles whose answer comes one to three cycles late, unless another one is held back already. What a real controller
    /// does with it is not published. Here it is always said to have arrived, and its command takes effect half of the times.
    pub late: f64,
    /// Share of the cycles that end commanding for a while: half of the times the quality is at most FAIR for 0.1 to 0.5 s, half of the
    /// times the application ends its motion. Commanding begins again by itself.
    pub leaves: f64,
    /// The robot's information has numbers that no version knows (99) for safety, drives, operation and control.
    pub unknown_enumerations: bool,
    /// Seed.
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

/// Most answers of a burst.
const BURST: u32 = 4;
/// Shortest and longest stall, ms.
const STALL_MS: (u32, u32) = (20, 200);
/// Most cycles that an answer is late.
const LATE: u32 = 3;
/// Shortest and longest fall of the quality, ms.
const FALL_MS: (u32, u32) = (100, 500);

#[derive(Debug)]
pub(super) struct Faults {
    config: FaultConfig,
    generator: Pcg64,
    /// Draws the faults added later, so that the older ones stay the same for a seed.
    later: Pcg64,
    /// Cycles in which no answer arrives any more.
    deaf: u32,
    /// Cycles in which the quality is at most FAIR.
    fallen: u32,
    leaves: bool,
    delay: Option<Delay>,
}

/// What happens to the answer of a cycle that is late.
#[derive(Debug, Clone, Copy)]
pub(super) struct Delay {
    pub(super) cycles: u32,
    /// Does its command take effect when it comes?
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

    /// From the next cycle on; the seed stays.
    pub(super) fn set(&mut self, config: FaultConfig) -> Result<(), FriError> {
        config.validate()?;
        self.config = config;
        Ok(())
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

    /// Do no answers arrive in this cycle?
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

    /// The quality that is said instead of this one.
    pub(super) fn said(&self, quality: ConnectionQuality) -> ConnectionQuality {
        match self.fallen {
            0 => quality,
            _ => quality.min(ConnectionQuality::Fair),
        }
    }
}

/// Cycles of a time between these two, at least one.
fn cycles((least_ms, most_ms): (u32, u32), share: f64, period_ms: u32) -> u32 {
    let ms = f64::from(least_ms) + share * f64::from(most_ms - least_ms);
    (ms / f64::from(period_ms)).ceil() as u32
}
