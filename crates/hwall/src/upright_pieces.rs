//! The upright surface pieces of a scene, as barriers.

use crate::error::SessionError;
use glam::DVec3;
use hwall_haptics::{Barrier, surface_axes};
use hwall_numeric::check::finite;
use hwall_scene::Scene;

/// Most pieces that a session tracks.
const MOST: usize = 2048;
/// Surfaces whose plane is closer to the base than this are no barriers, m.
const LEAST_BARRIER_M: f64 = 0.3;

/// Barriers that the board stays behind: the vertical surfaces of the scene, as seen from the base of the arm.
///
/// # Errors
/// A facet without a direction.
pub fn barriers_of(scene: &Scene) -> Result<Vec<Barrier>, SessionError> {
    let mut barriers = Vec::new();
    for facet in scene.vertical_facets() {
        barriers.extend(barrier_of(facet.point_m, facet.normal, &facet.outline_m)?);
    }
    Ok(barriers)
}

/// A flat surface piece in the base frame as a barrier; `None` if its plane passes close to the base or it has no extent.
///
/// # Errors
/// NaN, infinity, or no direction.
pub(crate) fn barrier_of(
    point_m: DVec3,
    normal: DVec3,
    outline_m: &[DVec3],
) -> Result<Option<Barrier>, SessionError> {
    let distance_m = normal.dot(point_m);
    // If a plane passes close to the base, it is unclear which side is the arm's.
    if distance_m.abs() < LEAST_BARRIER_M {
        return Ok(None);
    }
    finite("distance of a surface", distance_m)?;
    let outwards = normal * distance_m.signum();
    let [x, y] = surface_axes(outwards)?;
    let along = |axis: DVec3| {
        let at = outline_m.iter().map(|corner| corner.dot(axis));
        let (least, most) = at.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), s| {
            (a.min(s), b.max(s))
        });
        (0.5 * (least + most), 0.5 * (most - least))
    };
    let ((at_x, half_x), (at_y, half_y)) = (along(x), along(y));
    let middle_m = x * at_x + y * at_y + outwards * point_m.dot(outwards);
    // A facet without extent blocks nothing.
    if half_x > 0.0 && half_y > 0.0 {
        Ok(Some(Barrier::new(middle_m, outwards, [half_x, half_y])?))
    } else {
        Ok(None)
    }
}

/// Rejects more pieces than a session tracks.
pub(crate) fn within_limit(count: usize) -> Result<(), SessionError> {
    match count > MOST {
        true => Err(SessionError::TooManyUprightPieces { count, most: MOST }),
        false => Ok(()),
    }
}

/// Rejects a scene with too many upright pieces before minutes are spent on it.
pub(crate) fn check_pieces(scene: &Scene) -> Result<(), SessionError> {
    within_limit(scene.vertical_facets().len())
}
