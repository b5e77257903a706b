//! Forces at the tool from torques at the joints.

use crate::error::KinematicsError;
use crate::jacobian::Jacobian;
use crate::joints::JointTorques;
use crate::linalg::{gram, roots};
use hwall_geometry::Wrench;
use hwall_numeric::check::{all_finite, non_negative, positive};
use hwall_numeric::dense::symmetric_eigen;

/// An external wrench seen through the joint torques.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WrenchEstimate {
    /// Wrench on the tool, about the tool origin, base axes.
    pub wrench: Wrench,
    /// Largest over smallest singular value of the Jacobian, rotations counted by the moment length. Torque noise grows by up to this in the wrench.
    pub condition: f64,
    /// Norm of the torque that no wrench explains, N m: sensor noise, or a touch elsewhere on
    /// the arm.
    pub residual_n_m: f64,
}

/// How a wrench is estimated from joint torques.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WrenchConfig {
    /// Singular values of the Jacobian below this are held back instead of amplified, m; default
    /// 0.005. More makes the estimate near a singular pose quieter and smaller; with 0 it is the plain
    /// least squares one, and directions that the arm cannot feel at all (singular values below
    /// 1e-9) are left at zero.
    pub damping_m: f64,
    /// Length that moments are counted in, m; default 0.1, half of a board of 0.2 m.
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
    /// The wrench on the tool that explains external joint torques, by damped least squares:
    /// `min |Jᵀ f - τ|² + λ² |f|²` with the damping λ, moments counted in units of the moment length.
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
        let mut rows = jacobian.to_rows();
        all_finite("jacobian", rows.as_flattened())?;
        for row in &mut rows[3..] {
            *row = row.map(|x| x * moment_length_m);
        }
        let eigen = symmetric_eigen(&gram(&rows));
        let rhs: [f64; 6] = rows.map(|row| row.iter().zip(torques.0).map(|(a, b)| a * b).sum());
        let mut scaled = [0.0; 6];
        for (eigenvalue, vector) in eigen.values.into_iter().zip(eigen.vectors) {
            let damped = eigenvalue.max(0.0) + damping_m * damping_m;
            if damped > 1e-18 {
                let along: f64 = vector.iter().zip(rhs).map(|(a, b)| a * b).sum::<f64>() / damped;
                for (s, v) in scaled.iter_mut().zip(vector) {
                    *s += along * v;
                }
            }
        }
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
        let singular_values = roots(eigen.values);
        let condition = singular_values[0] / singular_values[5];
        Ok(Self {
            wrench,
            condition,
            residual_n_m,
        })
    }
}
