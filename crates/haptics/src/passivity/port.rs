//! The one way to use account, controller and tank.

use super::account::PortAccount;
use super::controller::{DissipationLimit, PassivityController};
use super::design::Sampling;
use super::observer::EnergyObserver;
use super::tank::EnergyTank;
use crate::error::HapticsError;
use hwall_numeric::check::{finite, non_negative, positive, that};

/// What the tank keeps of what the virtual side holds: with less, what is promised to commands under way is missing; with more,
/// it feeds oscillations for longer.
const KEPT: f64 = 2.0;

/// What is measured at the port, and what is commanded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Causality {
    /// Motion in, force out: torque overlay on a compliant arm. The command is the force of the actuator on the device, N,
    /// held for a period.
    Impedance,
    /// Force in, motion out: a position-controlled arm. The command is the velocity of the device, m/s, held for a period
    /// (its position a ramp).
    Admittance,
}

/// What keeps a port passive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum PassivityMethod {
    /// Nothing: the account is kept, the command goes through.
    Off,
    /// A damper once the account, as it looks, is below zero ([`PassivityController`]). It repairs; what has come out is felt.
    Controller,
    /// A command is let through as far as what has surely gone in pays for the worst that it may cost ([`EnergyTank`]).
    #[default]
    Tank,
    /// The damper as soon as less than nothing is free, and the tank for what is left.
    Both,
}

impl PassivityMethod {
    /// All four, from none to both.
    pub const ALL: [Self; 4] = [Self::Off, Self::Controller, Self::Tank, Self::Both];

    /// A short name for tables and files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Controller => "observer and controller",
            Self::Tank => "tank",
            Self::Both => "both",
        }
    }
}

/// What a hand may do, at most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandBounds {
    /// Force with which it pushes, N; default 280, the transient limit of contact with a hand [ISO/TS 15066].
    pub push_n: f64,
    /// Force with which it pulls, N; default 0: a bare hand on a board cannot pull.
    pub pull_n: f64,
    /// Speed at which it meets the device, m/s; default 2.
    pub speed_m_per_s: f64,
    /// Its stiffness, N/m; default 3000.
    pub stiffness_n_per_m: f64,
    /// Its damping, N s/m; default 20.
    pub damping_n_s_per_m: f64,
}

impl Default for HandBounds {
    fn default() -> Self {
        Self {
            push_n: 280.0,
            pull_n: 0.0,
            speed_m_per_s: 2.0,
            stiffness_n_per_m: 3000.0,
            damping_n_s_per_m: 20.0,
        }
    }
}

/// Settings of a [`PassivePort`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PortConfig {
    /// Which variable is commanded.
    pub causality: Causality,
    /// What keeps it passive.
    pub method: PassivityMethod,
    /// When commands are computed and act. The delay must be known; it may be up to 60 periods.
    pub sampling: Sampling,
    /// Mass of the device at the port, kg; where it varies the least. Default 2; used for impedance alone.
    pub mass_kg: f64,
    /// Friction of the device itself that may be counted upon, N s/m; default 0. What it dissipates may come out elsewhere.
    pub damping_n_s_per_m: f64,
    /// Largest error of a measured position (noise and resolution, not a constant offset), m; default 1e-5.
    pub position_error_m: f64,
    /// Largest error of a measured force, N; default 0.1. Used for admittance alone.
    pub force_error_n: f64,
    /// What the hand may do.
    pub hand: HandBounds,
    /// Largest command: N or m/s; default 140 N, the quasi-static limit for a hand; set it for admittance.
    pub most: f64,
    /// Limits of the damper; the default is that of [`PortConfig::impedance`].
    pub dissipation: DissipationLimit,
    /// How fast the device can brake, m/s²; default infinite, as for a light one; used for admittance alone.
    pub braking_m_per_s2: f64,
    /// The command changes only when what is wanted differs by more than this from what was wanted when it last changed, N or
    /// m/s; default 0. Set it to the noise of the wanted command: what does not change hides nothing from the account, so
    /// that a wall that is leaned on stands for ever instead of giving way slowly.
    pub still_band: f64,
    /// Energy that may come out before any has gone in, J; default 0.
    pub initial_j: f64,
    /// Most that is kept for giving out again, J; default 5.
    pub capacity_j: f64,
    /// Time constant with which the tank lets go what is above twice [`PortInput::stored_j`], s; default 0.05.
    pub spill_s: f64,
}

impl PortConfig {
    /// Impedance causality with defaults; the damper is limited to half of what a sampled one bears in front of the mass.
    #[must_use]
    pub fn impedance(sampling: Sampling, mass_kg: f64) -> Self {
        Self {
            causality: Causality::Impedance,
            method: PassivityMethod::default(),
            sampling,
            mass_kg,
            damping_n_s_per_m: 0.0,
            position_error_m: 1e-5,
            force_error_n: 0.1,
            hand: HandBounds::default(),
            most: 140.0,
            dissipation: DissipationLimit {
                gain: 0.5 * mass_kg / sampling.lag_s(),
                correction: 40.0,
            },
            braking_m_per_s2: f64::INFINITY,
            still_band: 0.0,
            initial_j: 0.0,
            capacity_j: 5.0,
            spill_s: 0.05,
        }
    }

    /// Admittance causality with defaults; the damper yields no more than half a stiff hand's give a period.
    #[must_use]
    pub fn admittance(sampling: Sampling, most_m_per_s: f64) -> Self {
        let hand = HandBounds::default();
        Self {
            causality: Causality::Admittance,
            most: most_m_per_s,
            dissipation: DissipationLimit {
                gain: 0.5 / (hand.stiffness_n_per_m * sampling.lag_s()),
                correction: 0.25,
            },
            ..Self::impedance(sampling, 2.0)
        }
    }

    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        self.sampling.validate()?;
        positive("mass_kg", self.mass_kg)?;
        non_negative("damping_n_s_per_m", self.damping_n_s_per_m)?;
        non_negative("position_error_m", self.position_error_m)?;
        non_negative("force_error_n", self.force_error_n)?;
        non_negative("push_n", self.hand.push_n)?;
        non_negative("pull_n", self.hand.pull_n)?;
        non_negative("speed_m_per_s", self.hand.speed_m_per_s)?;
        non_negative("stiffness_n_per_m", self.hand.stiffness_n_per_m)?;
        non_negative("hand.damping_n_s_per_m", self.hand.damping_n_s_per_m)?;
        positive("most", self.most)?;
        self.dissipation.validate()?;
        non_negative("still_band", self.still_band)?;
        non_negative("initial_j", self.initial_j)?;
        positive("spill_s", self.spill_s)?;
        let valid = self.capacity_j >= self.initial_j;
        that(valid, "capacity_j", self.capacity_j, "at least initial_j")?;
        Ok(())
    }
}

/// What a port is given at a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PortInput {
    /// Measured position of the device along the axis (the way in which the hand pushes), m.
    pub position_m: f64,
    /// Measured force of the hand on the device along the axis, N; not read for impedance.
    pub hand_force_n: f64,
    /// The command that is wanted: force of the actuator on the device (N; a wall pushes back, below zero) or velocity of the
    /// device (m/s).
    pub wanted: f64,
    /// Energy that the virtual side holds by itself: of its springs (`f² / 2 K` of a wall) and moving masses, J. The tank
    /// forgets what goes beyond twice that. `None`: it forgets nothing, and what a virtual damper took may come out again.
    pub stored_j: Option<f64>,
}

/// What a port answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PortOutput {
    /// The command that keeps the port passive: N or m/s.
    pub command: f64,
    /// By how much it differs from what was wanted: N or m/s.
    pub change: f64,
    /// Energy that has gone in less what has come out, as measured, J.
    pub seen_j: f64,
    /// The same, less all that sensors and sampling may hide, J.
    pub sure_j: f64,
    /// What the tank holds, J.
    pub tank_j: f64,
}

/// A port that gives out no more energy than has gone in.
///
/// ```
/// use hwall_haptics::passivity::{PassivePort, PortConfig, PortInput, Sampling};
///
/// let sampling = Sampling { period_s: 1e-3, delay_s: 5e-3 };
/// let mut port = PassivePort::new(PortConfig::impedance(sampling, 2.0))?;
/// // In every cycle: a wall of 2000 N/m at zero.
/// let position_m: f64 = 1e-4;
/// let wanted = -2000.0 * position_m.max(0.0);
/// let force_n = port.step(&PortInput { position_m, hand_force_n: 0.0, wanted, stored_j: None })?.command;
/// assert!(force_n.abs() <= wanted.abs());
/// # Ok::<(), hwall_haptics::HapticsError>(())
/// ```
#[derive(Debug, Clone)]
pub struct PassivePort {
    config: PortConfig,
    account: PortAccount,
    controller: PassivityController,
    tank: EnergyTank,
    /// What was wanted when it last changed by more than the band.
    held: f64,
}

impl PassivePort {
    /// A device at rest that nothing has acted on.
    ///
    /// # Errors
    /// As [`PortConfig::validate`], or a delay of more than 60 periods.
    pub fn new(config: PortConfig) -> Result<Self, HapticsError> {
        config.validate()?;
        Ok(Self {
            account: PortAccount::new(config)?,
            controller: PassivityController::new(config.dissipation)?,
            tank: EnergyTank::new(config.initial_j, config.capacity_j)?,
            held: 0.0,
            config,
        })
    }

    /// The settings.
    #[must_use]
    pub const fn config(&self) -> &PortConfig {
        &self.config
    }

    /// The tank.
    #[must_use]
    pub const fn tank(&self) -> &EnergyTank {
        &self.tank
    }

    /// The account as it looks.
    #[must_use]
    pub const fn observer(&self) -> &EnergyObserver {
        self.account.observer()
    }

    /// The hand is as stiff as this from now on, N/m.
    pub(crate) const fn set_hand_stiffness(&mut self, n_per_m: f64) {
        self.account.set_hand_stiffness(n_per_m);
    }

    /// The device brakes as fast as this from now on, m/s².
    pub(crate) const fn set_braking(&mut self, m_per_s2: f64) {
        self.account.set_braking(m_per_s2);
    }

    /// What the device was really told in this period, if it was less than what [`step`](Self::step) let through.
    pub fn sent(&mut self, command: f64) {
        if command.is_finite() {
            self.account.decided(command);
        }
    }

    /// One sample: call it once in every period. Does not allocate.
    ///
    /// # Errors
    /// NaN or infinity; nothing then changes, and the caller commands nothing or holds.
    pub fn step(&mut self, input: &PortInput) -> Result<PortOutput, HapticsError> {
        finite("position_m", input.position_m)?;
        finite("hand_force_n", input.hand_force_n)?;
        finite("wanted", input.wanted)?;
        if let Some(stored_j) = input.stored_j {
            non_negative("stored_j", stored_j)?;
        }
        let new_j = self.account.sample(input.position_m, input.hand_force_n)?;
        self.tank.exchange(new_j)?;
        if let Some(stored_j) = input.stored_j {
            let share = -(-self.config.sampling.period_s / self.config.spill_s).exp_m1();
            self.tank.let_go(KEPT * stored_j, share)?;
        }
        let most = self.config.most;
        if (input.wanted - self.held).abs() > self.config.still_band || input.wanted == 0.0 {
            self.held = input.wanted;
        }
        let wanted = self.held.clamp(-most, most);
        let command = match self.config.method {
            PassivityMethod::Off => wanted,
            PassivityMethod::Controller => {
                let balance_j = self.account.seen_j() + self.config.initial_j;
                self.damped(wanted, balance_j, input)?
            }
            PassivityMethod::Tank => self.paid(wanted)?,
            PassivityMethod::Both => {
                let reserved_j = self.account.cost(wanted).reserved_j;
                let free_j = self.tank.energy_j() - self.tank.debt_j() - reserved_j;
                let damped = self.damped(wanted, free_j, input)?;
                self.paid(damped)?
            }
        };
        self.account.decided(command);
        Ok(PortOutput {
            command,
            change: command - input.wanted,
            seen_j: self.account.seen_j(),
            sure_j: self.account.sure_j(),
            tank_j: self.tank.energy_j(),
        })
    }

    /// With what dissipates a shortage.
    fn damped(
        &mut self,
        wanted: f64,
        balance_j: f64,
        input: &PortInput,
    ) -> Result<f64, HapticsError> {
        let period_s = self.config.sampling.period_s;
        let correction = match self.config.causality {
            Causality::Impedance => {
                let velocity = self.account.velocity_m_per_s();
                self.controller.correction(balance_j, velocity, period_s)?
            }
            // The device yields to the force of the hand.
            Causality::Admittance => {
                -self
                    .controller
                    .correction(balance_j, input.hand_force_n, period_s)?
            }
        };
        let most = self.config.most;
        Ok((wanted + correction).clamp(-most, most))
    }

    /// As much of it as the tank can pay for.
    fn paid(&self, wanted: f64) -> Result<f64, HapticsError> {
        let yields = self.config.causality == Causality::Admittance && wanted > 0.0;
        if wanted == 0.0 || yields {
            return Ok(wanted);
        }
        let cost = self.account.cost(wanted);
        let size = self
            .tank
            .affordable(wanted.abs(), cost.a, cost.b, cost.reserved_j)?;
        Ok(size.copysign(wanted))
    }
}
