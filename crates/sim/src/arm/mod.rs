//! An arm at servo level and one at torque level, and the fingertip or the hand that presses its board.
//!
//! # The arm at servo level
//!
//! A command takes effect 22 ms after it was given. Commands every few milliseconds are a stream; the arm follows a stream within the limits with
//! only that delay, with an error below 1e-9 rad. Computation takes 0.2 µs per millisecond. Infeasible commands (a step, a jump, a ramp that is too
//! fast) are approached joint by joint on the time-optimal trajectory within limits of velocity, acceleration and jerk
//! (`hwall_motion::JointPoint`), without overshooting the position where the commands come to rest. `Hold` brakes as hard as the limits allow.
//! Velocity limits are the manufacturer's, acceleration limits those of Drake's description of the arm (5.4 to 13.8 rad/s²); that full acceleration
//! takes 10 ms to build up is an assumption. `cargo bench -p hwall-sim` prints time and error.
//!
//! # The arm at torque level
//!
//! `TorqueArm` accepts the commands of `ServoArm`, and `Torque`. The path from a command to a motion, and the assumptions about a real arm:
//!
//! ```text
//! command -> delay -> servo (Position, Hold) ----------------------\
//!                  -> overlay, at most 1 N m in 1 ms (Torque) + g(q) + friction compensation -> saturation -> delay, lag
//! state   <- momentum observer <- torque sensors <- links, stops, hand <- rotors, friction <- motor torque <--/
//! ```
//!
//! | part | what it does | default | source |
//! | --- | --- | --- | --- |
//! | command delay | a command applies from the first control period (1 ms) that begins after the delay | 5 ms | assumed, for FRI |
//! | servo | acceleration feedforward, PD on the reference motion of a `ServoArm`, model torques | 10 Hz, critically damped | assumed |
//! | overlay | added to gravity and friction compensation; no Coriolis torques | 1 N m in 1 ms | rate: typical clients of the torque interface |
//! | saturation | limit of the commanded motor torques | efforts of the chain: 176, 176, 110, 110, 110, 40, 40 N m | KUKA |
//! | inner torque loop | pure delay and first-order lag, both exact for any step | 1 ms, 2 ms (80 Hz) | assumed |
//! | rotors | inertia on the diagonal of the mass matrix, no gyroscopic torques, stiff gears | 3.4, 3.4, 3.4, 3.4, 1.3, 1.2, 1.2 kg m² | Drake's estimate for the iiwa 14 |
//! | hidden share | part of the rotor inertia `B` that the torque loop hides, `(1 - s) B` is felt | 0.8 | assumed; (Ott 2008) says that torque feedback does this |
//! | friction | breakaway, Stribeck, Coulomb, viscous, between motor and sensor; what the torque loop leaves | 1 N m (joints 1 to 4), 0.5, 0.3, 0.3; breakaway a quarter more | assumed |
//! | friction compensation | 80 % of the friction in motion, none below 0.01 rad/s, full from 0.05 rad/s | | users report that it is off at standstill; figures assumed |
//! | torque sensors | behind gear and friction; mean of a period, noise, bias, ripple by joint angle | 0.05 N m, 0, 0.1 N m 320 times a turn | assumed |
//! | external torque | momentum observer, no friction in it, first-order low pass | 25 Hz at -3 dB, time constant 6.4 ms | assumed |
//! | stops | at the joint limits, without rebound; their torque counts as external | on | |
//!
//! `TorqueConfig::ideal()` keeps only the rigid bodies, the stops and the observer. The controller may use a model that differs from the real
//! one (`with_controller_model`). Angles and velocities in the state are exact. Gears are stiff: no joint elasticity and no resonance from it.
//!
//! Friction and stops are solved as set-valued laws in every step: a joint below its breakaway torque stays exactly at rest, there is no chatter,
//! and neither friction nor stops do positive work. Integration: semi-implicit Euler in steps of 0.25 ms, or Runge-Kutta with steps split where a
//! joint comes to rest or reaches a stop.
//!
//! | checked (`tests/`) | result |
//! | --- | --- |
//! | six motions of half a second by MuJoCo 4.0.0, Runge-Kutta at 50 µs | 7e-9 rad; 3e-14 rad with the reference's flange of 1e-9 kg |
//! | energy without friction over 10 s in steps of 0.1 ms | Runge-Kutta 4e-10 J, semi-implicit 0.8 J at most |
//! | jerk-limited stream of positions at 1 kHz between goals up to 0.4 rad apart in each joint, board of 1 kg: joint, tool | 0.42 mrad, 0.30 mm; ideal 0.06 mrad, 0.05 mm |
//! | observer against the truth through its own low pass, arm in motion | 7 mN m of 8 N m |
//! | hand of 0.2 to 1 kg and 500 to 2000 N/m at 2 m/s, 1 kHz | stable, no energy gained |
//! | one second of 1 kHz control (`cargo bench -p hwall-sim --bench torque`) | 5.5 ms; Runge-Kutta 18 ms |
//!
//! `HandBody` is a mass on the spring and damper of the human arm behind a finger that only pushes, with Coulomb friction along the face. Its step
//! returns the mean force over the millisecond; the arm then gets this force for the same millisecond:
//!
//! ```rust
//! use hwall_haptics::{Arm, ArmCommand};
//! use hwall_kinematics::{Chain, ChainDynamics, Inertial, JointPositions, JointTorques, Pose, SrsArm};
//! use hwall_kinematics::glam::DVec3;
//! use hwall_sim::{HandBody, HandBodyConfig, HandDrive, TorqueArm, TorqueConfig};
//! use std::sync::Arc;
//!
//! let board = Inertial::solid_box("board", 1.0, DVec3::new(0.0, 0.0, 0.03), DVec3::new(0.2, 0.2, 0.02));
//! let face = Pose::from_translation(DVec3::new(0.0, 0.0, 0.04))?;
//! let mut arm = TorqueArm::new(
//!     Arc::new(SrsArm::iiwa7().with_tool(face)),
//!     ChainDynamics::new(&Chain::iiwa7())?.with_payload(&board)?,
//!     JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]),
//!     TorqueConfig::default(),
//! )?;
//! arm.command(ArmCommand::Torque(JointTorques::default()))?; // compliant
//!
//! let normal = arm.pose().rotation().z_axis;
//! let before_m = arm.pose().position_m();
//! let mut hand = HandBody::new(HandBodyConfig::default(), before_m + 0.01 * normal, DVec3::ZERO)?;
//! for _ in 0..500 {
//!     let wrench = hand.step(1e-3, &arm.pose(), &arm.twist(), &HandDrive::Force(-15.0 * normal))?;
//!     arm.apply_wrench(wrench)?;
//!     arm.advance(1e-3)?;
//! }
//! assert!((arm.pose().position_m() - before_m).dot(normal) < -0.02); // the board gave way
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! References: (Armstrong 1994) Armstrong-Hélouvry, Dupont, Canudas de Wit, A survey of models, analysis tools and compensation methods for the
//! control of machines with friction, Automatica 30(7). (De Luca 2006) De Luca, Albu-Schäffer, Haddadin, Hirzinger, Collision detection and safe
//! reaction with the DLR-III lightweight manipulator arm, IROS. (Ott 2008) Ott, Cartesian impedance control of redundant and flexible-joint robots,
//! Springer. Stewart, Trinkle, An implicit time-stepping scheme for rigid body dynamics with inelastic collisions and Coulomb friction, Int. J.
//! Numer. Methods Eng. 39, 1996. (Hajian 1997) Hajian, Howe, Identification of the mechanical impedance at the human finger tip, J. Biomech. Eng.
//! 119(1). (Tsuji 1995) Tsuji, Morasso, Goto, Ito, Human hand impedance characteristics during maintained posture, Biol. Cybern. 72. ISO/TS
//! 15066:2016, annex A. Measurements of hands are used only as orders of magnitude.

mod config;
mod hand_contact;
mod servo;
mod stream;
mod tool;
mod torque;
mod tracking;

pub use config::ServoConfig;
pub use hand_contact::HandContact;
pub use servo::ServoArm;
pub use torque::{
    ChainMotion, ChainMotionConfig, DriveConfig, FrictionCompensation, HandBody, HandBodyConfig,
    HandDrive, HeldTorques, Integrator, JointFriction, MotionSample, MotionSampling, PositionServo,
    TorqueArm, TorqueConfig, TorqueSensor, sample_motion,
};
