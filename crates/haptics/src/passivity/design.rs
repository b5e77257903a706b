//! How much damping a stiffness needs, and how much stiffness a damping allows.

use crate::error::HapticsError;
use glam::DVec3;
use hwall_kinematics::{Jacobian, MOST_JOINTS};
use hwall_numeric::ArgumentError;
use hwall_numeric::check::{all_finite, non_negative, positive, that};
use hwall_numeric::dense::{cholesky_in_place, solve_lower};

/// Timing of a sampled force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampling {
    /// Sampling period, s; the force is held in between.
    pub period_s: f64,
    /// From the measurement of a position until the resulting force acts, s.
    pub delay_s: f64,
}

impl Sampling {
    /// Rejects a period that is not positive and a negative delay.
    ///
    /// # Errors
    /// The first value outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("period_s", self.period_s)?;
        non_negative("delay_s", self.delay_s)?;
        Ok(())
    }

    /// Mean lag of a held, delayed force, s: `T/2 + t_d`.
    #[must_use]
    pub fn lag_s(&self) -> f64 {
        0.5 * self.period_s + self.delay_s
    }
}

/// Physical damping that makes a sampled, delayed wall passive, N s/m: `b = K (T/2 + t_d) + |B|`.
///
/// `stiffness_n_per_m` is the stiffness of the virtual wall (K), `virtual_damping_n_s_per_m` (B) the damping that the program adds; the result is the
/// friction of the device itself. Without delay this is the condition of [Colgate and Schenkel 1997], with delay that of [Hulin 2014] in the limit of
/// small damping; docs/PASSIVITY.md compares it with simulation.
///
/// # Errors
/// NaN, infinity or a negative stiffness, a period that is not positive, a negative delay.
pub fn required_damping_n_s_per_m(
    stiffness_n_per_m: f64,
    virtual_damping_n_s_per_m: f64,
    sampling: &Sampling,
) -> Result<f64, HapticsError> {
    non_negative("stiffness_n_per_m", stiffness_n_per_m)?;
    all_finite("virtual_damping_n_s_per_m", &[virtual_damping_n_s_per_m])?;
    sampling.validate()?;
    Ok(stiffness_n_per_m * sampling.lag_s() + virtual_damping_n_s_per_m.abs())
}

/// Damping for a stiffness acting on a mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DampingDesign {
    /// Damping for passivity of the sampled, delayed stiffness, N s/m: `K (T/2 + t_d)`.
    pub passive_n_s_per_m: f64,
    /// Damping for the wanted damping ratio of mass and stiffness, N s/m: `2 ζ sqrt(K m)`.
    pub ratio_n_s_per_m: f64,
    /// Most damping that a program may add, N s/m: `m / (T/2 + t_d)`. A sampled damper itself is unstable beyond `2 m / T` (no delay), which equals
    /// this limit, or about `(π/2) m / t_d` (mostly delay).
    pub most_sampled_n_s_per_m: f64,
}

impl DampingDesign {
    /// For a stiffness (N/m) acting on the effective mass (kg), see [`effective_mass_kg`].
    ///
    /// # Errors
    /// A stiffness, mass or ratio that is not positive, or a bad [`Sampling`].
    pub fn new(
        stiffness_n_per_m: f64,
        mass_kg: f64,
        damping_ratio: f64,
        sampling: &Sampling,
    ) -> Result<Self, HapticsError> {
        positive("stiffness_n_per_m", stiffness_n_per_m)?;
        positive("mass_kg", mass_kg)?;
        positive("damping_ratio", damping_ratio)?;
        Ok(Self {
            passive_n_s_per_m: required_damping_n_s_per_m(stiffness_n_per_m, 0.0, sampling)?,
            ratio_n_s_per_m: 2.0 * damping_ratio * (stiffness_n_per_m * mass_kg).sqrt(),
            most_sampled_n_s_per_m: mass_kg / sampling.lag_s(),
        })
    }

    /// Total damping to use, N s/m: the larger of the two needs.
    #[must_use]
    pub fn total_n_s_per_m(&self) -> f64 {
        self.passive_n_s_per_m.max(self.ratio_n_s_per_m)
    }

    /// Damping that the program should add to a device with this friction of its own, N s/m: the difference, but at most half the limit of a sampled
    /// damper.
    #[must_use]
    pub fn added_n_s_per_m(&self, physical_n_s_per_m: f64) -> f64 {
        (self.total_n_s_per_m() - physical_n_s_per_m)
            .min(0.5 * self.most_sampled_n_s_per_m)
            .max(0.0)
    }
}

/// Effective mass of the tool along a direction, kg: `1 / (nᵀ J M⁻¹ Jᵀ n)`.
///
/// `jacobian` in base axes, `mass_matrix` (kg m²) row-major, `n × n` with `n` up to 7, as `ChainDynamics::mass_matrix` returns it (any number of the
/// first joints; the others do not move); `direction` of any length but zero, base axes. If no joint moves the tool along the direction the mass is
/// infinite. Does not allocate. Source: [Khatib 1995].
///
/// # Errors
/// NaN or infinity, a matrix that is not square, too large, or not positive definite, a direction without length.
pub fn effective_mass_kg(
    jacobian: &Jacobian,
    mass_matrix: &[f64],
    direction: DVec3,
) -> Result<f64, HapticsError> {
    all_finite("mass_matrix", mass_matrix)?;
    all_finite("jacobian", jacobian.to_rows().as_flattened())?;
    let along = hwall_geometry::direction("direction", direction)?;
    let joints = (1..=MOST_JOINTS).find(|n| n * n == mass_matrix.len());
    let entries = mass_matrix.len() as f64;
    let Some(joints) = joints else {
        that(
            false,
            "entries of mass_matrix",
            entries,
            "the square of 1 to 7",
        )?;
        return Ok(f64::INFINITY);
    };
    let mut lower = [0.0; MOST_JOINTS * MOST_JOINTS];
    let lower = &mut lower[..mass_matrix.len()];
    lower.copy_from_slice(mass_matrix);
    cholesky_in_place(joints, lower).map_err(|bad| ArgumentError::OutOfRange {
        what: "pivot of mass_matrix",
        value: bad.value,
        wanted: "positive",
    })?;
    // nᵀ J M⁻¹ Jᵀ n = |L⁻¹ Jᵀ n|².
    let mut torques: [f64; MOST_JOINTS] = jacobian.linear.map(|column| column.dot(along));
    let torques = &mut torques[..joints];
    solve_lower(lower, torques);
    Ok(1.0 / torques.iter().map(|x| x * x).sum::<f64>())
}
