//! Reachability of walls for an arm with a board: maps, polygons, placement of the base.

use crate::arm::PyArm;
use crate::arrays::{Array, Floats, Rows, array, fixed, like, list, matrix, points};
use crate::error::{OrRaise, refuse};
use crate::scene::{PyScene, at, pairs};
use hwall::glam::DVec3;
use hwall::reachability::{
    ExactConfig, ExactSolver, Interval, LineIndex, PlacementConfig, PlacementScores, PolygonConfig,
    Presented, ReachabilityMap, Roll, Steps, Target, WallGrid, WallMaps, WallPlane, WallPoint,
    WallRegion, place_base,
};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use std::path::PathBuf;

/// Half the distance within which a look-up finds a map's single plane or height, m.
const SINGLE_M: f64 = 0.025;

/// Allowed roll of the board: "free", "quarter_turns", or angles in rad.
fn roll_of(roll: Option<Bound<'_, PyAny>>) -> PyResult<Roll> {
    let Some(roll) = roll else {
        return Ok(Roll::Fixed(0.0));
    };
    if let Ok(name) = roll.cast::<PyString>() {
        return match name.to_cow()?.as_ref() {
            "free" => Ok(Roll::Free),
            "quarter_turns" => Ok(Roll::quarter_turns()),
            name => refuse(format!(
                "roll {name:?} is not one of free, quarter_turns, or angles in rad"
            )),
        };
    }
    let angles = list("roll", &roll.extract::<Floats<'_>>()?)?;
    Ok(match angles[..] {
        [roll] => Roll::Fixed(roll),
        _ => Roll::AnyOf(angles),
    })
}

fn steps(what: &'static str, values: &Floats<'_>) -> PyResult<Steps> {
    let values = list(what, values)?;
    let steps = match values[..] {
        [value] => Steps::single(value, SINGLE_M),
        [first, .., last] => Steps::new(
            first,
            (last - first) / (values.len() - 1) as f64,
            values.len(),
        ),
        [] => Steps::new(0.0, 1.0, 0),
    };
    let steps = steps.or_raise()?;
    let even = |(i, value): (usize, &f64)| (steps.at(i) - value).abs() <= 1e-6 * steps.spacing_m();
    match values.iter().enumerate().all(even) {
        true => Ok(steps),
        false => refuse(format!("{what} must be evenly spaced")),
    }
}

fn exact(accuracy: f64, roll: Option<Bound<'_, PyAny>>) -> PyResult<ExactConfig> {
    Ok(ExactConfig {
        accuracy_m: accuracy,
        roll: roll_of(roll)?,
        ..ExactConfig::default()
    })
}

/// Map of parallel walls: for each orientation (heading of the normal, rad), plane (`normal . p`, m) and height (m) of a
/// horizontal line, the intervals in which the arm can hold its tool against the wall. Planes and heights must be evenly
/// spaced. `accuracy` of the ends, m; `roll` of the board about the normal: rad, several angles, "quarter_turns" or "free".
#[pyfunction]
#[pyo3(signature = (arm, orientations, planes, heights, *, accuracy=1e-6, roll=None))]
pub(crate) fn reach_map(
    py: Python<'_>,
    arm: &PyArm,
    orientations: Floats<'_>,
    planes: Floats<'_>,
    heights: Floats<'_>,
    accuracy: f64,
    roll: Option<Bound<'_, PyAny>>,
) -> PyResult<ReachMap> {
    let (distances, heights) = (steps("planes", &planes)?, steps("heights", &heights)?);
    let walls = list("orientations", &orientations)?
        .into_iter()
        .map(|heading_rad| WallGrid {
            heading_rad,
            distances,
            heights,
            span_m: None,
        });
    let (arm, walls) = (arm.srs()?, walls.collect());
    let config = exact(accuracy, roll)?;
    let map = py
        .detach(|| ReachabilityMap::build(arm, &config, walls))
        .or_raise()?;
    Ok(ReachMap { map })
}

/// Proven reachable intervals of horizontal lines on vertical walls, with holes. A wall with heading g has the
/// normal `n = (cos g, sin g, 0)` and the direction `t = (-sin g, cos g, 0)`; a point of it is `d n + s t + z k`, m.
#[pyclass(frozen, module = "hwall")]
pub(crate) struct ReachMap {
    map: ReachabilityMap,
}

impl ReachMap {
    fn spans<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(LineIndex) -> Vec<Interval>,
    ) -> PyResult<(Array<'py, i64>, Array<'py>)> {
        let (mut line, mut ends) = (Vec::new(), Vec::new());
        for (number, index) in self.map.lines().enumerate() {
            for span in of(index) {
                line.push(number as i64);
                ends.extend([span.lo_m, span.hi_m]);
            }
        }
        let count = line.len();
        Ok((array(py, line, &[count])?, array(py, ends, &[count, 2])?))
    }
}

#[pymethods]
impl ReachMap {
    /// The lines, (lines, 3): orientation (rad), plane (m), height (m).
    #[getter]
    fn lines<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let lines = self.map.lines().filter_map(|index| self.map.line(index));
        let values = lines.flat_map(|line| {
            [
                line.plane.heading_rad(),
                line.plane.distance_m(),
                line.height_m,
            ]
        });
        let values: Vec<f64> = values.collect();
        let count = values.len() / 3;
        array(py, values, &[count, 3])
    }

    /// Reachable intervals: number of the line (k,), and ends along it (k, 2), m.
    fn intervals<'py>(&self, py: Python<'py>) -> PyResult<(Array<'py, i64>, Array<'py>)> {
        self.spans(py, |index| {
            self.map.intervals(index).iter().map(|i| i.span).collect()
        })
    }

    /// Undecided bands around the ends, mostly narrower than the accuracy; format as `intervals`.
    fn unknown<'py>(&self, py: Python<'py>) -> PyResult<(Array<'py, i64>, Array<'py>)> {
        self.spans(py, |index| self.map.unknown(index).to_vec())
    }

    /// Reachability at the positions `s` (k,) along every line, m: (orientations, planes, heights, k) bool, for
    /// `imshow`. A map of a scene, whose walls differ in size, gives (lines, k).
    fn mask<'py>(&self, py: Python<'py>, s: Floats<'py>) -> PyResult<Array<'py, bool>> {
        let s = list("s", &s)?;
        let lines = self.map.lines().map(|index| self.map.intervals(index));
        let inside =
            lines.flat_map(|spans| s.iter().map(|s| spans.iter().any(|i| i.span.contains(*s))));
        let inside: Vec<bool> = inside.collect();
        let sizes: Vec<_> = self
            .map
            .walls()
            .map(|w| [w.distances.count(), w.heights.count()])
            .collect();
        match sizes[..] {
            [first, ..] if sizes.iter().all(|size| *size == first) => {
                array(py, inside, &[sizes.len(), first[0], first[1], s.len()])
            }
            _ => {
                let count = self.map.lines().count();
                array(py, inside, &[count, s.len()])
            }
        }
    }

    /// The nearest line's answer, in about 30 ns each: 1 reachable, 0 unreachable, -1 no line. `point` and `normal` (towards the
    /// person) (3,) or (n, 3), base frame, m.
    fn look_up<'py>(
        &self,
        py: Python<'py>,
        point: Floats<'py>,
        normal: Floats<'py>,
    ) -> PyResult<Array<'py, i8>> {
        let (place, normal) = (
            Rows::new("point", &point, &[3])?,
            Rows::new("normal", &normal, &[3])?,
        );
        let asked = pairs(&place, &normal)?;
        hwall::numeric::check::all_finite("point", place.values()).or_raise()?;
        hwall::numeric::check::all_finite("normal", normal.values()).or_raise()?;
        let found = py.detach(|| {
            let all = (0..asked.count).map(|i| self.map.look_up(at(&place, i), at(&normal, i)));
            all.map(|found| found.map_or(-1, |found| i8::from(found.reachable)))
                .collect()
        });
        like(py, asked, found, &[])
    }

    /// Exact check at the point itself: can the tool be held there? Bool, arguments as `look_up`.
    fn is_reachable<'py>(
        &self,
        py: Python<'py>,
        point: Floats<'py>,
        normal: Floats<'py>,
    ) -> PyResult<Array<'py, bool>> {
        let (place, normal) = (
            Rows::new("point", &point, &[3])?,
            Rows::new("normal", &normal, &[3])?,
        );
        let asked = pairs(&place, &normal)?;
        let found = py.detach(|| {
            let all =
                (0..asked.count).map(|i| self.map.is_reachable(at(&place, i), at(&normal, i)));
            all.collect::<Result<Vec<bool>, _>>()
        });
        like(py, asked, found.or_raise()?, &[])
    }

    /// Reachable length of all lines, m.
    #[getter]
    fn reachable_length(&self) -> f64 {
        self.map.lengths().reachable_m
    }

    /// Undecided length of all lines, m.
    #[getter]
    fn unknown_length(&self) -> f64 {
        self.map.lengths().unknown_m
    }

    /// Writes a file with version and checksum.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.map.save(path)).or_raise()
    }

    /// Reads a file written by `save`; a damaged, truncated or foreign file is an error.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let map = py.detach(|| ReachabilityMap::load(path)).or_raise()?;
        Ok(Self { map })
    }

    fn __len__(&self) -> usize {
        self.map.lines().count()
    }
}

/// Maps of the vertical surfaces of a scene that are within the arm's length. The scene is in the arm's base frame.
#[pyfunction]
pub(crate) fn wall_maps(py: Python<'_>, scene: &PyScene, arm: &PyArm) -> PyResult<PyWallMaps> {
    let arm = arm.srs()?;
    let maps = py.detach(|| hwall::maps_of(&scene.scene, arm)).or_raise()?;
    Ok(PyWallMaps { maps })
}

/// Places where the board can be presented on the walls of a scene.
#[pyclass(frozen, module = "hwall", name = "WallMaps")]
pub(crate) struct PyWallMaps {
    maps: WallMaps,
}

#[pymethods]
impl PyWallMaps {
    /// Where the board can be presented for a point of a wall: the point itself if possible, else the nearest point of the
    /// same wall, NaN if there is none. `point` and `normal` (towards the person) (3,) or (n, 3), m; the same shape is returned.
    fn present<'py>(
        &self,
        py: Python<'py>,
        point: Floats<'py>,
        normal: Floats<'py>,
    ) -> PyResult<Array<'py>> {
        let (place, normal) = (
            Rows::new("point", &point, &[3])?,
            Rows::new("normal", &normal, &[3])?,
        );
        let asked = pairs(&place, &normal)?;
        hwall::numeric::check::all_finite("point", place.values()).or_raise()?;
        hwall::numeric::check::all_finite("normal", normal.values()).or_raise()?;
        let found = py.detach(|| {
            let all =
                (0..asked.count).map(|i| match self.maps.present(at(&place, i), at(&normal, i)) {
                    Presented::Reachable => at(&place, i),
                    Presented::Nearest(place) => place,
                    Presented::Unknown => DVec3::NAN,
                });
            all.flat_map(|p| p.to_array()).collect()
        });
        like(py, asked, found, &[3])
    }

    /// Reachable stretches of the lines of all walls, (n, 2, 3), m: both ends of each, for a `Line3DCollection`.
    #[getter]
    fn stretches<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let stretches = self.maps.stretches();
        let values = stretches
            .iter()
            .flatten()
            .flat_map(|p| p.to_array())
            .collect();
        array(py, values, &[stretches.len(), 2, 3])
    }

    /// The map of all walls; None if no wall is near enough.
    #[getter]
    fn map(&self) -> Option<ReachMap> {
        let map = self.maps.map().cloned()?;
        Some(ReachMap { map })
    }
}

/// The reachable part of one wall as polygons: `orientation` (rad) and `plane` (m) as in `reach_map`; `heights` (lowest,
/// highest), m, by default all. `accuracy` of the outline, m.
#[pyfunction]
#[pyo3(signature = (arm, orientation, plane, *, heights=None, accuracy=1e-4, roll=None))]
pub(crate) fn wall_region(
    py: Python<'_>,
    arm: &PyArm,
    orientation: f64,
    plane: f64,
    heights: Option<Floats<'_>>,
    accuracy: f64,
    roll: Option<Bound<'_, PyAny>>,
) -> PyResult<Region> {
    let arm = arm.srs()?;
    let exact = exact(ExactConfig::default().accuracy_m, roll)?;
    let heights = heights.map(|ends| fixed("heights", &ends)).transpose()?;
    let config = PolygonConfig {
        accuracy_m: accuracy,
        heights_m: heights.map(|[lo, hi]| Interval::new(lo, hi)),
        ..PolygonConfig::default()
    };
    let region = py.detach(|| {
        let solver = ExactSolver::new(arm, &exact)?;
        WallRegion::of_plane(&solver, &WallPlane::new(orientation, plane)?, &config)
    });
    Ok(Region {
        region: region.or_raise()?,
    })
}

/// The reachable part of a wall. Coordinates: along the wall, height; m.
#[pyclass(frozen, module = "hwall")]
pub(crate) struct Region {
    region: WallRegion,
}

fn ring<'py>(py: Python<'py>, ring: &[WallPoint]) -> PyResult<Array<'py>> {
    let values = ring.iter().flat_map(|p| [p.s_m, p.z_m]).collect();
    array(py, values, &[ring.len(), 2])
}

#[pymethods]
impl Region {
    /// The polygons: for each its rings (n, 2), m, the outline first, then the holes.
    #[getter]
    fn polygons<'py>(&self, py: Python<'py>) -> PyResult<Vec<Vec<Array<'py>>>> {
        let polygons = self.region.polygons().iter();
        let rings = polygons.map(|polygon| polygon.rings().map(|r| ring(py, r)).collect());
        rings.collect()
    }

    /// Vertices of the triangulation, (n, 2), m: `plt.triplot(*region.vertices.T, region.triangles)`.
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        ring(py, self.region.vertices())
    }

    /// Triangles, (n, 3): indices of vertices.
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, u32>> {
        let triangles = self.region.triangles();
        array(py, triangles.as_flattened().to_vec(), &[triangles.len(), 3])
    }

    /// Area, m2.
    #[getter]
    fn area(&self) -> f64 {
        self.region.area_m2()
    }

    /// Is `at` inside? (2,) or (n, 2): along the wall, height; m.
    fn contains<'py>(&self, py: Python<'py>, at: Floats<'py>) -> PyResult<Array<'py, bool>> {
        let rows = Rows::new("at", &at, &[2])?;
        hwall::numeric::check::all_finite("at", rows.values()).or_raise()?;
        let places = rows
            .values()
            .chunks_exact(2)
            .map(|p| WallPoint::new(p[0], p[1]));
        let inside = places.map(|place| self.region.contains(place)).collect();
        like(py, &rows, inside, &[])
    }
}

/// Where should the base stand so that the board can be held at these points? `points` (n, 3) and `normals` (3,) or (n, 3)
/// towards the person, room frame, m. Tries all `x` and `y` (evenly spaced, m) at the height `z`, each with all
/// `headings` (rad, default eight). `least_behind`: least distance of the base behind the wall of each target, m.
#[pyfunction]
#[pyo3(signature = (arm, points, normals, x, y, *, z=0.0, headings=None, roll=None, best=10, least_behind=None))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn base_placement(
    py: Python<'_>,
    arm: &PyArm,
    points: Floats<'_>,
    normals: Floats<'_>,
    x: Floats<'_>,
    y: Floats<'_>,
    z: f64,
    headings: Option<Floats<'_>>,
    roll: Option<Bound<'_, PyAny>>,
    best: usize,
    least_behind: Option<f64>,
) -> PyResult<Placements> {
    let (places, normals) = (
        Rows::new("points", &points, &[3])?,
        Rows::new("normals", &normals, &[3])?,
    );
    let targets: Vec<Target> = (0..pairs(&places, &normals)?.count)
        .map(|i| Target {
            point_m: at(&places, i),
            normal: at(&normals, i),
        })
        .collect();
    let mut config = PlacementConfig::new(steps("x", &x)?, steps("y", &y)?, z);
    if let Some(headings) = headings {
        config.headings_rad = list("headings", &headings)?;
    }
    config.roll = roll_of(roll)?;
    config.best = best;
    config.least_behind_m = least_behind;
    let arm = arm.srs()?;
    let scores = py
        .detach(|| place_base(arm, &targets, &config))
        .or_raise()?;
    Ok(Placements { scores })
}

/// Share of the targets reached from each place.
#[pyclass(frozen, module = "hwall")]
pub(crate) struct Placements {
    scores: PlacementScores,
}

#[pymethods]
impl Placements {
    /// The best places, the best first: dicts of room_from_base (4, 4), heading (rad), share of the targets
    /// reached, worst_margin and mean_margin (m, of the reached ones; None without any).
    #[getter]
    fn best<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let all = self.scores.best().iter().map(|placement| {
            let found = PyDict::new(py);
            let pose = matrix(&placement.room_from_base).to_vec();
            found.set_item("room_from_base", array(py, pose, &[4, 4])?)?;
            found.set_item("heading", placement.heading_rad)?;
            found.set_item("share", placement.share())?;
            found.set_item("worst_margin", placement.worst_margin_m)?;
            found.set_item("mean_margin", placement.mean_margin_m)?;
            Ok(found)
        });
        all.collect()
    }

    /// Largest share of the targets reached from each place, over headings, (len(y), len(x)): for `imshow` or `pcolormesh`.
    #[getter]
    fn shares<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let config = self.scores.config();
        array(
            py,
            self.scores.shares(),
            &[config.y.count(), config.x.count()],
        )
    }
}

/// Points spread over a rectangle of a wall, (n, 3), m: `middle` halfway along the wall, `normal` towards the person, `heights`
/// (lowest, highest), at most `spacing` apart.
#[pyfunction]
pub(crate) fn places_on_wall<'py>(
    py: Python<'py>,
    middle: Floats<'py>,
    normal: Floats<'py>,
    width: f64,
    heights: Floats<'py>,
    spacing: f64,
) -> PyResult<Array<'py>> {
    let (middle, normal) = (fixed("middle", &middle)?, fixed("normal", &normal)?);
    let [lo, hi] = fixed("heights", &heights)?;
    let (middle, normal) = (DVec3::from_array(middle), DVec3::from_array(normal));
    let targets =
        Target::on_wall(middle, normal, width, Interval::new(lo, hi), spacing).or_raise()?;
    points(py, targets.into_iter().map(|target| target.point_m))
}
