//! Pictures of materials from PNG files.

use super::picture::{MaterialPicture, PictureKind};
use crate::error::{Result, TextonError};
use hwall_numeric::check::{positive, that};
use png::{BitDepth, ColorType, Decoder, DecodingError, Transformations};
use std::io::{BufReader, ErrorKind};
use std::path::Path;

/// Deflate yields at most 1032 bytes per byte, and expansion turns each bit of these into up to four bytes.
const MOST_BYTES_A_BYTE: u64 = 1032 * 32;
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
        let name = "width of what the picture shows";
        let width_mm = source.width_mm.ok_or(TextonError::Attribute { name })?;
        positive("width of the picture, mm", width_mm)?;
        let pixels = Pixels::read(path.as_ref())?;
        let (columns, colours, steps) = (pixels.columns, pixels.colours, pixels.steps);
        let (kind, values, step) = match source.relief_mm {
            Some(relief_mm) => {
                positive("relief from black to white, mm", relief_mm)?;
                let height = |c: &[f64; 3]| (relief_mm * c.iter().sum::<f64>() / 3.0) as f32;
                let heights: Vec<f32> = colours.iter().map(height).collect();
                (PictureKind::Height, heights, relief_mm / steps)
            }
            None => {
                let bright = |c: &[f64; 3]| (0..3).map(|i| LUMINANCE[i] * linear(c[i])).sum();
                let light: Vec<f64> = colours.iter().map(bright).collect();
                // One step at the mean brightness: the slope of the curve of sRGB there.
                let mean = light.iter().sum::<f64>() / light.len().max(1) as f64;
                let slope = (2.4 / 1.055 * mean.powf(1.4 / 2.4)).max(1.0 / 12.92);
                let light = light.into_iter().map(|v| v as f32).collect();
                (PictureKind::Albedo, light, slope / steps)
            }
        };
        Self::new(kind, columns, width_mm / columns as f64, values, step)
    }
}

/// A decoded file: red, green and blue, 0 to 1, in `steps` steps.
struct Pixels {
    columns: usize,
    colours: Vec<[f64; 3]>,
    steps: f64,
}

impl Pixels {
    fn read(path: &Path) -> Result<Self> {
        let io = |error: std::io::Error| TextonError::io(path, &error);
        let failed = |error: DecodingError| match error {
            DecodingError::IoError(error) => io(error),
            other => TextonError::file(path.display(), ErrorKind::InvalidData, other),
        };
        let file = std::fs::File::open(path).map_err(io)?;
        let bytes = file.metadata().map_err(io)?.len();
        let mut decoder = Decoder::new(BufReader::new(file));
        decoder.set_transformations(Transformations::EXPAND);
        let mut reader = decoder.read_info().map_err(failed)?;
        let size = reader.output_buffer_size().unwrap_or(usize::MAX);
        let holds = size as u64 <= bytes.saturating_mul(MOST_BYTES_A_BYTE).min(1 << 29);
        let wanted = "at most 2^29, and what the file can hold";
        that(holds, "bytes of pixels", size as f64, wanted)?;
        let mut data = vec![0; size];
        let frame = reader.next_frame(&mut data).map_err(failed)?;
        let channels = frame.color_type.samples();
        let (bytes, white) = match frame.bit_depth {
            BitDepth::Sixteen => (2, 65_535.0),
            _ => (1, 255.0),
        };
        // A grey file of 1, 2 or 4 bits has fewer steps than the bytes that it is expanded to; the colours of a palette have 8 bits.
        let bits = reader.info().bit_depth as u8;
        let steps = match reader.info().color_type {
            ColorType::Indexed => white,
            _ => f64::from((1_u32 << bits) - 1),
        };
        let colour = |pixel: &[u8]| {
            [0, 1, 2].map(|i| {
                let at = bytes * if channels < 3 { 0 } else { i };
                let sample = pixel[at..at + bytes].iter();
                sample.fold(0.0, |sum, byte| 256.0 * sum + f64::from(*byte)) / white
            })
        };
        Ok(Self {
            columns: frame.width as usize,
            colours: data.chunks_exact(bytes * channels).map(colour).collect(),
            steps,
        })
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
