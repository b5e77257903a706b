//! The arm's behaviour now: follow, wait, hold, or slide under the hand.
//!
//! # Commands in each phase
//!
//! | phase | command |
//! | --- | --- |
//! | following | position, on the path to the goal; for an unreachable target the last goal is kept, and the reason is reported |
//! | no target but a posture (`RenderInput::posture`) | position, on the path there, behind the surfaces |
//! | touched (above 3 N, until below 1.5 N for 50 ms) | position, brought to rest and frozen |
//! | touched, with a `Slide` (`Renderer::step_with`) | position, on the slide: it reaches its velocity as soon as the joints' accelerations and two 6 ms low-passes allow (within 5 % after 29 ms), without overshoot and without a component along the normal |
//! | target missing, stale or not finite | position, brought to rest |
//! | state stale or not finite, implausible torques, bad clock | `ArmCommand::Hold`: the arm brakes by itself |
//!
//! Following resumes when the inputs are good again.
//!
//! # Objects that move
//!
//! With `ObjectRendering` the board moves along with a door, panel, drawer or button. In each step the measured wrench on the face moves the object
//! by its own dynamics, and the arm is commanded to the resulting pose of the face, in one of two ways:
//!
//! | `ObjectCommand` | for | what is sent |
//! | --- | --- | --- |
//! | `Position` (admittance) | any arm with a cyclic position interface | joint angles on the path |
//! | `Torque` (impedance) | a compliant arm with a torque overlay | `Jᵀ (K e + D ė − F) + M q̈ + …` on top of gravity |
//!
//! ```rust
//! use hwall_haptics::glam::DVec3;
//! use hwall_haptics::kinematics::{ArmKinematics, JointPositions, JointVelocities, SrsArm, Wrench};
//! use hwall_haptics::{
//!     ArmState, Board, MovingObject, ObjectCommand, ObjectConfig, ObjectPath, ObjectRendering, ObjectRenderingConfig,
//!     RenderedObject,
//! };
//! use std::sync::Arc;
//!
//! let arm = Arc::new(SrsArm::iiwa7().with_tool(Board::default().flange_from_board_face()?));
//! let q = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
//! let inward = -arm.forward(&q).rotation().z_axis;
//! let mut panel = RenderedObject {
//!     object: MovingObject::new(ObjectConfig { damping: 20.0, ..ObjectConfig::new(8.0) })?,
//!     path: ObjectPath::sliding(inward)?,
//! };
//! let mut rendering = ObjectRendering::new(arm, ObjectCommand::Position, ObjectRenderingConfig::default())?;
//! rendering.begin(&mut panel, &q)?;
//! let state = ArmState { t_s: 0.0, q, qd: JointVelocities::default(), external_torque: None };
//! let wrench = Wrench { force_n: 10.0 * inward, ..Wrench::default() };
//! for _ in 0..200 {
//!     let step = rendering.step(&mut panel, &state, &wrench, 1e-3)?;
//!     assert_eq!(step.unreachable, None);
//! }
//! assert!(panel.object.position() > 0.01);
//! # Ok::<(), hwall_haptics::HapticsError>(())
//! ```
//!
//! - **Delays are compensated.** Filter, sensors and arm together lag by some 20 to 30 ms; the face is led to the object's predicted position then,
//!   by the object's own dynamics. Set `ObjectRenderingConfig::force_delay_s` and `motion_delay_s` to those of the arm: measure them with a force
//!   step and a position sine. The defaults are those of an iiwa as simulated in `hwall-sim`. An arm whose delay is 5 ms longer than configured feels
//!   like `5 ms · k` more damping.
//! - **Light objects are made heavier.** Within the delay `t` the system cannot react to a hand of stiffness `k`; below about `(k + 1000 N/m) t²` at
//!   the face the board may oscillate. `ObjectRendering::least_inertia` is that bound; `ObjectStep::raised_inertia` reports that it was applied. With
//!   30 ms and a hand of 3000 N/m it is 3.7 kg: such an arm cannot render a button of 50 g. A heavier object keeps its damping ratio.
//! - **The face stays on the path.** Joint speeds and accelerations limit the motion along the path, not each joint by itself. An object that
//!   accelerates faster feels heavier; one that the arm cannot follow is held back (`ObjectStep::unreachable`).
//! - **Requirements of a position interface**: commands every 1 to 5 ms are tracked with a constant delay, without overshoot; external torques (or a
//!   wrench sensor at the flange) come at the same rate, compensated for the board's weight. On an iiwa: FRI in position mode.
//! - **Requirements of a torque interface**: the arm compensates gravity, and friction down to `ImpedanceConfig::friction`; link and rotor inertias
//!   are known (`rotor_inertia_kg_m2`; without them the feed-forward is too small, and joints much lighter than configured oscillate); overlay
//!   torques act within 10 ms. On an iiwa: FRI with torque overlay and joint stiffness 0. The measured wrench is compensated only along the path.
//! - **No more energy comes out than went in.** Force at the board and motion along the path enter an energy balance (`ObjectPortConfig`). It pays
//!   for motions against the hand: from the object's initial energy, the energy put in by hands, and a reserve of 0.05 J. The pushes of docs/FEEL.md
//!   never reach that limit (with a reserve of 0.02 J it would act on light damping at servo level, because a command that is pending for 22 ms is
//!   paid in advance); a self-excited oscillation stops. `RenderStep::object_port` reports the balance.
//! - **A texture on a panel.** The path of a sliding panel lies in its face, where a texture also slides. Across the path the board slides as
//!   commanded. Along the path the hand feels the panel itself, and the slide is ignored, until the panel has been held for 0.1 s by a stop that it
//!   is pushed against or by friction (with 1 N to spare). Then the board also slides along the path, until the panel moves again. The panel moves as
//!   without the slide (within 0.2 mm of its closed form, speeds within 2 %: `tests/it/object_slide.rs`), and the slide does not count in its energy
//!   balance.
//! - **Limits of the joints.** The face brakes before a joint meets its limit on the path. Under torque control a push can turn joints in unplanned
//!   ways; `JointGuard` keeps them off their limits of angle and speed.
//! - **Textures.** A board on an object can slide within its face (`RenderInput::slide`) while it moves along; if the joints lack range or speed for
//!   both, the object has priority.
//! - **Not done**: the sensors' bias and ripple are not learnt (some tenths of a newton at the face: free objects creep unless they have friction);
//!   friction is fed forward, not observed.
//!
//! docs/FEEL.md in the repository compares rendered and configured stiffness, mass and damping.

mod aim;
mod config;
mod contact;
mod hold;
mod object;
mod proximity;
mod recess;
mod renderer;
mod step;
mod supervised;
mod yielding;

pub use config::{ForceConfig, RendererConfig, WatchdogConfig};
pub use contact::{ContactConfig, ContactDetector, ContactState};
pub use hold::HoldReason;
pub use object::impedance::{CartesianImpedance, FaceMotion, FrictionLeft, ImpedanceConfig};
pub use object::joint_guard::JointGuard;
pub use object::object_port::{ObjectPortConfig, PortLedger};
pub use object::object_rendering::{
    ObjectCommand, ObjectRendering, ObjectRenderingConfig, ObjectStep, RenderedObject,
};
pub use proximity::ProximityConfig;
pub(crate) use proximity::distance_and_closing;
pub use renderer::Renderer;
pub use step::{Phase, PostureTarget, RenderInput, RenderStep};
pub(crate) use yielding::{beyond, is_push};
