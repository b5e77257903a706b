//! Models that use only distances within a texture.

use super::model::{ModelInfo, Prediction, Quantity, RangedInput, RoughnessModel};
use crate::error::Result;
use crate::geometry::{ScanAngle, Texture};
use hwall_numeric::check::{non_negative, positive};

/// `R = 0.2 + 1.6 GW - 0.5 RW - 0.25 GW²` of Yoshioka and others (2001), widths in mm.
///
/// Groove and ridge of a scan through the middle of the bumps: the ridge is
/// [`Texton::contact_length_mm`](crate::geometry::Texton::contact_length_mm), the groove is the rest
/// of [`Texture::spacing_mm`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GrooveRidge;

impl RoughnessModel for GrooveRidge {
    fn info(&self) -> &'static ModelInfo {
        &ModelInfo {
            name: "groove and ridge",
            quantity: "magnitude estimate",
            source: "Yoshioka, Gibb, Dorsch, Hsiao, Johnson 2001, J. Neurosci. 21:6905 (correlation 0.99)",
            range: "gratings: grooves 0.1 to 2 mm, ridges 0 to 1 mm",
            misfit: "ignores speed; bumps longer than 1 mm along the scan are outside its range of ridges, so that the ridge term dominates",
            depends_on_speed: false,
        }
    }

    fn predict(
        &self,
        texture: &Texture,
        scan: ScanAngle,
        speed_mm_per_s: f64,
    ) -> Result<Prediction> {
        non_negative("speed_mm_per_s", speed_mm_per_s)?;
        let Some(spacing_mm) = texture.spacing_mm(scan) else {
            return Ok(Prediction::Undefined(Quantity::SpacingMm));
        };
        let ridge = texture.texton().contact_length_mm(scan);
        let groove = (spacing_mm - ridge).max(0.0);
        let value = 0.2 + 1.6 * groove - 0.5 * ridge - 0.25 * groove * groove;
        let inputs = [
            RangedInput {
                quantity: Quantity::GrooveMm,
                value: groove,
                range: [0.1, 2.0],
            },
            RangedInput {
                quantity: Quantity::RidgeMm,
                value: ridge,
                range: [0.0, 1.0],
            },
        ];
        Ok(Prediction::checked(value, &inputs))
    }
}

/// Roughness rises with spacing up to a peak and falls beyond it.
///
/// The source gives the position of the peak; the shape, `1 - ln² (d / peak)`, is this crate's own, and
/// only the order of its values counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InvertedU {
    /// Spacing that feels roughest, mm; default 3.2, published peaks lie at 3.2 to 3.5.
    pub peak_mm: f64,
}

impl Default for InvertedU {
    fn default() -> Self {
        Self { peak_mm: 3.2 }
    }
}

impl RoughnessModel for InvertedU {
    fn info(&self) -> &'static ModelInfo {
        &ModelInfo {
            name: "inverted U in spacing",
            quantity: "relative roughness, 1 at the peak",
            source: "Connor, Hsiao, Phillips, Johnson 1990; Connor, Johnson 1992: peak at 3.2 to 3.5 mm; shape assumed",
            range: "embossed dots, spacings 1.3 to 6.2 mm, dots 0.4 to 1.2 mm wide",
            misfit: "ignores speed and the size of the bumps; ranks 45 degrees first on the released grid, then 90 degrees",
            depends_on_speed: false,
        }
    }

    fn predict(
        &self,
        texture: &Texture,
        scan: ScanAngle,
        speed_mm_per_s: f64,
    ) -> Result<Prediction> {
        positive("peak_mm", self.peak_mm)?;
        by_spacing(texture, scan, speed_mm_per_s, [1.3, 6.2], |d| {
            1.0 - (d / self.peak_mm).ln().powi(2)
        })
    }
}

/// Roughness rises with spacing throughout; the prediction is the spacing itself, mm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MonotoneSpacing;

impl RoughnessModel for MonotoneSpacing {
    fn info(&self) -> &'static ModelInfo {
        &ModelInfo {
            name: "rising with spacing",
            quantity: "spacing, mm",
            source: "Dépeault, Meftah, Chapman 2009",
            range: "truncated cones, spacings 1.5 to 8.5 mm",
            misfit: "ignores speed; spacing shrinks with orientation on the dissertation's grids, so it predicts the reverse of the study",
            depends_on_speed: false,
        }
    }

    fn predict(
        &self,
        texture: &Texture,
        scan: ScanAngle,
        speed_mm_per_s: f64,
    ) -> Result<Prediction> {
        by_spacing(texture, scan, speed_mm_per_s, [1.5, 8.5], |d| d)
    }
}

/// Roughness rises with the number of bumps met per second, `f = v / d`, Hz.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TemporalFrequency;

impl RoughnessModel for TemporalFrequency {
    fn info(&self) -> &'static ModelInfo {
        &ModelInfo {
            name: "temporal frequency",
            quantity: "bumps per second, Hz",
            source: "the dissertation's reading of the temporal code",
            range: "15 Hz and above",
            misfit: "ignores size and height of the bumps; in other studies doubling the speed changes roughness little",
            depends_on_speed: true,
        }
    }

    fn predict(
        &self,
        texture: &Texture,
        scan: ScanAngle,
        speed_mm_per_s: f64,
    ) -> Result<Prediction> {
        non_negative("speed_mm_per_s", speed_mm_per_s)?;
        if speed_mm_per_s == 0.0 {
            return Ok(Prediction::Undefined(Quantity::FrequencyHz));
        }
        let Some(hz) = texture.ridge_frequency_hz(scan, speed_mm_per_s) else {
            return Ok(Prediction::Undefined(Quantity::SpacingMm));
        };
        let input = RangedInput {
            quantity: Quantity::FrequencyHz,
            value: hz,
            range: [15.0, f64::INFINITY],
        };
        Ok(Prediction::checked(hz, &[input]))
    }
}

fn by_spacing(
    texture: &Texture,
    scan: ScanAngle,
    speed_mm_per_s: f64,
    range: [f64; 2],
    roughness: impl Fn(f64) -> f64,
) -> Result<Prediction> {
    non_negative("speed_mm_per_s", speed_mm_per_s)?;
    let Some(d) = texture.spacing_mm(scan) else {
        return Ok(Prediction::Undefined(Quantity::SpacingMm));
    };
    let input = RangedInput {
        quantity: Quantity::SpacingMm,
        value: d,
        range,
    };
    Ok(Prediction::checked(roughness(d), &[input]))
}
