//! Estimates the present force from noisy, delayed measurements.

/// Two equal first-order low-passes in series, with linear extrapolation.
///
/// Each has half of the delay; the extrapolation compensates it, so a constant force and a ramp are exact.
#[derive(Debug, Clone, Copy)]
pub(in crate::render) struct ForceLead<const N: usize> {
    first: [f64; N],
    second: [f64; N],
    /// Slope of the second low-pass, per s.
    slope: [f64; N],
}

impl<const N: usize> ForceLead<N> {
    /// No force, now or before.
    pub(in crate::render) const NONE: Self = Self {
        first: [0.0; N],
        second: [0.0; N],
        slope: [0.0; N],
    };

    /// Takes one measurement. `filter_s`: delay of both low-passes together; zero: no filter, and no slope.
    pub(in crate::render) fn step(&self, measured: &[f64; N], filter_s: f64, dt_s: f64) -> Self {
        if filter_s == 0.0 {
            return Self {
                first: *measured,
                second: *measured,
                slope: [0.0; N],
            };
        }
        let half_s = 0.5 * filter_s;
        let share = -(-dt_s / half_s).exp_m1();
        let first = std::array::from_fn(|i| self.first[i] + share * (measured[i] - self.first[i]));
        let second: [f64; N] =
            std::array::from_fn(|i| self.second[i] + share * (first[i] - self.second[i]));
        Self {
            first,
            second,
            slope: std::array::from_fn(|i| (first[i] - second[i]) / half_s),
        }
    }

    /// Delay of both low-passes together at a sampling period, s.
    pub(in crate::render) fn lag_s(filter_s: f64, dt_s: f64) -> f64 {
        if filter_s == 0.0 {
            return 0.0;
        }
        let share = -(-2.0 * dt_s / filter_s).exp_m1();
        2.0 * dt_s * (1.0 / share - 1.0)
    }

    /// The filtered force.
    pub(in crate::render) const fn value(&self) -> &[f64; N] {
        &self.second
    }

    /// The force this long after the [filtered](Self::value) one, extrapolated linearly.
    pub(in crate::render) fn after(&self, by_s: f64) -> [f64; N] {
        std::array::from_fn(|i| self.second[i] + by_s * self.slope[i])
    }
}
