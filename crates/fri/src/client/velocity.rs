//! Joint velocities from positions: the controller sends no velocities.

use std::f64::consts::TAU;

/// Differences of consecutive positions through a first-order low-pass.
///
/// Exact for steady motion; the delay is the time constant plus half a step. Noise of 1e-6 rad at 1 kHz becomes about 5e-4 rad/s at 50 Hz.
#[derive(Debug)]
pub(super) struct VelocityFilter {
    time_constant_s: f64,
    last_rad: Option<[f64; 7]>,
    velocity_rad_per_s: [f64; 7],
}

impl VelocityFilter {
    pub(super) fn new(hz: f64) -> Self {
        Self {
            time_constant_s: 1.0 / (TAU * hz),
            last_rad: None,
            velocity_rad_per_s: [0.0; 7],
        }
    }

    /// Positions `dt_s` after the last ones.
    pub(super) fn update(&mut self, q_rad: &[f64; 7], dt_s: f64) {
        if let Some(last_rad) = self.last_rad.replace(*q_rad)
            && dt_s > 0.0
        {
            let share = dt_s / (dt_s + self.time_constant_s);
            for i in 0..7 {
                let difference = (q_rad[i] - last_rad[i]) / dt_s;
                self.velocity_rad_per_s[i] += share * (difference - self.velocity_rad_per_s[i]);
            }
        }
    }

    pub(super) const fn reset(&mut self) {
        self.last_rad = None;
        self.velocity_rad_per_s = [0.0; 7];
    }

    pub(super) const fn velocity_rad_per_s(&self) -> &[f64; 7] {
        &self.velocity_rad_per_s
    }
}

#[cfg(test)]
mod tests {
    use super::VelocityFilter;

    #[test]
    fn steady_motion_is_exact_and_a_step_follows_the_low_pass() {
        let mut filter = VelocityFilter::new(50.0);
        for k in 0..200 {
            filter.update(&[0.3 * f64::from(k) * 1e-3; 7], 1e-3);
            // n steps after the start of a motion, the filter shows 1 - (1 - share)^n of it.
            let share = 1e-3 / (1e-3 + 1.0 / (std::f64::consts::TAU * 50.0));
            let expected = 0.3 * (1.0 - (1.0_f64 - share).powi(k));
            assert!((filter.velocity_rad_per_s()[3] - expected).abs() < 1e-12);
        }
        assert!((filter.velocity_rad_per_s()[3] - 0.3).abs() < 1e-9);
        filter.reset();
        filter.update(&[5.0; 7], 1e-3);
        assert_eq!(filter.velocity_rad_per_s(), &[0.0; 7]);
    }
}
