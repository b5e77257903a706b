//! Model files: versioned JSON that restores the model bit by bit, or an error that names the fault.

use super::group::{Group, Role};
use super::layout::WeightLayout;
use super::prior::{PhaseVelocity, check_numbers};
use super::trained::{Model, ModelParts};
use super::tuning::Tuning;
use crate::basis::{Basis, OrthonormalBasis};
use crate::error::{BipError, length};
use crate::model_file::{self, Digest, Format};
use hwall_numeric::check;
use hwall_numeric::dense::Matrix;
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};

/// Format name and version written.
const FORMAT: Format = Format {
    name: "hwall-bip model",
    version: 2,
};

/// A whole file. Numbers are in the orthonormal bases of the filter, not in the named bases. The change of coordinates is stored too, because
/// another machine may compute it with other signs.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    version: u64,
    /// Digest of all fields below, hexadecimal.
    digest: String,
    demonstrations: usize,
    sampling_period: f64,
    phase_velocity_mean: f64,
    phase_velocity_variance: f64,
    shrinkage: f64,
    tuning: Option<Tuning>,
    groups: Vec<FileGroup>,
    offset: Vec<f64>,
    noise_fit: Vec<f64>,
    noise_held_out: Option<Vec<f64>>,
    mean: Vec<f64>,
    rank: usize,
    factor: Vec<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileGroup {
    name: String,
    role: Role,
    dofs: usize,
    basis: Basis,
    /// Independent functions among those of the basis.
    size: usize,
    /// Condition number; `None` is infinite.
    condition: Option<f64>,
    transform: Vec<f64>,
    inverse: Vec<f64>,
}

impl Model {
    /// The model as JSON: reading it gives an equal model, to the last bit.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Strings and finite numbers only: nothing that could fail.
        serde_json::to_string(&File::of(self)).unwrap_or_default()
    }

    /// Writes [`to_json`](Self::to_json).
    ///
    /// # Errors
    /// The writer fails.
    pub fn write_json(&self, writer: impl Write) -> Result<(), BipError> {
        Ok(model_file::write(writer, &self.to_json())?)
    }

    /// Reads what [`to_json`](Self::to_json) wrote, on any machine. White space does not matter.
    ///
    /// # Errors
    /// The text is not JSON, has another format or a newer version, or was truncated or edited: each number is checked, and all together are
    /// checked against the digest.
    pub fn from_json(text: &str) -> Result<Self, BipError> {
        FORMAT.parse::<File>(text)?.into_model()
    }

    /// Reads a file to its end; see [`from_json`](Self::from_json).
    ///
    /// # Errors
    /// Errors of [`from_json`](Self::from_json); also if the reader fails or the text is not UTF-8.
    pub fn read_json(reader: impl Read) -> Result<Self, BipError> {
        Self::from_json(&model_file::read(reader)?)
    }
}

impl File {
    fn of(model: &Model) -> Self {
        let parts = model.parts();
        let bases = parts.layout.bases();
        let groups = parts
            .layout
            .groups()
            .iter()
            .zip(bases)
            .map(|(group, basis)| FileGroup {
                name: group.name.clone(),
                role: group.role,
                dofs: group.dofs,
                basis: group.basis,
                size: basis.size(),
                condition: Some(basis.condition()).filter(|c| c.is_finite()),
                transform: basis.transform().entries().to_vec(),
                inverse: basis.inverse().entries().to_vec(),
            })
            .collect();
        let mut file = Self {
            format: FORMAT.name.to_owned(),
            version: FORMAT.version,
            digest: String::new(),
            demonstrations: parts.demonstrations,
            sampling_period: parts.sampling_period,
            phase_velocity_mean: parts.phase_velocity.mean,
            phase_velocity_variance: parts.phase_velocity.variance,
            shrinkage: parts.shrinkage,
            tuning: parts.tuning,
            groups,
            offset: parts.offset.clone(),
            noise_fit: parts.noise_fit.clone(),
            noise_held_out: parts.noise_held_out.clone(),
            mean: parts.mean.clone(),
            rank: parts.factor.columns(),
            factor: parts.factor.entries().to_vec(),
        };
        file.digest = file.digest();
        file
    }

    /// Checks lengths before allocating, then every number, then the digest.
    fn into_model(self) -> Result<Model, BipError> {
        let dofs = self
            .groups
            .iter()
            .try_fold(0_usize, |sum, g| sum.checked_add(g.dofs))
            .unwrap_or(usize::MAX);
        length("offset", dofs, self.offset.len())?;
        length("noise_fit", dofs, self.noise_fit.len())?;
        if let Some(noise) = &self.noise_held_out {
            length("noise_held_out", dofs, noise.len())?;
        }
        let weights = self
            .groups
            .iter()
            .try_fold(0_usize, |sum, g| {
                sum.checked_add(g.dofs.checked_mul(g.size)?)
            })
            .unwrap_or(usize::MAX);
        length("mean", weights, self.mean.len())?;
        let entries = weights.saturating_mul(self.rank);
        length("factor", entries, self.factor.len())?;
        let noise = self
            .noise_fit
            .iter()
            .chain(self.noise_held_out.iter().flatten());
        let shape = [&self.offset[..], &self.mean, &self.factor];
        check_numbers(shape, noise, self.sampling_period)?;
        let phase_velocity = PhaseVelocity {
            mean: self.phase_velocity_mean,
            variance: self.phase_velocity_variance,
        };
        phase_velocity.validate()?;
        let within = (0.0..=1.0).contains(&self.shrinkage);
        check::that(within, "shrinkage", self.shrinkage, "between 0 and 1")?;
        self.tuning.as_ref().map_or(Ok(()), Tuning::validate)?;
        let digest = self.digest();
        let groups: Vec<Group> = self
            .groups
            .iter()
            .map(|g| Group {
                name: g.name.clone(),
                dofs: g.dofs,
                basis: g.basis,
                role: g.role,
            })
            .collect();
        let bases = self
            .groups
            .into_iter()
            .map(|g| {
                let condition = g.condition.unwrap_or(f64::INFINITY);
                OrthonormalBasis::stored(g.basis, g.size, condition, g.transform, g.inverse)
            })
            .collect::<Result<Vec<_>, _>>()?;
        model_file::check_digest(&self.digest, digest)?;
        Ok(Model::from_parts(ModelParts {
            layout: WeightLayout::from_bases(groups, bases)?,
            offset: self.offset,
            mean: self.mean,
            factor: Matrix::from_rows(weights, self.rank, self.factor),
            noise_fit: self.noise_fit,
            noise_held_out: self.noise_held_out,
            phase_velocity,
            sampling_period: self.sampling_period,
            demonstrations: self.demonstrations,
            shrinkage: self.shrinkage,
            tuning: self.tuning,
        }))
    }

    fn digest(&self) -> String {
        let mut d = Digest::new();
        d.count(self.demonstrations);
        d.numbers(&[
            self.sampling_period,
            self.phase_velocity_mean,
            self.phase_velocity_variance,
            self.shrinkage,
        ]);
        let tuning = self.tuning.map(|t| {
            [
                t.noise_factor,
                t.acceleration_variance,
                t.spread,
                t.correlation_time,
            ]
        });
        d.optional(tuning.as_ref().map(|t| &t[..]));
        if let Some(tuning) = self.tuning.filter(|_| self.version > 1) {
            d.numbers(&[tuning.time_spread]);
        }
        d.count(self.groups.len());
        for g in &self.groups {
            d.count(g.name.len());
            d.bytes(g.name.as_bytes());
            let (kind, count, parameter) = match g.basis {
                Basis::Gaussian { count, variance } => (0, count, variance),
                Basis::NormalizedGaussian { count, variance } => (1, count, variance),
                Basis::Sigmoid { count, width } => (2, count, width),
                Basis::Polynomial { count } => (3, count, 0.0),
                Basis::Legendre { count } => (4, count, 0.0),
                Basis::Chebyshev { count } => (5, count, 0.0),
            };
            for n in [g.role as usize, g.dofs, kind, count, g.size] {
                d.count(n);
            }
            d.numbers(&[parameter, g.condition.unwrap_or(f64::INFINITY)]);
            d.numbers(&g.transform);
            d.numbers(&g.inverse);
        }
        d.numbers(&self.offset);
        d.numbers(&self.noise_fit);
        d.optional(self.noise_held_out.as_deref());
        d.numbers(&self.mean);
        d.count(self.rank);
        d.numbers(&self.factor);
        d.to_hex()
    }
}
