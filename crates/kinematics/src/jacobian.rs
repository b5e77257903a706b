//! The geometric Jacobian of an arm of at most seven joints.

use crate::joints::{JointTorques, JointVelocities};
use crate::linalg::gram;
use glam::DVec3;
use hwall_geometry::{Twist, Wrench};
use hwall_numeric::dense::symmetric_eigen;

/// Geometric Jacobian of the tool point, expressed in base axes.
///
/// Column `i` is the twist of the tool for 1 rad/s at joint `i`. Error: below 1e-9 against
/// central differences, below 1e-14 against the reference data (tests/it/srs_reference.rs).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jacobian {
    /// Linear velocity of the tool origin, m/s per rad/s.
    pub linear: [DVec3; 7],
    /// Angular velocity of the tool, rad/s per rad/s.
    pub angular: [DVec3; 7],
}

impl Jacobian {
    /// Twist of the tool for the joint velocities, base axes.
    #[must_use]
    pub fn twist(&self, velocities: &JointVelocities) -> Twist {
        let mut twist = Twist::default();
        for i in 0..7 {
            twist.linear_m_per_s += self.linear[i] * velocities[i];
            twist.angular_rad_per_s += self.angular[i] * velocities[i];
        }
        twist
    }

    /// Joint torques `τ = Jᵀ f` that a wrench on the tool (base axes, about the tool origin)
    /// exerts on the joints.
    #[must_use]
    pub fn torques(&self, wrench: &Wrench) -> JointTorques {
        JointTorques(std::array::from_fn(|i| {
            self.linear[i].dot(wrench.force_n) + self.angular[i].dot(wrench.moment_n_m)
        }))
    }

    /// Condition number: largest over smallest singular value, rotations weighted by a length in m. Infinite at a singular pose, up to
    /// rounding; NaN if nothing moves or an entry is NaN. It bounds the amplification of the relative error of joint torques in a wrench
    /// estimated without damping and with the same moment length.
    #[must_use]
    pub fn condition(&self, moment_length_m: f64) -> f64 {
        let singular_values = self.singular_values(moment_length_m);
        singular_values[0] / singular_values[5]
    }

    /// Singular values, largest first, rotations weighted by a length in m.
    pub(crate) fn singular_values(&self, moment_length_m: f64) -> [f64; 6] {
        let squares = symmetric_eigen(&gram(&self.to_scaled_rows(moment_length_m))).values;
        // Rounding can make the smallest slightly negative; NaN is kept.
        squares.map(|x| if x < 0.0 { 0.0 } else { x.sqrt() })
    }

    /// As [`to_rows`](Self::to_rows), the rotations multiplied by a length.
    pub(crate) fn to_scaled_rows(self, moment_length_m: f64) -> [[f64; 7]; 6] {
        let mut rows = self.to_rows();
        for row in &mut rows[3..] {
            *row = row.map(|x| x * moment_length_m);
        }
        rows
    }

    /// 6 × 7 as rows `[vx vy vz ωx ωy ωz]`.
    #[must_use]
    pub fn to_rows(&self) -> [[f64; 7]; 6] {
        std::array::from_fn(|row| {
            let part = if row < 3 { &self.linear } else { &self.angular };
            std::array::from_fn(|joint| part[joint][row % 3])
        })
    }
}
