//! A touched object that moves: the board goes along with it.

use super::impedance::{CartesianImpedance, FaceMotion, ImpedanceConfig};
use super::path_follower::PathFollower;
use crate::arm::{ArmCommand, ArmState};
use crate::error::HapticsError;
use crate::object::{MovingObject, ObjectPath};
use hwall_geometry::Wrench;
use hwall_kinematics::{
    ArmKinematics, ChainDynamics, JointPositions, JointVelocities, Unreachable,
};
use hwall_numeric::check::{non_negative, positive};
use std::sync::Arc;

/// An object in the scene: how it moves, and where.
#[derive(Debug, Clone)]
pub struct RenderedObject {
    /// Its motion.
    pub object: MovingObject,
    /// What its position means, base frame.
    pub path: ObjectPath,
}

/// How the arm is told to go along with an object. The object itself is the same: a simulation that the measured force
/// pushes.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum ObjectCommand {
    /// Admittance: the motion of the object as joint positions, for any arm with a position interface.
    #[default]
    Position,
    /// Impedance: a torque overlay that holds the face on the object with a Cartesian stiffness, for a compliant arm.
    Torque {
        /// Of the arm with the board.
        dynamics: Box<ChainDynamics>,
        /// Stiffness and damping.
        config: ImpedanceConfig,
    },
}

/// Settings of [`ObjectRendering`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectRenderingConfig {
    /// Time constant of the filter on the force that moves the object, s; default 0.004.
    pub filter_s: f64,
}

impl Default for ObjectRenderingConfig {
    fn default() -> Self {
        Self { filter_s: 0.004 }
    }
}

/// What a step with an object amounts to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectStep {
    /// For the coming cycle.
    pub command: ArmCommand,
    /// Force that moves the object, after the filter, N m or N.
    pub force: f64,
    /// Why the arm cannot go along, if so; the object is held back.
    pub unreachable: Option<Unreachable>,
}

/// Renders one object at a time under a hand.
///
/// In every step the measured wrench on the face moves the object by its own law, exactly ([`MovingObject`]), and the
/// face follows it along its path: a door's board turns with it. What the hand feels is the object as long as the arm follows;
/// the delay `t_d` of force and motion adds about `b t_d` of inertia to a damped object, and the device is stable where the
/// object is heavier than about `k_hand t_d²`. Allocates nothing after construction.
#[derive(Debug, Clone)]
pub struct ObjectRendering {
    follower: PathFollower,
    impedance: Option<CartesianImpedance>,
    config: ObjectRenderingConfig,
    force: f64,
    qd: JointVelocities,
}

impl ObjectRendering {
    /// The tool of the arm is the face of the board.
    ///
    /// # Errors
    /// A setting outside its range; dynamics of another arm.
    pub fn new(
        arm: Arc<dyn ArmKinematics>,
        command: ObjectCommand,
        config: ObjectRenderingConfig,
    ) -> Result<Self, HapticsError> {
        non_negative("filter_s", config.filter_s)?;
        let impedance = match command {
            ObjectCommand::Position => None,
            ObjectCommand::Torque { dynamics, config } => Some(CartesianImpedance::new(
                Arc::clone(&arm),
                *dynamics,
                config,
            )?),
        };
        Ok(Self {
            follower: PathFollower::new(arm),
            impedance,
            config,
            force: 0.0,
            qd: JointVelocities::default(),
        })
    }

    /// Begins with joints that hold the face on the object.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn begin(
        &mut self,
        rendered: &RenderedObject,
        q: &JointPositions,
    ) -> Result<(), HapticsError> {
        self.follower
            .begin(rendered.path, rendered.object.position(), q)?;
        self.force = 0.0;
        self.qd = JointVelocities::default();
        Ok(())
    }

    /// Joint angles that hold the face on the object, as of the last step, rad.
    #[must_use]
    pub const fn q(&self) -> &JointPositions {
        self.follower.q()
    }

    /// How they move there, rad/s.
    #[must_use]
    pub const fn qd(&self) -> &JointVelocities {
        &self.qd
    }

    /// One step under the measured wrench of the hand on the face (base axes, about its middle).
    ///
    /// # Errors
    /// NaN or infinity, a step that is not positive; the object then stays as it was.
    pub fn step(
        &mut self,
        rendered: &mut RenderedObject,
        state: &ArmState,
        wrench: &Wrench,
        dt_s: f64,
    ) -> Result<ObjectStep, HapticsError> {
        positive("dt_s", dt_s)?;
        let object = &mut rendered.object;
        let face = self.follower.face_at(object.position());
        let pushed = rendered.path.generalized_force(face.position_m(), wrench);
        let share = match self.config.filter_s > 0.0 {
            true => -(-dt_s / self.config.filter_s).exp_m1(),
            false => 1.0,
        };
        let force = self.force + share * (pushed - self.force);
        let (from, before) = (object.position(), *self.follower.q());
        object.step(force, dt_s)?;
        self.force = force;
        let unreachable = self.follower.follow(object, from, dt_s)?;
        let q = *self.follower.q();
        let qd = JointVelocities(std::array::from_fn(|i| (q[i] - before[i]) / dt_s));
        let command = match &mut self.impedance {
            None => ArmCommand::Position(q),
            Some(impedance) => {
                let pose = self.follower.face_at(object.position());
                let wanted = FaceMotion {
                    twist: rendered
                        .path
                        .velocity_at(pose.position_m(), object.velocity()),
                    pose,
                    q,
                    qd,
                    qdd_rad_per_s2: std::array::from_fn(|i| (qd[i] - self.qd[i]) / dt_s),
                };
                ArmCommand::Torque(impedance.torques(state, &wanted, wrench)?)
            }
        };
        self.qd = qd;
        Ok(ObjectStep {
            command,
            force,
            unreachable,
        })
    }
}
