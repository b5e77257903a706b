//! A patch: a plate with bumps, in tiles that a printer makes.

use crate::error::{finite, positive};
use crate::{TextonError, Texture};

/// A round hole through the plate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MountingHole {
    /// Its middle on the plate, mm.
    pub centre_mm: [f64; 2],
    /// Diameter, mm.
    pub diameter_mm: f64,
}

/// What a patch is cut from. The plate lies in `0..size_mm` with its top at z = 0; x runs along the
/// long axis of the bumps.
#[derive(Debug, Clone, PartialEq)]
pub struct PatchSpec {
    /// Size along the long and along the short axis, mm.
    pub size_mm: [f64; 2],
    /// Thickness of the plate below the bumps, mm.
    pub plate_mm: f64,
    /// Middle of the first bump, mm; `None` for half a pitch. No bump stands left of or below it; one left of
    /// or below the plate only moves the grid.
    pub first_mm: Option<[f64; 2]>,
    /// Bumps that come closer than this to a border or hole are left out, mm; 50 µm prints.
    pub margin_mm: f64,
    /// Size of the tiles in which it is made; `None` for one piece. The last ones may be smaller.
    pub tile_mm: Option<[f64; 2]>,
    /// Does the grid start anew at each tile, so that tiles are equal? Else it runs on, and bumps
    /// that a tile's border would cut are left out.
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

    fn validate(&self) -> Result<(), TextonError> {
        positive("width of the patch, mm", self.size_mm[0])?;
        positive("length of the patch, mm", self.size_mm[1])?;
        positive("thickness of the plate, mm", self.plate_mm)?;
        if !(self.margin_mm >= LEAST_GAP_MM && self.margin_mm.is_finite()) {
            return Err(TextonError::Parameter {
                what: "margin, mm",
                value: self.margin_mm,
                wanted: "at least 0.0001",
            });
        }
        for value in self.first_mm.into_iter().flatten() {
            finite("middle of the first bump, mm", value)?;
        }
        for value in self.tile_mm.into_iter().flatten() {
            positive("size of a tile, mm", value)?;
        }
        for (index, hole) in self.holes.iter().enumerate() {
            positive("diameter of a hole, mm", hole.diameter_mm)?;
            for value in hole.centre_mm {
                finite("middle of a hole, mm", value)?;
            }
            let apart = |other: &MountingHole| {
                let [x, y] = [0, 1].map(|i| hole.centre_mm[i] - other.centre_mm[i]);
                let radii = 0.5 * (hole.diameter_mm + other.diameter_mm);
                x.hypot(y) >= radii + self.margin_mm
            };
            if !self.holes[..index].iter().all(apart) {
                return Err(TextonError::Hole { index });
            }
        }
        Ok(())
    }
}

/// Below this, points of neighbouring bumps fall together in the single precision of STL.
pub(crate) const LEAST_GAP_MM: f64 = 1e-4;

/// Tiles and bumps at most: beyond, something was meant in another unit.
const MOST: f64 = 2e7;

/// Tiles along both axes; rounding makes no tile of its own.
fn tile_counts(size_mm: [f64; 2], tile_mm: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|i| (size_mm[i] / tile_mm[i] - 1e-9).ceil().max(1.0))
}

/// A rectangle of the plate, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rectangle {
    pub(crate) low: [f64; 2],
    pub(crate) high: [f64; 2],
}

impl Rectangle {
    /// How far a box around a middle stays inside; negative outside.
    pub(crate) fn clearance(&self, centre: [f64; 2], half: [f64; 2]) -> f64 {
        (0..2)
            .map(|i| (centre[i] - half[i] - self.low[i]).min(self.high[i] - centre[i] - half[i]))
            .fold(f64::INFINITY, f64::min)
    }

    fn contains(&self, at: [f64; 2]) -> bool {
        (0..2).all(|i| at[i] >= self.low[i] && at[i] < self.high[i])
    }
}

/// Where a bump stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bump {
    pub(crate) centre_mm: [f64; 2],
    /// Which grid: bumps of different grids are no neighbours in a lattice.
    pub(crate) grid: u32,
    pub(crate) column: i32,
    pub(crate) row: i32,
}

/// Places of the grid, by what became of them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct BumpCounts {
    /// Bumps on the patch.
    pub placed: usize,
    /// Left out as they would cross the border of the plate.
    pub at_border: usize,
    /// Left out as a border between tiles would cut them.
    pub at_tile: usize,
    /// Left out for a mounting hole.
    pub at_hole: usize,
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
    /// Puts bumps on a plate. None is ever cut: one that would cross a border or a hole is left
    /// out, and counted.
    ///
    /// # Errors
    /// Sizes that are no positive numbers; holes across borders or each other; no bump that fits;
    /// more than 2e7 tiles or places; a first bump more than 2e7 pitches left of or below the plate.
    pub fn new(texture: Texture, spec: PatchSpec) -> Result<Self, TextonError> {
        spec.validate()?;
        let plate = Rectangle {
            low: [0.0; 2],
            high: spec.size_mm,
        };
        let [width_mm, length_mm] = spec.size_mm;
        let pitch_mm = texture.layout().pitch_mm();
        let tile_mm = spec.tile_mm.unwrap_or(spec.size_mm);
        let [across, along] = tile_counts(spec.size_mm, tile_mm);
        // Columns and rows each, not areas: a long and thin grid has a small area and no end.
        let area_mm = if spec.restart {
            [0, 1].map(|i| tile_mm[i].min(spec.size_mm[i]))
        } else {
            spec.size_mm
        };
        let grids = if spec.restart { across * along } else { 1.0 };
        let [columns, rows] = [0, 1].map(|i| (area_mm[i] / pitch_mm[i]).ceil());
        let places = grids * columns * rows;
        for (what, value) in [("tiles", across * along), ("places of the grid", places)] {
            if value > MOST {
                return Err(TextonError::Parameter {
                    what,
                    value,
                    wanted: "at most 2e7",
                });
            }
        }
        for (value, pitch_mm) in spec.first_mm.into_iter().flatten().zip(pitch_mm) {
            // Beyond, rounding moves the bumps.
            if value < -MOST * pitch_mm {
                return Err(TextonError::Parameter {
                    what: "middle of the first bump, mm",
                    value,
                    wanted: "at most 2e7 pitches outside the plate",
                });
            }
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
            let clear = |t: &Rectangle| t.clearance(hole.centre_mm, [radius; 2]);
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

    /// What it was made from.
    #[must_use]
    pub const fn spec(&self) -> &PatchSpec {
        &self.spec
    }

    /// How many bumps there are, and how many were left out.
    #[must_use]
    pub const fn counts(&self) -> BumpCounts {
        self.counts
    }

    /// Middles of the bumps, mm.
    pub fn centres_mm(&self) -> impl ExactSizeIterator<Item = [f64; 2]> {
        self.bumps.iter().map(|b| b.centre_mm)
    }

    /// Volume of the true shape, mm³: plate and bumps less holes.
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

    /// The tiles as patches of their own, each with its lower left corner on the patch, mm.
    /// Tiles on which no bump stands are plain plates.
    #[must_use]
    pub fn tiles(&self) -> Vec<([f64; 2], Self)> {
        let tiles = self.rectangles();
        let moved = |at: [f64; 2], by: [f64; 2]| [at[0] - by[0], at[1] - by[1]];
        let cut = |tile: &Rectangle| {
            let bumps = self.bumps.iter().filter(|b| tile.contains(b.centre_mm));
            let bumps: Vec<Bump> = bumps
                .map(|b| Bump {
                    centre_mm: moved(b.centre_mm, tile.low),
                    ..*b
                })
                .collect();
            let holes = self
                .spec
                .holes
                .iter()
                .filter(|h| tile.contains(h.centre_mm));
            let holes = holes.map(|h| MountingHole {
                centre_mm: moved(h.centre_mm, tile.low),
                ..*h
            });
            let spec = PatchSpec {
                size_mm: moved(tile.high, tile.low),
                first_mm: Some(moved(
                    self.first_mm(),
                    if self.spec.restart {
                        [0.0; 2]
                    } else {
                        tile.low
                    },
                )),
                tile_mm: None,
                holes: holes.collect(),
                ..self.spec.clone()
            };
            let counts = BumpCounts {
                placed: bumps.len(),
                ..BumpCounts::default()
            };
            let texture = self.texture;
            (
                tile.low,
                Self {
                    texture,
                    spec,
                    bumps,
                    counts,
                },
            )
        };
        tiles.iter().map(cut).collect()
    }

    pub(crate) fn bumps(&self) -> &[Bump] {
        &self.bumps
    }

    /// Middle of the first bump of a grid, from the corner of what the grid fills.
    pub(crate) fn first_mm(&self) -> [f64; 2] {
        let [x, y] = self.texture.layout().pitch_mm();
        self.spec.first_mm.unwrap_or([0.5 * x, 0.5 * y])
    }

    /// The tiles, row by row; the whole plate if there are none.
    pub(crate) fn rectangles(&self) -> Vec<Rectangle> {
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
                    low: [x0, y0],
                    high: [x1, y1],
                });
            }
        }
        tiles
    }

    /// One grid over an area, its bumps each within one of the tiles.
    fn fill(&mut self, grid: u32, area: Rectangle, tiles: &[Rectangle]) {
        let half = self.texture.texton().radii_mm();
        let layout = *self.texture.layout();
        let first = self.first_mm();
        let pitch = layout.pitch_mm();
        let margin_mm = self.spec.margin_mm;
        let plate = Rectangle {
            low: [0.0; 2],
            high: self.spec.size_mm,
        };
        let span = |i: usize| area.high[i] - area.low[i] - first[i];
        let [columns, rows] = [0, 1].map(|i| (span(i) / pitch[i]).ceil().max(0.0) as i64);
        // One before the first inside, for rows that are moved on.
        let before = |i: usize| ((-first[i] / pitch[i]).floor() - 1.0).max(0.0) as i64;
        // Tiles stand in a grid of their own.
        let tile_mm = self.spec.tile_mm.unwrap_or(self.spec.size_mm);
        let tiles_across = tile_counts(self.spec.size_mm, tile_mm)[0] as usize;
        for row in before(1)..=rows {
            for column in before(0)..=columns {
                let [x, y] = layout.offset_mm(column, row);
                let centre_mm = [area.low[0] + first[0] + x, area.low[1] + first[1] + y];
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

    fn meets_hole(&self, centre: [f64; 2]) -> bool {
        let [a, b] = self.texture.texton().radii_mm();
        self.spec.holes.iter().any(|hole| {
            let p = [0, 1].map(|i| hole.centre_mm[i] - centre[i]);
            let inside = (p[0] / a).hypot(p[1] / b) <= 1.0;
            let distance = crate::surface::closest_on([a, b], p)
                .map_or(0.0, |c| (c[0] - p[0]).hypot(c[1] - p[1]));
            inside || distance < 0.5 * hole.diameter_mm + self.spec.margin_mm
        })
    }
}
