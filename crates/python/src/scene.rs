//! Rooms: touchable surfaces, ray casts, closest points.

use crate::arrays::{Array, Floats, Rows, array, like, one_pose, point, points};
use crate::error::{Error, OrRaise, refuse};
use hwall::geometry::Pose;
use hwall::glam::DVec3;
use hwall::haptics::body::{Obstacle, Room};
use hwall::scene::{Hit, Scene, SurfaceId};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// A room with named surfaces, immutable. Metres, z up, in the frame of its file.
#[pyclass(frozen, module = "hwall", name = "Scene")]
pub(crate) struct PyScene {
    pub(crate) scene: Scene,
    notes: Option<String>,
}

/// What really stands around the arm, and no part of it may meet. Base frame of the arm, m.
///
/// `planes`: (n, 6), a point and the normal towards the arm each, for floors and walls; `boxes`: (n, 7), the middle, the size and the yaw (rad) each.
/// At most 16 in all.
#[pyclass(frozen, module = "hwall", name = "Room")]
pub(crate) struct PyRoom {
    pub(crate) room: Room,
}

#[pymethods]
impl PyRoom {
    #[new]
    #[pyo3(signature = (planes=None, boxes=None))]
    fn new(planes: Option<Floats<'_>>, boxes: Option<Floats<'_>>) -> PyResult<Self> {
        let mut obstacles = Vec::new();
        if let Some(planes) = &planes {
            let planes = Rows::new("planes", planes, &[6])?;
            for number in 0..planes.count {
                let (point, normal) = planes.row(number).split_at(3);
                let made =
                    Obstacle::half_space(DVec3::from_slice(point), DVec3::from_slice(normal));
                obstacles.push(made.or_raise_in_row(number)?);
            }
        }
        if let Some(boxes) = &boxes {
            let boxes = Rows::new("boxes", boxes, &[7])?;
            for number in 0..boxes.count {
                let [middle, size] = [0, 3].map(|at| DVec3::from_slice(&boxes.row(number)[at..]));
                let pose = Pose::from_yaw(boxes.row(number)[6], middle).or_raise_in_row(number)?;
                let made = Obstacle::cuboid(pose, 0.5 * size);
                obstacles.push(made.or_raise_in_row(number)?);
            }
        }
        if obstacles.is_empty() {
            return refuse("the room is empty: give at least the floor, as a plane");
        }
        Ok(Self {
            room: Room::new(&obstacles).or_raise()?,
        })
    }
}

impl PyScene {
    fn find(&self, name: &str) -> PyResult<SurfaceId> {
        let none = || Error::new_err(format!("there is no surface {name:?}"));
        self.scene.find(name).ok_or_else(none)
    }

    fn with(&self, scene: Scene) -> Self {
        Self {
            scene,
            notes: self.notes.clone(),
        }
    }

    /// Hits as arrays.
    fn hits<'py>(
        &self,
        py: Python<'py>,
        asked: &Rows<'_>,
        hits: &[Option<Hit>],
    ) -> PyResult<Bound<'py, PyDict>> {
        let nowhere = hwall::glam::DVec3::NAN;
        let all = |of: fn(&Hit) -> hwall::glam::DVec3| {
            let values = hits
                .iter()
                .flat_map(|hit| hit.as_ref().map_or(nowhere, of).to_array());
            like(py, asked, values.collect(), &[3])
        };
        let found = PyDict::new(py);
        let surface = hits
            .iter()
            .map(|hit| hit.map_or(-1, |hit| hit.surface.0 as i64));
        let distance = hits
            .iter()
            .map(|hit| hit.map_or(f64::NAN, |hit| hit.distance_m));
        found.set_item("surface", like(py, asked, surface.collect(), &[])?)?;
        found.set_item("point", all(|hit| hit.point_m)?)?;
        found.set_item("normal", all(|hit| hit.normal)?)?;
        found.set_item("distance", like(py, asked, distance.collect(), &[])?)?;
        Ok(found)
    }
}

#[pymethods]
impl PyScene {
    /// A room from an OBJ file, and a TOML sidecar that declares doors, drawers and buttons (`room.toml`
    /// beside `room.obj` by default).
    #[staticmethod]
    #[pyo3(signature = (path, sidecar=None))]
    fn from_obj(py: Python<'_>, path: PathBuf, sidecar: Option<PathBuf>) -> PyResult<Self> {
        let read = py.detach(|| Scene::from_obj_file(&path, sidecar.as_deref()));
        let (scene, report) = read.or_raise()?;
        let notes = (!report.is_clean()).then(|| format!("{report:?}"));
        Ok(Self { scene, notes })
    }

    /// A room from the text of an OBJ file and its sidecar.
    #[staticmethod]
    #[pyo3(signature = (obj, sidecar=None))]
    fn from_obj_str(obj: &str, sidecar: Option<&str>) -> PyResult<Self> {
        let (scene, report) = Scene::from_obj_str(obj, sidecar).or_raise()?;
        let notes = (!report.is_clean()).then(|| format!("{report:?}"));
        Ok(Self { scene, notes })
    }

    /// Faults of the file that were repaired or left out; None without faults.
    #[getter]
    fn notes(&self) -> Option<&str> {
        self.notes.as_deref()
    }

    /// The same room at another place: `world_from_scene` (4, 4), m.
    fn placed(&self, world_from_scene: Floats<'_>) -> PyResult<Self> {
        let pose = one_pose("world_from_scene", &world_from_scene)?;
        Ok(self.with(self.scene.placed(&pose)))
    }

    /// The same room with a door, panel, drawer or button opened: rad for a door, m for the others.
    fn opened(&self, surface: &str, value: f64) -> PyResult<Self> {
        let mut scene = self.scene.clone();
        scene.set_opening(self.find(surface)?, value).or_raise()?;
        Ok(self.with(scene))
    }

    /// The surfaces as dicts of name, kind, touchable, roughness; their index in the list is the surface number in results.
    #[getter]
    fn surfaces<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let all = self.scene.surfaces().iter().map(|surface| {
            let found = PyDict::new(py);
            found.set_item("name", &surface.name)?;
            found.set_item("kind", surface.kind.name())?;
            found.set_item("touchable", surface.touchable())?;
            found.set_item("roughness", surface.roughness)?;
            Ok(found)
        });
        all.collect()
    }

    /// Triangles of a surface in its current position, (n, 3, 3), m.
    fn triangles<'py>(&self, py: Python<'py>, surface: &str) -> PyResult<Array<'py>> {
        let triangles = self.scene.triangles_m(self.find(surface)?).or_raise()?;
        let values: Vec<f64> = triangles.flatten().flat_map(|p| p.to_array()).collect();
        let count = values.len() / 9;
        array(py, values, &[count, 3, 3])
    }

    /// The first hit of a ray: dict of surface (-1: nothing), point, normal (towards the origin), distance (m, NaN: nothing).
    /// `origin` and `direction` (3,) or (n, 3).
    fn ray_cast<'py>(
        &self,
        py: Python<'py>,
        origin: Floats<'py>,
        direction: Floats<'py>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (from, to) = (
            Rows::new("origin", &origin, &[3])?,
            Rows::new("direction", &direction, &[3])?,
        );
        let asked = pairs(&from, &to)?;
        let hits = py.detach(|| {
            let rays = (0..asked.count).map(|i| (at(&from, i), at(&to, i)));
            rays.map(|(origin, direction)| self.scene.ray_cast(origin, direction))
                .collect::<Result<Vec<_>, _>>()
        });
        self.hits(py, asked, &hits.or_raise()?)
    }

    /// The nearest point of any surface (of the touchable ones if `touchable`), within `max_distance`: a dict as from
    /// `ray_cast`. `point` (3,) or (n, 3), m.
    #[pyo3(signature = (point, max_distance=f64::INFINITY, touchable=false))]
    fn closest_point<'py>(
        &self,
        py: Python<'py>,
        point: Floats<'py>,
        max_distance: f64,
        touchable: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let asked = Rows::new("point", &point, &[3])?;
        let hits = py.detach(|| {
            let ask = if touchable {
                Scene::closest_touchable
            } else {
                Scene::closest_point
            };
            let all = asked
                .vectors()
                .map(|point| ask(&self.scene, point, max_distance));
            all.collect::<Result<Vec<_>, _>>()
        });
        self.hits(py, &asked, &hits.or_raise()?)
    }

    /// The vertical surfaces as dicts of surface, point, normal, outline (n, 3), area (m2), width, lowest, highest (m).
    fn vertical_facets<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let all = self.scene.vertical_facets().into_iter().map(|facet| {
            let found = PyDict::new(py);
            found.set_item("surface", facet.surface.0)?;
            found.set_item("point", point(py, facet.point_m)?)?;
            found.set_item("normal", point(py, facet.normal)?)?;
            found.set_item("outline", points(py, facet.outline_m)?)?;
            found.set_item("area", facet.area_m2)?;
            found.set_item("width", facet.width_m)?;
            found.set_item("lowest", facet.lowest_m)?;
            found.set_item("highest", facet.highest_m)?;
            Ok(found)
        });
        all.collect()
    }

    fn __repr__(&self) -> String {
        let (surfaces, triangles) = (self.scene.surfaces().len(), self.scene.triangle_count());
        format!("<hwall.Scene of {surfaces} surfaces, {triangles} triangles>")
    }
}

/// The longer of two arguments; a single one applies to all rows of the other.
pub(crate) fn pairs<'a, 'b>(a: &'a Rows<'b>, b: &'a Rows<'b>) -> PyResult<&'a Rows<'b>> {
    match (a.many, b.many) {
        (true, true) if a.count != b.count => {
            refuse(format!("{} rows and {} rows", a.count, b.count))
        }
        (true, _) => Ok(a),
        (false, _) => Ok(b),
    }
}

/// The vector of a row, or the single one.
pub(crate) fn at(rows: &Rows<'_>, index: usize) -> hwall::glam::DVec3 {
    hwall::glam::DVec3::from_slice(rows.row(if rows.many { index } else { 0 }))
}
