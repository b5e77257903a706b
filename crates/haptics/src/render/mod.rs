//! What the arm does now: follow, wait, hold, or slide under the hand.
//!
//! # What holds when
//!
//! | phase | command |
//! | --- | --- |
//! | following | position, on the way to the goal; for an unreachable target the last goal is kept, with the reason |
//! | no target but a posture (`RenderInput::posture`) | position, on the way there, behind the surfaces |
//! | touched (above 3 N, until below 1.5 N for 50 ms) | position, brought to rest and frozen |
//! | touched, with a `Slide` (`Renderer::step_with`) | position, on the slide: its velocity as soon as the joints' accelerations allow and two low passes of 6 ms have followed (within 5 % after 29 ms), without overshoot and without a part along the normal |
//! | target missing, stale or not finite | position, brought to rest |
//! | state stale or not finite, torques that no hand exerts, clock bad | `ArmCommand::Hold`: the arm brakes by itself |
//!
//! Following resumes when the inputs are good again.
//!
//! # Objects that move
//!
//! `ObjectRendering` lets the board go along with a door, panel, drawer or button. In each step the measured wrench on the face moves the
//! object by its own law, and the arm is commanded to where the face has to be. It is driven in one of two ways:
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
//! rendering.begin(&panel, &q)?;
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
//! - **Delays are compensated.** Filter, sensors and arm are late by some 20 to 30 ms together; the face is led to where the object
//!   will be then, by the object's own law. `ObjectRenderingConfig::force_delay_s` and `motion_delay_s` must be those of the arm: measure
//!   them by a step of force and a sine of position. The defaults are those of an iiwa as it is simulated in `hwall-sim`. An arm whose
//!   delay is 5 ms longer than configured feels like `5 ms · k` more damping.
//! - **Light objects are made heavier.** Within the delay `t` a hand of stiffness `k` acts unseen; below about `(k + 1000 N/m) t²` at the
//!   face the board may swing. `ObjectRendering::least_inertia` is that bound, `ObjectStep::raised_inertia` says that it was applied. With
//!   30 ms and a hand of 3000 N/m it is 3.7 kg: such an arm cannot render a button of 50 g.
//! - **The face stays on the path.** Speeds and accelerations of the joints limit the way along the path, not each joint by itself; what
//!   speeds up faster feels heavier, and what the arm cannot reach holds the object back (`ObjectStep::unreachable`).
//! - **Assumed of a position interface**: commands every 1 to 5 ms are tracked with a constant delay, without overshoot; external torques
//!   (or a wrench sensor at the flange) at the same rate, compensated for the weight of the board. On an iiwa: FRI in position mode.
//! - **Assumed of a torque interface**: gravity is compensated by the arm, friction as far as `ImpedanceConfig::friction` leaves; link
//!   and rotor inertias are known (`rotor_inertia_kg_m2`; without them the feed-forward is short, and joints that are much
//!   lighter than configured oscillate); overlay torques act within 10 ms. On an iiwa: FRI with torque overlay and joint stiffness 0. The measured
//!   wrench is counteracted along the path alone.
//! - **No more energy comes out than went in.** Force at the board and motion along the path are an account of energy (`ObjectPortConfig`). A motion
//!   against the hand is paid from it: from what the object held at first, what hands put in, and a reserve of 0.05 J. The pushes of
//!   docs/FEEL.md never reach that limit (with a reserve of 0.02 J it would cut in on light damping at servo level, because a command that
//!   is 22 ms under way has to be paid in advance); a loop that swings by itself stops. `RenderStep::object_port` is the account.
//! - **A texture on a panel.** The path of a sliding panel lies in its face, where a texture slides, too. Across the path the board slides as
//!   commanded. Along the path the hand feels the panel itself, and the slide is left out; but a panel that has been held for 0.1 s, by a stop that it
//!   is pushed against or by friction (with 1 N to spare), lets the board slide along its path until it gives way. The panel moves as without the slide (within
//!   0.2 mm of its closed form, speeds within 2 %: `tests/it/object_slide.rs`), and the slide does not count in its account of energy.
//! - **Limits of the joints.** The face brakes before a joint meets its limit on the path. Under torques a push can turn joints in ways
//!   that were not planned; `JointGuard` keeps them off their limits of angle and speed.
//! - **Textures.** A board on an object slides within its face (`RenderInput::slide`) while it goes along; where the joints have no
//!   room or speed for both, the object goes first.
//! - **Not done**: the sensors' bias and ripple are not learnt (some tenths of a newton at the face: free objects creep unless they have
//!   friction); friction is fed forward, not observed.
//!
//! docs/FEEL.md in the repository says how far stiffness, mass and damping are what was asked for.

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
