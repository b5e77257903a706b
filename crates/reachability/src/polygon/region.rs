//! The reachable part of a wall as polygons with holes.

use super::config::PolygonConfig;
use super::contour::{LINE_SHARE, Tracer};
use super::extent::extent;
use super::images::{Images, Stop};
use super::proof::{RegionProof, TracedRegion, prove};
use super::rings::Contour;
use super::strips::Strips;
use super::triangulation::triangulate;
use super::wall_polygon::{WallPolygon, edges, nested, signed_area_m2};
use crate::error::{ReachabilityError, Result};
use crate::line::{ExactSolver, Interval, size_m};
use crate::wall::{WallPlane, WallPoint};
use hwall_numeric::check::{finite, positive, that};

/// Minimum number of lines per plane.
const LEAST_LINES: f64 = 16.0;

/// Maximum number of repairs, which add lines where squares contradict the polygons.
const REPAIRS: usize = 4;

/// The reachable part of a wall.
///
/// ```
/// use hwall_kinematics::SrsArm;
/// use hwall_reachability::{ExactConfig, ExactSolver, PolygonConfig, WallPlane, WallPoint, WallRegion};
///
/// let solver = ExactSolver::new(&SrsArm::iiwa7(), &ExactConfig::default())?;
/// let wall = WallPlane::new(0.0, 0.426)?;
/// let region = WallRegion::of_plane(&solver, &wall, &PolygonConfig::default())?;
/// assert_eq!(region.polygons()[0].holes.len(), 1); // too near to the shoulder
/// assert!((region.area_m2() - 1.4097).abs() < 1e-4);
/// let before_the_shoulder = WallPoint::new(0.0, 0.34);
/// assert!(!region.contains(before_the_shoulder));
/// let usable = region.nearest(before_the_shoulder).expect("some part is in reach");
/// assert!(usable.distance_m(before_the_shoulder) > 0.05);
/// # Ok::<(), hwall_reachability::ReachabilityError>(())
/// ```
#[derive(Debug, Clone)]
pub struct WallRegion {
    plane: WallPlane,
    polygons: Vec<WallPolygon>,
    vertices: Vec<WallPoint>,
    triangles: Vec<[u32; 3]>,
    strips: Strips,
    proof: Option<RegionProof>,
    lines: usize,
}

impl WallRegion {
    /// Traces the part of a plane that the solver's arm can reach.
    ///
    /// If the plane is provably symmetric under reflection in the plane of base axis and normal, one half
    /// represents the other.
    ///
    /// # Errors
    /// Settings outside their ranges, a NaN or reversed height range, more than a million lines.
    pub fn of_plane(
        solver: &ExactSolver,
        plane: &WallPlane,
        config: &PolygonConfig,
    ) -> Result<Self> {
        match Self::of_images(solver, plane, config)? {
            Some(region) => Ok(region),
            None => Self::of_plane_itself(solver, plane, config),
        }
    }

    fn of_plane_itself(
        solver: &ExactSolver,
        plane: &WallPlane,
        config: &PolygonConfig,
    ) -> Result<Self> {
        let solver = solver.with_accuracy(LINE_SHARE * config.accuracy_m);
        match Self::trace(&Images::none(&solver, *plane)?, config) {
            Ok(region) => Ok(region),
            Err(Stop::Failed(error)) => Err(error),
            // Cannot occur: there are no images.
            Err(Stop::ImagesDiffer) => Err(ReachabilityError::Empty { what: "images" }),
        }
    }

    /// One half stands for both; `None` if they are not alike.
    fn of_images(
        solver: &ExactSolver,
        plane: &WallPlane,
        config: &PolygonConfig,
    ) -> Result<Option<Self>> {
        let solver = solver.with_accuracy(LINE_SHARE * config.accuracy_m);
        let Some(images) = Images::mirrored(&solver, *plane)? else {
            return Ok(None);
        };
        match Self::trace(&images, config) {
            Ok(region) => Ok(Some(Self {
                plane: *plane,
                ..region
            })),
            Err(Stop::ImagesDiffer) => Ok(None),
            Err(Stop::Failed(error)) => Err(error),
        }
    }

    fn trace(images: &Images, config: &PolygonConfig) -> Result<Self, Stop> {
        let accuracy_m = positive("accuracy_m", config.accuracy_m)?;
        let size = size_m(images.direct().arm());
        that(
            (1e-8 * size..=0.1 * size).contains(&accuracy_m),
            "accuracy_m",
            accuracy_m,
            "between 1e-8 and 0.1 lengths of the stretched arm",
        )?;
        let spacing_m = positive("spacing_m", config.spacing_m)?;
        let clip_m = checked_clip(config.heights_m)?;
        let extent = extent(images.direct(), images.plane(), clip_m)?;
        let (mut contour, mut proof) = (Contour::default(), None);
        if let Some(extent) = extent {
            // Enough lines even if only little is reachable.
            let most_m = (extent.heights.length_m() / LEAST_LINES).max(accuracy_m);
            let spacing_m = spacing_m.min(most_m);
            let mut tracer = Tracer::new(images, accuracy_m, spacing_m, extent.heights)?;
            contour = tracer.contour();
            if let Some(beyond_m) = config.proof_m {
                let beyond_m = positive("proof_m", beyond_m)?.max(10.0 * accuracy_m);
                let check = |contour: &Contour| {
                    let rings = contour.rings.iter().map(Vec::as_slice);
                    let edges: Vec<_> = rings.flat_map(edges).collect();
                    let region = TracedRegion {
                        strips: &contour.strips,
                        edges: &edges,
                        extent,
                    };
                    prove(images, &region, beyond_m)
                };
                let mut found = check(&contour);
                for _ in 0..REPAIRS {
                    if found.contradictions.is_empty() {
                        break;
                    }
                    tracer.insert(&heights(&found.contradictions, 0.1 * beyond_m))?;
                    contour = tracer.contour();
                    found = check(&contour);
                }
                proof = Some(found);
            }
        }
        let Contour {
            rings,
            strips,
            lines,
            ..
        } = contour;
        let polygons = nested(rings);
        let rings = || polygons.iter().flat_map(WallPolygon::rings);
        let triangles = triangulate(rings())?;
        Ok(Self {
            plane: *images.plane(),
            vertices: rings().flatten().copied().collect(),
            polygons,
            triangles,
            strips,
            proof,
            lines,
        })
    }

    /// The wall.
    #[must_use]
    pub const fn plane(&self) -> WallPlane {
        self.plane
    }

    /// The connected parts; empty if nothing, or only a point or a line, is reachable.
    #[must_use]
    pub fn polygons(&self) -> &[WallPolygon] {
        &self.polygons
    }

    /// Corners of [`triangles`](Self::triangles): those of all rings, in order.
    #[must_use]
    pub fn vertices(&self) -> &[WallPoint] {
        &self.vertices
    }

    /// Triangles that cover the polygons, counter-clockwise, as indices of
    /// [`vertices`](Self::vertices): a constrained Delaunay triangulation, for drawing and sums.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Area, m²: the sum over the triangles.
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        let corner = |&i: &u32| self.vertices[i as usize];
        let area = |t: &[u32; 3]| signed_area_m2(&[corner(&t[0]), corner(&t[1]), corner(&t[2])]);
        self.triangles.iter().map(area).sum()
    }

    /// True if the point is in one of the polygons, outline included; false for NaN.
    #[must_use]
    pub fn contains(&self, at: WallPoint) -> bool {
        self.strips.contains(at)
    }

    /// The point of the polygons nearest to `at`: `at` itself if they contain it, `None` if there
    /// are no polygons, or for NaN.
    #[must_use]
    pub fn nearest(&self, at: WallPoint) -> Option<WallPoint> {
        self.strips.nearest(at)
    }

    /// The proof made with the region; `None` if not requested or if nothing can be reachable.
    #[must_use]
    pub const fn proof(&self) -> Option<&RegionProof> {
        self.proof.as_ref()
    }

    /// Lines that were solved.
    #[must_use]
    pub const fn line_count(&self) -> usize {
        self.lines
    }
}

/// Sorted heights of points, without those less than `apart_m` above another.
fn heights(points: &[WallPoint], apart_m: f64) -> Vec<f64> {
    let mut heights: Vec<f64> = points.iter().map(|p| p.z_m).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup_by(|z, kept| *z - *kept < apart_m);
    heights
}

fn checked_clip(clip: Option<Interval>) -> Result<Option<Interval>> {
    if let Some(Interval { lo_m, hi_m }) = clip {
        finite("lowest height", lo_m)?;
        finite("highest height", hi_m)?;
        that(hi_m > lo_m, "highest height", hi_m, "above the lowest")?;
    }
    Ok(clip)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line::ExactConfig;
    use hwall_kinematics::{JointLimit, SrsArm};
    use hwall_testkit::Sampler;

    fn solver(arm: &SrsArm) -> ExactSolver {
        ExactSolver::new(arm, &ExactConfig::default()).expect("valid")
    }

    /// Half of a wall against the whole wall: same areas, same verdicts, same proof.
    #[test]
    fn a_half_stands_for_all_of_its_images() {
        let solver = solver(&SrsArm::iiwa7());
        let config = PolygonConfig::default();
        let headings = [0.0, 0.5, -1.0];
        let mut sampler = Sampler::new(4);
        for distance_m in [0.9, 0.626, 0.3, 0.026, -0.3] {
            for heading in headings {
                let plane = WallPlane::new(heading, distance_m).expect("finite");
                let one = WallRegion::of_images(&solver, &plane, &config)
                    .expect("traced")
                    .expect("the limits of joint 1 make no difference");
                let whole = WallRegion::of_plane_itself(&solver, &plane, &config).expect("traced");
                let rings = whole.polygons().iter().flat_map(WallPolygon::rings);
                let edges = rings.flat_map(edges);
                let outline: f64 = edges.map(|[a, b]| a.distance_m(b)).sum();
                let off = (one.area_m2() - whole.area_m2()).abs();
                assert!(
                    off < 0.02 * config.accuracy_m * outline,
                    "{distance_m}: {off}"
                );
                let mut others = 0;
                for _ in 0..4_000 {
                    let at = WallPoint::new(sampler.uniform(-0.9, 0.9), sampler.uniform(-0.5, 1.2));
                    let truth = solver.is_reachable(&plane.line(at.z_m), at.s_m);
                    others += usize::from(one.contains(at) != truth.expect("finite"));
                }
                assert!(others < 8, "{others}");
                let (one, whole) = (one.proof().expect("asked"), whole.proof().expect("asked"));
                assert_eq!(one.contradicted_m2, 0.0);
                assert!(one.unproven_m2 <= whole.unproven_m2 + 1e-9);
                let all = |p: &RegionProof| p.proven_m2 + p.outline_m2 + p.unproven_m2;
                assert!((all(one) - all(whole)).abs() < 1e-9);
            }
        }
    }

    /// Limits that are not mirror symmetric end the half trace; then the whole wall is traced.
    #[test]
    fn images_that_differ_are_traced_one_by_one() {
        let mut limits = *SrsArm::iiwa7().limits();
        limits[0] = JointLimit::new(-0.3, 1.5);
        let uneven = solver(&SrsArm::iiwa7().with_limits(limits).expect("limits"));
        let config = PolygonConfig::default();
        let plane = WallPlane::new(0.0, 0.4).expect("finite");
        let found = WallRegion::of_images(&uneven, &plane, &config).expect("traced");
        assert!(found.is_none());
        let region = WallRegion::of_plane(&uneven, &plane, &config).expect("traced");
        let whole = WallRegion::of_plane_itself(&uneven, &plane, &config).expect("traced");
        assert_eq!(region.vertices(), whole.vertices());
    }
}
