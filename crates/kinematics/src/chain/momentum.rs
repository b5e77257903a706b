//! Equations of motion under a wrench at the tip (for simulation) and generalized momentum (for a disturbance observer).

use super::body::Screw;
use super::dynamics::{ChainDynamics, DynamicsScratch};
use crate::error::KinematicsError;
use glam::{DMat3, DVec3};
use hwall_geometry::Wrench;
use hwall_numeric::check::all_finite;

impl ChainDynamics {
    /// Mass matrix and driving torques of `M q̈ = b`, with `b = τ − C(q, q̇) q̇ − g(q) + Jᵀ f`.
    ///
    /// `wrench`: external wrench on the tip, base axes, about the tip's origin. `matrix` gets `M`, n × n, row-major
    /// (symmetric to the last bit), kg m²; `driving` gets `b`, N m. The caller adds further effects (rotors, friction,
    /// stops) before solving. Does not allocate. Error: as [`ChainDynamics::mass_matrix`] and [`ChainDynamics::inverse`].
    ///
    /// # Errors
    /// A wrong number of values, NaN or infinity.
    #[allow(clippy::too_many_arguments)]
    pub fn equations_into(
        &self,
        q: &[f64],
        qd: &[f64],
        torques: &[f64],
        wrench: &Wrench,
        scratch: &mut DynamicsScratch,
        matrix: &mut [f64],
        driving: &mut [f64],
    ) -> Result<(), KinematicsError> {
        self.check_out(driving)?;
        self.check_matrix(matrix)?;
        self.chain().check("joint velocities", qd)?;
        self.chain().check("joint torques", torques)?;
        all_finite("wrench", &wrench.to_array())?;
        self.place(q, scratch)?;
        self.newton_euler(qd, |_| 0.0, scratch, driving);
        let tip_m = self.composite_bodies(scratch, matrix);
        let moment = wrench.moment_n_m + tip_m.cross(wrench.force_n);
        for ((driving, torque), screw) in driving.iter_mut().zip(torques).zip(&scratch.screws) {
            let Screw { angular, linear } = screw;
            *driving = torque - *driving + angular.dot(moment) + linear.dot(wrench.force_n);
        }
        all_finite("driving torques", driving)?;
        Ok(all_finite("mass matrix", matrix)?)
    }

    /// Generalized momentum `p = M(q) q̇` and `∂T/∂q = Cᵀ(q, q̇) q̇`, the gradient of the kinetic energy, without the mass
    /// matrix: `ṗ = τ + τ_ext + ∂T/∂q − g(q)`.
    ///
    /// Let `h` be the momentum of everything beyond joint `i`, `s` its axis and `v` the velocity of its parent link. Then
    /// `p = s · h`. Turning the joint turns everything beyond it except the inherited velocity, so `∂T/∂q = h · (v × s)`
    /// with the motion cross product of Featherstone (2008), ch. 2. In N m s and N m. Does not allocate. Error: below
    /// 1e-12 relative against `M q̇` and central differences (tests/it/momentum.rs).
    ///
    /// # Errors
    /// A wrong number of values, NaN or infinity.
    pub fn momentum_into(
        &self,
        q: &[f64],
        qd: &[f64],
        scratch: &mut DynamicsScratch,
        momentum: &mut [f64],
        energy_gradient: &mut [f64],
    ) -> Result<(), KinematicsError> {
        self.check_out(momentum)?;
        self.check_out(energy_gradient)?;
        self.chain().check("joint velocities", qd)?;
        self.place(q, scratch)?;
        let (mut omega, mut v) = (DVec3::ZERO, DVec3::ZERO);
        let places = scratch.rotations.iter().zip(&scratch.translations);
        let momenta = scratch.forces.iter_mut().zip(&mut scratch.moments);
        let joints = self.chain().frames.iter().zip(&self.bodies).zip(qd);
        for ((((r, t), (linear, angular)), ((frame, body), rate)), screw) in
            places.zip(momenta).zip(joints).zip(&mut scratch.screws)
        {
            let back: DMat3 = r.transpose();
            v = back * (v + omega.cross(*t));
            omega = back * omega;
            // The parent's velocity suffices: the joint's own velocity is parallel to its axis.
            *screw = match frame.prismatic {
                true => Screw::new(DVec3::ZERO, omega.cross(DVec3::Z)),
                false => Screw::new(omega.cross(DVec3::Z), v.cross(DVec3::Z)),
            };
            if frame.prismatic {
                v.z += rate;
            } else {
                omega.z += rate;
            }
            *linear = body.mass * v + omega.cross(body.moment);
            *angular = body.inertia * omega + body.moment.cross(v);
        }
        let (mut linear, mut angular) = (DVec3::ZERO, DVec3::ZERO);
        for i in (0..qd.len()).rev() {
            linear += scratch.forces[i];
            angular += scratch.moments[i];
            let screw = scratch.screws[i];
            momentum[i] = match self.chain().frames[i].prismatic {
                true => linear.z,
                false => angular.z,
            };
            energy_gradient[i] = angular.dot(screw.angular) + linear.dot(screw.linear);
            linear = scratch.rotations[i] * linear;
            angular = scratch.rotations[i] * angular + scratch.translations[i].cross(linear);
        }
        all_finite("momentum", momentum)?;
        Ok(all_finite("energy gradient", energy_gradient)?)
    }
}
