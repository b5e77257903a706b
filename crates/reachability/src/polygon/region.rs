//! The reachable part of a wall as polygons with holes.

use super::config::PolygonConfig;
use super::contour::Tracer;
use super::extent::extent;
use super::proof::{RegionProof, TracedRegion, prove};
use super::rings::Contour;
use super::strips::Strips;
use super::triangulation::triangulate;
use super::wall_polygon::{WallPolygon, edges, nested, signed_area_m2};
use crate::error::ReachabilityError;
use crate::line::{ExactSolver, Interval, size_m};
use crate::progress::{Progress, map_indexed};
use crate::wall::{WallPlane, WallPoint};
use hwall_numeric::check::{finite, positive, that};
use std::collections::HashMap;
use std::ops::ControlFlow;

/// A plane is searched along at least this many lines.
const LEAST_LINES: f64 = 16.0;

/// Lines are added at most this often, each time where squares contradict the polygons.
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
    accuracy_m: f64,
    clip_m: Option<Interval>,
    polygons: Vec<WallPolygon>,
    vertices: Vec<WallPoint>,
    triangles: Vec<[u32; 3]>,
    strips: Strips,
    proof: Option<RegionProof>,
    lines: usize,
    slivers: usize,
}

impl WallRegion {
    /// Traces many planes, on all cores with the feature `parallel`; equal planes only once.
    ///
    /// # Errors
    /// As [`of_plane`](Self::of_plane).
    pub fn of_planes(
        solver: &ExactSolver,
        planes: &[WallPlane],
        config: &PolygonConfig,
    ) -> Result<Vec<Self>, ReachabilityError> {
        let mut first_of = HashMap::new();
        let mut different = Vec::new();
        let place_of: Vec<usize> = planes
            .iter()
            .map(|plane| {
                let key = [plane.heading_rad(), plane.distance_m()].map(f64::to_bits);
                *first_of.entry(key).or_insert_with(|| {
                    different.push(*plane);
                    different.len() - 1
                })
            })
            .collect();
        let silent = |_: Progress| ControlFlow::Continue(());
        let regions = map_indexed(different.len(), &silent, |i| {
            Self::of_plane(solver, &different[i], config)
        })?;
        Ok(place_of.iter().map(|&i| regions[i].clone()).collect())
    }

    /// Traces what the solver's arm can reach of a plane.
    ///
    /// # Errors
    /// Settings outside their ranges, a NaN or reversed height range, more than a million lines.
    pub fn of_plane(
        solver: &ExactSolver,
        plane: &WallPlane,
        config: &PolygonConfig,
    ) -> Result<Self, ReachabilityError> {
        let accuracy_m = positive("accuracy_m", config.accuracy_m)?;
        let size = size_m(&solver.family().wide);
        that(
            (1e-8 * size..=0.1 * size).contains(&accuracy_m),
            "accuracy_m",
            accuracy_m,
            "between 1e-8 and 0.1 lengths of the stretched arm",
        )?;
        let spacing_m = positive("spacing_m", config.spacing_m)?;
        let clip_m = checked_clip(config.heights_m)?;
        let extent = extent(solver, plane, clip_m)?;
        let (mut contour, mut proof) = (Contour::default(), None);
        if let Some(extent) = extent {
            // At least some lines where only little is in reach.
            let most_m = (extent.heights.length_m() / LEAST_LINES).max(accuracy_m);
            let spacing_m = spacing_m.min(most_m);
            let mut tracer = Tracer::new(solver, *plane, accuracy_m, spacing_m, extent.heights)?;
            contour = tracer.contour();
            if let Some(beyond_m) = config.proof_m {
                let beyond_m = positive("proof_m", beyond_m)?.max(10.0 * accuracy_m);
                let check = |contour: &Contour| {
                    let rings = contour.rings.iter().map(Vec::as_slice);
                    let edges: Vec<_> = rings.flat_map(edges).collect();
                    let region = TracedRegion {
                        plane: *plane,
                        strips: &contour.strips,
                        edges: &edges,
                        extent,
                    };
                    prove(solver, &region, beyond_m)
                };
                let mut found = check(&contour)?;
                for _ in 0..REPAIRS {
                    if found.contradictions.is_empty() {
                        break;
                    }
                    tracer.insert(&heights(&found.contradictions, 0.1 * beyond_m))?;
                    contour = tracer.contour();
                    found = check(&contour)?;
                }
                proof = Some(found);
            }
        }
        let Contour {
            rings,
            strips,
            lines,
            slivers,
        } = contour;
        let polygons = nested(rings);
        let rings = || polygons.iter().flat_map(WallPolygon::rings);
        let triangles = triangulate(rings())?;
        Ok(Self {
            plane: *plane,
            accuracy_m,
            clip_m,
            vertices: rings().flatten().copied().collect(),
            polygons,
            triangles,
            strips,
            proof,
            lines,
            slivers,
        })
    }

    /// The wall.
    #[must_use]
    pub const fn plane(&self) -> WallPlane {
        self.plane
    }

    /// The connected parts; empty where nothing, or only a point or a line, is in reach.
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

    /// Is the point in one of the polygons? Their outlines belong to them; NaN is nowhere.
    #[must_use]
    pub fn contains(&self, at: WallPoint) -> bool {
        self.strips.contains(at)
    }

    /// The point of the polygons nearest to `at`: itself where they contain it, `None` where there
    /// are no polygons, or for NaN.
    #[must_use]
    pub fn nearest(&self, at: WallPoint) -> Option<WallPoint> {
        self.strips.nearest(at)
    }

    /// Proves that polygons and arm agree wherever the outline is further than `beyond_m` away:
    /// that no island, hole or branch of the outline wider than that was missed.
    ///
    /// `solver` is the one that the region was made with. A free roll, or any part of the board
    /// instead of its middle, makes proofs harder, not wrong: more is then left unproven.
    ///
    /// # Errors
    /// A distance that is not positive, or below ten times the accuracy.
    pub fn prove(
        &self,
        solver: &ExactSolver,
        beyond_m: f64,
    ) -> Result<RegionProof, ReachabilityError> {
        positive("beyond_m", beyond_m)?;
        that(
            beyond_m >= 10.0 * self.accuracy_m,
            "beyond_m",
            beyond_m,
            "at least ten times the accuracy of the polygons",
        )?;
        let Some(extent) = extent(solver, &self.plane, self.clip_m)? else {
            return Ok(RegionProof::default());
        };
        let rings = self.polygons.iter().flat_map(WallPolygon::rings);
        let edges: Vec<[WallPoint; 2]> = rings.flat_map(edges).collect();
        let region = TracedRegion {
            plane: self.plane,
            strips: &self.strips,
            edges: &edges,
            extent,
        };
        prove(solver, &region, beyond_m)
    }

    /// [`PolygonConfig::accuracy_m`] that was asked for, m.
    #[must_use]
    pub const fn accuracy_m(&self) -> f64 {
        self.accuracy_m
    }

    /// What was proven while the region was made, `None` if that was not asked for or nothing is
    /// near enough to be in reach.
    #[must_use]
    pub const fn proof(&self) -> Option<&RegionProof> {
        self.proof.as_ref()
    }

    /// Lines that were solved.
    #[must_use]
    pub const fn line_count(&self) -> usize {
        self.lines
    }

    /// Islands and holes lower than the accuracy, each met by one line only; they are left out.
    #[must_use]
    pub const fn sliver_count(&self) -> usize {
        self.slivers
    }
}

/// Sorted heights of points, without those less than `apart_m` above another.
fn heights(points: &[WallPoint], apart_m: f64) -> Vec<f64> {
    let mut heights: Vec<f64> = points.iter().map(|p| p.z_m).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup_by(|z, kept| *z - *kept < apart_m);
    heights
}

fn checked_clip(clip: Option<Interval>) -> Result<Option<Interval>, ReachabilityError> {
    if let Some(Interval { lo_m, hi_m }) = clip {
        finite("lowest height", lo_m)?;
        finite("highest height", hi_m)?;
        that(hi_m > lo_m, "highest height", hi_m, "above the lowest")?;
    }
    Ok(clip)
}
