//! Joint-space dynamics of a [`Chain`] with link inertials.
//!
//! `τ = M(q) q̈ + C(q, q̇) q̇ + g(q)`, rigid links, no friction, no rotor inertia. Recursions as in
//! Featherstone (2008), "Rigid Body Dynamics Algorithms": recursive Newton-Euler (ch. 5), composite
//! rigid bodies (ch. 6); written with plain three-vectors about the joint origins, where `h = m c`
//! and the inertia about the origin replace the centre of mass.

use super::axis_frame::{Axis, GROUP, settings};
use super::body::{Body, Screw};
use super::inertia::Inertial;
use super::model::Chain;
use crate::error::KinematicsError;
use glam::{DMat3, DVec3};
use hwall_geometry::Wrench;
use hwall_numeric::check::{all_finite, finite};
use hwall_numeric::dense::{cholesky_in_place, solve_lower, solve_lower_transposed};

/// Standard gravity of the crate, base axes with z up, m/s².
pub const GRAVITY_M_PER_S2: DVec3 = DVec3::new(0.0, 0.0, -9.81);

/// Dynamics of a chain: an immutable model, cheap to call at 1 kHz.
///
/// All joint torques are N m (N for a prismatic joint), in the order of the chain's joints. Every vector or matrix
/// query has an `_into` form that does not allocate. Input that makes the result overflow is an error, like NaN.
///
/// ```
/// use glam::DVec3;
/// use hwall_kinematics::{Chain, ChainDynamics, Inertial};
///
/// let board = Inertial::solid_box("board", 1.5, DVec3::new(0.0, 0.0, 0.05), DVec3::new(0.3, 0.4, 0.02));
/// let arm = ChainDynamics::new(&Chain::iiwa7())?.with_payload(&board)?;
/// let (q, qd) = ([0.0, 0.6, 0.0, 1.2, 0.0, -0.4, 0.0], [0.1; 7]);
/// let hold = arm.gravity_torque(&q)?;
/// let acceleration = arm.forward(&q, &[0.0; 7], &hold)?;
/// assert!(acceleration.iter().all(|a| a.abs() < 1e-10));
/// let torques = arm.inverse(&q, &qd, &[0.5; 7])?;
/// # assert_eq!(torques.len(), 7);
/// # Ok::<(), hwall_kinematics::KinematicsError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ChainDynamics {
    chain: Chain,
    pub(super) bodies: Vec<Body>,
    gravity: DVec3,
}

/// Memory for the `_into` forms, from [`ChainDynamics::scratch`].
#[derive(Debug, Clone)]
pub struct DynamicsScratch {
    /// This frame in the previous one.
    pub(super) rotations: Vec<DMat3>,
    pub(super) translations: Vec<DVec3>,
    pub(super) forces: Vec<DVec3>,
    pub(super) moments: Vec<DVec3>,
    bodies: Vec<Body>,
    axes: Vec<Axis>,
    pub(super) screws: Vec<Screw>,
    matrix: Vec<f64>,
}

impl ChainDynamics {
    /// Dynamics under [`GRAVITY_M_PER_S2`].
    ///
    /// # Errors
    /// [`KinematicsError::NoInertials`] when no link has mass, [`KinematicsError::Inertia`] or
    /// [`KinematicsError::Argument`] for a body that is not physical.
    pub fn new(chain: &Chain) -> Result<Self, KinematicsError> {
        let mut bodies = Vec::with_capacity(chain.joint_count());
        for (joint, frame) in chain.joints().iter().zip(&chain.frames) {
            let mut body = Body::EMPTY;
            for part in &joint.inertials {
                part.validate()?;
                body.add(&part.transformed(&frame.axis_from_link));
            }
            bodies.push(body);
        }
        if bodies.iter().all(|body| body.mass == 0.0) {
            return Err(KinematicsError::NoInertials);
        }
        Ok(Self {
            chain: chain.clone(),
            bodies,
            gravity: GRAVITY_M_PER_S2,
        })
    }

    /// Sets gravity, base axes, m/s²: for a tilted or hanging base, or zero.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn with_gravity(mut self, gravity_m_per_s2: DVec3) -> Result<Self, KinematicsError> {
        all_finite("gravity", &gravity_m_per_s2.to_array())?;
        self.gravity = gravity_m_per_s2;
        Ok(self)
    }

    /// Adds a body fixed to the tip, in the tip frame: the board, a tool.
    ///
    /// # Errors
    /// As [`ChainDynamics::new`] for the body.
    pub fn with_payload(mut self, payload: &Inertial) -> Result<Self, KinematicsError> {
        payload.validate()?;
        if let Some(last) = self.bodies.last_mut() {
            last.add(&payload.transformed(&self.chain.last_from_tip));
        }
        Ok(self)
    }

    /// The chain.
    #[must_use]
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// Allocates scratch memory for this model.
    #[must_use]
    pub fn scratch(&self) -> DynamicsScratch {
        let n = self.bodies.len();
        DynamicsScratch {
            rotations: vec![DMat3::IDENTITY; n],
            translations: vec![DVec3::ZERO; n],
            forces: vec![DVec3::ZERO; n],
            moments: vec![DVec3::ZERO; n],
            bodies: vec![Body::EMPTY; n],
            axes: vec![Axis::ZERO; n],
            screws: vec![Screw::ZERO; n],
            matrix: vec![0.0; n * n],
        }
    }

    /// Torques that hold the arm still against gravity, `g(q)`.
    ///
    /// # Errors
    /// A wrong number of values, NaN or infinity.
    pub fn gravity_torque(&self, q: &[f64]) -> Result<Vec<f64>, KinematicsError> {
        let mut out = vec![0.0; self.bodies.len()];
        self.gravity_torque_into(q, &mut self.scratch(), &mut out)?;
        Ok(out)
    }

    /// As [`ChainDynamics::gravity_torque`], without allocation.
    ///
    /// # Errors
    /// As [`ChainDynamics::gravity_torque`], or an `out` of another length.
    pub fn gravity_torque_into(
        &self,
        q: &[f64],
        scratch: &mut DynamicsScratch,
        out: &mut [f64],
    ) -> Result<(), KinematicsError> {
        self.check_out(out)?;
        self.place(q, scratch)?;
        let mut a = -self.gravity;
        for (i, body) in self.bodies.iter().enumerate() {
            a = scratch.rotations[i].transpose() * a;
            scratch.forces[i] = body.mass * a;
            scratch.moments[i] = body.moment.cross(a);
        }
        self.gather(scratch, out);
        Ok(all_finite("gravity torque", out)?)
    }

    /// Torques for a motion, `τ = M q̈ + C q̇ + g` (recursive Newton-Euler).
    ///
    /// # Errors
    /// A wrong number of values, NaN or infinity.
    pub fn inverse(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Result<Vec<f64>, KinematicsError> {
        let mut out = vec![0.0; self.bodies.len()];
        self.inverse_into(q, qd, qdd, &mut self.scratch(), &mut out)?;
        Ok(out)
    }

    /// As [`ChainDynamics::inverse`], without allocation.
    ///
    /// # Errors
    /// As [`ChainDynamics::inverse`], or an `out` of another length.
    pub fn inverse_into(
        &self,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        scratch: &mut DynamicsScratch,
        out: &mut [f64],
    ) -> Result<(), KinematicsError> {
        self.check_out(out)?;
        self.chain.check("joint velocities", qd)?;
        self.chain.check("joint accelerations", qdd)?;
        self.place(q, scratch)?;
        self.newton_euler(qd, |i| qdd[i], scratch, out);
        Ok(all_finite("joint torques", out)?)
    }

    /// Mass matrix `M(q)`, n × n, row-major (symmetric to the last bit), kg m².
    ///
    /// # Errors
    /// A wrong number of values, NaN or infinity.
    pub fn mass_matrix(&self, q: &[f64]) -> Result<Vec<f64>, KinematicsError> {
        let n = self.bodies.len();
        let mut out = vec![0.0; n * n];
        self.mass_matrix_into(q, &mut self.scratch(), &mut out)?;
        Ok(out)
    }

    /// As [`ChainDynamics::mass_matrix`], without allocation.
    ///
    /// # Errors
    /// As [`ChainDynamics::mass_matrix`], or an `out` that does not hold n² numbers.
    pub fn mass_matrix_into(
        &self,
        q: &[f64],
        scratch: &mut DynamicsScratch,
        out: &mut [f64],
    ) -> Result<(), KinematicsError> {
        self.check_matrix(out)?;
        self.place(q, scratch)?;
        self.composite_bodies(scratch, out);
        Ok(all_finite("mass matrix", out)?)
    }

    /// Joint accelerations under torques, `q̈ = M⁻¹ (τ − C q̇ − g)`, by Cholesky of the mass matrix.
    ///
    /// # Errors
    /// A wrong number of values, NaN or infinity; [`KinematicsError::SingularMass`] if some joint motion moves no mass.
    pub fn forward(
        &self,
        q: &[f64],
        qd: &[f64],
        torques: &[f64],
    ) -> Result<Vec<f64>, KinematicsError> {
        let mut out = vec![0.0; self.bodies.len()];
        self.forward_into(q, qd, torques, &mut self.scratch(), &mut out)?;
        Ok(out)
    }

    /// As [`ChainDynamics::forward`], without allocation.
    ///
    /// # Errors
    /// As [`ChainDynamics::forward`], or an `out` of another length.
    pub fn forward_into(
        &self,
        q: &[f64],
        qd: &[f64],
        torques: &[f64],
        scratch: &mut DynamicsScratch,
        out: &mut [f64],
    ) -> Result<(), KinematicsError> {
        let n = self.bodies.len();
        let mut matrix = std::mem::take(&mut scratch.matrix);
        matrix.resize(n * n, 0.0);
        let none = Wrench::default();
        let written = self.equations_into(q, qd, torques, &none, scratch, &mut matrix, out);
        let solved = written.and_then(|()| {
            cholesky_in_place(n, &mut matrix)
                .map_err(|fault| KinematicsError::SingularMass { joint: fault.pivot })?;
            solve_lower(&matrix, out);
            solve_lower_transposed(&matrix, out);
            Ok(())
        });
        scratch.matrix = matrix;
        solved?;
        Ok(all_finite("joint accelerations", out)?)
    }

    /// Kinetic energy `½ q̇ᵀ M q̇`, J.
    ///
    /// # Errors
    /// A wrong number of values, NaN or infinity.
    pub fn kinetic_energy_j(&self, q: &[f64], qd: &[f64]) -> Result<f64, KinematicsError> {
        self.chain.check("joint velocities", qd)?;
        let mut scratch = self.scratch();
        self.place(q, &mut scratch)?;
        let (mut omega, mut v, mut energy) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for (i, body) in self.bodies.iter().enumerate() {
            let back = scratch.rotations[i].transpose();
            v = back * (v + omega.cross(scratch.translations[i]));
            omega = back * omega;
            *(if self.chain.frames[i].prismatic {
                &mut v.z
            } else {
                &mut omega.z
            }) += qd[i];
            energy += 0.5 * body.mass * v.length_squared()
                + v.dot(omega.cross(body.moment))
                + 0.5 * omega.dot(body.inertia * omega);
        }
        Ok(finite("kinetic energy", energy)?)
    }

    /// Potential energy `−Σ m g·c`, J, zero for a mass at the base origin.
    ///
    /// # Errors
    /// A wrong number of values, NaN or infinity.
    pub fn potential_energy_j(&self, q: &[f64]) -> Result<f64, KinematicsError> {
        let mut scratch = self.scratch();
        self.place(q, &mut scratch)?;
        let (mut r, mut p, mut energy) = (DMat3::IDENTITY, DVec3::ZERO, 0.0);
        for (i, body) in self.bodies.iter().enumerate() {
            p += r * scratch.translations[i];
            r *= scratch.rotations[i];
            energy -= self.gravity.dot(body.mass * p + r * body.moment);
        }
        Ok(finite("potential energy", energy)?)
    }

    /// Checks the length of an output: one value per joint, or one per pair of joints.
    pub(super) fn check_length(
        what: &'static str,
        expected: usize,
        out: &[f64],
    ) -> Result<(), KinematicsError> {
        match out.len() {
            got if got == expected => Ok(()),
            got => Err(KinematicsError::WrongJointCount {
                what,
                expected,
                got,
            }),
        }
    }

    pub(super) fn check_out(&self, out: &[f64]) -> Result<(), KinematicsError> {
        Self::check_length("out", self.bodies.len(), out)
    }

    pub(super) fn check_matrix(&self, out: &[f64]) -> Result<(), KinematicsError> {
        Self::check_length("mass matrix", self.bodies.len().pow(2), out)
    }

    /// Checks `q` and writes the pose of each frame in the previous one to the scratch.
    pub(super) fn place(&self, q: &[f64], s: &mut DynamicsScratch) -> Result<(), KinematicsError> {
        self.chain.check("joint positions", q)?;
        if s.rotations.len() != q.len() {
            *s = self.scratch();
        }
        let mut i = 0;
        for (frames, q) in self.chain.frames.chunks(GROUP).zip(q.chunks(GROUP)) {
            for (frame, setting) in frames.iter().zip(settings(frames, q)) {
                (s.rotations[i], s.translations[i]) = frame.at(setting);
                i += 1;
            }
        }
        Ok(())
    }

    /// Outward pass: force and moment on each body, about its joint origin.
    pub(super) fn newton_euler(
        &self,
        qd: &[f64],
        qdd: impl Fn(usize) -> f64,
        s: &mut DynamicsScratch,
        out: &mut [f64],
    ) {
        // Gravity enters as an upward acceleration of the base.
        let (mut omega, mut alpha, mut a) = (DVec3::ZERO, DVec3::ZERO, -self.gravity);
        for (i, (frame, body)) in self.chain.frames.iter().zip(&self.bodies).enumerate() {
            let (back, t) = (s.rotations[i].transpose(), s.translations[i]);
            a = back * (a + alpha.cross(t) + omega.cross(omega.cross(t)));
            (omega, alpha) = (back * omega, back * alpha);
            let (rate, acceleration) = (qd[i], qdd(i));
            // ω × z = (ω_y, −ω_x, 0).
            let turning = DVec3::new(omega.y * rate, -omega.x * rate, acceleration);
            if frame.prismatic {
                a += DVec3::new(2.0 * turning.x, 2.0 * turning.y, turning.z);
            } else {
                alpha += turning;
                omega.z += rate;
            }
            s.forces[i] =
                body.mass * a + alpha.cross(body.moment) + omega.cross(omega.cross(body.moment));
            s.moments[i] =
                body.inertia * alpha + omega.cross(body.inertia * omega) + body.moment.cross(a);
        }
        self.gather(s, out);
    }

    /// Inward pass: accumulates the load of each joint and projects it onto the axis.
    fn gather(&self, s: &DynamicsScratch, out: &mut [f64]) {
        let (mut force, mut moment) = (DVec3::ZERO, DVec3::ZERO);
        for i in (0..self.bodies.len()).rev() {
            force += s.forces[i];
            moment += s.moments[i];
            out[i] = if self.chain.frames[i].prismatic {
                force.z
            } else {
                moment.z
            };
            force = s.rotations[i] * force;
            moment = s.rotations[i] * moment + s.translations[i].cross(force);
        }
    }

    /// Mass matrix, row-major, from composite bodies and joint screws in base axes about the last joint's origin: with this choice the
    /// wrist entries, which are the smallest, do not suffer cancellation. Returns the tip relative to that origin, base axes; the screws
    /// stay in the scratch.
    pub(super) fn composite_bodies(&self, s: &mut DynamicsScratch, out: &mut [f64]) -> DVec3 {
        let n = self.bodies.len();
        let (mut r, mut p) = (DMat3::IDENTITY, DVec3::ZERO);
        for i in 0..n {
            p += r * s.translations[i];
            r *= s.rotations[i];
            s.axes[i] = Axis {
                direction: r.z_axis,
                origin_m: p,
            };
            s.bodies[i] = self.bodies[i].rotated(r);
        }
        let center = p;
        for i in 0..n {
            let Axis {
                direction: z,
                origin_m,
            } = s.axes[i];
            let arm = origin_m - center;
            s.bodies[i] = s.bodies[i].about(arm);
            s.screws[i] = match self.chain.frames[i].prismatic {
                true => Screw::new(DVec3::ZERO, z),
                false => Screw::new(z, arm.cross(z)),
            };
        }
        let mut composite = Body::EMPTY;
        for i in (0..n).rev() {
            composite.mass += s.bodies[i].mass;
            composite.moment += s.bodies[i].moment;
            composite.inertia += s.bodies[i].inertia;
            // Force and moment for unit acceleration of joint i alone.
            let Screw {
                angular: w,
                linear: v,
            } = s.screws[i];
            let force = composite.mass * v + w.cross(composite.moment);
            let moment = composite.inertia * w + composite.moment.cross(v);
            for (j, screw) in s.screws[..=i].iter().enumerate() {
                let entry = screw.angular.dot(moment) + screw.linear.dot(force);
                out[i * n + j] = entry;
                out[j * n + i] = entry;
            }
        }
        r * self.chain.last_from_tip.position_m()
    }
}
