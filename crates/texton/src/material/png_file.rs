//! Pictures of materials from PNG files.

use super::picture::{MaterialPicture, PictureKind};
use crate::error::{Result, TextonError};
use hwall_numeric::check::{positive, that};
use png::{BitDepth, Decoder, Transformations};
use std::io::{BufReader, ErrorKind};
use std::path::Path;

/// Deflate yields at most 1032 bytes per byte.
const MOST_BYTES_A_BYTE: u64 = 1032;
/// Most pixels of a file, as of other pictures.
const MOST_PIXELS: u64 = 1 << 26;
/// Relative luminance of red, green and blue (ITU-R BT.709).
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// What a PNG file does not state.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PngSource {
    /// Width of what the picture shows, mm. Required: the density in the file is usually that of a print.
    pub width_mm: Option<f64>,
    /// Height of white above black, mm, for a height map; `None`: a colour picture in sRGB.
    pub relief_mm: Option<f64>,
}

impl MaterialPicture {
    /// Reads a PNG file: luminance of a colour picture, or brightness of a height map; transparency is ignored.
    ///
    /// # Errors
    /// A file that is missing, damaged, too large or not a PNG; a width that is not given; as [`MaterialPicture::new`].
    pub fn read_png(path: impl AsRef<Path>, source: &PngSource) -> Result<Self> {
        let path = path.as_ref();
        let width_mm = source.width_mm.ok_or(TextonError::Attribute {
            name: "width of what the picture shows",
        })?;
        positive("width of the picture, mm", width_mm)?;
        let file = std::fs::File::open(path).map_err(|error| TextonError::io(path, &error))?;
        let bytes = file
            .metadata()
            .map_err(|error| TextonError::io(path, &error))?
            .len();
        let failed = |error: png::DecodingError| {
            let kind = match &error {
                png::DecodingError::IoError(error) => error.kind(),
                _ => ErrorKind::InvalidData,
            };
            TextonError::file(path.display(), kind, error)
        };
        let mut decoder = Decoder::new(BufReader::new(file));
        decoder.set_transformations(Transformations::EXPAND);
        let mut reader = decoder.read_info().map_err(failed)?;
        let info = reader.info();
        let [columns, rows] = [info.width, info.height];
        let pixels = u64::from(columns) * u64::from(rows);
        that(
            pixels <= MOST_PIXELS,
            "pixels",
            pixels as f64,
            "at most 67108864",
        )?;
        let size = reader.output_buffer_size().unwrap_or(usize::MAX) as u64;
        // Expansion turns one bit into up to four bytes.
        let most = bytes.saturating_mul(MOST_BYTES_A_BYTE * 32);
        that(
            size <= most,
            "bytes of pixels",
            size as f64,
            "what the size of the file can hold",
        )?;
        let mut data = vec![0; size as usize];
        let frame = reader.next_frame(&mut data).map_err(failed)?;
        let wide = frame.bit_depth == BitDepth::Sixteen;
        let steps = if wide { 65_535.0 } else { 255.0 };
        let samples: Vec<f64> = match wide {
            true => {
                let pairs = data.chunks_exact(2);
                pairs
                    .map(|b| f64::from(u16::from_be_bytes([b[0], b[1]])))
                    .collect()
            }
            false => data.iter().map(|b| f64::from(*b)).collect(),
        };
        let channels = frame.color_type.samples();
        let pixels = samples.chunks_exact(channels).map(|pixel| {
            let share = |i: usize| pixel[i] / steps;
            let colour = if channels < 3 {
                [share(0); 3]
            } else {
                [0, 1, 2].map(share)
            };
            match source.relief_mm {
                Some(relief_mm) => relief_mm * colour.iter().sum::<f64>() / 3.0,
                None => colour
                    .iter()
                    .zip(LUMINANCE)
                    .map(|(c, weight)| weight * linear(*c))
                    .sum(),
            }
        });
        let values: Vec<f32> = pixels.map(|value| value as f32).collect();
        let (kind, step) = match source.relief_mm {
            Some(relief_mm) => {
                positive("relief from black to white, mm", relief_mm)?;
                (PictureKind::Height, relief_mm / steps)
            }
            None => (PictureKind::Albedo, step_at_mean(&values, steps)),
        };
        Self::new(
            kind,
            columns as usize,
            width_mm / f64::from(columns),
            values,
            step,
        )
    }
}

/// Linear light of an sRGB value, both 0 to 1 (IEC 61966-2-1).
fn linear(share: f64) -> f64 {
    if share <= 0.040_45 {
        share / 12.92
    } else {
        ((share + 0.055) / 1.055).powf(2.4)
    }
}

/// One step of an sRGB value at the mean brightness: the slope of its curve there.
fn step_at_mean(values: &[f32], steps: f64) -> f64 {
    let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len().max(1) as f64;
    let slope = 2.4 / 1.055 * (mean.powf(1.0 / 2.4)).powf(1.4);
    slope.max(1.0 / 12.92) / steps
}
