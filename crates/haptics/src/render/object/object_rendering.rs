//! A touched object that moves: the board moves along with it.

use super::force_lead::ForceLead;
use super::impedance::{CartesianImpedance, FaceMotion, ImpedanceConfig};
use super::object_port::{ObjectPort, ObjectPortConfig, PortLedger};
use super::path_follower::PathFollower;
use crate::arm::{ArmCommand, ArmState};
use crate::error::HapticsError;
use crate::motion::Slide;
use crate::object::{MovingObject, ObjectPath};
use hwall_geometry::{Twist, Wrench};
use hwall_kinematics::{
    ArmKinematics, ChainDynamics, JointPositions, JointVelocities, Unreachable,
};
use hwall_numeric::check::{all_finite, non_negative, positive};
use std::sync::Arc;

/// An object in the scene: its dynamics and its path.
#[derive(Debug, Clone)]
pub struct RenderedObject {
    /// Its motion.
    pub object: MovingObject,
    /// Maps its position to space, base frame.
    pub path: ObjectPath,
}

/// How the arm is commanded to move along with an object. The object is the same: a simulation driven by the measured force.
#[derive(Debug, Clone, PartialEq, Default)]
#[expect(
    clippy::large_enum_variant,
    reason = "made once, and its numbers are easier to write unboxed"
)]
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
    /// Delay of the filter (two equal low-passes) on the measured wrench, s; default 0.008. It is compensated like the other delays; a longer one
    /// makes commands smoother and light objects heavier.
    pub filter_s: f64,
    /// From a force to its measurement, s. `None`, the default: 0.0005 for positions (half a period), 0.0055 for torques (external torques of 25 Hz
    /// bandwidth).
    pub force_delay_s: Option<f64>,
    /// From a command to the motion of the face, s. `None`, the default: 0.022 for positions, the reaction of an iiwa ([H-Wall]), and 0.0085 for
    /// torques: 5 ms of transport, 3 ms in the torque loop, half a period.
    pub motion_delay_s: Option<f64>,
    /// Stiffest hand under which the board must be stable from the start, N/m; default 3000; 0: none, and no object is made heavier. Objects too
    /// light for it and the delays are made [heavier](ObjectRendering::least_inertia); if a hand turns out to be stiffer, as soon as that is
    /// detected.
    pub hand_stiffness_n_per_m: f64,
    /// Joint accelerations for following an object, rad/s²; default nine tenths of
    /// [`IIWA7_ACCELERATION_RAD_PER_S2`](hwall_motion::IIWA7_ACCELERATION_RAD_PER_S2). An object that accelerates faster is followed later.
    pub max_acceleration_rad_per_s2: [f64; 7],
    /// Limits the energy that the board delivers to what hands have put into the object.
    pub port: ObjectPortConfig,
}

impl Default for ObjectRenderingConfig {
    fn default() -> Self {
        Self {
            filter_s: 0.008,
            force_delay_s: None,
            motion_delay_s: None,
            hand_stiffness_n_per_m: 3000.0,
            max_acceleration_rad_per_s2: hwall_motion::IIWA7_ACCELERATION_RAD_PER_S2
                .map(|most| 0.9 * most),
            port: ObjectPortConfig::default(),
        }
    }
}

/// The result of a step with an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectStep {
    /// For the coming cycle.
    pub command: ArmCommand,
    /// Force that moves the object, filtered, N m or N.
    pub force: f64,
    /// Why the arm cannot follow, if so; the object is held back.
    pub unreachable: Option<Unreachable>,
    /// Why the board cannot slide as requested, if so; it then stands within the face.
    pub cannot_slide: Option<Unreachable>,
    /// Raised inertia of the object, kg m² or kg; `None`: as configured.
    pub raised_inertia: Option<f64>,
    /// Energy exchanged between hand and board since the touch began.
    pub ledger: PortLedger,
}

/// Renders one moving object at a time under a hand.
///
/// In every step the measured wrench on the face moves the object exactly by its own dynamics ([`MovingObject`]). Filter and sensors delay that by
/// `t_f`, and the arm by a further `t_m`. So the face is led to the object's predicted position `t_f + t_m` later, by the same dynamics and an
/// extrapolated force. (For torques the reference leads by `t_f`; feed-forward and compensated wrench lead by both.) The face stays on the path; a
/// door's board turns with it.
///
/// Compensation cannot remove the delays: hands act within them. Objects lighter than [`least_inertia`](Self::least_inertia) are made heavier, and
/// the step reports it. Allocates nothing after construction.
#[derive(Debug, Clone)]
pub struct ObjectRendering {
    follower: PathFollower,
    impedance: Option<CartesianImpedance>,
    filter_s: f64,
    force_delay_s: f64,
    motion_delay_s: f64,
    hand_stiffness_n_per_m: f64,
    force: ForceLead<1>,
    port: ObjectPort,
    /// The arm's acceleration limit along the path, after the last step, rad/s² or m/s².
    most_acceleration: f64,
}

/// Stiffness added to the configured one, N/m: even soft hands oscillate on very light objects. The stable cases of docs/FEEL.md lie below
/// `(k + 1000) t²` for all hands and arms.
const SOFTEST_N_PER_M: f64 = 1000.0;

impl ObjectRendering {
    /// The arm's tool is the face of the board.
    ///
    /// # Errors
    /// A setting outside its range; dynamics of another arm.
    pub fn new(
        arm: Arc<dyn ArmKinematics>,
        command: ObjectCommand,
        config: ObjectRenderingConfig,
    ) -> Result<Self, HapticsError> {
        let (impedance, force_delay_s, motion_delay_s) = match command {
            ObjectCommand::Position => (None, 0.0005, 0.022),
            ObjectCommand::Torque { dynamics, config } => {
                let arm = Arc::clone(&arm);
                let impedance = CartesianImpedance::new(arm, *dynamics, config)?;
                (Some(impedance), 0.0055, 0.0085)
            }
        };
        let filter_s = non_negative("filter_s", config.filter_s)?;
        let force_delay_s = config.force_delay_s.unwrap_or(force_delay_s);
        let motion_delay_s = config.motion_delay_s.unwrap_or(motion_delay_s);
        non_negative("force_delay_s", force_delay_s)?;
        non_negative("motion_delay_s", motion_delay_s)?;
        for most in config.max_acceleration_rad_per_s2 {
            positive("max_acceleration_rad_per_s2", most)?;
        }
        let hand_stiffness_n_per_m = config.hand_stiffness_n_per_m;
        non_negative("hand_stiffness_n_per_m", hand_stiffness_n_per_m)?;
        Ok(Self {
            follower: PathFollower::new(arm, config.max_acceleration_rad_per_s2),
            impedance,
            filter_s,
            force_delay_s,
            motion_delay_s,
            hand_stiffness_n_per_m,
            force: ForceLead::NONE,
            port: ObjectPort::new(
                config.port,
                force_delay_s,
                motion_delay_s,
                filter_s + force_delay_s + motion_delay_s,
            )?,
            most_acceleration: f64::INFINITY,
        })
    }

    /// Begins with a configuration that holds the face on the object. An object at rest gets its configured inertia back, which the last hand may
    /// have raised.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn begin(
        &mut self,
        rendered: &mut RenderedObject,
        q: &JointPositions,
    ) -> Result<(), HapticsError> {
        if rendered.object.velocity().abs() < RESTS_PER_S {
            rendered.object.restore_inertia();
        }
        if let Some(impedance) = &mut self.impedance {
            impedance.begin();
        }
        self.follower
            .begin(rendered.path, rendered.object.position(), q)?;
        let face = self.follower.face_at(rendered.object.position());
        self.port.begin(rendered.path, face);
        self.force = ForceLead::NONE;
        self.most_acceleration = f64::INFINITY;
        Ok(())
    }

    /// Joint angles that hold the face on the object, after the last step, rad.
    #[must_use]
    pub const fn q(&self) -> &JointPositions {
        self.follower.q()
    }

    /// Is the arm controlled by torques?
    pub(in crate::render) const fn by_torques(&self) -> bool {
        self.impedance.is_some()
    }

    /// Energy exchanged between hand and board since the touch began.
    #[must_use]
    pub const fn ledger(&self) -> &PortLedger {
        self.port.ledger()
    }

    /// Joint velocities when the object moves at a velocity (rad/s or m/s), rad/s.
    #[must_use]
    pub fn qd_at(&self, velocity: f64) -> JointVelocities {
        let rates = self.follower.joint_rates().unwrap_or_default();
        JointVelocities(rates.map(|rate| rate * velocity))
    }

    /// Smallest inertia that is stable under the stiffest hand, kg m² or kg: at the face `(k + 1000 N/m) t²`, with the hand's stiffness `k` and the
    /// sum `t` of all delays.
    #[must_use]
    pub fn least_inertia(&self, rendered: &RenderedObject) -> f64 {
        let face = self.follower.face_at(rendered.object.position());
        let lever = rendered
            .path
            .velocity_at(face.position_m(), 1.0)
            .linear_m_per_s
            .length();
        if self.hand_stiffness_n_per_m == 0.0 {
            return 0.0;
        }
        let stiffness_n_per_m = self.hand_stiffness_n_per_m + SOFTEST_N_PER_M;
        stiffness_n_per_m * (self.delay_s() * lever).powi(2)
    }

    /// Delay from the force to the motion, s.
    fn delay_s(&self) -> f64 {
        self.filter_s + self.force_delay_s + self.motion_delay_s
    }

    /// Sets the slide of the board within the face, in addition to the motion of the object; zero at the beginning of a touch. A non-finite slide
    /// counts as none.
    ///
    /// Along its own path an object moves as the hand pushes it. So on a panel or a drawer only the slide's component across the path is used, until
    /// the object has been held for 0.1 s by a stop that it is pushed against or by friction, with 1 N to spare. Then the board also slides along the
    /// path, and stops when the object moves again. Neither slide moves the object.
    pub fn set_slide(&mut self, slide: Option<&Slide>) {
        let finite = slide.filter(|slide| slide.validate().is_ok());
        self.follower
            .set_slide(&finite.copied().unwrap_or_default());
    }

    /// One step under the measured wrench of the hand on the face (base axes, about its centre).
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
        state.validate()?;
        all_finite("wrench", &wrench.to_array())?;
        // A hand stiffer than expected makes the loop oscillate until the object is heavy enough for it.
        let felt = self.port.felt_stiffness() * self.delay_s().powi(2);
        let least = match self.hand_stiffness_n_per_m > 0.0 {
            true => self.least_inertia(rendered).max(felt),
            false => 0.0,
        };
        let object = &mut rendered.object;
        if least > object.inertia() {
            object.raise_inertia(least)?;
        }
        let face = self.follower.face_at(self.follower.reached());
        let pushed = rendered.path.generalized_force(face.position_m(), wrench);
        let filtered = self.force.step(&[pushed], self.filter_s, dt_s);
        let force = filtered.value()[0];
        let way = rendered.path.velocity_at(face.position_m(), 1.0);
        let to_spare = HELD_WITH_N * way.linear_m_per_s.length();
        self.follower.hold(is_held(object, force, to_spare), dt_s);
        let (from, before) = (object.position(), object.velocity());
        object.step(force, dt_s)?;
        self.force = filtered;
        // An object that accelerates faster than the arm can feels heavier.
        let most = self.most_acceleration * dt_s;
        let (gained, speed) = (object.velocity() - before, object.velocity());
        if gained.abs() > most && gained * speed > 0.0 {
            let slower = before + gained.clamp(-most, most);
            let share = (before + slower) / (before + speed);
            let share = if share.is_finite() {
                share.clamp(0.0, 1.0)
            } else {
                0.0
            };
            object.hold_back(from + share * (object.position() - from), slower)?;
        }

        let force_lead_s = ForceLead::<1>::lag_s(self.filter_s, dt_s) + self.force_delay_s;
        let both_s = force_lead_s + self.motion_delay_s;
        let lead_s = match self.impedance {
            None => both_s,
            Some(_) => force_lead_s,
        };
        // Constant forces that give a mass the same displacement, or the same velocity, as a ramp.
        let (wanted, _) = object.after(self.force.after(lead_s / 3.0)[0], lead_s)?;
        let (_, velocity) = object.after(self.force.after(lead_s / 2.0)[0], lead_s)?;
        let measured = (pushed, self.follower.arm().forward(&state.q));
        let held_j = object.energy_j();
        let commanded = self.follower.commanded_way();
        let port = &mut self.port;
        let slid_along = self.follower.slid_along();
        let followed = self.follower.follow((wanted, velocity), dt_s, |rate| {
            let (force, face) = (measured.0, &measured.1);
            port.limited((force, face, slid_along), (held_j, commanded), rate, dt_s)
        })?;
        port.sent(followed.rate, followed.most_acceleration);
        self.most_acceleration = followed.most_acceleration;
        // If the port reduces a motion, the object is reduced as well: it loses that energy. Not when it reverses.
        let same_way = followed.rate * object.velocity() >= 0.0;
        let share = followed.share * if same_way { followed.allowed } else { 1.0 };
        if share < 1.0 {
            // Held back: it loses speed, and gains no energy.
            let slower = from + share * (object.position() - from);
            object.hold_back(slower, share * object.velocity())?;
        }
        let q = *self.follower.q();
        let command = match &mut self.impedance {
            None => ArmCommand::Position(q),
            Some(impedance) => {
                // Without joint rates the object stands.
                let rates = self.follower.joint_rates().unwrap_or_default();
                let pose = self.follower.face_at(self.follower.reached());
                // Only along the path: across it the stiffness holds the face, and a delayed compensation would make it oscillate there.
                let way = rendered
                    .path
                    .velocity_at(pose.position_m(), 1.0)
                    .linear_m_per_s;
                // Extrapolating a self-excited oscillation amplifies it.
                let spent = self.port.is_spent();
                let lead_n = if spent {
                    filtered.value()[0]
                } else {
                    self.force.after(both_s)[0]
                };
                let along_n = lead_n / way.length_squared().max(f64::MIN_POSITIVE);
                let held = Wrench {
                    force_n: way * along_n,
                    ..Wrench::default()
                };
                let velocity = share * velocity;
                let acceleration = rendered.object.acceleration_after(
                    self.force.after(0.5 * both_s)[0],
                    both_s,
                    self.force.after(both_s)[0],
                )?;
                // Limited to the acceleration of the reference: torques for a faster object would throw the arm about.
                let most = if spent {
                    0.0
                } else {
                    followed.most_acceleration
                };
                let acceleration = acceleration.clamp(-most, most);
                let (slides, slide_rates) = self.follower.slide_motion();
                let along = rendered.path.velocity_at(pose.position_m(), velocity);
                let wanted = FaceMotion {
                    twist: Twist {
                        linear_m_per_s: along.linear_m_per_s + slides.linear_m_per_s,
                        angular_rad_per_s: along.angular_rad_per_s + slides.angular_rad_per_s,
                    },
                    pose,
                    q,
                    qd: JointVelocities(std::array::from_fn(|i| {
                        rates[i] * velocity + slide_rates[i]
                    })),
                    qdd_rad_per_s2: rates
                        .map(|rate| share * (rate * acceleration).clamp(-MOST, MOST)),
                };
                ArmCommand::Torque(impedance.torques(state, &wanted, &held, dt_s)?)
            }
        };
        Ok(ObjectStep {
            command,
            force,
            unreachable: followed.unreachable,
            cannot_slide: followed.cannot_slide,
            raised_inertia: (rendered.object.inertia() > rendered.object.config().inertia)
                .then(|| rendered.object.inertia()),
            ledger: *self.port.ledger(),
        })
    }
}

/// An object slower than this rests, rad/s or m/s: a hand that bounces on it does not make it light again.
const RESTS_PER_S: f64 = 0.01;

/// An object held with less margin than this against the hand's push may move at any time, N at the face.
const HELD_WITH_N: f64 = 1.0;

/// Does the object stand, also under a slightly larger or smaller force, N m or N?
fn is_held(object: &MovingObject, force: f64, to_spare: f64) -> bool {
    let stays = |force: f64| object.acceleration(force) == 0.0;
    object.velocity() == 0.0 && stays(force - to_spare) && stays(force + to_spare)
}

/// Largest joint acceleration in the feed-forward, rad/s²: above that of any arm, but below that of hitting a stop.
const MOST: f64 = 20.0;
