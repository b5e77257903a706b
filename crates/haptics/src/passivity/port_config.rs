//! Settings of a port.

use super::controller::DissipationLimit;
use super::design::Sampling;
use crate::error::HapticsError;
use hwall_numeric::check::{non_negative, positive, that};

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

/// The method that keeps a port passive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum PassivityMethod {
    /// None: the balance is tracked, the command passes.
    Off,
    /// A damper that acts while the observed balance is negative ([`PassivityController`](super::PassivityController)). It acts afterwards: the hand
    /// feels the energy that has come out.
    Controller,
    /// Passes a command as far as the guaranteed energy pays for its worst-case cost ([`EnergyTank`](super::EnergyTank)).
    #[default]
    Tank,
    /// The damper as soon as the free energy is negative, and the tank for the rest.
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

/// Limits of the hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandBounds {
    /// Largest pushing force, N; default 280, the transient limit of contact with a hand [ISO/TS 15066].
    pub push_n: f64,
    /// Largest pulling force, N; default 0: a bare hand on a board cannot pull.
    pub pull_n: f64,
    /// Largest speed at which it meets the device, m/s; default 2.
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

/// Settings of a [`PassivePort`](super::PassivePort).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PortConfig {
    /// Which variable is commanded.
    pub causality: Causality,
    /// The method that keeps it passive.
    pub method: PassivityMethod,
    /// Timing of the commands. The delay must be known; it may be up to 60 periods.
    pub sampling: Sampling,
    /// Smallest mass of the device at the port, kg; default 2; used only for impedance.
    pub mass_kg: f64,
    /// Guaranteed friction of the device itself, N s/m; default 0. The energy that it dissipates may come out elsewhere.
    pub damping_n_s_per_m: f64,
    /// Largest error of a measured position (noise and resolution, not a constant offset), m; default 1e-5.
    pub position_error_m: f64,
    /// Largest error of a measured force, N; default 0.1. Used only for admittance.
    pub force_error_n: f64,
    /// Limits of the hand.
    pub hand: HandBounds,
    /// Largest command: N or m/s; default 140 N, the quasi-static limit for a hand; set it for admittance.
    pub most: f64,
    /// Limits of the damper; the default is that of [`PortConfig::impedance`].
    pub dissipation: DissipationLimit,
    /// Largest deceleration of the device, m/s²; default infinite, as for a light device; used only for admittance.
    pub braking_m_per_s2: f64,
    /// The command changes only when the wanted command differs by more than this from its value at the last change, N or m/s; default 0. Set it to
    /// the noise of the wanted command: a constant command hides nothing from the balance, so a wall that is leaned on stands forever instead of
    /// yielding slowly.
    pub still_band: f64,
    /// Energy that may come out before any has gone in, J; default 0.
    pub initial_j: f64,
    /// Largest energy stored for later release, J; default 5.
    pub capacity_j: f64,
    /// Time constant with which the tank drops what exceeds twice [`PortInput::stored_j`](super::PortInput::stored_j), s; default 0.05.
    pub spill_s: f64,
}

impl PortConfig {
    /// Impedance causality with defaults; the damper is limited to half of what a sampled damper can have on this mass.
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

    /// Admittance causality with defaults; within the lag the damper yields at most half the deflection of the default hand.
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
