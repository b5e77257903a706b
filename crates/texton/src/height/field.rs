//! Heights over a regular grid of points.

use crate::error::{Result, TextonError};
use crate::mesh::{TriangleMesh, inside, outline};
use crate::print::Patch;
use glam::DVec2;
use hwall_numeric::check::{positive, that};

/// Largest number of pixels: a gigabyte.
pub(crate) const MOST_PIXELS: u64 = 1 << 28;

/// Heights above the plate, mm, at the middles of square pixels; row 0 at the lower border (least y).
#[derive(Debug, Clone, PartialEq)]
pub struct HeightField {
    columns: usize,
    pitch_mm: f64,
    heights_mm: Vec<f32>,
}

impl HeightField {
    /// Rows of heights, mm, the lowest row (least y) first; pixels `pitch_mm` apart both ways.
    ///
    /// Error of single precision: 6e-8 of the height.
    ///
    /// # Errors
    /// A pitch that is not positive, an incomplete row, no pixels, a height that is not finite.
    pub fn new(columns: usize, pitch_mm: f64, heights_mm: Vec<f32>) -> Result<Self> {
        positive("pixel pitch, mm", pitch_mm)?;
        if columns == 0 || heights_mm.is_empty() || !heights_mm.len().is_multiple_of(columns) {
            return Err(TextonError::MapSize {
                width: columns,
                height: heights_mm.len().checked_div(columns).unwrap_or(0),
                values: heights_mm.len(),
            });
        }
        if let Some(i) = heights_mm.iter().position(|h| !h.is_finite()) {
            return Err(TextonError::Pixel {
                column: i % columns,
                // From the top, as in pictures.
                row: heights_mm.len() / columns - 1 - i / columns,
                value: f64::from(heights_mm[i]),
            });
        }
        Ok(Self {
            columns,
            pitch_mm,
            heights_mm,
        })
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        [self.columns, self.heights_mm.len() / self.columns]
    }

    /// Distance of neighbouring pixels, mm.
    #[must_use]
    pub const fn pitch_mm(&self) -> f64 {
        self.pitch_mm
    }

    /// All heights, mm, the lowest row first.
    #[must_use]
    pub fn heights_mm(&self) -> &[f32] {
        &self.heights_mm
    }

    /// Height of a pixel, mm; beyond the border, the height of the nearest pixel.
    pub(super) fn pixel_mm(&self, column: i64, row: i64) -> f64 {
        let [columns, rows] = self.size();
        let column = column.clamp(0, columns as i64 - 1) as usize;
        let row = row.clamp(0, rows as i64 - 1) as usize;
        f64::from(self.heights_mm[row * self.columns + column])
    }

    /// Height at a point, mm; linear between the middles of pixels, constant from the outermost middles
    /// to the border, `None` outside. `at_mm`: from the lower left corner of the field.
    #[must_use]
    pub fn height_at_mm(&self, at_mm: DVec2) -> Option<f64> {
        let size = self.size();
        let inside = |i: usize| at_mm[i] >= 0.0 && at_mm[i] <= size[i] as f64 * self.pitch_mm;
        if !(inside(0) && inside(1)) {
            return None;
        }
        let [(i, s), (j, t)] = at_mm.to_array().map(|x| {
            let pixels = x / self.pitch_mm - 0.5;
            (pixels.floor() as i64, pixels - pixels.floor())
        });
        let row = |j: i64| (1.0 - s) * self.pixel_mm(i, j) + s * self.pixel_mm(i + 1, j);
        Some((1.0 - t) * row(j) + t * row(j + 1))
    }

    /// Unit normal of a pixel by central differences, one-sided at the border; z away from the plate.
    #[must_use]
    pub fn normal(&self, column: usize, row: usize) -> [f64; 3] {
        let [columns, rows] = self.size();
        let (i, j) = (column as i64, row as i64);
        let slope = |low: f64, high: f64, at: usize, count: usize| {
            // At a border one of the two neighbours is the pixel itself.
            let steps = usize::from(at > 0) + usize::from(at + 1 < count);
            if steps == 0 {
                0.0
            } else {
                (high - low) / (steps as f64 * self.pitch_mm)
            }
        };
        let x = slope(
            self.pixel_mm(i - 1, j),
            self.pixel_mm(i + 1, j),
            column,
            columns,
        );
        let y = slope(self.pixel_mm(i, j - 1), self.pixel_mm(i, j + 1), row, rows);
        glam::dvec3(-x, -y, 1.0).normalize().to_array()
    }

    /// A closed solid with two triangles for every four neighbouring pixels, bounded by the middles of
    /// the outermost pixels, with a plate of `plate_mm` below the lowest pixel.
    ///
    /// # Errors
    /// Fewer than 2 x 2 pixels; a thickness that is not positive; more than `max_triangles`.
    pub fn mesh(&self, plate_mm: f64, max_triangles: u64) -> Result<TriangleMesh> {
        positive("thickness of the plate, mm", plate_mm)?;
        let [columns, rows] = self.size();
        that(
            columns >= 2 && rows >= 2,
            "pixels along a side",
            columns.min(rows) as f64,
            "at least 2",
        )?;
        let around = 2 * (columns + rows) as u64 - 4;
        let triangles = 2 * ((columns - 1) * (rows - 1)) as u64 + 3 * around - 2;
        let limit = max_triangles.min(u64::from(u32::MAX));
        if triangles > limit {
            return Err(TextonError::TooManyTriangles { triangles, limit });
        }
        let lowest = self
            .heights_mm
            .iter()
            .copied()
            .fold(f32::INFINITY, f32::min);
        let bottom = f64::from(lowest) - plate_mm;
        let at = |k: usize| (k as f64 + 0.5) * self.pitch_mm;
        let mut points: Vec<[f64; 3]> = (0..rows * columns)
            .map(|k| {
                let height = f64::from(self.heights_mm[k]);
                [at(k % columns), at(k / columns), height]
            })
            .collect();
        let mut faces = Vec::with_capacity(triangles as usize);
        let index = |i: usize, j: usize| (j * columns + i) as u32;
        for j in 0..rows - 1 {
            for i in 0..columns - 1 {
                let [a, b] = [index(i, j), index(i + 1, j)];
                let [c, d] = [index(i + 1, j + 1), index(i, j + 1)];
                faces.extend([[a, b, c], [a, c, d]]);
            }
        }
        let rim: Vec<u32> = (0..columns - 1)
            .map(|i| index(i, 0))
            .chain((0..rows - 1).map(|j| index(columns - 1, j)))
            .chain((1..columns).rev().map(|i| index(i, rows - 1)))
            .chain((1..rows).rev().map(|j| index(0, j)))
            .collect();
        let low = points.len() as u32;
        let flat: Vec<[f64; 2]> = rim
            .iter()
            .map(|i| [points[*i as usize][0], points[*i as usize][1]])
            .collect();
        points.extend(flat.iter().map(|[x, y]| [*x, *y, bottom]));
        let sides: Vec<[u32; 2]> = outline(0, rim.len() as u32).collect();
        for &[a, b] in &sides {
            let (top_a, top_b) = (rim[a as usize], rim[b as usize]);
            faces.extend([[top_a, low + a, low + b], [top_a, low + b, top_b]]);
        }
        let below = inside(&flat, &sides)?;
        faces.extend(
            below
                .into_iter()
                .map(|[a, b, c]| [low + a, low + c, low + b]),
        );
        Ok(TriangleMesh::from_parts(points, faces))
    }
}

impl Patch {
    /// Height of the true surface above the plate, mm; `None` outside the patch and in its holes.
    /// Checks every bump: for many points use [`Patch::height_field`].
    #[must_use]
    pub fn height_at_mm(&self, at_mm: DVec2) -> Option<f64> {
        let size = self.spec().size_mm;
        let on_plate = (0..2).all(|i| at_mm[i] >= 0.0 && at_mm[i] <= size[i]);
        let in_hole = self.spec().holes.iter().any(|h| {
            let off = at_mm - h.centre_mm;
            off.x.hypot(off.y) < 0.5 * h.diameter_mm
        });
        if !on_plate || in_hole {
            return None;
        }
        let texton = self.texture().texton();
        let height = |centre_mm: DVec2| texton.height_at_mm(at_mm - centre_mm);
        Some(self.centres_mm().map(height).fold(0.0, f64::max))
    }

    /// Heights above the plate at the middles of pixels; a last column or row that would extend beyond the
    /// border by more than half a pixel is left out. Holes are level with the plate.
    ///
    /// # Errors
    /// A pitch that is not positive; no pixels or too many.
    pub fn height_field(&self, pitch_mm: f64) -> Result<HeightField> {
        positive("pixel pitch, mm", pitch_mm)?;
        let count = self.spec().size_mm.map(|x| (x / pitch_mm).round());
        let pixels = pixel_count(count[0] * count[1])?;
        let [columns, rows] = count.map(|c| c as usize);
        let mut heights_mm = vec![0.0_f32; pixels];
        let texton = self.texture().texton();
        let radii = texton.radii().to_array();
        for centre in self.centres_mm() {
            // Pixels whose middles are below the bump.
            let [(i0, i1), (j0, j1)] = [(0, columns), (1, rows)].map(|(axis, count)| {
                let to = |x: f64| (x / pitch_mm - 0.5).max(0.0);
                let first = to(centre[axis] - radii[axis]).ceil() as usize;
                let last = to(centre[axis] + radii[axis]).floor() as usize;
                (first, (last + 1).min(count))
            });
            for j in j0..j1 {
                for i in i0..i1 {
                    let at = DVec2::from([i, j].map(|k| (k as f64 + 0.5) * pitch_mm));
                    let height = texton.height_at_mm(at - centre);
                    let pixel = &mut heights_mm[j * columns + i];
                    *pixel = pixel.max(height as f32);
                }
            }
        }
        HeightField::new(columns, pitch_mm, heights_mm)
    }
}

fn pixel_count(pixels: f64) -> Result<usize> {
    let holds = (1.0..=MOST_PIXELS as f64).contains(&pixels);
    Ok(that(holds, "pixels", pixels, "1 to 268435456")? as usize)
}
