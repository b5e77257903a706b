//! The law from relief to roughness, fitted to published series, with its cross-validated error.

use super::picture::{MaterialPicture, PictureKind};
use super::relief::Relief;
use super::samples::{MaterialSample, MaterialSeries, samples};
use crate::error::Result;
use glam::{DMat2, DVec2, dvec2};
use std::fmt;

/// Half-width of a 90 % interval in standard deviations.
const NINETY: f64 = 1.644_854;
/// Relief of shorter periods is felt by vibration [Hollins 2000]; a picture that does not resolve it misses what makes fine textures rough.
/// In mm.
const FINE_MM: f64 = 0.2;
/// `ln R = a + p ln Sq + q ln Sdq`, with an `a` for each series and kind of picture; contains p and q.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Law(DVec2);

impl Law {
    /// By least squares within each series, because the units of magnitude of the series are not known to agree.
    fn fitted<'a>(rows: impl Iterator<Item = &'a MaterialSample> + Clone) -> Self {
        let (mut squares, mut products) = (DMat2::ZERO, DVec2::ZERO);
        for series in MaterialSeries::ALL {
            let own = rows.clone().filter(|row| row.series == series);
            let count = own.clone().count().max(1) as f64;
            let middle = own.clone().map(heights).sum::<DVec2>() / count;
            for row in own {
                let x = heights(row) - middle;
                squares += DMat2::from_cols(x * x.x, x * x.y);
                products += x * row.magnitude.ln();
            }
        }
        Self(squares.inverse() * products)
    }

    /// Logarithm of a row's magnitude minus the law without its `a`, for each picture of a kind.
    fn left(self, row: &MaterialSample, kind: PictureKind) -> impl Iterator<Item = f64> {
        let reliefs = row.reliefs[kind as usize].iter();
        reliefs.map(move |relief| row.magnitude.ln() - self.0.dot(features(relief)))
    }

    /// The `a` of a series and a kind, from these rows.
    fn offset<'a>(
        self,
        rows: impl Iterator<Item = &'a MaterialSample>,
        series: MaterialSeries,
        kind: PictureKind,
    ) -> f64 {
        let own = rows.filter(|row| row.series == series);
        mean(own.flat_map(|row| self.left(row, kind)))
    }
}

/// Error of the law, as the standard deviation of the natural logarithm of a ratio of magnitudes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaleError {
    /// Each material predicted from the others of both series.
    pub material_ln: f64,
    /// The sandpapers predicted from the gratings alone, up to one common factor. The reverse is not possible: sandpapers of all grades
    /// have the same slope.
    pub study_ln: f64,
}

impl ScaleError {
    /// The greater of the two errors. Intervals use it, because a new material belongs to neither study. It does not contain the common factor
    /// between the two studies, because their units are not known to agree: relative to P80, a material other than sandpaper may be off by
    /// more.
    #[must_use]
    pub const fn ln_sd(&self) -> f64 {
        self.material_ln.max(self.study_ln)
    }
}

/// From relief to roughness; 1 is sandpaper P80.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialScale {
    law: Law,
    /// The law's `a` of the sandpapers, for each kind of picture.
    offset_ln: [f64; 2],
    errors: [ScaleError; 2],
    /// Least and greatest height, mm, and slope of the samples.
    range: [[f64; 2]; 2],
    samples: Vec<MaterialSample>,
}

impl MaterialScale {
    /// Synthesizes the published surfaces, and fits and cross-validates the law; about a second.
    ///
    /// # Errors
    /// None in practice: the surfaces are those of this crate.
    pub fn calibrated() -> Result<Self> {
        let mut samples = samples()?;
        let left: Vec<_> = (0..samples.len()).map(|i| left_out(&samples, i)).collect();
        let paper = MaterialSeries::Sandpaper;
        let law = Law::fitted(samples.iter());
        let gratings = Law::fitted(samples.iter().filter(|row| row.series != paper));
        let errors = PictureKind::ALL.map(|kind| {
            let papers = samples.iter().filter(|row| row.series == paper);
            let offset = gratings.offset(papers.clone(), paper, kind);
            let study = papers.flat_map(|row| gratings.left(row, kind));
            ScaleError {
                material_ln: rms(left
                    .iter()
                    .flat_map(|one| one[kind as usize].iter().copied())),
                study_ln: rms(study.map(|left| left - offset)),
            }
        });
        let extreme = |i: usize, of: fn(f64, f64) -> f64| {
            let values = samples.iter().map(|row| heights(row)[i].exp());
            values.reduce(of).unwrap_or(0.0)
        };
        let range = [0, 1].map(|i| [f64::min, f64::max].map(|of| extreme(i, of)));
        let offset_ln = PictureKind::ALL.map(|kind| law.offset(samples.iter(), paper, kind));
        for (sample, errors) in samples.iter_mut().zip(left) {
            let magnitude = sample.magnitude;
            let predicted = |error: f64| magnitude * (-error).exp();
            sample.left_out = errors.map(|of| of.into_iter().map(predicted).collect());
        }
        Ok(Self {
            law,
            offset_ln,
            errors,
            range,
            samples,
        })
    }

    /// Exponents of height and slope.
    #[must_use]
    pub const fn exponents(&self) -> [f64; 2] {
        self.law.0.to_array()
    }

    /// Cross-validated error for a kind of picture.
    #[must_use]
    pub const fn error(&self, kind: PictureKind) -> ScaleError {
        self.errors[kind as usize]
    }

    /// The materials of the calibration, each predicted from the others.
    #[must_use]
    pub fn samples(&self) -> &[MaterialSample] {
        &self.samples
    }

    /// The roughness that a picture suggests. Outside the range of the calibration it is that of the nearest relief within.
    ///
    /// # Errors
    /// A picture without information, as [`Relief::of`].
    pub fn propose(&self, picture: &MaterialPicture) -> Result<RoughnessProposal> {
        let relief = Relief::of(picture)?;
        let kind = picture.kind();
        let [finest_mm, _] = relief.band_mm;
        let [height_mm, slope] = self.range;
        let outside = |[low, high]: [f64; 2], value: f64| !(low..=high).contains(&value);
        let caveats = [
            (true, Caveat::NotGeometry),
            (kind == PictureKind::Albedo, Caveat::Print),
            (finest_mm > FINE_MM, Caveat::FineUnseen { finest_mm }),
            (
                outside(height_mm, relief.height_mm) || outside(slope, relief.slope),
                Caveat::BeyondCalibration { height_mm, slope },
            ),
        ];
        let holding = caveats.into_iter().filter(|(holds, _)| *holds);
        let nearest = Relief {
            height_mm: relief.height_mm.clamp(height_mm[0], height_mm[1]),
            slope: relief.slope.clamp(slope[0], slope[1]),
            ..relief
        };
        let ln_roughness = self.offset_ln[kind as usize] + self.law.0.dot(features(&nearest));
        Ok(RoughnessProposal {
            kind,
            relief,
            roughness: ln_roughness.exp(),
            ln_sd: self.error(kind).ln_sd(),
            caveats: holding.map(|(_, caveat)| caveat).collect(),
        })
    }
}

/// Errors of a material that is left out of the fit, as the logarithm of published over predicted magnitude, for each picture of each kind.
fn left_out(rows: &[MaterialSample], index: usize) -> [Vec<f64>; 2] {
    let row = &rows[index];
    let all = rows.iter().enumerate();
    let others = all.filter(|(i, _)| *i != index).map(|(_, row)| row);
    let law = Law::fitted(others.clone());
    PictureKind::ALL.map(|kind| {
        let offset = law.offset(others.clone(), row.series, kind);
        law.left(row, kind).map(|left| left - offset).collect()
    })
}

/// A proposed roughness.
#[derive(Debug, Clone, PartialEq)]
pub struct RoughnessProposal {
    /// What the picture shows.
    pub kind: PictureKind,
    /// Relief in the picture; for an albedo, under the assumption that its contrast is shading.
    pub relief: Relief,
    /// Magnitude on a ratio scale: 1 is sandpaper P80.
    pub roughness: f64,
    /// Standard deviation of its natural logarithm within the calibration: [`ScaleError::ln_sd`].
    pub ln_sd: f64,
    /// What the picture does not show.
    pub caveats: Vec<Caveat>,
}

impl RoughnessProposal {
    /// Is the relief within the range of the calibration? Nothing is known about errors outside.
    #[must_use]
    pub fn is_calibrated(&self) -> bool {
        let is_beyond = |caveat: &Caveat| matches!(caveat, Caveat::BeyondCalibration { .. });
        !self.caveats.iter().any(is_beyond)
    }

    /// 90 % interval of the roughness, if the other caveats do not apply; `None` outside the calibration.
    #[must_use]
    pub fn interval(&self) -> Option<[f64; 2]> {
        let at = |z: f64| self.roughness * (z * self.ln_sd).exp();
        self.is_calibrated().then(|| [-NINETY, NINETY].map(at))
    }

    /// Probability, 0.5 to 1, that two materials are in the order of their proposals, if their errors are independent; `None` if one of them is
    /// outside the calibration.
    #[must_use]
    pub fn order_certainty(&self, other: &Self) -> Option<f64> {
        let apart = (self.roughness / other.roughness).ln().abs();
        let sd = std::f64::consts::SQRT_2 * self.ln_sd.hypot(other.ln_sd);
        let is_known = self.is_calibrated() && other.is_calibrated();
        is_known.then(|| 0.5 * libm::erfc(-apart / sd))
    }
}

/// What a picture does not show about roughness.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the variants say what the fields hold")]
pub enum Caveat {
    /// Softness, friction and sharpness of edges are in no picture.
    NotGeometry,
    /// A colour picture may show a print or stain without relief.
    Print,
    /// Relief finer than the shortest resolved period, mm, is not seen: the proposal is based on the coarser relief alone.
    FineUnseen { finest_mm: f64 },
    /// Relief outside the range of the calibration, whose nearest relief counts instead; the fields are the calibration's least and greatest
    /// height and slope.
    BeyondCalibration {
        height_mm: [f64; 2],
        slope: [f64; 2],
    },
}

impl fmt::Display for Caveat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotGeometry => write!(f, "softness, friction and sharpness are in no picture"),
            Self::Print => write!(f, "a print without relief looks the same and feels smooth"),
            Self::FineUnseen { finest_mm } => {
                write!(f, "relief finer than {finest_mm:.2} mm is not resolved")
            }
            Self::BeyondCalibration {
                height_mm: [low, high],
                slope: [flat, steep],
            } => write!(
                f,
                "beyond the calibration, so its edge counts, with unknown error: rms heights of {low:.3} to {high:.3} mm and slopes of {flat:.2} to {steep:.2}"
            ),
        }
    }
}

fn heights(sample: &MaterialSample) -> DVec2 {
    features(&sample.reliefs[PictureKind::Height as usize][0])
}

fn features(relief: &Relief) -> DVec2 {
    dvec2(relief.height_mm.ln(), relief.slope.ln())
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
    if n > 0.0 { sum / n } else { 0.0 }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    mean(values.map(|value| value * value)).sqrt()
}
