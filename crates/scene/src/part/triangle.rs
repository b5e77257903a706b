//! One triangle: corners, normal, area.

use glam::DVec3;

/// Largest coordinate of a vertex, m. Beyond it, products of areas lose precision or overflow.
pub const COORDINATE_LIMIT_M: f64 = 1e9;

/// True within [`COORDINATE_LIMIT_M`]; false for NaN.
pub(crate) fn is_usable(coordinate: f64) -> bool {
    coordinate.abs() <= COORDINATE_LIMIT_M
}

/// Corners in metres, counter-clockwise seen from outside.
pub(crate) type Triangle = [DVec3; 3];

/// A triangle in the frame of the part and the surface that it belongs to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Face {
    pub(crate) corners_m: Triangle,
    pub(crate) surface: u32,
}

/// Unit normal by the winding; zero for a triangle without area.
pub(crate) fn normal([a, b, c]: &Triangle) -> DVec3 {
    (*b - *a).cross(*c - *a).normalize_or_zero()
}

pub(crate) fn area_m2([a, b, c]: &Triangle) -> f64 {
    0.5 * (*b - *a).cross(*c - *a).length()
}

/// True if the area is so small that the normal would be rounding noise.
///
/// The height is below 1e-12 of the longest side: ten bits above the rounding of coordinates as large as the triangle.
pub(crate) fn is_degenerate([a, b, c]: &Triangle) -> bool {
    let longest_squared = (*b - *a)
        .length_squared()
        .max((*c - *b).length_squared().max((*a - *c).length_squared()));
    // Twice the area is side times height. NaN compares false, so it counts as no area.
    let twice_area = (*b - *a).cross(*c - *a).length();
    let has_area = twice_area > 1e-12 * longest_squared;
    !has_area
}

/// True if the triangle is so thin that rounding in a scene of this extent destroys its shape.
///
/// Corners are stored relative to the middle of their part, with a rounding of 1e-16 times the extent. A triangle
/// counts as lost if its height is below 1024 times that rounding.
pub(crate) fn is_lost([a, b, c]: &Triangle, reach_m: f64) -> bool {
    let longest = (*b - *a)
        .length()
        .max((*c - *b).length().max((*a - *c).length()));
    let twice_area = (*b - *a).cross(*c - *a).length();
    let is_kept = twice_area > 1024.0 * f64::EPSILON * reach_m * longest;
    !is_kept
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];

    #[test]
    fn slivers_are_degenerate_at_every_size() {
        for scale in [1e-6, 1.0, 1e6] {
            assert!(!is_degenerate(&UNIT.map(|p| p * scale)));
            let sliver = [DVec3::ZERO, DVec3::X, DVec3::new(0.5, 1e-14, 0.0)];
            assert!(is_degenerate(&sliver.map(|p| p * scale)));
        }
        assert!(is_degenerate(&[DVec3::NAN; 3]));
    }
}
