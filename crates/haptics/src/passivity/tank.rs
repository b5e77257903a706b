//! The only store from which energy may come out.

use crate::error::HapticsError;
use hwall_numeric::check::{finite, non_negative, that};

/// Energy that may be released again.
///
/// Energy that enters through the port fills the tank up to its capacity (the excess counts as dissipated); energy that leaves drains it. An action
/// is allowed only as far as the tank can pay for its worst-case cost. So the tank never runs below zero while the worst case was predicted; an
/// unpredicted loss is a debt that is paid back before anything else is released.
///
/// Source: the energy tanks of [Ferraguti 2013]; here the state is the energy itself instead of its root.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnergyTank {
    energy_j: f64,
    capacity_j: f64,
    debt_j: f64,
}

impl EnergyTank {
    /// With an initial energy and a capacity, J.
    ///
    /// # Errors
    /// A negative energy, or a capacity below it. An infinite capacity is valid.
    pub fn new(energy_j: f64, capacity_j: f64) -> Result<Self, HapticsError> {
        non_negative("energy_j", energy_j)?;
        that(
            capacity_j >= energy_j,
            "capacity_j",
            capacity_j,
            "at least the energy at first",
        )?;
        Ok(Self {
            energy_j,
            capacity_j,
            debt_j: 0.0,
        })
    }

    /// Energy that went in (positive) or came out (negative), J.
    ///
    /// # Errors
    /// NaN or infinity; the tank then stays as it was.
    pub fn exchange(&mut self, energy_j: f64) -> Result<(), HapticsError> {
        finite("energy_j", energy_j)?;
        let level_j = finite("level_j", self.energy_j - self.debt_j + energy_j)?;
        self.debt_j = (-level_j).max(0.0);
        let level_j = level_j.max(0.0);
        self.energy_j = level_j.min(self.capacity_j);
        Ok(())
    }

    /// Drops a share of the energy above a level: energy that is no longer needed must not feed an oscillation.
    ///
    /// # Errors
    /// NaN, a negative level, or a share outside [0, 1].
    pub fn let_go(&mut self, above_j: f64, share: f64) -> Result<(), HapticsError> {
        that(above_j >= 0.0, "above_j", above_j, "at least 0")?;
        that((0.0..=1.0).contains(&share), "share", share, "from 0 to 1")?;
        let gone_j = share * (self.energy_j - above_j).max(0.0);
        self.energy_j -= gone_j;
        Ok(())
    }

    /// The largest `x` in `[0, wanted]` with `a x² + b x + reserved <= energy - debt`, J: the first two terms are the worst-case cost of an action of
    /// size `x` (`b < 0`: a small action is sure to gain energy), `reserved` is promised already (negative: sure to be gained first). In debt, only
    /// actions that are sure to gain energy.
    ///
    /// # Errors
    /// NaN, infinity, or a negative `wanted` or `a`.
    pub fn affordable(
        &self,
        wanted: f64,
        a: f64,
        b: f64,
        reserved_j: f64,
    ) -> Result<f64, HapticsError> {
        non_negative("wanted", wanted)?;
        non_negative("a", a)?;
        finite("b", b)?;
        finite("reserved_j", reserved_j)?;
        let free_j = self.energy_j - self.debt_j - reserved_j;
        if b >= 0.0 && free_j < 0.0 {
            return Ok(0.0);
        }
        // The larger root of a x² + b x = free, without cancellation; without a root, the action that gains most.
        let root = (b * b + 4.0 * a * free_j).max(0.0).sqrt();
        let most = if b > 0.0 {
            2.0 * free_j / (b + root)
        } else if a > 0.0 {
            (root - b) / (2.0 * a)
        } else {
            f64::INFINITY
        };
        Ok(wanted.min(most))
    }

    /// Stored energy, J; never negative.
    #[must_use]
    pub const fn energy_j(&self) -> f64 {
        self.energy_j
    }

    /// Unpredicted energy that came out and is not paid back yet, J.
    #[must_use]
    pub const fn debt_j(&self) -> f64 {
        self.debt_j
    }
}
