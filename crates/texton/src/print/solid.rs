//! The closed solid of a patch: plate and bumps with one common surface.
//!
//! Most bumps lie in equal cells of their grid: one bump and the cell around it are triangulated
//! once and repeated. The rest (between the cells and the border, around mounting
//! holes and across tiles) is one constrained triangulation between the outlines.

use super::bump_mesh::{BumpMesh, FEWEST_AROUND};
use super::cell::{Cells, Corner};
use super::patch::{Bump, LEAST_GAP_MM, MountingHole, Patch, Rectangle};
use crate::error::{Result, TextonError};
use crate::mesh::{ChordSide, Tessellation, TriangleMesh, inside, outline};
use glam::DVec2;
use std::collections::HashSet;
use std::collections::hash_map::{Entry, HashMap};
use std::f64::consts::TAU;

/// Cells closer than this to a border or hole go to the constrained triangulation.
const CLEAR_MM: f64 = 1e-3;

/// Corners of the plate on the top, and again on the bottom.
const PLATE_CORNERS: u32 = 4;

/// The repeated parts, and their positions.
struct Plan {
    bump: BumpMesh,
    /// Triangles over a cell's corners, then the outline.
    cell: Vec<[u32; 3]>,
    /// How many corners a cell has.
    sides: usize,
    /// Corners of each bump that has a cell, one after the other.
    cell_corners: Vec<u32>,
    /// For each bump: does it have a cell?
    has_cell: Vec<bool>,
    /// The corners, on the plate, mm.
    corners_mm: Vec<DVec2>,
    /// Points around each hole, mm.
    around_holes: Vec<Vec<[f64; 2]>>,
}

impl Patch {
    /// Number of triangles of [`Patch::mesh`], without building it.
    ///
    /// # Errors
    /// As [`Patch::mesh`], except for too many triangles.
    pub fn triangle_count(&self, ask: &Tessellation) -> Result<u64> {
        Ok(self.plan(ask)?.triangles(self.bumps().len()))
    }

    /// The patch as one closed solid, mm: top of the plate at z = 0, bumps above, bottom at
    /// `-plate_mm`; holes are prisms with corners on the circle.
    ///
    /// Error: below `ask.accuracy_mm` from the true surface everywhere, on the side of `ask.side`. At
    /// least 8 points around each bump and hole at any accuracy.
    ///
    /// # Errors
    /// An accuracy outside 0.001 to 1 mm; touching bumps, which meet in a point and do not bound a solid;
    /// more triangles than allowed.
    pub fn mesh(&self, ask: &Tessellation) -> Result<TriangleMesh> {
        let plan = self.plan(ask)?;
        let count = plan.triangles(self.bumps().len());
        if count > ask.max_triangles.min(u64::from(u32::MAX)) {
            return Err(TextonError::TooManyTriangles {
                triangles: count,
                limit: ask.max_triangles,
            });
        }
        let mut points = Vec::with_capacity(count as usize / 2 + 4);
        let mut triangles = Vec::with_capacity(count as usize);
        points.extend(plan.corners_mm.iter().map(|c| [c.x, c.y, 0.0]));
        let mut with_cell = plan.cell_corners.chunks_exact(plan.sides);
        let mut rest = Rest::default();
        let n = plan.bump.outline as u32;
        for (bump, has_cell) in self.bumps().iter().zip(&plan.has_cell) {
            let first = points.len() as u32;
            let DVec2 { x, y } = bump.centre_mm;
            points.extend(plan.bump.points.iter().map(|p| [x + p.x, y + p.y, p.z]));
            triangles.extend(plan.bump.triangles.iter().map(|t| t.map(|i| first + i)));
            if let Some(corners) = has_cell.then(|| with_cell.next()).flatten() {
                let sides = plan.sides as u32;
                let index = |i: u32| {
                    if i < sides {
                        corners[i as usize]
                    } else {
                        first + i - sides
                    }
                };
                triangles.extend(plan.cell.iter().map(|t| t.map(index)));
            } else {
                rest.add_outline(&points, first, n);
            }
        }
        for [a, b] in open_sides(&plan.cell_corners, plan.sides) {
            rest.add_side(&points, a, b);
        }
        let mut outlines = Vec::new();
        for hole in &plan.around_holes {
            let first = points.len() as u32;
            points.extend(hole.iter().map(|[x, y]| [*x, *y, 0.0]));
            rest.add_outline(&points, first, hole.len() as u32);
            outlines.push(OutlinePoints {
                first,
                count: hole.len() as u32,
            });
        }
        let top = points.len() as u32;
        let [width, length] = self.spec().size_mm;
        let plate = [[0.0, 0.0], [width, 0.0], [width, length], [0.0, length]];
        points.extend(plate.map(|[x, y]| [x, y, 0.0]));
        rest.add_outline(&points, top, PLATE_CORNERS);
        triangles.extend(rest.triangles()?);
        let plate = OutlinePoints {
            first: top,
            count: PLATE_CORNERS,
        };
        self.close(&mut points, &mut triangles, plate, &outlines)?;
        debug_assert_eq!(triangles.len() as u64, count);
        Ok(TriangleMesh::from_parts(points, triangles))
    }

    /// Adds sides, holes and bottom below the outlines of the top.
    fn close(
        &self,
        points: &mut Vec<[f64; 3]>,
        triangles: &mut Vec<[u32; 3]>,
        plate: OutlinePoints,
        holes: &[OutlinePoints],
    ) -> Result<()> {
        let mut below = Rest::default();
        for &OutlinePoints { first, count } in std::iter::once(&plate).chain(holes) {
            let low = points.len() as u32;
            for i in first..first + count {
                let [x, y, _] = points[i as usize];
                points.push([x, y, -self.spec().plate_mm]);
            }
            for ([a, b], [c, d]) in outline(first, count).zip(outline(low, count)) {
                // The plate lies left of its own outline, right of a hole's.
                if first == plate.first {
                    triangles.extend([[a, c, d], [a, d, b]]);
                } else {
                    triangles.extend([[a, d, c], [a, b, d]]);
                }
            }
            below.add_outline(points, low, count);
        }
        let bottom = below.triangles()?;
        triangles.extend(bottom.into_iter().map(|[a, b, c]| [a, c, b]));
        Ok(())
    }

    fn plan(&self, ask: &Tessellation) -> Result<Plan> {
        ask.validate()?;
        let texton = self.texture().texton();
        let (grow_mm, gap_mm) = match ask.side {
            ChordSide::Inside => (0.0, self.texture().gap_mm()),
            // Corners outside the surface must stay clear of borders, too.
            ChordSide::Both => {
                let margin_mm = self.spec().margin_mm;
                let gap_mm = self.texture().gap_mm().min(2.0 * margin_mm);
                (ask.accuracy_mm, gap_mm)
            }
        };
        let least_mm = LEAST_GAP_MM + 2.0 * grow_mm;
        if self.bumps().len() > 1 && gap_mm < least_mm {
            return Err(TextonError::Touching { gap_mm, least_mm });
        }
        let bump = BumpMesh::new(texton, ask)?;
        let mut plan = Plan {
            bump,
            cell: Vec::new(),
            sides: 1,
            cell_corners: Vec::new(),
            has_cell: vec![false; self.bumps().len()],
            corners_mm: Vec::new(),
            around_holes: Vec::new(),
        };
        for hole in &self.spec().holes {
            plan.around_holes.push(around(hole, ask.accuracy_mm));
        }
        // A bump without neighbours may fill its cell to the border.
        if gap_mm >= least_mm
            && let Some(cells) = Cells::new(texton, self.texture().layout())
        {
            self.plan_cells(&cells, &mut plan)?;
        }
        Ok(plan)
    }

    fn plan_cells(&self, cells: &Cells, plan: &mut Plan) -> Result<()> {
        let corners = cells.around(0, 0).map(|c| cells.at_mm(c).to_array());
        let mut around: Vec<[f64; 2]> = corners.collect();
        plan.sides = around.len();
        let half = [0, 1].map(|i| around.iter().map(|p| p[i]).fold(0.0, f64::max));
        let half = DVec2::from_array(half);
        let flat = plan.bump.points[..plan.bump.outline].iter();
        around.extend(flat.map(|p| [p.x, p.y]));
        let (sides, n) = (plan.sides as u32, plan.bump.outline as u32);
        let outlines: Vec<[u32; 2]> = outline(0, sides).chain(outline(sides, n)).collect();
        plan.cell = inside(&around, &outlines)?;
        let tiles = self.rectangles();
        let plate = Rectangle::plate(self.spec().size_mm);
        let mut index: HashMap<(u32, Corner), u32> = HashMap::new();
        for (k, bump) in self.bumps().iter().enumerate() {
            // Cells of different grids must not meet.
            let area = if self.spec().restart && tiles.len() > 1 {
                tiles[bump.grid as usize]
            } else {
                plate
            };
            if area.clearance(bump.centre_mm, half) < CLEAR_MM || self.near_hole(bump, half) {
                continue;
            }
            plan.has_cell[k] = true;
            for corner in cells.around(bump.column, bump.row) {
                let next = index.len() as u32;
                let entry = index.entry((bump.grid, corner));
                if let Entry::Vacant(_) = entry {
                    // Position of the grid's first bump: this bump's position minus its offset.
                    let offset = self
                        .texture()
                        .layout()
                        .offset_mm(i64::from(bump.column), i64::from(bump.row));
                    let first_mm = bump.centre_mm - offset;
                    plan.corners_mm.push(first_mm + cells.at_mm(corner));
                }
                plan.cell_corners.push(*entry.or_insert(next));
            }
        }
        Ok(())
    }

    /// Is the box of half sizes `half` around a bump, which contains its cell, near a hole?
    fn near_hole(&self, bump: &Bump, half: DVec2) -> bool {
        self.spec().holes.iter().any(|hole| {
            let off = (hole.centre_mm - bump.centre_mm).abs() - half;
            off.x.max(0.0).hypot(off.y.max(0.0)) < 0.5 * hole.diameter_mm + CLEAR_MM
        })
    }
}

impl Plan {
    /// Number of triangles, from Euler's formula: the plate's top has `V + 2 H + 2 I - 2` triangles for V points
    /// on outlines, I other points and H outlines within the outer one.
    fn triangles(&self, bumps: usize) -> u64 {
        let bumps = bumps as u64;
        let holes = self.around_holes.len() as u64;
        let around: u64 = self.around_holes.iter().map(|h| h.len() as u64).sum();
        let own = u64::from(PLATE_CORNERS);
        let corners = self.corners_mm.len() as u64;
        let outlines = self.bump.outline as u64 * bumps + around + own;
        let top = outlines + 2 * (bumps + holes) + 2 * corners - 2;
        let bottom = around + own + 2 * holes - 2;
        let walls = 2 * (around + own);
        top + bottom + walls + self.bump.triangles.len() as u64 * bumps
    }
}

/// Points around a hole, counter-clockwise.
fn around(hole: &MountingHole, accuracy_mm: f64) -> Vec<[f64; 2]> {
    let radius = 0.5 * hole.diameter_mm;
    // A chord over the angle 2 a sags by r (1 - cos a).
    let half = (1.0 - accuracy_mm / radius).max(0.0).acos();
    let count = ((0.5 * TAU / half).ceil() as usize).max(FEWEST_AROUND);
    let at = |i: usize| {
        let (sin, cos) = (TAU * i as f64 / count as f64).sin_cos();
        let DVec2 { x, y } = hole.centre_mm;
        [x + radius * cos, y + radius * sin]
    };
    (0..count).map(at).collect()
}

/// Sides of cells that no other cell shares, in the order of their points.
fn open_sides(cell_corners: &[u32], sides: usize) -> Vec<[u32; 2]> {
    let mut open: HashSet<[u32; 2]> = HashSet::new();
    for corners in cell_corners.chunks_exact(sides) {
        for (i, &a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % sides];
            if !open.remove(&[b, a]) {
                open.insert([a, b]);
            }
        }
    }
    let mut open: Vec<[u32; 2]> = open.into_iter().collect();
    open.sort_unstable();
    open
}

/// A closed outline over points of the mesh that follow each other.
#[derive(Clone, Copy)]
struct OutlinePoints {
    first: u32,
    count: u32,
}

/// A region between outlines over points of the mesh.
#[derive(Default)]
struct Rest {
    flat: Vec<[f64; 2]>,
    /// Indices of the region's points among all points of the mesh.
    global: Vec<u32>,
    local: HashMap<u32, u32>,
    sides: Vec<[u32; 2]>,
}

impl Rest {
    fn point(&mut self, points: &[[f64; 3]], global: u32) -> u32 {
        let next = self.flat.len() as u32;
        *self.local.entry(global).or_insert_with(|| {
            let [x, y, _] = points[global as usize];
            self.flat.push([x, y]);
            self.global.push(global);
            next
        })
    }

    fn add_side(&mut self, points: &[[f64; 3]], a: u32, b: u32) {
        let side = [self.point(points, a), self.point(points, b)];
        self.sides.push(side);
    }

    fn add_outline(&mut self, points: &[[f64; 3]], first: u32, count: u32) {
        for [a, b] in outline(first, count) {
            self.add_side(points, a, b);
        }
    }

    fn triangles(self) -> Result<Vec<[u32; 3]>> {
        let triangles = inside(&self.flat, &self.sides)?;
        Ok(triangles
            .into_iter()
            .map(|t| t.map(|i| self.global[i as usize]))
            .collect())
    }
}
