//! Torques that hold the face on a moving pose with a Cartesian stiffness.

use super::joint_guard::JointGuard;
use crate::arm::ArmState;
use crate::error::HapticsError;
use glam::{DMat3, DQuat, DVec3};
use hwall_geometry::{Pose, Twist, Wrench};
use hwall_kinematics::{
    ArmKinematics, ChainDynamics, DynamicsScratch, Jacobian, JointPositions, JointTorques,
    JointVelocities,
};
use hwall_numeric::check::{all_finite, non_negative, positive, that};
use hwall_numeric::dense::{cholesky_in_place, solve_lower};
use std::sync::Arc;

/// Settings of [`CartesianImpedance`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpedanceConfig {
    /// Translational stiffness of the face, N/m; default 4000.
    pub stiffness_n_per_m: f64,
    /// Rotational stiffness, N m/rad; default 100.
    pub stiffness_n_m_per_rad: f64,
    /// Damping ratio, from the effective mass along each axis; default 0.8.
    pub damping_ratio: f64,
    /// Stiffness of every joint towards the planned configuration, N m/rad; default 10: it holds the elbow, which the face leaves free.
    pub joint_stiffness_n_m_per_rad: f64,
    /// Damping of every joint relative to its planned motion, N m s/rad; default 1.
    pub joint_damping_n_m_s_per_rad: f64,
    /// Share of the measured external force that is compensated, 0 to 1; default 1: the face then stays on its path under a push, and only the object
    /// decides how it yields.
    pub force_share: f64,
    /// Rate at which a lasting joint error is integrated out, 1/s; default 1: friction and sensors would leave such errors. The torque is at most
    /// `integral_most_n_m`.
    pub integral_per_s: f64,
    /// Largest torque of the integral, N m; default 3.
    pub integral_most_n_m: f64,
    /// Friction that the arm itself does not compensate, as far as it is known.
    pub friction: FrictionLeft,
    /// Keeps joints off their limits.
    pub guard: JointGuard,
    /// Rotor inertia reflected to the joints, kg m²; default zero. Inertia that is not given here is missing in the feed-forward.
    pub rotor_inertia_kg_m2: [f64; 7],
}

impl Default for ImpedanceConfig {
    fn default() -> Self {
        Self {
            stiffness_n_per_m: 4000.0,
            stiffness_n_m_per_rad: 100.0,
            damping_ratio: 0.8,
            joint_stiffness_n_m_per_rad: 10.0,
            joint_damping_n_m_s_per_rad: 1.0,
            force_share: 1.0,
            integral_per_s: 1.0,
            integral_most_n_m: 3.0,
            friction: FrictionLeft::default(),
            guard: JointGuard::default(),
            rotor_inertia_kg_m2: [0.0; 7],
        }
    }
}

impl ImpedanceConfig {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("stiffness_n_per_m", self.stiffness_n_per_m)?;
        positive("stiffness_n_m_per_rad", self.stiffness_n_m_per_rad)?;
        non_negative("damping_ratio", self.damping_ratio)?;
        non_negative("joint_stiffness", self.joint_stiffness_n_m_per_rad)?;
        non_negative("joint_damping", self.joint_damping_n_m_s_per_rad)?;
        non_negative("force_share", self.force_share)?;
        non_negative("integral_per_s", self.integral_per_s)?;
        non_negative("integral_most_n_m", self.integral_most_n_m)?;
        self.friction.validate()?;
        self.guard.validate()?;
        for inertia in self.rotor_inertia_kg_m2 {
            non_negative("rotor_inertia_kg_m2", inertia)?;
        }
        Ok(())
    }
}

/// Dry friction that an arm leaves uncompensated, fed forward in the direction of the planned motion. Measure it by turning joints slowly one by one;
/// unknown friction is zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionLeft {
    /// Friction of joints that hardly move, N m; default zero.
    pub slow_n_m: [f64; 7],
    /// Friction of joints in motion, N m; default zero.
    pub moving_n_m: [f64; 7],
    /// Speeds up to which the first value holds, and from which the second holds, rad/s; default 0.01 and 0.05.
    pub between_rad_per_s: [f64; 2],
}

impl Default for FrictionLeft {
    fn default() -> Self {
        Self {
            slow_n_m: [0.0; 7],
            moving_n_m: [0.0; 7],
            between_rad_per_s: [0.01, 0.05],
        }
    }
}

/// Planned speed at which the direction counts as known, rad/s.
const DIRECTION_RAD_PER_S: f64 = 0.003;

impl FrictionLeft {
    fn validate(&self) -> Result<(), HapticsError> {
        for joint in 0..7 {
            non_negative("slow_n_m", self.slow_n_m[joint])?;
            non_negative("moving_n_m", self.moving_n_m[joint])?;
        }
        let [slow, moving] = self.between_rad_per_s;
        non_negative("between_rad_per_s[0]", slow)?;
        let valid = moving > slow;
        that(valid, "between_rad_per_s[1]", moving, "above the first")?;
        Ok(())
    }

    /// Torque that compensates it at a planned speed, N m.
    fn torque_n_m(&self, joint: usize, qd_rad_per_s: f64) -> f64 {
        let [slow, moving] = self.between_rad_per_s;
        let share = ((qd_rad_per_s.abs() - slow) / (moving - slow)).clamp(0.0, 1.0);
        let known = self.slow_n_m[joint] + share * (self.moving_n_m[joint] - self.slow_n_m[joint]);
        known * (qd_rad_per_s / DIRECTION_RAD_PER_S).tanh()
    }
}

/// Planned pose and motion of the face at an instant.
#[derive(Debug, Clone, Copy)]
pub struct FaceMotion {
    /// Pose of the face, base frame.
    pub pose: Pose,
    /// Its velocity about the centre of the face, base axes.
    pub twist: Twist,
    /// Planned joint angles, rad.
    pub q: JointPositions,
    /// Planned joint velocities, rad/s.
    pub qd: JointVelocities,
    /// Planned joint accelerations, rad/s².
    pub qdd_rad_per_s2: [f64; 7],
}

/// Torques in addition to gravity compensation: `τ = Jᵀ (K e + D ė − s F) + M q̈_d + integral + friction + joint terms`. A share `s` of the measured
/// external wrench `F` is compensated; the damping follows from the effective mass along each axis, `D_i = 2 ζ √(K_i m_i)` ([Khatib 1995], [Ott
/// 2008]). Allocates nothing after construction.
#[derive(Debug, Clone)]
pub struct CartesianImpedance {
    arm: Arc<dyn ArmKinematics>,
    dynamics: ChainDynamics,
    scratch: DynamicsScratch,
    config: ImpedanceConfig,
    mass: [f64; 49],
    /// Integral torque against lasting errors, N m.
    integral: [f64; 7],
}

impl CartesianImpedance {
    /// The arm's tool is the face of the board; `dynamics` are those of the same arm with the board.
    ///
    /// # Errors
    /// A setting outside its range, or dynamics with another number of joints.
    pub fn new(
        arm: Arc<dyn ArmKinematics>,
        dynamics: ChainDynamics,
        config: ImpedanceConfig,
    ) -> Result<Self, HapticsError> {
        config.validate()?;
        let joints = dynamics.chain().joint_count();
        hwall_numeric::check::that(
            joints == arm.joint_count(),
            "joints of the dynamics",
            joints as f64,
            "as many as the arm has",
        )?;
        Ok(Self {
            scratch: dynamics.scratch(),
            arm,
            dynamics,
            config,
            mass: [0.0; 49],
            integral: [0.0; 7],
        })
    }

    /// Resets the integral.
    pub const fn begin(&mut self) {
        self.integral = [0.0; 7];
    }

    /// The torques for a measured state and the measured external wrench on the face (base axes, about its centre). Call once in a period.
    ///
    /// # Errors
    /// NaN or infinity, a period that is not positive; a mass matrix that is not positive definite.
    pub fn torques(
        &mut self,
        state: &ArmState,
        wanted: &FaceMotion,
        external: &Wrench,
        dt_s: f64,
    ) -> Result<JointTorques, HapticsError> {
        positive("dt_s", dt_s)?;
        let joints = self.arm.joint_count();
        let (face, jacobian) = self.arm.forward_and_jacobian(&state.q);
        let mass = &mut self.mass[..joints * joints];
        self.dynamics
            .mass_matrix_into(&state.q.0[..joints], &mut self.scratch, mass)?;
        for joint in 0..joints {
            mass[joint * joints + joint] += self.config.rotor_inertia_kg_m2[joint];
        }
        let feed_forward: [f64; 7] = std::array::from_fn(|row| {
            (0..joints)
                .filter(|_| row < joints)
                .map(|column| mass[row * joints + column] * wanted.qdd_rad_per_s2[column])
                .sum()
        });
        let inertia: [f64; 7] = std::array::from_fn(|i| match i < joints {
            true => mass[i * joints + i],
            false => 0.0,
        });
        cholesky_in_place(joints, mass).map_err(|bad| {
            hwall_numeric::ArgumentError::OutOfRange {
                what: "pivot of the mass matrix",
                value: bad.value,
                wanted: "positive",
            }
        })?;
        let velocity = jacobian.twist(&state.qd);
        let off_m = wanted.pose.position_m() - face.position_m();
        let off_rad = rotation_vector(wanted.pose.rotation() * face.rotation().transpose());
        let slip = wanted.twist.linear_m_per_s - velocity.linear_m_per_s;
        let spin = wanted.twist.angular_rad_per_s - velocity.angular_rad_per_s;
        let c = &self.config;
        let (mut force_n, mut moment_n_m) = (DVec3::ZERO, DVec3::ZERO);
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let heavy = effective(
                &jacobian,
                &self.mass[..joints * joints],
                joints,
                axis,
                false,
            );
            let damping = 2.0 * c.damping_ratio * (c.stiffness_n_per_m * heavy).sqrt();
            force_n += axis * (c.stiffness_n_per_m * off_m.dot(axis) + damping * slip.dot(axis));
            let heavy = effective(&jacobian, &self.mass[..joints * joints], joints, axis, true);
            let damping = 2.0 * c.damping_ratio * (c.stiffness_n_m_per_rad * heavy).sqrt();
            moment_n_m +=
                axis * (c.stiffness_n_m_per_rad * off_rad.dot(axis) + damping * spin.dot(axis));
        }
        let springs = jacobian.torques(&Wrench {
            force_n: c.stiffness_n_per_m * off_m,
            moment_n_m: c.stiffness_n_m_per_rad * off_rad,
        });
        let most = c.integral_most_n_m;
        let integral: [f64; 7] = std::array::from_fn(|i| {
            let spring = springs[i] + c.joint_stiffness_n_m_per_rad * (wanted.q[i] - state.q[i]);
            (self.integral[i] + dt_s * c.integral_per_s * spring).clamp(-most, most)
        });
        let held = jacobian.torques(&Wrench {
            force_n: force_n - external.force_n * c.force_share,
            moment_n_m: moment_n_m - external.moment_n_m * c.force_share,
        });
        let speeds = self.arm.max_velocity_rad_per_s();
        let limits = self.arm.limits();
        let guarded = |i: usize| {
            let (is, planned) = ([state.q[i], state.qd[i]], [wanted.q[i], wanted.qd[i]]);
            c.guard
                .torque_n_m(i, inertia[i], &limits[i], speeds[i], is, planned)
        };
        let torques = JointTorques(std::array::from_fn(|i| {
            guarded(i)
                + held[i]
                + feed_forward[i]
                + integral[i]
                + c.friction.torque_n_m(i, wanted.qd[i])
                + c.joint_stiffness_n_m_per_rad * (wanted.q[i] - state.q[i])
                + c.joint_damping_n_m_s_per_rad * (wanted.qd[i] - state.qd[i])
        }));
        all_finite("torques", &torques.0)?;
        self.integral = integral;
        Ok(torques)
    }
}

/// Effective mass, or inertia, along an axis, kg or kg m²; from the Cholesky factor of the mass matrix. At most a ton: where no joint moves the face,
/// there is nothing to damp.
fn effective(jacobian: &Jacobian, lower: &[f64], joints: usize, axis: DVec3, turns: bool) -> f64 {
    const HEAVIEST: f64 = 1e3;
    let columns = if turns {
        &jacobian.angular
    } else {
        &jacobian.linear
    };
    let mut torques: [f64; 7] = columns.map(|column| column.dot(axis));
    solve_lower(lower, &mut torques[..joints]);
    let mobility: f64 = torques[..joints].iter().map(|x| x * x).sum();
    (1.0 / mobility.max(1.0 / HEAVIEST)).min(HEAVIEST)
}

/// Rotation vector (axis times angle), rad.
fn rotation_vector(rotation: DMat3) -> DVec3 {
    DQuat::from_mat3(&rotation).normalize().to_scaled_axis()
}
