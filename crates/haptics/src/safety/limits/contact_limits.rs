//! Limits of contact with a hand.

use crate::error::HapticsError;
use hwall_numeric::check::{non_negative, positive, that};

/// Limits of contact with a hand, named after [ISO/TS 15066].
///
/// Secondary publications quote the standard with different values, and parts of the hand differ. Confirm these defaults for each setup against the
/// standard itself and the risk assessment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactLimits {
    /// Force that may last, also on a hand clamped by the board, N; default 140 (hands and fingers).
    pub quasi_static_n: f64,
    /// Force of a short impact on a free hand, N; default 280, twice the quasi-static one.
    pub transient_n: f64,
    /// How long a force counts as an impact, s; default 0.5.
    pub transient_s: f64,
    /// Energy that an impact may transfer, J; default 0.49 (hands and fingers).
    pub energy_j: f64,
    /// Pressure that may last, N/m²; default 1.9e6 (190 N/cm², the least of the values for a hand).
    pub pressure_n_per_m2: f64,
    /// Factor by which an impact may exceed the lasting pressure; default 2.
    pub transient_pressure_factor: f64,
    /// Area over which the board meets a hand, m²; default 1e-4 (a fingertip, 1 cm²).
    pub contact_area_m2: f64,
    /// Mass of a hand, kg; default 0.6.
    pub hand_mass_kg: f64,
    /// Stiffness of a hand in an impact, N/m; default 75 000.
    pub hand_stiffness_n_per_m: f64,
    /// A hand that was pressed too hard counts as free below this, N; default 65, the smallest force limit of any body region (face).
    pub relaxed_n: f64,
    /// Forces above this are implausible: the sensors are broken, N; default 1000.
    pub implausible_n: f64,
}

impl Default for ContactLimits {
    fn default() -> Self {
        Self {
            quasi_static_n: 140.0,
            transient_n: 280.0,
            transient_s: 0.5,
            energy_j: 0.49,
            pressure_n_per_m2: 1.9e6,
            transient_pressure_factor: 2.0,
            contact_area_m2: 1e-4,
            hand_mass_kg: 0.6,
            hand_stiffness_n_per_m: 75e3,
            relaxed_n: 65.0,
            implausible_n: 1000.0,
        }
    }
}

impl ContactLimits {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("quasi_static_n", self.quasi_static_n)?;
        positive("transient_n", self.transient_n)?;
        let ordered = self.transient_n >= self.quasi_static_n;
        that(
            ordered,
            "transient_n",
            self.transient_n,
            "at least quasi_static_n",
        )?;
        non_negative("transient_s", self.transient_s)?;
        positive("energy_j", self.energy_j)?;
        positive("pressure_n_per_m2", self.pressure_n_per_m2)?;
        let factor = self.transient_pressure_factor;
        let valid = factor >= 1.0 && factor.is_finite();
        that(valid, "transient_pressure_factor", factor, "at least 1")?;
        positive("contact_area_m2", self.contact_area_m2)?;
        positive("hand_mass_kg", self.hand_mass_kg)?;
        positive("hand_stiffness_n_per_m", self.hand_stiffness_n_per_m)?;
        positive("relaxed_n", self.relaxed_n)?;
        let plausible = self.implausible_n >= self.transient_n && self.implausible_n.is_finite();
        that(
            plausible,
            "implausible_n",
            self.implausible_n,
            "at least transient_n",
        )?;
        Ok(())
    }

    /// Force that may last, N: the lesser of force and pressure times area.
    #[must_use]
    pub fn lasting_force_n(&self) -> f64 {
        let by_pressure_n = self.pressure_n_per_m2 * self.contact_area_m2;
        self.quasi_static_n.min(by_pressure_n)
    }

    /// Force of an impact, N: the lesser of force and pressure times area.
    #[must_use]
    pub fn impact_force_n(&self) -> f64 {
        let factor = self.transient_pressure_factor;
        let by_pressure_n = factor * self.pressure_n_per_m2 * self.contact_area_m2;
        self.transient_n.min(by_pressure_n)
    }

    /// Reduced mass of hand and device, kg: `1 / (1/m_hand + 1/m)`. An infinite mass gives that of the hand.
    #[must_use]
    pub fn reduced_mass_kg(&self, effective_mass_kg: f64) -> f64 {
        1.0 / (1.0 / self.hand_mass_kg + 1.0 / effective_mass_kg)
    }

    /// Relative speed at which a device of this effective mass may meet a hand, m/s: `F / sqrt(μ k)`, and no more than the
    /// energy allows, `sqrt(2 E / μ)`.
    ///
    /// Two masses with a spring in between ([ISO/TS 15066], annex A); see
    /// [`effective_mass_kg`](crate::passivity::effective_mass_kg).
    ///
    /// # Errors
    /// A mass that is not positive. Infinity is a mass.
    pub fn speed_cap_m_per_s(&self, effective_mass_kg: f64) -> Result<f64, HapticsError> {
        let mass = effective_mass_kg;
        that(mass > 0.0, "effective_mass_kg", mass, "positive")?;
        let mu = self.reduced_mass_kg(mass);
        let by_force = self.impact_force_n() / (mu * self.hand_stiffness_n_per_m).sqrt();
        Ok(by_force.min((2.0 * self.energy_j / mu).sqrt()))
    }
}
