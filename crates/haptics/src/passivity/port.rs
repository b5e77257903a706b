//! Combines energy balance, controller and tank.

use super::account::PortAccount;
use super::controller::PassivityController;
use super::observer::EnergyObserver;
use super::port_config::{Causality, PassivityMethod, PortConfig};
use super::tank::EnergyTank;
use crate::error::HapticsError;
use hwall_numeric::check::{finite, non_negative};

/// The tank keeps this multiple of the energy stored on the virtual side: with less, the reserve for pending commands is missing; with more, it feeds
/// oscillations for longer.
const KEPT: f64 = 2.0;

/// The inputs of a port at a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PortInput {
    /// Measured position of the device along the axis (the direction in which the hand pushes), m.
    pub position_m: f64,
    /// Measured force of the hand on the device along the axis, N; ignored for impedance.
    pub hand_force_n: f64,
    /// The wanted command: force of the actuator on the device (N; negative for a wall, which pushes back) or velocity of the device (m/s).
    pub wanted: f64,
    /// Energy stored on the virtual side, in springs (`f² / 2 K` of a wall) and moving masses, J. The tank drops what exceeds twice that. `None`: it
    /// drops nothing, and energy taken by a virtual damper may come out again.
    pub stored_j: Option<f64>,
}

/// The outputs of a port.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PortOutput {
    /// The command that keeps the port passive: N or m/s.
    pub command: f64,
    /// Difference from the wanted command: N or m/s.
    pub change: f64,
    /// Observed energy balance, J.
    pub seen_j: f64,
    /// Guaranteed energy balance: the observed one minus all that sensors and sampling may hide, J.
    pub sure_j: f64,
    /// Energy in the tank, J.
    pub tank_j: f64,
}

/// A port that delivers no more energy than has gone in.
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
    /// The wanted command when it last changed by more than the band.
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

    /// The observed energy balance.
    #[must_use]
    pub const fn observer(&self) -> &EnergyObserver {
        self.account.observer()
    }

    /// Sets the stiffness of the hand from now on, N/m.
    pub(crate) const fn set_hand_stiffness(&mut self, n_per_m: f64) {
        self.account.set_hand_stiffness(n_per_m);
    }

    /// Sets the way against the hand that was commanded and that the device has not made yet, m: it may be longer than the delay explains.
    pub(crate) const fn set_outstanding(&mut self, way_m: f64) {
        self.account.set_outstanding(way_m);
    }

    /// Sets the largest deceleration of the device from now on, m/s².
    pub(crate) const fn set_braking(&mut self, m_per_s2: f64) {
        self.account.set_braking(m_per_s2);
    }

    /// Reports the command actually sent in this period, if it was less than [`step`](Self::step) allowed.
    pub fn sent(&mut self, command: f64) {
        if command.is_finite() {
            self.account.decided(command);
        }
    }

    /// One sample: call it once in every period. Does not allocate.
    ///
    /// # Errors
    /// NaN or infinity; nothing then changes, and the caller must command zero or hold.
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

    /// Adds the damping that dissipates a shortage.
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

    /// The share that the tank can pay for.
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
