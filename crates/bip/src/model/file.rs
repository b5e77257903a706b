//! Model files: versioned JSON that gives back the model bit by bit, or says what is wrong.

use crate::error::{finite, length, not_negative, positive, share};
use crate::model::lay_out_with;
use crate::orthonormal::OrthonormalBasis;
use crate::{Basis, BipError, Group, Model, PhaseVelocity, Role, Tuning};
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};

/// What a file of this crate calls itself.
const FORMAT: &str = "hwall-bip model";
/// The version written, and the newest one read.
const VERSION: u64 = 1;

/// Read before anything else: the rest of a newer version may look different.
#[derive(Deserialize)]
struct Header {
    format: String,
    version: u64,
}

/// A whole file. Numbers are those of the filter, not of the named bases: the change of
/// coordinates is stored too, because another machine may compute it with other signs.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    version: u64,
    /// Digest of all that follows, hexadecimal.
    digest: String,
    demonstrations: usize,
    sampling_period: f64,
    phase_velocity_mean: f64,
    phase_velocity_variance: f64,
    shrinkage: f64,
    tuning: Option<FileTuning>,
    groups: Vec<FileGroup>,
    offset: Vec<f64>,
    noise_fit: Vec<f64>,
    noise_held_out: Option<Vec<f64>>,
    mean: Vec<f64>,
    rank: usize,
    factor: Vec<f64>,
}

#[derive(Serialize, Deserialize, Clone, Copy)]
#[serde(deny_unknown_fields)]
struct FileTuning {
    noise_factor: f64,
    acceleration_variance: f64,
    spread: f64,
    correlation_time: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileGroup {
    name: String,
    role: FileRole,
    dofs: usize,
    basis: FileBasis,
    /// Independent functions among those of the basis.
    size: usize,
    /// Condition number; none is infinite.
    condition: Option<f64>,
    transform: Vec<f64>,
    inverse: Vec<f64>,
}

#[derive(Serialize, Deserialize, Clone, Copy)]
#[serde(rename_all = "snake_case")]
enum FileRole {
    Observed,
    Controlled,
    Either,
}

#[derive(Serialize, Deserialize, Clone, Copy)]
#[serde(rename_all = "snake_case", tag = "kind", deny_unknown_fields)]
enum FileBasis {
    Gaussian { count: usize, variance: f64 },
    NormalizedGaussian { count: usize, variance: f64 },
    Sigmoid { count: usize, width: f64 },
    Polynomial { count: usize },
    Legendre { count: usize },
    Chebyshev { count: usize },
}

/// Writing and reading, with the feature `serde`.
impl Model {
    /// The model as a file: reading it gives an equal model, every number to the last bit.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Strings and finite numbers only: nothing that could fail.
        serde_json::to_string(&File::of(self)).unwrap_or_default()
    }

    /// Writes [`to_json`](Self::to_json).
    ///
    /// # Errors
    /// The writer fails.
    pub fn write_json(&self, mut writer: impl Write) -> Result<(), BipError> {
        writer
            .write_all(self.to_json().as_bytes())
            .and_then(|()| writer.flush())
            .map_err(|e| BipError::Io { kind: e.kind() })
    }

    /// Reads what [`to_json`](Self::to_json) wrote, on any machine. White space does not matter.
    ///
    /// # Errors
    /// No JSON, another format, a newer version; a file that was cut off or edited: every number
    /// is checked for itself, and all together against the digest.
    pub fn from_json(text: &str) -> Result<Self, BipError> {
        let header: Header = serde_json::from_str(text).map_err(damage)?;
        if header.format != FORMAT {
            return Err(BipError::FileFormat {
                expected: FORMAT,
                found: header.format,
            });
        }
        if header.version == 0 || header.version > VERSION {
            return Err(BipError::FileVersion {
                newest: VERSION,
                found: header.version,
            });
        }
        let file: File = serde_json::from_str(text).map_err(damage)?;
        file.into_model()
    }

    /// Reads a file to its end; see [`from_json`](Self::from_json).
    ///
    /// # Errors
    /// As there; the reader fails, or it holds no UTF-8.
    pub fn read_json(mut reader: impl Read) -> Result<Self, BipError> {
        let mut text = String::new();
        reader
            .read_to_string(&mut text)
            .map_err(|e| BipError::Io { kind: e.kind() })?;
        Self::from_json(&text)
    }
}

fn damage(e: serde_json::Error) -> BipError {
    let (line, column) = (e.line(), e.column());
    match e.classify() {
        serde_json::error::Category::Eof => BipError::FileTruncated { line, column },
        serde_json::error::Category::Data => BipError::FileContents {
            line,
            column,
            problem: e.to_string(),
        },
        _ => BipError::FileSyntax { line, column },
    }
}

impl File {
    fn of(model: &Model) -> Self {
        let groups = model
            .groups
            .iter()
            .zip(&model.bases)
            .map(|(group, basis)| FileGroup {
                name: group.name.clone(),
                role: group.role.into(),
                dofs: group.dofs,
                basis: group.basis.into(),
                size: basis.size(),
                condition: Some(basis.condition()).filter(|c| c.is_finite()),
                transform: basis.transform().to_vec(),
                inverse: basis.inverse().to_vec(),
            })
            .collect();
        let mut file = Self {
            format: FORMAT.to_owned(),
            version: VERSION,
            digest: String::new(),
            demonstrations: model.demonstrations,
            sampling_period: model.sampling_period,
            phase_velocity_mean: model.phase_velocity.mean,
            phase_velocity_variance: model.phase_velocity.variance,
            shrinkage: model.shrinkage,
            tuning: model.tuning.map(|t| FileTuning {
                noise_factor: t.noise_factor,
                acceleration_variance: t.acceleration_variance,
                spread: t.spread,
                correlation_time: t.correlation_time,
            }),
            groups,
            offset: model.offset.clone(),
            noise_fit: model.noise_fit.clone(),
            noise_held_out: model.noise_held_out.clone(),
            mean: model.mean.clone(),
            rank: model.rank,
            factor: model.factor.clone(),
        };
        file.digest = file.digest();
        file
    }

    /// Lengths before anything is allocated by them; then every number; then the digest.
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
        finite("offset", &self.offset)?;
        finite("mean", &self.mean)?;
        finite("factor", &self.factor)?;
        let held_out = self.noise_held_out.iter().flatten();
        for v in self.noise_fit.iter().chain(held_out) {
            positive("measurement noise", *v)?;
        }
        finite("mean phase velocity", &[self.phase_velocity_mean])?;
        positive(
            "variance of the phase velocity",
            self.phase_velocity_variance,
        )?;
        positive("sampling period", self.sampling_period)?;
        share("shrinkage", self.shrinkage)?;
        if let Some(t) = self.tuning {
            positive("noise factor", t.noise_factor)?;
            not_negative("acceleration variance", t.acceleration_variance)?;
            positive("spread", t.spread)?;
            not_negative("correlation time", t.correlation_time)?;
        }
        let digest = self.digest();
        let groups: Vec<Group> = self
            .groups
            .iter()
            .map(|g| Group {
                name: g.name.clone(),
                dofs: g.dofs,
                basis: g.basis.into(),
                role: g.role.into(),
            })
            .collect();
        let bases = self
            .groups
            .into_iter()
            .map(|g| {
                let condition = g.condition.unwrap_or(f64::INFINITY);
                OrthonormalBasis::stored(g.basis.into(), g.size, condition, g.transform, g.inverse)
            })
            .collect::<Result<Vec<_>, _>>()?;
        if self.digest != digest {
            return Err(BipError::FileDigest {
                stored: self.digest,
                computed: digest,
            });
        }
        let (layout, _) = lay_out_with(&groups, &bases)?;
        Ok(Model {
            groups,
            bases,
            layout,
            offset: self.offset,
            mean: self.mean,
            factor: self.factor,
            rank: self.rank,
            noise_fit: self.noise_fit,
            noise_held_out: self.noise_held_out,
            phase_velocity: PhaseVelocity {
                mean: self.phase_velocity_mean,
                variance: self.phase_velocity_variance,
            },
            sampling_period: self.sampling_period,
            demonstrations: self.demonstrations,
            shrinkage: self.shrinkage,
            tuning: self.tuning.map(|t| Tuning {
                noise_factor: t.noise_factor,
                acceleration_variance: t.acceleration_variance,
                spread: t.spread,
                correlation_time: t.correlation_time,
            }),
        })
    }

    /// Over the bits of the numbers, not their text: the way they are printed is free.
    fn digest(&self) -> String {
        let mut d = Digest::default();
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
        d.count(self.groups.len());
        for g in &self.groups {
            d.count(g.name.len());
            d.bytes(g.name.as_bytes());
            let (kind, count, parameter) = match g.basis {
                FileBasis::Gaussian { count, variance } => (0, count, variance),
                FileBasis::NormalizedGaussian { count, variance } => (1, count, variance),
                FileBasis::Sigmoid { count, width } => (2, count, width),
                FileBasis::Polynomial { count } => (3, count, 0.0),
                FileBasis::Legendre { count } => (4, count, 0.0),
                FileBasis::Chebyshev { count } => (5, count, 0.0),
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
        format!("{:016x}", d.0)
    }
}

/// The 64-bit Fowler-Noll-Vo hash, variant 1a: against accidents, not against forgery.
struct Digest(u64);

impl Default for Digest {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Digest {
    fn bytes(&mut self, bytes: &[u8]) {
        for b in bytes {
            self.0 = (self.0 ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    fn count(&mut self, n: usize) {
        self.bytes(&(n as u64).to_le_bytes());
    }

    fn optional(&mut self, numbers: Option<&[f64]>) {
        self.count(usize::from(numbers.is_some()));
        self.numbers(numbers.unwrap_or_default());
    }

    /// Their number, then their bits.
    fn numbers(&mut self, numbers: &[f64]) {
        self.count(numbers.len());
        for x in numbers {
            self.bytes(&x.to_bits().to_le_bytes());
        }
    }
}

impl From<Role> for FileRole {
    fn from(role: Role) -> Self {
        match role {
            Role::Observed => Self::Observed,
            Role::Controlled => Self::Controlled,
            Role::Either => Self::Either,
        }
    }
}

impl From<FileRole> for Role {
    fn from(role: FileRole) -> Self {
        match role {
            FileRole::Observed => Self::Observed,
            FileRole::Controlled => Self::Controlled,
            FileRole::Either => Self::Either,
        }
    }
}

impl From<Basis> for FileBasis {
    fn from(basis: Basis) -> Self {
        match basis {
            Basis::Gaussian { count, variance } => Self::Gaussian { count, variance },
            Basis::NormalizedGaussian { count, variance } => {
                Self::NormalizedGaussian { count, variance }
            }
            Basis::Sigmoid { count, width } => Self::Sigmoid { count, width },
            Basis::Polynomial { count } => Self::Polynomial { count },
            Basis::Legendre { count } => Self::Legendre { count },
            Basis::Chebyshev { count } => Self::Chebyshev { count },
        }
    }
}

impl From<FileBasis> for Basis {
    fn from(basis: FileBasis) -> Self {
        match basis {
            FileBasis::Gaussian { count, variance } => Self::Gaussian { count, variance },
            FileBasis::NormalizedGaussian { count, variance } => {
                Self::NormalizedGaussian { count, variance }
            }
            FileBasis::Sigmoid { count, width } => Self::Sigmoid { count, width },
            FileBasis::Polynomial { count } => Self::Polynomial { count },
            FileBasis::Legendre { count } => Self::Legendre { count },
            FileBasis::Chebyshev { count } => Self::Chebyshev { count },
        }
    }
}
