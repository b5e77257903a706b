//! The force that acts now, from measurements that are noisy and late.

/// Two equal first-order low passes in a row, and the straight line through what they say.
///
/// Each has half of the delay; the line makes up for the delay, so a constant force and one that changes evenly come out right.
#[derive(Debug, Clone, Copy)]
pub(in crate::render) struct ForceLead<const N: usize> {
    first: [f64; N],
    second: [f64; N],
    /// Change of the second one, per s.
    slope: [f64; N],
}

impl<const N: usize> ForceLead<N> {
    /// Nothing acts, and nothing did.
    pub(in crate::render) const NONE: Self = Self {
        first: [0.0; N],
        second: [0.0; N],
        slope: [0.0; N],
    };

    /// One measurement later. `filter_s`: delay of both together; zero is no filter, and no slope.
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

    /// Delay of both together at a sampling period, s.
    pub(in crate::render) fn lag_s(filter_s: f64, dt_s: f64) -> f64 {
        if filter_s == 0.0 {
            return 0.0;
        }
        let share = -(-2.0 * dt_s / filter_s).exp_m1();
        2.0 * dt_s * (1.0 / share - 1.0)
    }

    /// The newest, filtered.
    pub(in crate::render) const fn value(&self) -> &[f64; N] {
        &self.second
    }

    /// As it will be this long after what was [filtered](Self::value), if it goes on changing like that.
    pub(in crate::render) fn after(&self, by_s: f64) -> [f64; N] {
        std::array::from_fn(|i| self.second[i] + by_s * self.slope[i])
    }
}
