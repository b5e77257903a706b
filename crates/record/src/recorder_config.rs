//! Settings of a recorder.

use crate::error::RecordError;
use hwall::numeric::check::{non_negative, that};

/// What happens if the writing thread falls behind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overflow {
    /// The loop blocks. Use it for simulations, in which every step counts.
    Wait,
    /// Drops messages that do not fit, and records their number. Use it for loops that must not block.
    Drop,
}

/// Settings of a [`Recorder`](crate::Recorder).
#[derive(Debug, Clone, PartialEq)]
pub struct RecorderConfig {
    /// What happens if the writing thread falls behind; default [`Overflow::Drop`].
    pub overflow: Overflow,
    /// Largest number of messages that wait to be written; default 4096, four seconds of a loop at 1 kHz.
    pub capacity: usize,
    /// A chunk is written when it has this size, bytes; default 256 KiB.
    pub chunk_bytes: usize,
    /// A chunk is written after this time at the latest, s; a crash loses no more than this time. Default 0.5.
    pub flush_s: f64,
    /// Period of the views, s; default 0.01.
    pub view_period_s: f64,
    /// Every view whose number is a multiple of this is drawn in `/scene/now`; default 3; 0 draws none.
    pub scene_every: u32,
    /// Scenes with more triangles are not drawn; default 200,000.
    pub most_triangles: usize,
    /// Time of the arm's zero in the file, ns; default 0. Set it to the time since 1970 to sort recordings by date.
    pub epoch_ns: u64,
}

impl Default for RecorderConfig {
    fn default() -> Self {
        Self {
            overflow: Overflow::Drop,
            capacity: 4096,
            chunk_bytes: 256 * 1024,
            flush_s: 0.5,
            view_period_s: 0.01,
            scene_every: 3,
            most_triangles: 200_000,
            epoch_ns: 0,
        }
    }
}

impl RecorderConfig {
    /// For simulations: nothing is dropped.
    #[must_use]
    pub fn simulated() -> Self {
        Self {
            overflow: Overflow::Wait,
            ..Self::default()
        }
    }

    pub(crate) fn validate(&self) -> Result<(), RecordError> {
        non_negative("view_period_s", self.view_period_s)?;
        non_negative("flush_s", self.flush_s)?;
        that(self.flush_s <= 60.0, "flush_s", self.flush_s, "at most 60")?;
        for (what, count, most, range) in [
            ("capacity", self.capacity, 1 << 20, "1 to 2^20"),
            ("chunk_bytes", self.chunk_bytes, 1 << 28, "1 to 2^28"),
        ] {
            that((1..=most).contains(&count), what, count as f64, range)?;
        }
        Ok(())
    }
}
