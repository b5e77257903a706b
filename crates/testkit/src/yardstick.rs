//! Check that the machine was quiet while tables were measured.

use crate::stats::quantile;
use std::fmt;
use std::hint::black_box;
use std::time::Instant;

/// A fixed arithmetic loop, timed repeatedly beside the tables.
///
/// Its minimum time identifies the machine's speed, so that two runs can be compared. On a quiet machine the other times are
/// close to the minimum; the 99th percentile shows other load.
#[derive(Debug, Clone, Default)]
pub struct Yardstick {
    samples_ns: Vec<f64>,
}

/// Limits for a quiet machine: median and p99 relative to the minimum.
const QUIET: [f64; 2] = [1.1, 2.0];
/// Runs of one measurement, and steps of the loop: some 60 us.
const RUNS: usize = 200;
const STEPS: usize = 20_000;

impl Yardstick {
    /// Times the loop 200 times, which takes about 12 ms.
    pub fn measure(&mut self) {
        for _ in 0..RUNS {
            let start = Instant::now();
            black_box(work(black_box(0.3)));
            self.samples_ns.push(start.elapsed().as_nanos() as f64);
        }
    }

    /// Minimum time, ns, then median and 99th percentile relative to it; NaN before any measurement.
    #[must_use]
    pub fn spread(&self) -> [f64; 3] {
        let mut sorted = self.samples_ns.clone();
        sorted.sort_by(f64::total_cmp);
        let least = quantile(&sorted, 0.0);
        [
            least,
            quantile(&sorted, 0.5) / least,
            quantile(&sorted, 0.99) / least,
        ]
    }

    /// Was the machine quiet? False before any measurement.
    #[must_use]
    pub fn is_quiet(&self) -> bool {
        let [_, median, p99] = self.spread();
        median < QUIET[0] && p99 < QUIET[1]
    }
}

impl fmt::Display for Yardstick {
    /// One line of Markdown.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [least, median, p99] = self.spread();
        let verdict = if self.is_quiet() {
            "quiet"
        } else {
            "not quiet: times are too long"
        };
        write!(
            f,
            "Yardstick, a fixed loop timed between the tables: {:.1} us at the least, median {median:.2} and p99 {p99:.2} times that; \
             the machine was {verdict}",
            1e-3 * least
        )
    }
}

/// Each step depends on the previous one, so only the processor's clock matters.
fn work(mut x: f64) -> f64 {
    for _ in 0..STEPS {
        x = 3.7 * x * (1.0 - x);
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_neighbour_is_noticed() {
        let of = |samples: &[f64]| Yardstick {
            samples_ns: samples.to_vec(),
        };
        assert!(!Yardstick::default().is_quiet());
        let mut samples = vec![100.0; 1000];
        assert!(of(&samples).is_quiet());
        for slow in samples.iter_mut().step_by(20) {
            *slow = 400.0;
        }
        let busy = of(&samples);
        assert!(!busy.is_quiet());
        assert_eq!(busy.spread(), [100.0, 1.0, 4.0]);
        assert!(busy.to_string().contains("not quiet"));
    }
}
