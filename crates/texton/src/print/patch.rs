//! A patch: a plate with bumps, in tiles that fit a printer.

use crate::error::{Result, TextonError};
use crate::geometry::{Texture, closest_on};
use glam::DVec2;
use hwall_numeric::check::{finite, positive, that};

/// A round hole through the plate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MountingHole {
    /// Middle of the hole on the plate, mm.
    pub centre_mm: DVec2,
    /// Diameter, mm.
    pub diameter_mm: f64,
}

/// Plate, grid and tiles of a patch. The plate lies from 0 to `size_mm` with its top at z = 0; x runs along the
/// long axis of the bumps.
#[derive(Debug, Clone, PartialEq)]
pub struct PatchSpec {
    /// Size along the long and along the short axis, mm.
    pub size_mm: [f64; 2],
    /// Thickness of the plate below the bumps, mm.
    pub plate_mm: f64,
    /// Middle of the first bump, mm; `None` for half a pitch. No bump is placed left of or below it. A first bump
    /// left of or below the plate only shifts the grid.
    pub first_mm: Option<DVec2>,
    /// Bumps closer than this to a border or hole are left out, mm; printers resolve 50 µm.
    pub margin_mm: f64,
    /// Size of the tiles in which the patch is made, mm; `None` for one piece. The last ones may be smaller.
    pub tile_mm: Option<[f64; 2]>,
    /// Does the grid start anew on each tile, so that tiles are equal? Otherwise it continues across tiles, and
    /// bumps that a tile border would cut are left out.
    pub restart: bool,
    /// Holes for screws, each within one tile.
    pub holes: Vec<MountingHole>,
}

impl Default for PatchSpec {
    /// 50 x 50 mm on a plate of 1 mm, as in the studies.
    fn default() -> Self {
        Self {
            size_mm: [50.0, 50.0],
            plate_mm: 1.0,
            first_mm: None,
            margin_mm: 0.05,
            tile_mm: None,
            restart: true,
            holes: Vec::new(),
        }
    }
}

impl PatchSpec {
    /// The released patch: 200 x 200 mm in four tiles of 100 x 100 mm, each with its own grid.
    #[must_use]
    pub fn released() -> Self {
        Self {
            size_mm: [200.0, 200.0],
            tile_mm: Some([100.0, 100.0]),
            ..Self::default()
        }
    }

    fn validate(&self) -> Result<()> {
        positive("width of the patch, mm", self.size_mm[0])?;
        positive("length of the patch, mm", self.size_mm[1])?;
        positive("thickness of the plate, mm", self.plate_mm)?;
        that(
            self.margin_mm >= LEAST_GAP_MM && self.margin_mm.is_finite(),
            "margin, mm",
            self.margin_mm,
            "at least 0.0001",
        )?;
        for value in self.first_mm.into_iter().flat_map(|at| at.to_array()) {
            finite("middle of the first bump, mm", value)?;
        }
        for value in self.tile_mm.into_iter().flatten() {
            positive("size of a tile, mm", value)?;
        }
        for (index, hole) in self.holes.iter().enumerate() {
            positive("diameter of a hole, mm", hole.diameter_mm)?;
            for value in hole.centre_mm.to_array() {
                finite("middle of a hole, mm", value)?;
            }
            let apart = |other: &MountingHole| {
                let off = hole.centre_mm - other.centre_mm;
                let radii = 0.5 * (hole.diameter_mm + other.diameter_mm);
                off.x.hypot(off.y) >= radii + self.margin_mm
            };
            if !self.holes[..index].iter().all(apart) {
                return Err(TextonError::Hole { index });
            }
        }
        Ok(())
    }
}

/// Below this, points of neighbouring bumps coincide in the single precision of STL.
pub(super) const LEAST_GAP_MM: f64 = 1e-4;

/// Largest number of tiles or bumps: more indicate a size in the wrong unit.
const MOST: f64 = 2e7;

/// Tiles along both axes; a remainder that is only rounding does not count as a tile.
fn tile_counts(size_mm: [f64; 2], tile_mm: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|i| (size_mm[i] / tile_mm[i] - 1e-9).ceil().max(1.0))
}

/// A rectangle of the plate, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rectangle {
    pub(super) low: DVec2,
    pub(super) high: DVec2,
}

impl Rectangle {
    /// A plate from 0 to `size_mm`.
    pub(super) const fn plate(size_mm: [f64; 2]) -> Self {
        Self {
            low: DVec2::ZERO,
            high: DVec2::from_array(size_mm),
        }
    }

    /// Distance of a box (middle and half sizes) from the border; negative where it crosses the border.
    pub(super) fn clearance(&self, centre: DVec2, half: DVec2) -> f64 {
        (0..2)
            .map(|i| (centre[i] - half[i] - self.low[i]).min(self.high[i] - centre[i] - half[i]))
            .fold(f64::INFINITY, f64::min)
    }

    fn contains(&self, at: DVec2) -> bool {
        (0..2).all(|i| at[i] >= self.low[i] && at[i] < self.high[i])
    }
}

/// Position of a bump.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bump {
    pub(super) centre_mm: DVec2,
    /// Index of the grid in which columns and rows are counted.
    pub(super) grid: u32,
    pub(super) column: i32,
    pub(super) row: i32,
}

/// Number of bumps placed, and of those left out by reason.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct BumpCounts {
    /// Bumps on the patch.
    pub placed: usize,
    /// Left out: they would cross the border of the plate.
    pub at_border: usize,
    /// Left out: a border between tiles would cut them.
    pub at_tile: usize,
    /// Left out: they would meet a mounting hole.
    pub at_hole: usize,
}

/// A piece of a patch that is printed separately.
#[derive(Debug, Clone, PartialEq)]
pub struct Tile {
    /// Lower left corner of the tile on the whole patch, mm.
    pub corner_mm: DVec2,
    /// The piece, its own lower left corner at the origin.
    pub patch: Patch,
}

/// A textured plate.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    texture: Texture,
    spec: PatchSpec,
    bumps: Vec<Bump>,
    counts: BumpCounts,
}

impl Patch {
    /// Places bumps on a plate. Bumps that would cross a border or a hole are left out and counted, never cut.
    ///
    /// # Errors
    /// Sizes that are not positive; holes across borders or each other; no bump that fits;
    /// more than 2e7 tiles or places; a first bump more than 2e7 pitches left of or below the plate.
    pub fn new(texture: Texture, spec: PatchSpec) -> Result<Self> {
        spec.validate()?;
        let plate = Rectangle::plate(spec.size_mm);
        let [width_mm, length_mm] = spec.size_mm;
        let pitch_mm = texture.layout().pitch_mm();
        let tile_mm = spec.tile_mm.unwrap_or(spec.size_mm);
        let [across, along] = tile_counts(spec.size_mm, tile_mm);
        // Check columns and rows separately: a long, thin grid has a small area but many columns.
        let area_mm = if spec.restart {
            [0, 1].map(|i| tile_mm[i].min(spec.size_mm[i]))
        } else {
            spec.size_mm
        };
        let grids = if spec.restart { across * along } else { 1.0 };
        let [columns, rows] = [0, 1].map(|i| (area_mm[i] / pitch_mm[i]).ceil());
        let places = grids * columns * rows;
        for (what, value) in [("tiles", across * along), ("places of the grid", places)] {
            that(value <= MOST, what, value, "at most 2e7")?;
        }
        let first_mm = spec.first_mm.into_iter().flat_map(|at| at.to_array());
        for (value, pitch_mm) in first_mm.zip(pitch_mm) {
            // Beyond this, rounding would move the bumps.
            that(
                value >= -MOST * pitch_mm,
                "middle of the first bump, mm",
                value,
                "at most 2e7 pitches outside the plate",
            )?;
        }
        let mut patch = Self {
            texture,
            spec,
            bumps: Vec::new(),
            counts: BumpCounts::default(),
        };
        let tiles = patch.rectangles();
        for (index, hole) in patch.spec.holes.iter().enumerate() {
            let radius = 0.5 * hole.diameter_mm;
            let clear = |t: &Rectangle| t.clearance(hole.centre_mm, DVec2::splat(radius));
            if !tiles.iter().any(|t| clear(t) >= patch.spec.margin_mm) {
                return Err(TextonError::Hole { index });
            }
        }
        if patch.spec.restart {
            for (grid, tile) in (0..).zip(&tiles) {
                patch.fill(grid, *tile, std::slice::from_ref(tile));
            }
        } else {
            patch.fill(0, plate, &tiles);
        }
        if patch.bumps.is_empty() {
            return Err(TextonError::NoBumps {
                width_mm,
                length_mm,
            });
        }
        patch.counts.placed = patch.bumps.len();
        Ok(patch)
    }

    /// The released patch with its texture: 2,880 bumps.
    ///
    /// # Panics
    /// Never: the constants fit.
    #[must_use]
    pub fn released() -> Self {
        Self::new(Texture::released(), PatchSpec::released()).expect("the released patch has bumps")
    }

    /// The texture.
    #[must_use]
    pub const fn texture(&self) -> &Texture {
        &self.texture
    }

    /// The specification it was made from.
    #[must_use]
    pub const fn spec(&self) -> &PatchSpec {
        &self.spec
    }

    /// Numbers of bumps placed and left out.
    #[must_use]
    pub const fn counts(&self) -> BumpCounts {
        self.counts
    }

    /// Middles of the bumps, mm.
    pub fn centres_mm(&self) -> impl ExactSizeIterator<Item = DVec2> {
        self.bumps.iter().map(|b| b.centre_mm)
    }

    /// Volume of the true shape, mm³: plate and bumps without holes.
    #[must_use]
    pub fn volume_mm3(&self) -> f64 {
        let [x, y] = self.spec.size_mm;
        let holes: f64 = self.spec.holes.iter().map(|h| h.diameter_mm.powi(2)).sum();
        let plate = x * y - 0.25 * std::f64::consts::PI * holes;
        plate * self.spec.plate_mm + self.bumps.len() as f64 * self.texture.texton().volume_mm3()
    }

    /// Share of the patch that bumps cover.
    #[must_use]
    pub fn coverage(&self) -> f64 {
        let [x, y] = self.spec.size_mm;
        self.bumps.len() as f64 * self.texture.texton().base_area_mm2() / (x * y)
    }

    /// The tiles as patches of their own. Tiles without bumps are plain plates.
    #[must_use]
    pub fn tiles(&self) -> Vec<Tile> {
        let tiles = self.rectangles();
        let cut = |tile: &Rectangle| {
            let bumps = self.bumps.iter().filter(|b| tile.contains(b.centre_mm));
            let bumps: Vec<Bump> = bumps
                .map(|b| Bump {
                    centre_mm: b.centre_mm - tile.low,
                    ..*b
                })
                .collect();
            let holes = self
                .spec
                .holes
                .iter()
                .filter(|h| tile.contains(h.centre_mm));
            let holes = holes.map(|h| MountingHole {
                centre_mm: h.centre_mm - tile.low,
                ..*h
            });
            let spec = PatchSpec {
                size_mm: (tile.high - tile.low).to_array(),
                first_mm: Some(if self.spec.restart {
                    self.first_mm()
                } else {
                    self.first_mm() - tile.low
                }),
                tile_mm: None,
                holes: holes.collect(),
                ..self.spec.clone()
            };
            let counts = BumpCounts {
                placed: bumps.len(),
                ..BumpCounts::default()
            };
            let texture = self.texture;
            Tile {
                corner_mm: tile.low,
                patch: Self {
                    texture,
                    spec,
                    bumps,
                    counts,
                },
            }
        };
        tiles.iter().map(cut).collect()
    }

    pub(super) fn bumps(&self) -> &[Bump] {
        &self.bumps
    }

    /// Middle of the first bump of a grid, from the corner of the area that the grid fills.
    fn first_mm(&self) -> DVec2 {
        let half_pitch_mm = 0.5 * DVec2::from_array(self.texture.layout().pitch_mm());
        self.spec.first_mm.unwrap_or(half_pitch_mm)
    }

    /// The tiles, row by row; the whole plate if there are none.
    pub(super) fn rectangles(&self) -> Vec<Rectangle> {
        let size = self.spec.size_mm;
        let tile = self.spec.tile_mm.unwrap_or(size);
        let count = tile_counts(size, tile).map(|n| n as usize);
        let cut = |i: usize, k: usize| {
            let at = |k: usize| {
                if k == count[i] {
                    size[i]
                } else {
                    k as f64 * tile[i]
                }
            };
            (at(k), at(k + 1))
        };
        let mut tiles = Vec::with_capacity(count[0] * count[1]);
        for row in 0..count[1] {
            for column in 0..count[0] {
                let ((x0, x1), (y0, y1)) = (cut(0, column), cut(1, row));
                tiles.push(Rectangle {
                    low: DVec2::new(x0, y0),
                    high: DVec2::new(x1, y1),
                });
            }
        }
        tiles
    }

    /// Fills an area with one grid; each bump has to lie within one of the tiles.
    fn fill(&mut self, grid: u32, area: Rectangle, tiles: &[Rectangle]) {
        let half = DVec2::from_array(self.texture.texton().radii().to_array());
        let layout = *self.texture.layout();
        let first = self.first_mm();
        let pitch = layout.pitch_mm();
        let margin_mm = self.spec.margin_mm;
        let plate = Rectangle::plate(self.spec.size_mm);
        let span = |i: usize| area.high[i] - area.low[i] - first[i];
        let [columns, rows] = [0, 1].map(|i| (span(i) / pitch[i]).ceil().max(0.0) as i64);
        // Start one column and row before the first one inside, for shifted rows.
        let before = |i: usize| ((-first[i] / pitch[i]).floor() - 1.0).max(0.0) as i64;
        // Tiles have their own grid.
        let tile_mm = self.spec.tile_mm.unwrap_or(self.spec.size_mm);
        let tiles_across = tile_counts(self.spec.size_mm, tile_mm)[0] as usize;
        for row in before(1)..=rows {
            for column in before(0)..=columns {
                let centre_mm = area.low + first + layout.offset_mm(column, row);
                if !area.contains(centre_mm) {
                    continue;
                }
                if plate.clearance(centre_mm, half) < margin_mm {
                    self.counts.at_border += 1;
                    continue;
                }
                let tile = if let [only] = tiles {
                    *only
                } else {
                    let [i, j] = [0, 1].map(|i| (centre_mm[i] / tile_mm[i]) as usize);
                    let index = (j * tiles_across + i.min(tiles_across - 1)).min(tiles.len() - 1);
                    tiles[index]
                };
                if tile.clearance(centre_mm, half) < margin_mm {
                    self.counts.at_tile += 1;
                    continue;
                }
                if self.meets_hole(centre_mm) {
                    self.counts.at_hole += 1;
                    continue;
                }
                self.bumps.push(Bump {
                    centre_mm,
                    grid,
                    column: column as i32,
                    row: row as i32,
                });
            }
        }
    }

    fn meets_hole(&self, centre_mm: DVec2) -> bool {
        let [a, b] = self.texture.texton().radii().to_array();
        self.spec.holes.iter().any(|hole| {
            let p = hole.centre_mm - centre_mm;
            let inside = (p.x / a).hypot(p.y / b) <= 1.0;
            let distance =
                closest_on([a, b], p.to_array()).map_or(0.0, |c| (c[0] - p.x).hypot(c[1] - p.y));
            inside || distance < 0.5 * hole.diameter_mm + self.spec.margin_mm
        })
    }
}
