//! Online measurement of tracker noise.

/// Number of differences kept; odd, so that the median is one of them. Two thirds of a second at 90 Hz.
const KEPT: usize = 61;

/// Running median of the size of differences between samples.
///
/// Short fast motion, such as a saccade or a hand that starts, hardly changes it, so it measures the noise between samples. Errors that last longer
/// than a sample are not included. Allocation-free.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MedianSize {
    sizes: [f64; KEPT],
    next: usize,
    median: f64,
}

impl MedianSize {
    /// Starts as if all differences had this size.
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

    /// Takes the size of the next difference; ignores non-finite ones.
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
