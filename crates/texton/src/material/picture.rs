//! A picture of a material, to scale.

use crate::error::{Result, TextonError};
use crate::height::HeightField;
use hwall_numeric::check::{non_negative, positive, that};

/// Most pixels: larger pictures show no more of the texture, and the analysis keeps three copies.
const MOST_PIXELS: usize = 1 << 26;

/// What the values of a picture are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureKind {
    /// Heights, mm.
    Height,
    /// Linear reflectance or brightness in any unit: only ratios count.
    Albedo,
}

impl PictureKind {
    /// Both kinds.
    pub const ALL: [Self; 2] = [Self::Height, Self::Albedo];
}

/// A picture of a material, to scale; square pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialPicture {
    pub(super) kind: PictureKind,
    pub(super) columns: usize,
    pub(super) pitch_mm: f64,
    pub(super) values: Vec<f32>,
    /// Smallest difference of two values that the picture can hold.
    pub(super) step: f64,
}

impl MaterialPicture {
    /// From values row by row, pixels `pitch_mm` apart; `step`: smallest difference of two values that their source could hold.
    ///
    /// # Errors
    /// An incomplete row, fewer than 64 pixels each way, more than 2^26 in all, a value that is not finite, a negative reflectance, a pitch
    /// that is not positive, a step that is negative.
    pub fn new(
        kind: PictureKind,
        columns: usize,
        pitch_mm: f64,
        values: Vec<f32>,
        step: f64,
    ) -> Result<Self> {
        positive("pixel pitch, mm", pitch_mm)?;
        non_negative("step of the values", step)?;
        let rows = values.len().checked_div(columns).unwrap_or(0);
        if rows * columns != values.len() {
            return Err(TextonError::MapSize {
                width: columns,
                height: rows,
                values: values.len(),
            });
        }
        let side = columns.min(rows);
        let wanted = "at least 64: two octaves of periods";
        that(side >= 64, "pixels along a side", side as f64, wanted)?;
        let pixels = values.len() as f64;
        that(
            values.len() <= MOST_PIXELS,
            "pixels",
            pixels,
            "at most 67108864",
        )?;
        let bad = |v: &f32| !v.is_finite() || kind == PictureKind::Albedo && *v < 0.0;
        if let Some(i) = values.iter().position(bad) {
            return Err(TextonError::Pixel {
                column: i % columns,
                row: i / columns,
                value: f64::from(values[i]),
            });
        }
        Ok(Self {
            kind,
            columns,
            pitch_mm,
            values,
            step,
        })
    }

    /// From heights; their steps are those of single precision.
    ///
    /// # Errors
    /// As [`MaterialPicture::new`].
    pub fn from_heights(field: &HeightField) -> Result<Self> {
        let heights = field.heights_mm();
        let largest = heights.iter().fold(0.0_f32, |most, h| most.max(h.abs()));
        let step = f64::from(largest * f32::EPSILON);
        let [columns, _] = field.size();
        Self::new(
            PictureKind::Height,
            columns,
            field.pitch_mm(),
            heights.to_vec(),
            step,
        )
    }

    /// What the values are.
    #[must_use]
    pub const fn kind(&self) -> PictureKind {
        self.kind
    }
}
