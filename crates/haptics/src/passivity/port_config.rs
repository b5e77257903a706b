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

/// What keeps a port passive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum PassivityMethod {
    /// Nothing: the account is kept, the command goes through.
    Off,
    /// A damper once the account, as it looks, is below zero ([`PassivityController`](super::PassivityController)). It repairs; what has come out is felt.
    Controller,
    /// A command is let through as far as what has surely gone in pays for the worst that it may cost ([`EnergyTank`](super::EnergyTank)).
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

/// Settings of a [`PassivePort`](super::PassivePort).
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
    /// Time constant with which the tank lets go what is above twice [`PortInput::stored_j`](super::PortInput::stored_j), s; default 0.05.
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
