//! The energy balance at the port.

use crate::error::HapticsError;
use hwall_numeric::check::finite;

/// Energy that has gone in through a port, minus energy that has come out.
///
/// Book the force *of the hand on the device* times the motion in its direction; book an actuator's force with its sign reversed, since the device
/// delivers the actuator's work. While one factor is constant, the balance needs only the change of the other one's integral and is exact:
///
/// - impedance (motion measured, force held): [`book`](Self::book) with the held force and the measured displacement;
/// - admittance (force measured, velocity held): the mean of the force over the period and the displacement.
///
/// Source: the passivity observer of [Hannaford and Ryu 2002], with displacement for velocity times period [Ryu 2004].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EnergyObserver {
    net_j: f64,
    least_j: f64,
    absorbed_j: f64,
    released_j: f64,
}

impl EnergyObserver {
    /// Nothing booked.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            net_j: 0.0,
            least_j: 0.0,
            absorbed_j: 0.0,
            released_j: 0.0,
        }
    }

    /// Books a force (N) through a displacement (m). Returns the balance, J.
    ///
    /// # Errors
    /// NaN or infinity, also of the product; the balance then stays as it was.
    pub fn book(&mut self, force_n: f64, displacement_m: f64) -> Result<f64, HapticsError> {
        finite("force_n", force_n)?;
        finite("displacement_m", displacement_m)?;
        self.book_energy(force_n * displacement_m)
    }

    /// Books a known energy, J: into the device if positive. Returns the balance, J.
    ///
    /// # Errors
    /// NaN or infinity; the balance then stays as it was.
    pub fn book_energy(&mut self, energy_j: f64) -> Result<f64, HapticsError> {
        finite("energy_j", energy_j)?;
        let net_j = finite("balance_j", self.net_j + energy_j)?;
        self.net_j = net_j;
        self.least_j = self.least_j.min(net_j);
        if energy_j > 0.0 {
            self.absorbed_j += energy_j;
        } else {
            self.released_j -= energy_j;
        }
        Ok(net_j)
    }

    /// Energy in minus energy out, J; negative if more came out than went in.
    #[must_use]
    pub const fn net_j(&self) -> f64 {
        self.net_j
    }

    /// The lowest balance so far, J; at most 0.
    #[must_use]
    pub const fn least_j(&self) -> f64 {
        self.least_j
    }

    /// All energy that went in, J.
    #[must_use]
    pub const fn absorbed_j(&self) -> f64 {
        self.absorbed_j
    }

    /// All energy that came out, J.
    #[must_use]
    pub const fn released_j(&self) -> f64 {
        self.released_j
    }
}
