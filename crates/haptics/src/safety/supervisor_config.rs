//! Settings of the supervisor.

use super::limits::contact_limits::ContactLimits;
use super::limits::load::LoadLimits;
use super::limits::motion_guard::GuardLimits;
use super::limits::person::{PersonLimits, PersonPart};
use super::watch::obedience::ObedienceConfig;
use super::watch::target_leaps::LeapLimits;
use super::watch::torque_bias::BiasConfig;
use super::watch::watchdog::ChannelWatch;
use crate::body::{BodyConfig, Room, SeparationConfig};
use crate::error::HapticsError;
use hwall_numeric::check::{non_negative, positive};

/// How long the states last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimingConfig {
    /// A fault that lasts longer than this turns holding into retreating (or stopped), s; default 0.3. A resting arm that is pushed yields at once.
    pub hold_s: f64,
    /// A fault that lasts longer than this turns retreating into stopped, s; default 1.5.
    pub retreat_s: f64,
    /// Inputs must have been sound for this long before commands go through again, s; default 0.25.
    pub recovery_s: f64,
    /// Distance of a retreat, m; default 0.1.
    pub retreat_m: f64,
    /// Speed of a retreat, m/s; default 0.1.
    pub retreat_m_per_s: f64,
    /// Speed at which the arm yields to a push, m/s; default 0.25, reduced speed of [ISO 10218-1]: a grip of 175 N with 2 kN/m is released in 0.35 s.
    pub yield_m_per_s: f64,
    /// Longest time by which one step advances a command, s; default 0.05, and no more than four nominal steps.
    pub max_step_s: f64,
}

impl Default for TimingConfig {
    fn default() -> Self {
        Self {
            hold_s: 0.3,
            retreat_s: 1.5,
            recovery_s: 0.25,
            retreat_m: 0.1,
            retreat_m_per_s: 0.1,
            yield_m_per_s: 0.25,
            max_step_s: 0.05,
        }
    }
}

/// Which faults need a person before the arm moves again ([`Supervisor::reset`](super::Supervisor::reset)). A requested stop always does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Latch {
    /// Every fault.
    Everything,
    /// A hand pressed too hard, an arm beyond its limits or disobeying, broken sensors, angles that return where the held arm cannot be. Other inputs
    /// that were missing or wrong for a while do not count. The default.
    #[default]
    Serious,
    /// None: every fault ends by itself once all inputs have been sound for the recovery time. For simulations without people.
    Nothing,
}

/// Settings of [`Supervisor`](super::Supervisor).
#[derive(Debug, Clone, PartialEq)]
pub struct SupervisorConfig {
    /// Limits of contact with a hand.
    pub contact: ContactLimits,
    /// Speed limits near the person.
    pub person: PersonLimits,
    /// Limits of pushes near the edge.
    pub load: LoadLimits,
    /// Joint limits; `None`: [`GuardLimits::of_arm`].
    pub guard: Option<GuardLimits>,
    /// Does the arm follow its commands? `None`: not checked.
    pub obedience: Option<ObedienceConfig>,
    /// Number of consecutive states that must agree before the first command; default 3. 1 disables the check.
    pub agreeing_states: u32,
    /// Allowed torque bias while nobody can touch the board; `None`: not checked.
    pub bias: Option<BiasConfig>,
    /// How often the target may jump.
    pub leaps: LeapLimits,
    /// Which faults need a person.
    pub latch: Latch,
    /// Parts of the person that must have been tracked before the arm moves, and are missed when they are lost; default head and fingertip. A part
    /// that is not required is not missed before it was first seen, and nothing keeps the arm away from it until then. Elbow and other hand, which
    /// headsets often lose, are never missed unless they are required.
    pub required: Vec<PersonPart>,
    /// Must external torques have been measured before the arm moves? Default true: an arm without them feels neither a touch nor a person that it
    /// squeezes.
    pub requires_torque: bool,
    /// The arm's body.
    pub body: BodyConfig,
    /// The real surroundings of the arm; `None`, the default: a floor at the height of its base.
    pub room: Option<Room>,
    /// How the arm keeps away from head and torso.
    pub separation: SeparationConfig,
    /// Effective mass at the board, kg; default infinite, which bounds that of every arm in every posture.
    /// [`Supervisor::set_effective_mass_kg`](super::Supervisor::set_effective_mass_kg) updates it with the configuration.
    pub effective_mass_kg: f64,
    /// The arm's state: angles, rad.
    pub position: ChannelWatch,
    /// The arm's state: velocities, rad/s.
    pub velocity: ChannelWatch,
    /// The arm's state: external torques, N m.
    pub torque: ChannelWatch,
    /// Fingertip and palm, m.
    pub hand: ChannelWatch,
    /// Heads, of the person and of bystanders, m.
    pub head: ChannelWatch,
    /// Target, m. May jump and stand still by default: the renderer moves there smoothly.
    pub target: ChannelWatch,
    /// Estimated force, N.
    pub force: ChannelWatch,
    /// Number of clock steps that may repeat the same time; default 20.
    pub repeated_times: usize,
    /// Largest step of the clock, s; default 0.2.
    pub largest_tick_s: f64,
    /// How long the states last.
    pub timing: TimingConfig,
}

impl Default for SupervisorConfig {
    fn default() -> Self {
        let watch = |max_age_s, jump, rate_per_s, frozen_s| ChannelWatch {
            max_age_s,
            jump,
            rate_per_s,
            frozen_s,
        };
        Self {
            contact: ContactLimits::default(),
            person: PersonLimits::default(),
            load: LoadLimits::default(),
            guard: None,
            obedience: Some(ObedienceConfig::default()),
            agreeing_states: 3,
            bias: Some(BiasConfig::default()),
            leaps: LeapLimits::default(),
            latch: Latch::default(),
            required: vec![PersonPart::Head, PersonPart::Fingertip],
            requires_torque: true,
            body: BodyConfig::default(),
            room: None,
            separation: SeparationConfig::default(),
            effective_mass_kg: f64::INFINITY,
            // The fastest joint of an iiwa turns at 3.1 rad/s.
            position: watch(0.1, 0.02, 5.0, Some(0.1)),
            velocity: watch(0.1, 1.0, 200.0, Some(0.2)),
            torque: watch(0.1, 250.0, 2e4, Some(0.2)),
            // A hand moves at up to about 5 m/s; a recovering tracker jumps.
            // Five frames at 90 Hz.
            hand: watch(0.06, 0.1, 8.0, Some(1.0)),
            head: watch(0.06, 0.1, 4.0, Some(1.0)),
            target: watch(0.25, f64::INFINITY, 0.0, None),
            force: watch(0.1, 500.0, 1e5, None),
            repeated_times: 20,
            largest_tick_s: 0.2,
            timing: TimingConfig::default(),
        }
    }
}

impl SupervisorConfig {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        self.contact.validate()?;
        self.person.validate()?;
        self.load.validate()?;
        self.body.validate()?;
        self.separation.validate()?;
        if let Some(guard) = &self.guard {
            guard.validate()?;
        }
        if let Some(obedience) = &self.obedience {
            obedience.validate()?;
        }
        if let Some(bias) = &self.bias {
            bias.validate()?;
        }
        self.leaps.validate()?;
        self.contact.speed_cap_m_per_s(self.effective_mass_kg)?;
        positive("largest_tick_s", self.largest_tick_s)?;
        let timing = &self.timing;
        non_negative("hold_s", timing.hold_s)?;
        non_negative("retreat_s", timing.retreat_s)?;
        non_negative("recovery_s", timing.recovery_s)?;
        non_negative("retreat_m", timing.retreat_m)?;
        positive("retreat_m_per_s", timing.retreat_m_per_s)?;
        positive("yield_m_per_s", timing.yield_m_per_s)?;
        positive("max_step_s", timing.max_step_s)?;
        Ok(())
    }

    /// Longest time from a fault to the last state (stopped or compliant) if the fault lasts, s: `hold + retreat`, and one more hold if the arm's
    /// state fails meanwhile. Until then the arm stands, floats or withdraws.
    #[must_use]
    pub fn longest_to_last_state_s(&self) -> f64 {
        2.0 * self.timing.hold_s + self.timing.retreat_s
    }
}
