//! Between forces at the tool and torques at the joints.

use crate::error::KinematicsError;
use crate::joints::{JointPositions, JointTorques};
use crate::srs::model::SrsArm;
use crate::wrench::{WrenchConfig, WrenchEstimate};
use hwall_geometry::Wrench;
use hwall_numeric::check::all_finite;

impl SrsArm {
    /// Joint torques that a wrench on the tool (base axes, about the tool origin) exerts,
    /// `τ = Jᵀ f`.
    #[must_use]
    pub fn torques_from_wrench(&self, q: &JointPositions, wrench: &Wrench) -> JointTorques {
        self.jacobian(q).torques(wrench)
    }

    /// The wrench on the tool that explains external joint torques, see
    /// [`WrenchEstimate::from_torques`].
    ///
    /// # Errors
    /// NaN or infinity, a negative damping, or a moment length that is not positive.
    pub fn wrench_from_torques(
        &self,
        q: &JointPositions,
        torques: &JointTorques,
        config: &WrenchConfig,
    ) -> Result<WrenchEstimate, KinematicsError> {
        all_finite("q", &q.0)?;
        WrenchEstimate::from_torques(&self.jacobian(q), torques, config)
    }
}
