//! Rays and closest points.

use crate::error::{Result, SceneError, finite};
use crate::part::{ALL, PartHit, PartRay, triangle};
use crate::scene::Scene;
use crate::surface::{SurfaceId, SurfaceKind};
use glam::DVec3;
use hwall_geometry::ArgumentError;
use hwall_numeric::check::that;
use std::cell::Cell;

/// Number of rays per batch.
const TOGETHER: usize = 512;

/// A ray to cast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Origin, m.
    pub origin_m: DVec3,
    /// Direction, of any length.
    pub direction: DVec3,
}

/// A point of a surface: where a ray hits it, or the point closest to a query point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// The surface.
    pub surface: SurfaceId,
    /// The point, m; for a ray a point of the triangle, to rounding.
    pub point_m: DVec3,
    /// Unit normal of the triangle, towards the ray origin or query point (outward if that lies in its plane).
    pub normal: DVec3,
    /// True if the normal points outward, according to the winding of the file.
    pub outside: bool,
    /// Distance from the origin of the ray, or from the query point, m.
    pub distance_m: f64,
}

impl Scene {
    /// Nearest surface along a ray, untouchable ones included, both sides of every face.
    ///
    /// `direction` may have any length; a hit at the origin itself counts. No ray passes between
    /// two triangles that share an edge. Everything except the search is f64. The error of the
    /// point is about 1e-15 of the scene's size plus 1e-16 of the distance to the origin; for
    /// grazing rays it is divided by the sine of the angle to the face.
    ///
    /// # Errors
    /// NaN, infinity, or a direction of zero length.
    pub fn ray_cast(&self, origin_m: DVec3, direction: DVec3) -> Result<Option<Hit>> {
        let (origin_m, direction) = (finite("ray origin", origin_m)?, unit(direction)?);
        let mut best: Option<(usize, PartHit)> = None;
        for (part, ray) in self.part_rays(origin_m, direction) {
            let max_m = best.map_or(f64::INFINITY, |(_, hit)| hit.distance_m);
            if let Some(hit) = self.geometry.parts[part].ray_cast(&ray, max_m) {
                best = Some((part, hit));
            }
        }
        Ok(best.map(|(part, hit)| self.to_hit(part, &hit, |_| -direction)))
    }

    /// [`ray_cast`](Self::ray_cast) for many rays: bit-identical, but faster than one by one.
    ///
    /// `hits` is cleared first; after an error it is empty.
    ///
    /// # Errors
    /// As [`ray_cast`](Self::ray_cast), for the first invalid ray.
    pub fn ray_casts(&self, rays: &[Ray], hits: &mut Vec<Option<Hit>>) -> Result<()> {
        hits.clear();
        hits.reserve(rays.len());
        for rays in rays.chunks(TOGETHER) {
            if let Err(error) = self.cast_chunk(rays, hits) {
                hits.clear();
                return Err(error);
            }
        }
        Ok(())
    }

    /// Appends the hits of at most [`TOGETHER`] rays.
    fn cast_chunk(&self, rays: &[Ray], hits: &mut Vec<Option<Hit>>) -> Result<()> {
        let mut directions = [DVec3::ZERO; TOGETHER];
        for (to, ray) in directions.iter_mut().zip(rays) {
            finite("ray origin", ray.origin_m)?;
            *to = unit(ray.direction)?;
        }
        let best: [Cell<Option<(usize, PartHit)>>; TOGETHER] =
            [const { Cell::new(None) }; TOGETHER];
        for (part, pose) in self.world_from_part.iter().enumerate() {
            self.geometry.parts[part].ray_casts(
                rays.len(),
                |i| {
                    let ray = PartRay {
                        origin_m: pose.inverse_transform_point(rays[i].origin_m),
                        direction: pose.inverse_transform_vector(directions[i]),
                    };
                    let nearest = best[i].get();
                    (
                        ray,
                        nearest.map_or(f64::INFINITY, |(_, hit)| hit.distance_m),
                    )
                },
                |i, hit| best[i].set(Some((part, hit))),
            );
        }
        let best = best.iter().zip(&directions).take(rays.len());
        hits.extend(best.map(|(best, direction)| {
            let (part, hit) = best.get()?;
            Some(self.to_hit(part, &hit, |_| -*direction))
        }));
        Ok(())
    }

    /// True if a ray hits anything at a distance in `[0, max_distance_m)`. Stops at the first hit.
    ///
    /// # Errors
    /// NaN, an infinite origin or direction, a direction of zero length. An infinite distance is allowed.
    pub fn any_hit(&self, origin_m: DVec3, direction: DVec3, max_distance_m: f64) -> Result<bool> {
        let (origin_m, direction) = (finite("ray origin", origin_m)?, unit(direction)?);
        let max_m = distance(max_distance_m)?;
        Ok(self
            .part_rays(origin_m, direction)
            .any(|(part, ray)| self.geometry.parts[part].any_hit(&ray, max_m)))
    }

    /// True if the open segment between two points is free.
    ///
    /// A billionth of its length is ignored at both ends, so that a point on a surface is visible;
    /// a surface that close to an end does not block.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn visible(&self, from_m: DVec3, to_m: DVec3) -> Result<bool> {
        let line = finite("target", to_m)? - finite("viewpoint", from_m)?;
        let length_m = line.length();
        if length_m == 0.0 {
            return Ok(true);
        }
        // Coordinates far from the origin have rounding errors.
        let margin_m = 1e-9 * length_m + 1e-14 * from_m.abs().max(to_m.abs()).max_element();
        if length_m <= 2.0 * margin_m {
            return Ok(true);
        }
        let start_m = from_m + line * (margin_m / length_m);
        Ok(!self.any_hit(start_m, line, length_m - 2.0 * margin_m)?)
    }

    /// Closest point of any surface, untouchable ones included, nearer than `max_distance_m`.
    ///
    /// Exact to rounding. On an edge, the face that faces the query point most directly gives the normal.
    ///
    /// # Errors
    /// NaN, an infinite point, a point more than 6e153 m away. An infinite limit is allowed.
    pub fn closest_point(&self, point_m: DVec3, max_distance_m: f64) -> Result<Option<Hit>> {
        self.closest(point_m, max_distance_m, |_| ALL, |_| true)
    }

    /// [`closest_point`](Self::closest_point) among the surfaces that a hand may touch.
    ///
    /// # Errors
    /// As [`closest_point`](Self::closest_point).
    pub fn closest_touchable(&self, point_m: DVec3, max_distance_m: f64) -> Result<Option<Hit>> {
        let geometry = &*self.geometry;
        self.closest(
            point_m,
            max_distance_m,
            |part| geometry.touchable_bits[part],
            |id| geometry.kinds[id] != SurfaceKind::Untouchable,
        )
    }

    /// Closest point of one surface, at any distance.
    ///
    /// # Errors
    /// NaN, infinity, a point more than 6e153 m away, or an id of another scene.
    pub fn project_on(&self, surface: SurfaceId, point_m: DVec3) -> Result<Hit> {
        self.check(surface)?;
        let part = self.geometry.part_of[surface.0];
        let local = self.world_from_part[part].inverse_transform_point(located(point_m)?);
        let wanted = self.geometry.parts[part].bit(surface.0);
        let hit =
            self.geometry.parts[part].closest(local, f64::INFINITY, wanted, |id| id == surface.0);
        // Every surface has at least one triangle and distances are finite.
        hit.map(|hit| self.to_hit(part, &hit, |foot_m| point_m - foot_m))
            .ok_or(SceneError::NoFaces)
    }

    /// `wanted`: surface bits to search in a part; zero skips the part.
    fn closest(
        &self,
        point_m: DVec3,
        max_distance_m: f64,
        wanted: impl Fn(usize) -> u64,
        accept: impl Fn(usize) -> bool + Copy,
    ) -> Result<Option<Hit>> {
        located(point_m)?;
        let max_m = distance(max_distance_m)?;
        let mut best: Option<(usize, PartHit)> = None;
        for (index, (part, pose)) in self
            .geometry
            .parts
            .iter()
            .zip(&self.world_from_part)
            .enumerate()
        {
            let wanted = wanted(index);
            if wanted == 0 {
                continue;
            }
            let bound_m = best.map_or(max_m, |(_, hit)| hit.distance_m);
            let hit = part.closest(
                pose.inverse_transform_point(point_m),
                bound_m,
                wanted,
                accept,
            );
            if let Some(hit) = hit.filter(|h| h.distance_m < bound_m) {
                best = Some((index, hit));
            }
        }
        Ok(best.map(|(part, hit)| self.to_hit(part, &hit, |foot_m| point_m - foot_m)))
    }

    /// `towards`: vector from the point to the ray origin or query point.
    #[inline(always)]
    fn to_hit(&self, part: usize, hit: &PartHit, towards: impl Fn(DVec3) -> DVec3) -> Hit {
        let point_m = self.world_from_part[part].transform_point(hit.point_m);
        let face = &self.geometry.parts[part].face(hit.triangle);
        let outward = triangle::normal(&face.corners_m);
        let normal = self.world_from_part[part].transform_vector(outward);
        let outside = normal.dot(towards(point_m)) >= 0.0;
        Hit {
            surface: SurfaceId(face.surface as usize),
            point_m,
            normal: if outside { normal } else { -normal },
            outside,
            distance_m: hit.distance_m,
        }
    }

    /// The ray in the frame of each part.
    fn part_rays(
        &self,
        origin_m: DVec3,
        direction: DVec3,
    ) -> impl Iterator<Item = (usize, PartRay)> + '_ {
        self.world_from_part
            .iter()
            .enumerate()
            .map(move |(part, pose)| {
                let ray = PartRay {
                    origin_m: pose.inverse_transform_point(origin_m),
                    direction: pose.inverse_transform_vector(direction),
                };
                (part, ray)
            })
    }
}

/// Unit vector of a direction of any length.
fn unit(direction: DVec3) -> Result<DVec3> {
    let largest = finite("ray direction", direction)?.abs().max_element();
    if largest == 0.0 {
        return Err(SceneError::ZeroDirection);
    }
    // The square of 1e-200 underflows and that of 1e200 overflows, so very small or large directions are first scaled to a largest
    // component of one.
    Ok(if (1e-100..1e100).contains(&largest) {
        direction.normalize()
    } else {
        (direction / largest).normalize()
    })
}

/// Rejects NaN, infinity and points so far away that the square of the distance overflows.
fn located(point_m: DVec3) -> Result<DVec3, ArgumentError> {
    let distance_m = finite("point", point_m)?.length();
    let squares = 2.0 * distance_m <= f64::MAX.sqrt();
    that(squares, "distance", distance_m, "at most 6e153 m")?;
    Ok(point_m)
}

/// Rejects NaN. Infinity means no limit; a negative distance finds nothing.
fn distance(max_distance_m: f64) -> Result<f64, ArgumentError> {
    if max_distance_m.is_nan() {
        return Err(ArgumentError::NonFinite {
            what: "maximum distance",
            index: None,
            value: max_distance_m,
        });
    }
    Ok(max_distance_m.max(0.0))
}
