//! The law from relief to roughness, fitted to published series, with its cross-validated error.

use super::picture::{MaterialPicture, PictureKind};
use super::relief::Relief;
use super::samples::{MaterialSeries, Sample, samples};
use crate::error::Result;
use std::fmt;

/// Half-width of a 90 % interval in standard deviations.
const NINETY: f64 = 1.644_854;
/// Relief of shorter periods is felt by vibration [Hollins 2000]: a picture that does not resolve it misses what makes fine textures rough, mm.
const FINE_MM: f64 = 0.2;
/// The band should hold this many rms wavelengths.
const LEAST_PERIODS: f64 = 2.0;

/// Logarithms of a relief's height and slope.
type Features = [f64; 2];

/// A sample as the fit sees it.
struct Row {
    series: MaterialSeries,
    ln_magnitude: f64,
    heights: Features,
    /// Of all pictures of a kind: one of heights, several of shaded surfaces.
    of_kind: [Vec<Features>; 2],
}

impl Row {
    fn of(sample: &Sample) -> Result<Self> {
        let heights = features(&Relief::of(&sample.heights)?);
        let shaded = sample.shaded.iter();
        let shaded = shaded.map(|picture| Ok(features(&Relief::of(picture)?)));
        Ok(Self {
            series: sample.series,
            ln_magnitude: sample.magnitude.ln(),
            heights,
            of_kind: [vec![heights], shaded.collect::<Result<_>>()?],
        })
    }
}

/// `ln R = a + p ln Sq + q ln Sdq`, with an `a` for each series and kind of picture.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Law {
    p: f64,
    q: f64,
}

impl Law {
    /// By least squares within the series: their units of magnitude are not known to agree.
    fn fitted<'a>(rows: impl Iterator<Item = &'a Row> + Clone) -> Self {
        let (mut a, mut b, mut c, mut u, mut v) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for series in MaterialSeries::ALL {
            let own = rows.clone().filter(|row| row.series == series);
            let middle = |of: &dyn Fn(&Row) -> f64| mean(own.clone().map(of));
            let [x0, y0] = [0, 1].map(|i| middle(&|row| row.heights[i]));
            let z0 = middle(&|row| row.ln_magnitude);
            for row in own.clone() {
                let (x, y) = (row.heights[0] - x0, row.heights[1] - y0);
                let z = row.ln_magnitude - z0;
                (a, b, c) = (a + x * x, b + x * y, c + y * y);
                (u, v) = (u + x * z, v + y * z);
            }
        }
        let determinant = a * c - b * b;
        Self {
            p: (c * u - b * v) / determinant,
            q: (a * v - b * u) / determinant,
        }
    }

    fn value(&self, [height, slope]: Features) -> f64 {
        self.p * height + self.q * slope
    }

    /// What the law leaves of a row to its series, for each picture of a kind.
    fn left(self, row: &Row, kind: PictureKind) -> impl Iterator<Item = f64> {
        let pictures = row.of_kind[kind as usize].iter();
        pictures.map(move |features| row.ln_magnitude - self.value(*features))
    }

    /// The `a` of a series and a kind, from these rows.
    fn offset<'a>(
        self,
        rows: impl Iterator<Item = &'a Row>,
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
    /// The greater of the two, which intervals use: a new material is of neither study.
    #[must_use]
    pub const fn ln_sd(&self) -> f64 {
        self.material_ln.max(self.study_ln)
    }
}

/// A material of the calibration and its predictions from the others.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleError {
    /// Its name.
    pub name: String,
    /// Where it was published.
    pub series: MaterialSeries,
    /// Published roughness, in the unit of its series.
    pub magnitude: f64,
    /// Relief of its synthesized surface.
    pub relief: Relief,
    /// Predictions when it is left out of the fit: from its heights, and from its surface shaded under several lights.
    pub left_out: [Vec<f64>; 2],
}

/// From relief to roughness; 1 is sandpaper P80.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialScale {
    law: Law,
    /// Of the sandpapers, for each kind of picture.
    offset_ln: [f64; 2],
    errors: [ScaleError; 2],
    /// Least and greatest height, mm, and slope of the samples.
    range: [[f64; 2]; 2],
    samples: Vec<SampleError>,
}

impl MaterialScale {
    /// Synthesizes the published surfaces, and fits and cross-validates the law; about a second.
    ///
    /// # Errors
    /// None in practice: the surfaces are those of this crate.
    pub fn calibrated() -> Result<Self> {
        let samples = samples()?;
        let rows: Vec<Row> = samples.iter().map(Row::of).collect::<Result<_>>()?;
        let errors = (0..rows.len())
            .map(|i| left_out(&rows, i))
            .collect::<Vec<_>>();
        let paper = MaterialSeries::Sandpaper;
        let law = Law::fitted(rows.iter());
        let by_gratings = Law::fitted(rows.iter().filter(|row| row.series != paper));
        let error = |kind: PictureKind| {
            let papers = rows.iter().filter(|row| row.series == paper);
            let offset = by_gratings.offset(rows.iter(), paper, kind);
            let study = papers.flat_map(|row| by_gratings.left(row, kind));
            ScaleError {
                material_ln: rms(errors.iter().flat_map(|e| e[kind as usize].iter().copied())),
                study_ln: rms(study.map(|left| left - offset)),
            }
        };
        let extreme = |i: usize, of: fn(f64, f64) -> f64| {
            rows.iter()
                .map(|row| row.heights[i].exp())
                .reduce(of)
                .unwrap_or(0.0)
        };
        let told = samples.into_iter().zip(&errors).map(|(sample, errors)| {
            let predicted = |error: &f64| sample.magnitude * (-error).exp();
            Ok(SampleError {
                relief: Relief::of(&sample.heights)?,
                left_out: [0, 1].map(|kind| errors[kind].iter().map(predicted).collect()),
                name: sample.name,
                series: sample.series,
                magnitude: sample.magnitude,
            })
        });
        Ok(Self {
            law,
            offset_ln: PictureKind::ALL.map(|kind| law.offset(rows.iter(), paper, kind)),
            errors: PictureKind::ALL.map(error),
            range: [0, 1].map(|i| [extreme(i, f64::min), extreme(i, f64::max)]),
            samples: told.collect::<Result<_>>()?,
        })
    }

    /// Exponents of height and slope.
    #[must_use]
    pub const fn exponents(&self) -> [f64; 2] {
        [self.law.p, self.law.q]
    }

    /// Cross-validated error for a kind of picture.
    #[must_use]
    pub const fn error(&self, kind: PictureKind) -> ScaleError {
        self.errors[kind as usize]
    }

    /// The materials of the calibration, each predicted from the others.
    #[must_use]
    pub fn samples(&self) -> &[SampleError] {
        &self.samples
    }

    /// The roughness that a picture suggests.
    ///
    /// # Errors
    /// A picture without information, as [`Relief::of`].
    pub fn propose(&self, picture: &MaterialPicture) -> Result<RoughnessProposal> {
        let relief = Relief::of(picture)?;
        let kind = picture.kind();
        let [finest_mm, coarsest_mm] = relief.band_mm;
        let [height_mm, slope] = self.range;
        let outside = |[low, high]: [f64; 2], value: f64| !(low..=high).contains(&value);
        let caveats = [
            (true, Caveat::NotGeometry),
            (kind == PictureKind::Albedo, Caveat::Print),
            (finest_mm > FINE_MM, Caveat::FineUnseen { finest_mm }),
            (
                coarsest_mm < LEAST_PERIODS * relief.period_mm(),
                Caveat::CoarseUnseen { coarsest_mm },
            ),
            (
                outside(height_mm, relief.height_mm) || outside(slope, relief.slope),
                Caveat::BeyondCalibration { height_mm, slope },
            ),
        ];
        let holding = caveats.into_iter().filter(|(holds, _)| *holds);
        let ln_roughness = self.offset_ln[kind as usize] + self.law.value(features(&relief));
        Ok(RoughnessProposal {
            kind,
            relief,
            roughness: ln_roughness.exp(),
            ln_sd: self.error(kind).ln_sd(),
            caveats: holding.map(|(_, caveat)| caveat).collect(),
        })
    }
}

/// Errors of a material that is left out of the fit, ln of published over predicted, for each picture of each kind.
fn left_out(rows: &[Row], index: usize) -> [Vec<f64>; 2] {
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
    /// Its relief, for an albedo under the assumption that its contrast is shading.
    pub relief: Relief,
    /// Magnitude on a ratio scale: 1 is sandpaper P80.
    pub roughness: f64,
    /// Standard deviation of its natural logarithm: [`ScaleError::ln_sd`].
    pub ln_sd: f64,
    /// What the picture does not tell.
    pub caveats: Vec<Caveat>,
}

impl RoughnessProposal {
    /// 90 % interval of the roughness, if the caveats do not apply.
    #[must_use]
    pub fn interval(&self) -> [f64; 2] {
        [-NINETY, NINETY].map(|z| self.roughness * (z * self.ln_sd).exp())
    }

    /// Probability, 0.5 to 1, that two materials are in the order of their proposals, if their errors are independent.
    #[must_use]
    pub fn order_certainty(&self, other: &Self) -> f64 {
        let apart = (self.roughness / other.roughness).ln().abs();
        0.5 * libm::erfc(-apart / (std::f64::consts::SQRT_2 * self.ln_sd.hypot(other.ln_sd)))
    }
}

/// What a picture does not tell about roughness.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the variants say what the fields hold")]
pub enum Caveat {
    /// Softness, friction and sharpness of edges are in no picture.
    NotGeometry,
    /// A colour picture may show a print or stain without relief.
    Print,
    /// Relief finer than the shortest period resolved, mm: the proposal is that of the coarser relief alone.
    FineUnseen { finest_mm: f64 },
    /// The picture is too small for its coarsest relief; longest period resolved, mm.
    CoarseUnseen { coarsest_mm: f64 },
    /// Relief outside that of the calibration, whose least and greatest height and slope these are: the law is extrapolated.
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
            Self::CoarseUnseen { coarsest_mm } => {
                write!(
                    f,
                    "relief coarser than {coarsest_mm:.2} mm does not fit in the picture"
                )
            }
            Self::BeyondCalibration {
                height_mm: [low, high],
                slope: [flat, steep],
            } => write!(
                f,
                "extrapolated: calibrated on rms heights of {low:.3} to {high:.3} mm and slopes of {flat:.2} to {steep:.2}"
            ),
        }
    }
}

fn features(relief: &Relief) -> Features {
    [relief.height_mm.ln(), relief.slope.ln()]
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
    if n > 0.0 { sum / n } else { 0.0 }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    mean(values.map(|value| value * value)).sqrt()
}
