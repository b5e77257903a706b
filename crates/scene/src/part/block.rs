//! Up to four triangles of a leaf in structure-of-arrays form, to test a ray against all of them at once.
//!
//! Each ray permutes the axes. Triangles stored as nine consecutive numbers would have to be shuffled for every
//! ray, which would be a quarter of all instructions of a ray cast.

use super::triangle::Face;
use glam::DVec3;

/// Triangles of a block.
pub(super) const LANES: usize = 4;

/// One number of each triangle.
pub(super) type Lanes = [f64; LANES];

/// The surface of a lane without a triangle.
const NO_SURFACE: u32 = u32::MAX;

/// Triangles in the frame of the part.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Block {
    /// Coordinates by axis and corner, m; NaN in lanes without a triangle, so that no ray hits them.
    pub(super) corners_m: [[Lanes; 3]; 3],
    surfaces: [u32; LANES],
}

impl Block {
    pub(super) const EMPTY: Self = Self {
        corners_m: [[[f64::NAN; LANES]; 3]; 3],
        surfaces: [NO_SURFACE; LANES],
    };

    /// At most [`LANES`] triangles.
    pub(super) fn new<'a>(faces: impl Iterator<Item = &'a Face>) -> Self {
        let mut block = Self::EMPTY;
        for (lane, face) in faces.take(LANES).enumerate() {
            block.surfaces[lane] = face.surface;
            for axis in 0..3 {
                for (corner, point_m) in face.corners_m.iter().enumerate() {
                    block.corners_m[axis][corner][lane] = point_m[axis];
                }
            }
        }
        block
    }

    /// Number of triangles; they are in the first lanes.
    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        let are = self.surfaces.iter().filter(|&&s| s != NO_SURFACE);
        are.count()
    }

    #[inline(always)]
    pub(super) fn face(&self, lane: usize) -> Face {
        let [x, y, z] = &self.corners_m;
        let corner = |i: usize| DVec3::new(x[i][lane], y[i][lane], z[i][lane]);
        Face {
            corners_m: [corner(0), corner(1), corner(2)],
            surface: self.surfaces[lane],
        }
    }
}
