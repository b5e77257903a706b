//! The noise of a tracker, measured while it runs.

/// Sizes kept; odd, so that the median is one of them. Two thirds of a second at 90 Hz.
const KEPT: usize = 61;

/// The median of the newest differences between samples.
///
/// What moves fast for a short time, an eye in flight or a hand that sets off, hardly changes it; so it tells the noise from sample
/// to sample. Errors that last longer than a sample are not in it. Nothing is allocated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MedianSize {
    sizes: [f64; KEPT],
    next: usize,
    median: f64,
}

impl MedianSize {
    /// Starts as if this had been the size of all differences.
    pub(crate) const fn new(assumed: f64) -> Self {
        Self {
            sizes: [assumed; KEPT],
            next: 0,
            median: assumed,
        }
    }

    pub(crate) const fn median(&self) -> f64 {
        self.median
    }

    /// Takes the size of the next difference; one that is not finite is passed over.
    pub(crate) fn add(&mut self, size: f64) {
        if !size.is_finite() {
            return;
        }
        self.sizes[self.next] = size;
        self.next = (self.next + 1) % KEPT;
        let mut sorted = self.sizes;
        let (_, median, _) = sorted.select_nth_unstable_by(KEPT / 2, f64::total_cmp);
        self.median = *median;
    }
}
