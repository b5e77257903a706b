//! How much an eye tracker trembles, measured while it runs.

/// Differences kept; odd, so that the median is one of them. Two thirds of a second at 90 Hz.
const KEPT: usize = 61;

/// The noise of single directions, from the differences between successive ones.
///
/// The median hardly notices saccades, which are a small share of all samples. It is the noise from sample to sample;
/// errors that last longer than a sample (drift, calibration) are not in it.
#[derive(Debug, Clone, Copy)]
pub(super) struct GazeNoise {
    differences_rad: [f64; KEPT],
    next: usize,
    sd_rad: f64,
}

/// The length of the difference of two directions, each with unit noise in two directions, has this median: √2 times the
/// median √(2 ln 2) of a Rayleigh distribution.
const MEDIAN_OF_DIFFERENCE: f64 = 1.665_109_222_315_395_4;

impl GazeNoise {
    /// Starts from an assumed standard deviation in each of two directions, rad.
    pub(super) fn new(assumed_rad: f64) -> Self {
        Self {
            differences_rad: [assumed_rad * MEDIAN_OF_DIFFERENCE; KEPT],
            next: 0,
            sd_rad: assumed_rad,
        }
    }

    /// Standard deviation of one direction in each of two directions, rad.
    pub(super) const fn sd_rad(&self) -> f64 {
        self.sd_rad
    }

    /// Takes the angle between two successive directions, rad.
    pub(super) fn add(&mut self, difference_rad: f64) {
        if !difference_rad.is_finite() {
            return;
        }
        self.differences_rad[self.next] = difference_rad;
        self.next = (self.next + 1) % KEPT;
        let mut sorted = self.differences_rad;
        let (_, median, _) = sorted.select_nth_unstable_by(KEPT / 2, f64::total_cmp);
        self.sd_rad = *median / MEDIAN_OF_DIFFERENCE;
    }
}
