//! Brakes moving commanded positions to rest.

/// Commanded positions and their velocities.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CommandedMotion {
    pub(crate) q_rad: [f64; 7],
    pub(crate) speed_rad_per_s: [f64; 7],
}

impl CommandedMotion {
    pub(crate) const fn at_rest(q_rad: [f64; 7]) -> Self {
        Self {
            q_rad,
            speed_rad_per_s: [0.0; 7],
        }
    }

    /// New positions, `dt_s` after the last ones.
    pub(crate) fn moved_to(&self, q_rad: [f64; 7], dt_s: f64) -> Self {
        Self {
            q_rad,
            speed_rad_per_s: std::array::from_fn(|i| (q_rad[i] - self.q_rad[i]) / dt_s),
        }
    }

    /// The next positions of joints that brake to rest.
    pub(crate) fn braked(&self, braking_rad_per_s2: &[f64; 7], dt_s: f64) -> Self {
        let speed_rad_per_s = std::array::from_fn(|i| {
            let speed = self.speed_rad_per_s[i];
            let change = (braking_rad_per_s2[i] * dt_s).min(speed.abs());
            speed - change.copysign(speed)
        });
        Self {
            q_rad: std::array::from_fn(|i| self.q_rad[i] + speed_rad_per_s[i] * dt_s),
            speed_rad_per_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::CommandedMotion;

    #[test]
    fn comes_to_rest_in_the_least_time() {
        let start = CommandedMotion::at_rest([0.0; 7]);
        let mut motion = start.moved_to([0.001, -0.001, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-3);
        // From 1 rad/s at 10 rad/s² it takes 0.1 s and 0.05 rad.
        for _ in 0..100 {
            motion = motion.braked(&[10.0; 7], 1e-3);
        }
        assert!((motion.q_rad[0] - 0.051).abs() < 1e-3);
        assert!((motion.q_rad[0] + motion.q_rad[1]).abs() < 1e-15);
        let rest = motion.braked(&[10.0; 7], 1e-3).braked(&[10.0; 7], 1e-3);
        assert!((rest.q_rad[0] - motion.q_rad[0]).abs() < 1e-12);
        assert!(rest.q_rad.iter().all(|q| q.is_finite()));
    }
}
