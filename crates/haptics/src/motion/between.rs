//! How far the face may come in front of surfaces between two samples.

use super::barrier::tree::{Barriers, distance_m};
use super::barrier::{Footprint, Plane};
use glam::DVec3;

/// Distances that differ by less are equal, m.
const EQUAL_M: f64 = 1e-8;

/// A stretch of a point's path: its ends, and an upper bound of its length, m.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    pub(super) from_m: DVec3,
    pub(super) to_m: DVec3,
    pub(super) way_m: f64,
}

impl Stretch {
    /// Upper bound of a value on the stretch that changes by at most `rate` per path length, from its values at the ends: every place on the stretch
    /// is within half the path of one of the ends.
    fn most(&self, at: impl Fn(DVec3) -> f64, rate: f64) -> f64 {
        0.5 * (at(self.from_m) + at(self.to_m) + rate * self.way_m)
    }

    fn least(&self, at: impl Fn(DVec3) -> f64) -> f64 {
        -self.most(|m| -at(m), 1.0)
    }
}

impl Barriers {
    /// Upper bound of how far a point is in front of the surfaces on a stretch, m, as defined by [`all_in_front`](Self::all_in_front); returns
    /// `enough_m` (positive) where the bound stays below it.
    ///
    /// Distances to a plane and to a rectangle change no faster than the point moves. The distance in front does not: it jumps where another surface
    /// becomes the nearest. So every surface counts that may be the nearest somewhere on the stretch. At such a place it is no further than the
    /// surface that is nearest at an end, and both distances change by at most the path to that end. The paths to both ends add up to the stretch, so
    /// the surface's excess distances at the ends add up to at most twice the stretch.
    pub(super) fn most_between_m(
        &self,
        stretch: &Stretch,
        enough_m: f64,
        footprints: &[Option<Footprint>],
        planes: &[Option<Plane>],
    ) -> f64 {
        let mut most_m = enough_m;
        for plane in planes.iter().flatten() {
            let may_be_near = stretch.least(|m| m.distance(plane.point_m)) <= plane.radius_m;
            if may_be_near {
                let off_m = |m: DVec3| (m - plane.point_m).dot(plane.normal);
                most_m = most_m.max(stretch.most(off_m, 1.0));
            }
        }
        if self.is_empty() {
            return most_m;
        }
        let [from_m, to_m] = [stretch.from_m, stretch.to_m].map(|m| self.least_distance_m(m));
        // A box, like a surface, may be the nearest only if its excess distances add up to no more than that.
        let most_excess_m = 2.0 * stretch.way_m + EQUAL_M;
        let excess_m = |from: f64, to: f64| from - from_m + to - to_m;
        self.walk(
            &mut most_m,
            |aabb| {
                let at_m = |m| distance_m(aabb, m);
                excess_m(at_m(stretch.from_m), at_m(stretch.to_m))
            },
            |_| most_excess_m,
            |most_m, barrier| {
                let in_front_m = |m| barrier.in_front_m(m);
                let mut at_most_m = stretch.most(in_front_m, 1.0);
                if at_most_m <= *most_m {
                    return;
                }
                let at_m = |m| barrier.place_of(m).distance_m();
                if excess_m(at_m(stretch.from_m), at_m(stretch.to_m)) > most_excess_m {
                    return;
                }
                for footprint in footprints.iter().flatten() {
                    let eased_m = footprint.most_between_m(stretch, in_front_m);
                    // Easing applies only in front of the surface.
                    at_most_m = at_most_m.min(eased_m.max(0.0));
                }
                *most_m = most_m.max(at_most_m);
            },
        );
        most_m
    }
}

impl Footprint {
    /// Upper bound of the eased distance in front of a surface on a stretch, m; infinite where part of the stretch is beyond the margin.
    fn most_between_m(&self, stretch: &Stretch, in_front_m: impl Fn(DVec3) -> f64) -> f64 {
        let beyond_m = |m| self.beyond_m(m);
        let most_beyond_m = stretch.most(beyond_m, 1.0);
        if most_beyond_m >= self.margin_m() {
            return f64::INFINITY;
        }
        let before_face_m = stretch.most(|m| self.before_face_m(m), 1.0);
        if most_beyond_m <= 0.0 {
            return before_face_m;
        }
        // Both terms may grow with the path.
        let eased_m = |m| in_front_m(m) - self.margin_m() + beyond_m(m).max(0.0);
        before_face_m.max(stretch.most(eased_m, 2.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::{Board, board_pose};
    use crate::motion::{Barrier, BarrierTree};
    use hwall_testkit::Sampler;

    /// Random rectangles, and boxes: closed surfaces whose sides face outwards.
    fn soup(sampler: &mut Sampler) -> Barriers {
        let mut all = Vec::new();
        let corner = DVec3::splat(0.4);
        for _ in 0..3 {
            let middle_m = sampler.point_in_box(-corner, corner);
            let half = [sampler.uniform(0.02, 0.4), sampler.uniform(0.02, 0.4)];
            all.push(Barrier::new(middle_m, sampler.unit_vector(), half).unwrap());
        }
        let middle_m = sampler.point_in_box(-corner, corner);
        let half_m = DVec3::from_array(sampler.array_within([(0.02, 0.3); 3]));
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let mut normal = DVec3::ZERO;
                normal[axis] = sign;
                let [x, y] = crate::board::surface_axes(normal).unwrap();
                let half = [x, y].map(|along| along.abs().dot(half_m));
                let at_m = middle_m + normal * half_m;
                all.push(Barrier::new(at_m, normal, half).unwrap());
            }
        }
        Barriers::from(BarrierTree::from(all))
    }

    #[test]
    fn no_point_is_further_in_front_between_two_samples_than_the_bound_says() {
        let mut sampler = Sampler::new(77);
        let corner = DVec3::splat(0.5);
        // A board of no size: its corners coincide with its centre.
        let dot = Board {
            half_width_m: 0.0,
            half_height_m: 0.0,
            ..Board::default()
        };
        let (mut jumps, mut tight) = (0, 0);
        for _ in 0..1000 {
            let barriers = soup(&mut sampler);
            let mut place = || {
                let (at_m, normal) = (sampler.point_in_box(-corner, corner), sampler.unit_vector());
                board_pose(at_m, normal, sampler.uniform(0.0, 3.0)).unwrap()
            };
            let footprints = [Some(Footprint::new(place(), &Board::default(), 0.2)), None];
            let at = place();
            let planes = [Some(Plane {
                point_m: at.position_m(),
                normal: at.rotation().z_axis,
                radius_m: 0.3,
            })];
            // A crooked path.
            let size_m = 10f64.powf(sampler.uniform(-4.0, -0.7));
            let mut points_m = vec![sampler.point_in_box(-corner, corner)];
            for _ in 0..3 {
                let last_m = points_m[points_m.len() - 1];
                points_m.push(last_m + sampler.unit_vector() * size_m * sampler.uniform(0.0, 1.0));
            }
            let stretch = Stretch {
                from_m: points_m[0],
                to_m: points_m[3],
                way_m: points_m.windows(2).map(|p| p[0].distance(p[1])).sum(),
            };
            let bound_m = barriers.most_between_m(&stretch, 1e-3, &footprints, &planes);
            let is_at = |m: DVec3| {
                let face = board_pose(m, DVec3::X, 0.0).unwrap();
                let found = barriers.most_in_front(&dot, &face, &footprints, &planes);
                found.map_or(f64::NEG_INFINITY, |point| point.in_front_m)
            };
            let mut most_m = f64::NEG_INFINITY;
            for pair in points_m.windows(2) {
                for k in 0..=150 {
                    most_m = most_m.max(is_at(pair[0].lerp(pair[1], f64::from(k) / 150.0)));
                }
            }
            assert!(
                most_m <= bound_m + 1e-9,
                "{most_m} above {bound_m}, {stretch:?}"
            );
            let ends_m = 0.5 * (is_at(stretch.from_m) + is_at(stretch.to_m) + stretch.way_m);
            jumps += usize::from(most_m > ends_m + 1e-9 && most_m > 1e-3);
            tight += usize::from(bound_m <= most_m.max(1e-3) + 2.0 * stretch.way_m);
        }
        println!("{jumps} of 1000 leap above what their ends say, {tight} bounds are close");
        // Values at the ends for their nearest surfaces alone give no bound.
        assert!(jumps > 10, "{jumps}");
        assert!(tight > 700, "{tight}");
    }
}
