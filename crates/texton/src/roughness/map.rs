//! The roughness of a virtual surface: one number, or an image over it.

use crate::error::{Result, TextonError};
#[cfg(feature = "exr")]
use crate::picture::{channels, choose, read_bounded};
use glam::DVec2;
#[cfg(feature = "exr")]
use std::io::{Read, Seek};

/// How rough a surface of a scene is.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum SurfaceRoughness {
    /// The same everywhere, from a material or a sidecar.
    Uniform(f64),
    /// An image over the surface.
    Map(RoughnessMap),
}

impl SurfaceRoughness {
    /// The roughness at texture coordinates u, v; `None` for NaN and infinity, even if the roughness is uniform.
    #[must_use]
    pub fn at(&self, uv: DVec2) -> Option<f64> {
        match self {
            Self::Uniform(value) => uv.is_finite().then_some(*value),
            Self::Map(map) => map.at(uv),
        }
    }
}

/// An image of roughness, one number per pixel, the first row at the top.
#[derive(Debug, Clone, PartialEq)]
pub struct RoughnessMap {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

impl RoughnessMap {
    /// From pixels, row by row from the top.
    ///
    /// # Errors
    /// No pixels; a number of pixels other than `width x height`; a pixel that is not finite.
    pub fn new(width: usize, height: usize, values: Vec<f32>) -> Result<Self> {
        if values.is_empty() || width.checked_mul(height) != Some(values.len()) {
            return Err(TextonError::MapSize {
                width,
                height,
                values: values.len(),
            });
        }
        if let Some(i) = values.iter().position(|value| !value.is_finite()) {
            return Err(TextonError::Pixel {
                column: i % width,
                row: i / width,
                value: f64::from(values[i]),
            });
        }
        Ok(Self {
            width,
            height,
            values,
        })
    }

    /// From an OpenEXR file: its only channel, or else `roughness`, `Y` or `R`.
    ///
    /// # Errors
    /// A file that is not an OpenEXR image, is truncated or too large; no such channel; as
    /// [`RoughnessMap::new`].
    #[cfg(feature = "exr")]
    pub fn from_exr(file: impl Read + Seek) -> Result<Self> {
        let image = read_bounded(std::io::BufReader::new(file), "roughness map")?;
        let all = channels(&image);
        let chosen = choose(&all, None, &["roughness", "Y", "R"])?;
        let values = chosen.channel.sample_data.values_as_f32().collect();
        Self::new(chosen.layer.size.0, chosen.layer.size.1, values)
    }

    /// Columns and rows.
    #[must_use]
    pub const fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// The roughness at texture coordinates u, v, bilinear between the middles of the pixels; `None` for
    /// NaN and infinity.
    ///
    /// u runs to the right and v upwards (as in OBJ files), from 0 to 1 over the image; outside, the border value
    /// continues.
    #[must_use]
    pub fn at(&self, uv: DVec2) -> Option<f64> {
        if !uv.is_finite() {
            return None;
        }
        let DVec2 { x: u, y: v } = uv;
        let place = |share: f64, n: usize| {
            let at = (share * n as f64 - 0.5).clamp(0.0, (n - 1) as f64);
            let low = at.floor() as usize;
            (low, (low + 1).min(n - 1), at - low as f64)
        };
        let (left, right, x) = place(u, self.width);
        let (top, bottom, y) = place(1.0 - v, self.height);
        let row = |row: usize| {
            let pixel = |column: usize| f64::from(self.values[row * self.width + column]);
            pixel(left) + x * (pixel(right) - pixel(left))
        };
        Some(row(top) + y * (row(bottom) - row(top)))
    }
}
