//! Timing of calls, with the tail, which matters in a 1 kHz loop.

use crate::stats::quantile;
use std::{
    hint::black_box,
    sync::OnceLock,
    time::{Duration, Instant},
};

/// Nanoseconds per call over `count` samples; NaN without samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// Half of the samples took at most this.
    pub median_ns: f64,
    /// 99 % of the samples took at most this.
    pub p99_ns: f64,
    /// The fastest sample.
    pub min_ns: f64,
    /// The slowest sample.
    pub max_ns: f64,
    /// Number of samples: calls, or batches of calls.
    pub count: usize,
}

impl Timing {
    /// From times per call, ns.
    #[must_use]
    pub fn from_samples_ns(mut samples: Vec<f64>) -> Self {
        samples.sort_by(f64::total_cmp);
        Self {
            median_ns: quantile(&samples, 0.5),
            p99_ns: quantile(&samples, 0.99),
            min_ns: quantile(&samples, 0.0),
            max_ns: quantile(&samples, 1.0),
            count: samples.len(),
        }
    }
}

/// Times each of the calls `f(0) … f(n - 1)` separately: for calls above about 1 µs, and if the tail
/// matters.
///
/// The cost of reading the clock (about 20 to 50 ns) is subtracted, but its jitter stays; below 1 µs use
/// [`time_batches`].
/// There is no warm-up: the first call counts. Dropping the result is part of the call.
pub fn time_each<T>(n: usize, mut f: impl FnMut(usize) -> T) -> Timing {
    let sample = |i| per_call_ns(1, || drop(black_box(f(i))));
    Timing::from_samples_ns((0..n).map(sample).collect())
}

/// Times whole batches of calls: for calls below about 1 µs.
///
/// Calls `f(i)` with `i` counting through all batches, from 0 to `batches · per_batch - 1`, after
/// one batch of warm-up (again from 0). Median and p99 are over batches, so the tail of single calls is
/// averaged away.
/// Choose `per_batch` for at least 10 µs per batch.
pub fn time_batches<T>(batches: usize, per_batch: usize, mut f: impl FnMut(usize) -> T) -> Timing {
    if per_batch == 0 {
        return Timing::from_samples_ns(Vec::new());
    }
    let mut batch = |b: usize| {
        for i in b * per_batch..(b + 1) * per_batch {
            black_box(f(black_box(i)));
        }
    };
    if batches > 0 {
        batch(0);
    }
    Timing::from_samples_ns(
        (0..batches)
            .map(|b| per_call_ns(per_batch, || batch(b)))
            .collect(),
    )
}

fn per_call_ns(calls: usize, f: impl FnOnce()) -> f64 {
    let overhead = clock_overhead();
    let start = Instant::now();
    f();
    start.elapsed().saturating_sub(overhead).as_nanos() as f64 / calls as f64
}

/// Median time between two neighbouring readings of the clock.
fn clock_overhead() -> Duration {
    static OVERHEAD: OnceLock<Duration> = OnceLock::new();
    *OVERHEAD.get_or_init(|| {
        let mut readings: Vec<Duration> = (0..2001).map(|_| Instant::now().elapsed()).collect();
        readings.sort_unstable();
        readings[readings.len() / 2]
    })
}
