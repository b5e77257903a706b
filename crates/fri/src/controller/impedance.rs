//! The arm's own controller in the modes torque and wrench: springs, dampers, and the overlay.

use crate::error::FriError;
use crate::wrench::wrench_in_base;
use hwall_geometry::rotation_vector;
use hwall_haptics::ArmState;
use hwall_kinematics::{ArmKinematics, JointPositions, Wrench};
use hwall_numeric::check::{each, non_negative};

/// Stiffness and damping set by the application. They cannot change while commands come.
///
/// The inertias here are assumptions that give roughly the right damping; the control laws do not know the true ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpedanceConfig {
    /// Joint stiffness in mode torque, N m/rad; default 200. 0 also means no damping: the arm is free.
    pub joint_stiffness_n_m_per_rad: [f64; 7],
    /// Joint inertia assumed for the damping, kg m²; default 2, 2, 1, 1, 0.3, 0.3, 0.25.
    pub joint_inertia_kg_m2: [f64; 7],
    /// Damping ratio of all springs; default 0.7.
    pub damping_ratio: f64,
    /// Translational stiffness of the tool in mode wrench, N/m; default 2000.
    pub translation_n_per_m: f64,
    /// Rotational stiffness of the tool, N m/rad; default 200.
    pub rotation_n_m_per_rad: f64,
    /// Mass assumed for the translational damping, kg; default 6.
    pub mass_kg: f64,
    /// Inertia assumed for the rotational damping, kg m²; default 0.3.
    pub inertia_kg_m2: f64,
    /// Stiffness of each joint in mode wrench, which holds the elbow, N m/rad; default 10.
    pub posture_n_m_per_rad: f64,
}

impl Default for ImpedanceConfig {
    fn default() -> Self {
        Self {
            joint_stiffness_n_m_per_rad: [200.0; 7],
            joint_inertia_kg_m2: [2.0, 2.0, 1.0, 1.0, 0.3, 0.3, 0.25],
            damping_ratio: 0.7,
            translation_n_per_m: 2000.0,
            rotation_n_m_per_rad: 200.0,
            mass_kg: 6.0,
            inertia_kg_m2: 0.3,
            posture_n_m_per_rad: 10.0,
        }
    }
}

impl ImpedanceConfig {
    pub(super) fn validate(&self) -> Result<(), FriError> {
        let stiffness = &self.joint_stiffness_n_m_per_rad;
        each(non_negative, "joint_stiffness_n_m_per_rad", stiffness)?;
        each(
            non_negative,
            "joint_inertia_kg_m2",
            &self.joint_inertia_kg_m2,
        )?;
        non_negative("damping_ratio", self.damping_ratio)?;
        non_negative("translation_n_per_m", self.translation_n_per_m)?;
        non_negative("rotation_n_m_per_rad", self.rotation_n_m_per_rad)?;
        non_negative("mass_kg", self.mass_kg)?;
        non_negative("inertia_kg_m2", self.inertia_kg_m2)?;
        non_negative("posture_n_m_per_rad", self.posture_n_m_per_rad)?;
        Ok(())
    }

    fn damping(&self, stiffness: f64, inertia: f64) -> f64 {
        2.0 * self.damping_ratio * (stiffness * inertia).sqrt()
    }

    /// `τ = K (q_c − q) − D q̇ + τ_c`, N m.
    pub(super) fn joint_torques(
        &self,
        state: &ArmState,
        reference: &JointPositions,
        overlay_n_m: &[f64; 7],
    ) -> [f64; 7] {
        std::array::from_fn(|i| {
            let stiffness = self.joint_stiffness_n_m_per_rad[i];
            let damping = self.damping(stiffness, self.joint_inertia_kg_m2[i]);
            stiffness * (reference[i] - state.q[i]) - damping * state.qd[i] + overlay_n_m[i]
        })
    }

    /// `τ = Jᵀ (K (x_c − x) − D ẋ + w) + k (q_c − q) − d q̇`, N m. The wrench acts at the tool, along the axes of the tool.
    pub(super) fn cartesian_torques(
        &self,
        arm: &dyn ArmKinematics,
        state: &ArmState,
        reference: &JointPositions,
        overlay: &Wrench,
    ) -> [f64; 7] {
        let wanted = arm.forward(reference);
        let (found, jacobian) = arm.forward_and_jacobian(&state.q);
        let velocity = jacobian.twist(&state.qd);
        let place = self.translation_n_per_m;
        let turn = self.rotation_n_m_per_rad;
        let off_m = wanted.position_m() - found.position_m();
        let off_rad = rotation_vector(wanted.rotation() * found.rotation().transpose());
        let overlay = wrench_in_base(&found, overlay);
        let wrench = Wrench {
            force_n: place * off_m - self.damping(place, self.mass_kg) * velocity.linear_m_per_s
                + overlay.force_n,
            moment_n_m: turn * off_rad
                - self.damping(turn, self.inertia_kg_m2) * velocity.angular_rad_per_s
                + overlay.moment_n_m,
        };
        let torques = jacobian.torques(&wrench);
        let posture = self.posture_n_m_per_rad;
        std::array::from_fn(|i| {
            let damping = self.damping(posture, self.joint_inertia_kg_m2[i]);
            torques[i] + posture * (reference[i] - state.q[i]) - damping * state.qd[i]
        })
    }
}
