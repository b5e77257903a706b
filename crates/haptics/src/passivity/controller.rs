//! Dissipates generated energy.

use crate::error::HapticsError;
use hwall_numeric::check::{finite, positive};

/// How much a [`PassivityController`] may do in one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DissipationLimit {
    /// Largest gain: N s/m for a force correction (impedance), m/(N s) for a velocity correction (admittance). A sampled damper above its stable
    /// limit generates energy instead; see [`DampingDesign::most_sampled_n_s_per_m`](super::DampingDesign::most_sampled_n_s_per_m).
    pub gain: f64,
    /// Largest correction: N, or m/s.
    pub correction: f64,
}

impl DissipationLimit {
    /// Rejects limits that are not positive.
    ///
    /// # Errors
    /// The first limit outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("gain", self.gain)?;
        positive("correction", self.correction)?;
        Ok(())
    }
}

/// A damper that acts only while energy has to be dissipated.
///
/// For a shortage `E < 0` it adds `-α c` to the command, where `c` is the variable that the port imposes (velocity for impedance, force for
/// admittance) and `α = -E / (c² T)`: this dissipates the shortage within one period if `c` stays constant and no limit applies. The rest stays in
/// the balance for later steps.
///
/// It acts afterwards: the energy of up to one period and the delay comes out first.
///
/// Source: [Hannaford and Ryu 2002], eq. (11) to (16), with limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassivityController {
    limit: DissipationLimit,
}

impl PassivityController {
    /// With limits.
    ///
    /// # Errors
    /// As [`DissipationLimit::validate`].
    pub fn new(limit: DissipationLimit) -> Result<Self, HapticsError> {
        limit.validate()?;
        Ok(Self { limit })
    }

    /// What to add to the command for the coming period: for impedance the force on the device (N) from its velocity (m/s), for admittance the
    /// velocity of the device, against the force of the hand *on* it.
    ///
    /// `balance_j` is the energy balance, J; nothing is added from zero on. `imposed` is the variable that the port imposes.
    ///
    /// # Errors
    /// NaN, infinity, or a period that is not positive.
    pub fn correction(
        &self,
        balance_j: f64,
        imposed: f64,
        period_s: f64,
    ) -> Result<f64, HapticsError> {
        finite("balance_j", balance_j)?;
        finite("imposed", imposed)?;
        positive("period_s", period_s)?;
        if balance_j >= 0.0 || imposed == 0.0 {
            return Ok(0.0);
        }
        let gain = (-balance_j / (imposed * imposed * period_s)).min(self.limit.gain);
        let size = (gain * imposed.abs()).min(self.limit.correction);
        Ok(-size.copysign(imposed))
    }
}
