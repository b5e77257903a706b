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
    height: Features,
    shaded: Vec<Features>,
}

/// `ln R = a + p ln Sq + q ln Sdq`, with an `a` for each series.
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
            let [x0, y0, z0] = [
                middle(&|row| row.height[0]),
                middle(&|row| row.height[1]),
                middle(&|row| row.ln_magnitude),
            ];
            for row in own.clone() {
                let [x, y, z] = [
                    row.height[0] - x0,
                    row.height[1] - y0,
                    row.ln_magnitude - z0,
                ];
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

    /// What the law leaves to the unit of the series.
    fn left(&self, row: &Row) -> f64 {
        row.ln_magnitude - self.value(row.height)
    }

    fn left_shaded(&self, row: &Row) -> impl Iterator<Item = f64> {
        row.shaded
            .iter()
            .map(|features| row.ln_magnitude - self.value(*features))
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

/// A material of the calibration and its prediction from the others.
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
    /// Prediction from its heights, when the material is left out of the fit.
    pub left_out: f64,
    /// Least and greatest prediction from its shaded pictures, when it is left out.
    pub shaded: [f64; 2],
}

/// From relief to roughness; 1 is sandpaper P80.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialScale {
    law: Law,
    /// Of the sandpapers.
    offset_ln: f64,
    /// Mean error of shaded pictures.
    shading_ln: f64,
    heights: ScaleError,
    shaded: ScaleError,
    /// Least and greatest features of the samples.
    range: [Features; 2],
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
        let law = Law::fitted(rows.iter());
        let papers = |row: &&Row| row.series == MaterialSeries::Sandpaper;
        let offset_ln = mean(rows.iter().filter(papers).map(|row| law.left(row)));
        let each: Vec<LeftOut> = (0..rows.len()).map(|i| LeftOut::of(&rows, i)).collect();
        let from_gratings = Law::fitted(rows.iter().filter(|row| !papers(row)));
        let papers = || rows.iter().filter(papers);
        let heights = ScaleError {
            material_ln: rms(each.iter().map(|one| one.height)),
            study_ln: spread(papers().map(|row| from_gratings.left(row))),
        };
        let shaded = ScaleError {
            material_ln: rms(each.iter().flat_map(|one| one.shaded.iter().copied())),
            study_ln: spread(papers().flat_map(|row| from_gratings.left_shaded(row))),
        };
        let extreme = |of: fn(f64, f64) -> f64| {
            let merge = |a: Features, b: Features| [of(a[0], b[0]), of(a[1], b[1])];
            rows.iter()
                .map(|row| row.height)
                .reduce(merge)
                .unwrap_or_default()
        };
        let samples = samples.into_iter().zip(&each);
        Ok(Self {
            law,
            offset_ln,
            shading_ln: shading_ln(&law, rows.iter()),
            heights,
            shaded,
            range: [extreme(f64::min), extreme(f64::max)],
            samples: samples
                .map(|(sample, one)| one.told(sample))
                .collect::<Result<_>>()?,
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
        match kind {
            PictureKind::Height => self.heights,
            PictureKind::Albedo => self.shaded,
        }
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
        let features = features(&relief);
        let shading_ln = match kind {
            PictureKind::Height => 0.0,
            PictureKind::Albedo => self.shading_ln,
        };
        Ok(RoughnessProposal {
            kind,
            relief,
            roughness: (self.offset_ln + shading_ln + self.law.value(features)).exp(),
            ln_sd: self.error(kind).ln_sd(),
            caveats: self.caveats(kind, &relief),
        })
    }

    fn caveats(&self, kind: PictureKind, relief: &Relief) -> Vec<Caveat> {
        let [finest_mm, coarsest_mm] = relief.band_mm;
        let [least, most] = self.range;
        let outside = |i: usize, value: f64| !(least[i]..=most[i]).contains(&value.ln());
        let all = [
            (true, Caveat::NotGeometry),
            (kind == PictureKind::Albedo, Caveat::Print),
            (finest_mm > FINE_MM, Caveat::FineUnseen { finest_mm }),
            (
                coarsest_mm < LEAST_PERIODS * relief.period_mm(),
                Caveat::CoarseUnseen { coarsest_mm },
            ),
            (
                outside(0, relief.height_mm) || outside(1, relief.slope),
                Caveat::BeyondCalibration {
                    height_mm: [least[0].exp(), most[0].exp()],
                    slope: [least[1].exp(), most[1].exp()],
                },
            ),
        ];
        all.into_iter()
            .filter(|(holds, _)| *holds)
            .map(|(_, caveat)| caveat)
            .collect()
    }
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
}

/// Probability, 0.5 to 1, that two materials are in the order of their proposals, if their errors are independent.
#[must_use]
pub fn order_certainty(one: &RoughnessProposal, other: &RoughnessProposal) -> f64 {
    let apart = (one.roughness / other.roughness).ln().abs();
    0.5 * libm::erfc(-apart / (std::f64::consts::SQRT_2 * one.ln_sd.hypot(other.ln_sd)))
}

/// What a picture does not tell about roughness.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Caveat {
    /// Softness, friction and sharpness of edges are in no picture.
    NotGeometry,
    /// A colour picture may show a print or stain without relief.
    Print,
    /// Fine relief is not resolved: the proposal is that of the coarser relief alone.
    FineUnseen {
        /// Shortest period resolved, mm.
        finest_mm: f64,
    },
    /// The picture is too small for its coarsest relief.
    CoarseUnseen {
        /// Longest period resolved, mm.
        coarsest_mm: f64,
    },
    /// Relief outside that of the calibration: the law is extrapolated.
    BeyondCalibration {
        /// Least and greatest height, mm.
        height_mm: [f64; 2],
        /// Least and greatest slope.
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

/// Errors of a material that is left out of the fit, ln of published over predicted.
struct LeftOut {
    height: f64,
    shaded: Vec<f64>,
}

impl LeftOut {
    fn of(rows: &[Row], index: usize) -> Self {
        let row = &rows[index];
        let others = rows
            .iter()
            .enumerate()
            .filter(|(i, _)| *i != index)
            .map(|(_, row)| row);
        let law = Law::fitted(others.clone());
        let alike = others.clone().filter(|other| other.series == row.series);
        let offset_ln = mean(alike.map(|other| law.left(other)));
        let shading_ln = shading_ln(&law, others);
        Self {
            height: law.left(row) - offset_ln,
            shaded: law
                .left_shaded(row)
                .map(|left| left - offset_ln - shading_ln)
                .collect(),
        }
    }

    fn told(&self, sample: Sample) -> Result<SampleError> {
        let predicted = |error: f64| sample.magnitude * (-error).exp();
        let shaded = || self.shaded.iter().copied().map(predicted);
        Ok(SampleError {
            relief: Relief::of(&sample.heights)?,
            left_out: predicted(self.height),
            shaded: [
                shaded().fold(f64::INFINITY, f64::min),
                shaded().fold(0.0, f64::max),
            ],
            name: sample.name,
            series: sample.series,
            magnitude: sample.magnitude,
        })
    }
}

impl Row {
    fn of(sample: &Sample) -> Result<Self> {
        let shaded = sample.shaded.iter();
        let shaded = shaded.map(|picture| Ok(features(&Relief::of(picture)?)));
        Ok(Self {
            series: sample.series,
            ln_magnitude: sample.magnitude.ln(),
            height: features(&Relief::of(&sample.heights)?),
            shaded: shaded.collect::<Result<_>>()?,
        })
    }
}

fn features(relief: &Relief) -> Features {
    [relief.height_mm.ln(), relief.slope.ln()]
}

/// By how much the logarithm of the roughness is larger than a shaded picture suggests, on average.
fn shading_ln<'a>(law: &Law, rows: impl Iterator<Item = &'a Row>) -> f64 {
    mean(rows.flat_map(|row| {
        let height = law.value(row.height);
        row.shaded
            .iter()
            .map(move |features| height - law.value(*features))
    }))
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
    if n > 0.0 { sum / n } else { 0.0 }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    mean(values.map(|value| value * value)).sqrt()
}

/// Standard deviation about the mean.
fn spread(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    let middle = mean(values.iter().copied());
    rms(values.iter().map(|value| value - middle))
}
