//! Forces at the tool from torques at the joints.

use crate::error::KinematicsError;
use crate::jacobian::Jacobian;
use crate::joints::JointTorques;
use crate::linalg::gram;
use hwall_geometry::Wrench;
use hwall_numeric::check::{all_finite, non_negative, positive};
use hwall_numeric::dense::{
    cholesky_in_place, solve_lower, solve_lower_transposed, symmetric_eigen,
};

/// An external wrench estimated from joint torques.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WrenchEstimate {
    /// Wrench on the tool, about the tool origin, base axes.
    pub wrench: Wrench,
    /// Norm of the joint torque that this wrench does not explain, N m: sensor noise, contact
    /// elsewhere on the arm, or the effect of damping.
    pub residual_n_m: f64,
}

/// Settings for estimating a wrench from joint torques.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WrenchConfig {
    /// Singular values of the Jacobian below this are damped instead of amplified, m; default 0.005. A
    /// larger value makes the estimate near a singular pose less noisy and smaller. 0 gives plain
    /// least squares, with zero in directions that the arm cannot sense (singular values below 1e-9).
    pub damping_m: f64,
    /// Length by which moments are divided, m; default 0.1, half of a board of 0.2 m.
    pub moment_length_m: f64,
}

impl Default for WrenchConfig {
    fn default() -> Self {
        Self {
            damping_m: 0.005,
            moment_length_m: 0.1,
        }
    }
}

impl WrenchEstimate {
    /// Estimates the wrench on the tool from external joint torques by damped least squares: `min |Jᵀ f - τ|² + λ² |f|²` with
    /// damping λ, moments in units of the moment length. Damping shrinks the wrench in directions that the arm hardly senses,
    /// near singular poses. The minimum is accurate to 1e-9 for arms of a few metres (tests in this file). Without damping
    /// [`Jacobian::condition`] bounds the amplification of torque noise; with damping it is at most 1/2λ.
    ///
    /// # Errors
    /// NaN or infinity, a negative damping, or a moment length that is not positive.
    pub fn from_torques(
        jacobian: &Jacobian,
        torques: &JointTorques,
        config: &WrenchConfig,
    ) -> Result<Self, KinematicsError> {
        let WrenchConfig {
            damping_m,
            moment_length_m,
        } = *config;
        all_finite("torques", &torques.0)?;
        non_negative("damping_m", damping_m)?;
        positive("moment_length_m", moment_length_m)?;
        let rows = jacobian.to_scaled_rows(moment_length_m);
        all_finite("jacobian", rows.as_flattened())?;
        let gram = gram(&rows);
        let rhs: [f64; 6] = rows.map(|row| row.iter().zip(torques.0).map(|(a, b)| a * b).sum());
        let damping = damping_m * damping_m;
        let trace: f64 = (0..6).map(|i| gram[i][i]).sum();
        // No eigenvalue is below the damping, so elimination loses at most the digits of trace over damping. It is faster, and this runs
        // in every control step.
        let mut scaled = match damping > LEAST_SHARE * trace {
            true => eliminated(&gram, damping, &rhs),
            false => None,
        }
        .unwrap_or_else(|| by_eigenvectors(&gram, damping, &rhs));
        // The last three are moments in units of the length.
        for s in &mut scaled[3..] {
            *s *= moment_length_m;
        }
        let wrench = Wrench::from_array(scaled);
        let explained = jacobian.torques(&wrench);
        let residual_n_m = (0..7)
            .map(|i| (torques[i] - explained[i]).powi(2))
            .sum::<f64>()
            .sqrt();
        Ok(Self {
            wrench,
            residual_n_m,
        })
    }
}

/// Below this fraction of the trace, damping no longer keeps elimination accurate.
const LEAST_SHARE: f64 = 1e-8;
/// Eigenvalues below this belong to directions that the arm cannot sense, m².
const FELT: f64 = 1e-18;

/// `(G + d I)⁻¹ b` of a Gram matrix by Cholesky factors; `None` if it is not positive definite.
fn eliminated(gram: &[[f64; 6]; 6], damping: f64, rhs: &[f64; 6]) -> Option<[f64; 6]> {
    let mut lower = *gram;
    for (i, row) in lower.iter_mut().enumerate() {
        row[i] += damping;
    }
    cholesky_in_place(6, lower.as_flattened_mut()).ok()?;
    let mut x = *rhs;
    solve_lower(lower.as_flattened(), &mut x);
    solve_lower_transposed(lower.as_flattened(), &mut x);
    Some(x)
}

/// As [`eliminated`], by eigenvectors; zero in directions that the arm cannot sense.
fn by_eigenvectors(gram: &[[f64; 6]; 6], damping: f64, rhs: &[f64; 6]) -> [f64; 6] {
    let eigen = symmetric_eigen(gram);
    let mut x = [0.0; 6];
    for (eigenvalue, vector) in eigen.values.into_iter().zip(eigen.vectors) {
        let damped = eigenvalue.max(0.0) + damping;
        if damped > FELT {
            let along: f64 = vector.iter().zip(rhs).map(|(a, b)| a * b).sum::<f64>() / damped;
            for (s, v) in x.iter_mut().zip(vector) {
                *s += along * v;
            }
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joints::JointPositions;
    use crate::srs::SrsArm;
    use hwall_testkit::Sampler;

    /// Jacobians at random configurations, and with elbow, wrist or both at or near zero, where they are singular.
    fn jacobians() -> impl Iterator<Item = Jacobian> {
        let arm = SrsArm::iiwa7();
        let mut sampler = Sampler::new(7);
        (0..2000).map(move |i| {
            let mut q = JointPositions(sampler.array_within([(-2.0, 2.0); 7]));
            let near = [0.0, 1e-9, 1e-5, 1e-3][i / 4 % 4];
            for (joint, turn) in [(3, 1), (5, 2)] {
                if (i % 4) & turn != 0 {
                    q[joint] = near;
                }
            }
            arm.jacobian(&q)
        })
    }

    #[test]
    fn elimination_and_eigenvectors_give_the_same_wrench() {
        let mut sampler = Sampler::new(8);
        let mut worst = 0.0_f64;
        for jacobian in jacobians() {
            let (gram, rhs) = (
                gram(&jacobian.to_scaled_rows(0.1)),
                sampler.array_within([(-20.0, 20.0); 6]),
            );
            let damping = WrenchConfig::default().damping_m.powi(2);
            let one = eliminated(&gram, damping, &rhs).expect("positive definite");
            let other = by_eigenvectors(&gram, damping, &rhs);
            let norm = other.iter().map(|x| x * x).sum::<f64>().sqrt();
            for (a, b) in one.iter().zip(other) {
                worst = worst.max((a - b).abs() / norm);
            }
        }
        assert!(worst < 1e-10, "{worst:e}");
    }

    #[test]
    fn nothing_leaps_where_the_method_changes_and_nothing_is_lost_at_the_ends() {
        let mut sampler = Sampler::new(9);
        for jacobian in jacobians().step_by(7) {
            let torques = JointTorques(sampler.array_within([(-20.0, 20.0); 7]));
            let with = |torques: &JointTorques, damping_m: f64| {
                let config = WrenchConfig {
                    damping_m,
                    ..WrenchConfig::default()
                };
                let found = WrenchEstimate::from_torques(&jacobian, torques, &config);
                found.expect("finite").wrench.to_array()
            };
            let gram = gram(&jacobian.to_scaled_rows(0.1));
            let trace: f64 = (0..6).map(|i| gram[i][i]).sum();
            let change_m = (LEAST_SHARE * trace).sqrt();
            let [below, above] = [1.0 - 1e-9, 1.0 + 1e-9].map(|s| with(&torques, s * change_m));
            let norm = above.iter().map(|x| x * x).sum::<f64>().sqrt();
            for (a, b) in below.iter().zip(above) {
                assert!((a - b).abs() <= 1e-6 * norm, "{below:?} {above:?}");
            }
            for damping_m in [0.0, 1e-200, 1e-12, 1e154, f64::MAX] {
                assert!(with(&torques, damping_m).iter().all(|x| x.is_finite()));
            }
            // Too large to square: the result must not be a small finite force.
            let huge = with(&JointTorques([1e308; 7]), 0.005);
            assert!(
                huge.iter().any(|x| x.is_nan() || x.abs() > 1e300),
                "{huge:?}"
            );
        }
    }
}
