//! A node of the hierarchy: eight boxes, and a ray prepared to test them.

use glam::DVec3;

/// Children of a node.
pub(super) const CHILDREN: usize = 8;

/// Unused children have a box that no ray hits.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Node {
    /// Lower and upper planes of the boxes, by axis.
    pub(super) planes: [[[f32; CHILDREN]; 3]; 2],
    /// Index of a node, or a leaf.
    pub(super) children: [u32; CHILDREN],
}

/// Flag of a leaf; the lower bits are its index.
pub(super) const LEAF: u32 = 1 << 31;

/// The root is never a child, so its index marks unused slots.
pub(super) const UNUSED: u32 = 0;

/// The index of a leaf.
#[inline(always)]
pub(super) fn leaf_of(child: u32) -> usize {
    (child & !LEAF) as usize
}

/// True for a leaf, false for a node.
#[inline(always)]
pub(super) fn is_leaf(child: u32) -> bool {
    child & LEAF != 0
}

impl Node {
    pub(super) const EMPTY: Self = Self {
        planes: [
            [[f32::INFINITY; CHILDREN]; 3],
            [[f32::NEG_INFINITY; CHILDREN]; 3],
        ],
        children: [UNUSED; CHILDREN],
    };
}

/// A ray prepared for boxes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct BoxRay {
    pub(super) origin: [f32; 3],
    pub(super) inverse: [f32; 3],
    /// For each axis, the plane that the ray meets first: 0 is the lower, 1 the upper one.
    pub(super) entered: [usize; 3],
}

impl BoxRay {
    /// `inverse`: reciprocal of each component of the direction.
    #[inline(always)]
    pub(super) fn new(origin: DVec3, inverse: DVec3) -> Self {
        // At most 1/epsilon, to avoid products of zero and infinity.
        let limit = f64::from(1.0 / f32::EPSILON);
        let inverse = inverse.clamp(DVec3::splat(-limit), DVec3::splat(limit));
        Self {
            origin: origin.as_vec3().to_array(),
            inverse: inverse.as_vec3().to_array(),
            entered: [
                usize::from(inverse.x < 0.0),
                usize::from(inverse.y < 0.0),
                usize::from(inverse.z < 0.0),
            ],
        }
    }
}
