//! The reachable part of a wall as polygons with holes.

use crate::contour::Tracer;
use crate::error::{finite, positive};
use crate::exact::size_m;
use crate::region_proof::{RegionProof, prove};
use crate::rings::Contour;
use crate::strips::Strips;
use crate::threads::{Progress, map_indexed};
use crate::triangulation::triangulate;
use crate::{ExactSolver, Interval, ReachabilityError, WallPlane, WallPoint};
use glam::DVec3;
use std::collections::HashMap;
use std::ops::ControlFlow;

/// A plane is searched along this many lines at least.
const LEAST_LINES: f64 = 16.0;

/// Lines are added at most this often; each time they find what the squares have met.
const REPAIRS: usize = 4;

/// What is asked of a [`WallRegion`].
#[derive(Debug, Clone, PartialEq)]
pub struct PolygonConfig {
    /// Hausdorff distance between the polygons' outline and the true one, m; default 1e-4.
    /// Below 1e-8 or above 0.1 arm lengths is an error.
    ///
    /// It is tested at places along the outline, not proven: a thorn with a base narrower than
    /// twenty accuracies that no line meets may be missed, and so is what is thinner than the
    /// accuracy. How far such parts can reach is what [`proof_m`](Self::proof_m) bounds. On the
    /// planes of the published maps iiwa 7 shows none at 1e-4; of 400 arms with limits narrowed at
    /// random 29 showed one, of up to 7 mm, and with `proof_m` at 1e-3 seven, of up to 0.5 mm.
    pub accuracy_m: f64,
    /// Heights to keep, m; default all that the arm reaches.
    pub heights_m: Option<Interval>,
    /// Lines to begin with are no further apart than this, m; default 0.02.
    pub spacing_m: f64,
    /// The plane is proven to be as the polygons say wherever the outline is further away than
    /// this, m; at least ten times the accuracy, else that is taken. Default 0.01; finer takes
    /// longer, `None` trusts the lines and saves two fifths of the time. Where proof and polygons
    /// contradict each other lines are added; [`WallRegion::proof`] says what is left.
    pub proof_m: Option<f64>,
}

impl Default for PolygonConfig {
    fn default() -> Self {
        Self {
            accuracy_m: 1e-4,
            heights_m: None,
            spacing_m: 0.02,
            proof_m: Some(0.01),
        }
    }
}

/// A connected part of the reachable set of a wall, seen from the person's side.
#[derive(Debug, Clone, PartialEq)]
pub struct WallPolygon {
    /// Counter-clockwise; the last point is joined to the first.
    pub outline: Vec<WallPoint>,
    /// Clockwise, each within the outline, none within another.
    pub holes: Vec<Vec<WallPoint>>,
}

impl WallPolygon {
    /// Outline and holes.
    pub fn rings(&self) -> impl Iterator<Item = &[WallPoint]> {
        std::iter::once(&self.outline)
            .chain(&self.holes)
            .map(Vec::as_slice)
    }

    /// Area without the holes, m², from the outline alone (shoelace formula).
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        self.rings().map(signed_area_m2).sum()
    }
}

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
    /// Traces many planes, on all cores with the feature `parallel`; equal planes once.
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

    /// Traces what the solver's arm reaches of a plane.
    ///
    /// # Errors
    /// Settings outside their ranges, a NaN or reversed height range, more than a million lines.
    pub fn of_plane(
        solver: &ExactSolver,
        plane: &WallPlane,
        config: &PolygonConfig,
    ) -> Result<Self, ReachabilityError> {
        let accuracy_m = positive("accuracy_m", config.accuracy_m)?;
        let size = size_m(&solver.wide);
        if !(1e-8 * size..=0.1 * size).contains(&accuracy_m) {
            return Err(ReachabilityError::Parameter {
                what: "accuracy_m",
                value: accuracy_m,
                wanted: "between 1e-8 and 0.1 lengths of the stretched arm",
            });
        }
        let spacing_m = positive("spacing_m", config.spacing_m)?;
        let clip_m = checked_clip(config.heights_m)?;
        let extent = extent(solver, plane, clip_m)?;
        let (mut contour, mut proof) = (Contour::default(), None);
        if let Some(extent) = extent {
            // At least some lines also where little is in reach.
            let most_m = (extent[1].length_m() / LEAST_LINES).max(accuracy_m);
            let spacing_m = spacing_m.min(most_m);
            let mut tracer = Tracer::new(solver, *plane, accuracy_m, spacing_m, extent[1])?;
            contour = tracer.contour();
            if let Some(beyond_m) = config.proof_m {
                let beyond_m = positive("proof_m", beyond_m)?.max(10.0 * accuracy_m);
                let check = |contour: &Contour| {
                    let rings = contour.rings.iter().map(Vec::as_slice);
                    let edges: Vec<_> = rings.flat_map(edges).collect();
                    prove(solver, *plane, &contour.strips, &edges, extent, beyond_m)
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

    /// Every edge of every ring.
    pub(crate) fn edges(&self) -> impl Iterator<Item = [WallPoint; 2]> {
        let rings = self.polygons.iter().flat_map(WallPolygon::rings);
        rings.flat_map(edges)
    }

    pub(crate) const fn strips(&self) -> &Strips {
        &self.strips
    }

    /// Heights that were asked for, m.
    pub(crate) const fn clip_m(&self) -> Option<Interval> {
        self.clip_m
    }

    /// Hausdorff distance that was asked for, m.
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

    /// Islands and holes lower than the accuracy that a line happened to meet; they are left out.
    #[must_use]
    pub const fn sliver_count(&self) -> usize {
        self.slivers
    }
}

fn edges(ring: &[WallPoint]) -> impl Iterator<Item = [WallPoint; 2]> {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(&a, &b)| [a, b])
}

/// Sorted heights of points, without those less than `apart_m` above another.
fn heights(points: &[WallPoint], apart_m: f64) -> Vec<f64> {
    let mut heights: Vec<f64> = points.iter().map(|p| p.z_m).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup_by(|z, kept| *z - *kept < apart_m);
    heights
}

/// Positive for rings that run counter-clockwise, m².
fn signed_area_m2(ring: &[WallPoint]) -> f64 {
    // From the first corner, so that small rings far away keep their digits.
    let Some(&origin) = ring.first() else {
        return 0.0;
    };
    let from = |p: &WallPoint| (p.s_m - origin.s_m, p.z_m - origin.z_m);
    let cross = |pair: &[WallPoint]| {
        let ((a, b), (c, d)) = (from(&pair[0]), from(&pair[1]));
        a * d - b * c
    };
    0.5 * ring.windows(2).map(cross).sum::<f64>()
}

/// Is a point that is no corner inside of a ring?
fn encloses(ring: &[WallPoint], at: WallPoint) -> bool {
    let mut inside = false;
    let mut a = ring[ring.len() - 1];
    for &b in ring {
        if (a.z_m > at.z_m) != (b.z_m > at.z_m) {
            let share = (at.z_m - a.z_m) / (b.z_m - a.z_m);
            inside ^= at.s_m < a.s_m + share * (b.s_m - a.s_m);
        }
        a = b;
    }
    inside
}

/// Gives each hole to the smallest outline around it.
fn nested(rings: Vec<Vec<WallPoint>>) -> Vec<WallPolygon> {
    let (outer, holes): (Vec<_>, Vec<_>) = rings.into_iter().partition(|r| signed_area_m2(r) > 0.0);
    let polygon = |outline: Vec<WallPoint>| {
        (
            signed_area_m2(&outline),
            WallPolygon {
                outline,
                holes: Vec::new(),
            },
        )
    };
    let mut polygons: Vec<(f64, WallPolygon)> = outer.into_iter().map(polygon).collect();
    for hole in holes {
        let around = polygons
            .iter_mut()
            .filter(|(_, p)| encloses(&p.outline, hole[0]));
        if let Some((_, polygon)) = around.min_by(|a, b| a.0.total_cmp(&b.0)) {
            polygon.holes.push(hole);
        }
    }
    polygons.into_iter().map(|(_, polygon)| polygon).collect()
}

/// Stretches along the wall and of heights beyond which nothing can be in reach, the heights
/// clipped; `None` where that leaves nothing.
pub(crate) fn extent(
    solver: &ExactSolver,
    plane: &WallPlane,
    clip: Option<Interval>,
) -> Result<Option<[Interval; 2]>, ReachabilityError> {
    let arm = &solver.wide;
    let longest = arm.shoulder_wrist_range().longest_m;
    // A hair further than it is, so that the rounding of the ends is covered.
    let longest = longest * (1.0 + 1e-13);
    let mut extent: Option<[Interval; 2]> = None;
    for freedom in &solver.freedoms {
        let pose = plane.board_pose(WallPoint::new(0.0, 0.0), freedom.roll)?;
        let wrist = arm.wrist_from_shoulder_m(&pose);
        let across = wrist.dot(plane.normal()).abs();
        if across > longest {
            continue;
        }
        // A turn about the normal moves the wrist by no more than this, a rise by itself.
        let lever = wrist - (pose.position_m() - DVec3::Z * arm.geometry().d_bs_m);
        let swing = 2.0 * lever.length() * (0.5 * freedom.half_roll).sin();
        let half = ((longest - across) * (longest + across)).sqrt() + swing;
        let about = |middle: f64, half: f64| Interval::new(middle - half, middle + half);
        let found = [
            about(-wrist.dot(plane.along()), half + solver.half_width_m),
            about(-wrist.z, half + freedom.half_rise),
        ];
        let around =
            |a: Interval, b: Interval| Interval::new(a.lo_m.min(b.lo_m), a.hi_m.max(b.hi_m));
        extent = Some(extent.map_or(found, |e| [around(e[0], found[0]), around(e[1], found[1])]));
    }
    Ok(extent.and_then(|[s, mut z]| {
        if let Some(clip) = clip {
            z = Interval::new(z.lo_m.max(clip.lo_m), z.hi_m.min(clip.hi_m));
        }
        (z.lo_m < z.hi_m).then_some([s, z])
    }))
}

fn checked_clip(clip: Option<Interval>) -> Result<Option<Interval>, ReachabilityError> {
    if let Some(Interval { lo_m, hi_m }) = clip {
        finite("lowest height", lo_m)?;
        if finite("highest height", hi_m)? <= lo_m {
            return Err(ReachabilityError::Parameter {
                what: "highest height",
                value: hi_m,
                wanted: "above the lowest",
            });
        }
    }
    Ok(clip)
}
