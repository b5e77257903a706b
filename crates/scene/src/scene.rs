//! The scene: surfaces, where they stand, and the questions asked of them.

use crate::error::finite;
use crate::mesh::{self, LoadReport, SurfaceMesh};
use crate::obj::{self, LoadLimits};
use crate::part::{Face, Part, PartHit, PartRay};
use crate::patch::{self, Patch};
use crate::rigid::Rigid;
use crate::tree::{ALL, MAX_TRIANGLES};
use crate::{BuildQuality, SceneError, Surface, SurfaceId, SurfaceKind, sidecar, triangle};
use glam::{DAffine3, DVec3};
use std::path::Path;
use std::sync::Arc;

/// Where a ray meets the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// The surface met.
    pub surface: SurfaceId,
    /// The point, m; a point of the triangle to rounding.
    pub point_m: DVec3,
    /// Unit normal of the triangle, on the side the ray came from.
    pub normal: DVec3,
    /// Was the side met the outside, by the winding of the file?
    pub outside: bool,
    /// Distance from the origin of the ray, m.
    pub distance_m: f64,
}

/// The point of a surface closest to some point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// The surface it lies on.
    pub surface: SurfaceId,
    /// The closest point, m.
    pub point_m: DVec3,
    /// Unit normal of the triangle, on the side of the query point (outward if that lies in its plane).
    pub normal: DVec3,
    /// Does the query point lie on the outside, by the winding of the file?
    pub outside: bool,
    /// Distance from the query point, m.
    pub distance_m: f64,
}

/// Named surfaces in one frame; only the openings of doors and panels change.
///
/// Lengths are metres, in the frame of the file until [`placed`](Self::placed) moves the scene
/// (by convention into the robot base frame). Geometry is shared between copies, so placing
/// and cloning cost little; queries take `&self` and allocate nothing.
#[derive(Clone)]
pub struct Scene {
    geometry: Arc<Geometry>,
    world_from_file: Rigid,
    /// As placed: the axes of doors are in the frame of this scene.
    surfaces: Vec<Surface>,
    /// Opening of each surface, rad or m; zero for what does not move.
    openings: Vec<f64>,
    /// Where the parts are now.
    world_from_part: Vec<Rigid>,
}

/// What no motion changes.
struct Geometry {
    parts: Vec<Part>,
    /// Where the parts stand at opening zero.
    file_from_part: Vec<Rigid>,
    /// Kinds in the frame of the file.
    kinds: Vec<SurfaceKind>,
    /// Part of each surface.
    part_of: Vec<usize>,
    /// Triangles of each surface within its part.
    triangles_of: Vec<Vec<u32>>,
    /// For each part what marks its touchable surfaces.
    touchable_bits: Vec<u64>,
}

impl Geometry {
    fn new(
        parts: Vec<Part>,
        file_from_part: Vec<Rigid>,
        kinds: Vec<SurfaceKind>,
        part_of: Vec<usize>,
    ) -> Self {
        let mut triangles_of = vec![Vec::new(); kinds.len()];
        for part in &parts {
            for (i, face) in part.faces().iter().enumerate() {
                triangles_of[face.surface as usize].push(i as u32);
            }
        }
        let mut touchable_bits = vec![0; parts.len()];
        for (id, kind) in kinds.iter().enumerate() {
            if *kind != SurfaceKind::Untouchable {
                touchable_bits[part_of[id]] |= parts[part_of[id]].bit(id);
            }
        }
        Self {
            parts,
            file_from_part,
            kinds,
            part_of,
            triangles_of,
            touchable_bits,
        }
    }
}

impl Scene {
    /// Reads an OBJ file and its sidecar; without one named, `room.toml` beside `room.obj` is
    /// read if it exists. Limits: [`LoadLimits::default`].
    ///
    /// # Errors
    /// A missing, oversized or malformed file, a sidecar that does not fit it, no face left.
    pub fn from_obj_file(
        obj: &Path,
        sidecar: Option<&Path>,
    ) -> Result<(Self, LoadReport), SceneError> {
        Self::from_obj_file_within(obj, sidecar, &LoadLimits::default())
    }

    /// [`from_obj_file`](Self::from_obj_file) with limits of the caller's choice.
    ///
    /// # Errors
    /// As there.
    pub fn from_obj_file_within(
        obj: &Path,
        sidecar: Option<&Path>,
        limits: &LoadLimits,
    ) -> Result<(Self, LoadReport), SceneError> {
        let text = obj::read_text(obj, limits)?;
        let beside = obj.with_extension("toml");
        let sidecar = sidecar.or_else(|| beside.is_file().then_some(beside.as_path()));
        let sidecar_text = sidecar
            .map(|path| obj::read_text(path, limits))
            .transpose()?;
        let directory = obj.parent().unwrap_or(Path::new(""));
        Self::from_text(&text, sidecar_text.as_deref(), Some(directory), limits)
    }

    /// Reads an OBJ and its sidecar from memory; material libraries are reported as missing.
    ///
    /// # Errors
    /// As [`from_obj_file`](Self::from_obj_file).
    pub fn from_obj_str(
        obj: &str,
        sidecar: Option<&str>,
    ) -> Result<(Self, LoadReport), SceneError> {
        Self::from_text(obj, sidecar, None, &LoadLimits::default())
    }

    fn from_text(
        text: &str,
        sidecar: Option<&str>,
        directory: Option<&Path>,
        limits: &LoadLimits,
    ) -> Result<(Self, LoadReport), SceneError> {
        let (mut meshes, mut report) = obj::parse(text, directory, limits)?;
        if let Some(text) = sidecar {
            sidecar::apply(text, &mut meshes)?;
        }
        let scene = Self::build(meshes, &mut report)?;
        Ok((scene, report))
    }

    /// From triangles in memory. Faces without area and repeated faces are left out and reported.
    ///
    /// # Errors
    /// A coordinate that is not finite or too large, two surfaces of one name, impossible
    /// surface properties, no face left.
    pub fn from_meshes(meshes: Vec<SurfaceMesh>) -> Result<(Self, LoadReport), SceneError> {
        let mut report = LoadReport::default();
        let scene = Self::build(meshes, &mut report)?;
        Ok((scene, report))
    }

    fn build(meshes: Vec<SurfaceMesh>, report: &mut LoadReport) -> Result<Self, SceneError> {
        let meshes = mesh::repaired(meshes, report)?;
        let got = meshes.iter().map(|m| m.triangles_m.len()).sum::<usize>() as u64;
        if got > MAX_TRIANGLES {
            let (what, limit) = ("triangles", MAX_TRIANGLES);
            return Err(SceneError::TooLarge { what, got, limit });
        }
        // Everything that stands still is one part, whatever moves is a part of its own.
        let (mut still, mut groups) = (None, Vec::<Vec<Face>>::new());
        let mut part_of = Vec::with_capacity(meshes.len());
        for (id, mesh) in meshes.iter().enumerate() {
            let movable = mesh.surface.kind.range().is_some();
            let part = match still {
                Some(part) if !movable => part,
                _ => {
                    groups.push(Vec::new());
                    groups.len() - 1
                }
            };
            if !movable {
                still = Some(part);
            }
            groups[part].extend(mesh.triangles_m.iter().map(|&corners_m| Face {
                corners_m,
                surface: id as u32,
            }));
            part_of.push(part);
        }
        let (parts, file_from_part): (Vec<_>, Vec<_>) = groups
            .into_iter()
            .map(|faces| Part::build(faces, BuildQuality::default()))
            .map(|(part, middle)| (part, Rigid::translation(middle)))
            .unzip();
        let surfaces: Vec<Surface> = meshes.into_iter().map(|m| m.surface).collect();
        let kinds = surfaces.iter().map(|s| s.kind.clone()).collect();
        Ok(Self {
            world_from_file: Rigid::IDENTITY,
            openings: vec![0.0; surfaces.len()],
            world_from_part: file_from_part.clone(),
            surfaces,
            geometry: Arc::new(Geometry::new(parts, file_from_part, kinds, part_of)),
        })
    }

    /// The same scene with hierarchies of another quality; nothing else changes.
    ///
    /// Constructors build at [`BuildQuality::Balanced`].
    #[must_use]
    pub fn with_build_quality(&self, quality: BuildQuality) -> Self {
        let Geometry {
            parts,
            file_from_part,
            kinds,
            part_of,
            ..
        } = &*self.geometry;
        let parts = parts.iter().map(|part| part.rebuilt(quality)).collect();
        let geometry = Geometry::new(
            parts,
            file_from_part.clone(),
            kinds.clone(),
            part_of.clone(),
        );
        Self {
            geometry: Arc::new(geometry),
            ..self.clone()
        }
    }

    /// Bytes that triangles and hierarchies take, shared between copies.
    #[must_use]
    pub fn geometry_bytes(&self) -> usize {
        let indices = self.geometry.triangles_of.iter().map(|t| size_of_val(&**t));
        let parts = self.geometry.parts.iter().map(Part::bytes);
        parts.sum::<usize>() + indices.sum::<usize>()
    }

    /// The same scene moved by `world_from_scene`, openings and hinge axes with it.
    ///
    /// Placements add up: `scene.placed(b)?.placed(a)?` is `scene.placed(a * b)?` to rounding.
    ///
    /// # Errors
    /// NaN, infinity, or a matrix further than [`RIGID_TOLERANCE`](crate::RIGID_TOLERANCE) from
    /// a rotation (scale, shear, mirror).
    pub fn placed(&self, world_from_scene: DAffine3) -> Result<Self, SceneError> {
        let mut scene = self.clone();
        scene.world_from_file = Rigid::from_affine(&world_from_scene)? * self.world_from_file;
        for (surface, kind) in scene.surfaces.iter_mut().zip(&self.geometry.kinds) {
            surface.kind = kind.transformed(&scene.world_from_file);
        }
        for part in 0..scene.world_from_part.len() {
            scene.move_part(part);
        }
        Ok(scene)
    }

    /// All surfaces; a [`SurfaceId`] is an index into them.
    #[must_use]
    pub fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    /// One surface.
    ///
    /// # Panics
    /// If the id is of another scene.
    #[must_use]
    pub fn surface(&self, id: SurfaceId) -> &Surface {
        &self.surfaces[id.0]
    }

    /// The surface of that name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<SurfaceId> {
        self.surfaces
            .iter()
            .position(|s| s.name == name)
            .map(SurfaceId)
    }

    /// Triangles in the scene.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.geometry.parts.iter().map(|p| p.faces().len()).sum()
    }

    /// Triangles of one surface where it is now, corners in metres, counter-clockwise from outside.
    ///
    /// # Errors
    /// An id of another scene.
    pub fn triangles_m(
        &self,
        id: SurfaceId,
    ) -> Result<impl ExactSizeIterator<Item = [DVec3; 3]> + '_, SceneError> {
        self.check(id)?;
        let part = self.geometry.part_of[id.0];
        let world_from_part = self.world_from_part[part];
        let faces = self.geometry.parts[part].faces();
        let indices = &self.geometry.triangles_of[id.0];
        Ok(indices.iter().map(move |&i| {
            faces[i as usize]
                .corners_m
                .map(|p| world_from_part.point(p))
        }))
    }

    /// Smallest and largest corner of the box around everything, m, at the present openings.
    #[must_use]
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let mut bounds = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (part, world_from_part) in self.geometry.parts.iter().zip(&self.world_from_part) {
            for corner in part.faces().iter().flat_map(|f| f.corners_m) {
                let p = world_from_part.point(corner);
                bounds = (bounds.0.min(p), bounds.1.max(p));
            }
        }
        bounds
    }

    /// Opening of a door (rad) or panel (m); `None` for what does not move.
    #[must_use]
    pub fn opening(&self, id: SurfaceId) -> Option<f64> {
        self.surfaces.get(id.0)?.kind.range()?;
        Some(self.openings[id.0])
    }

    /// Opens a door (rad) or panel (m). Nothing is rebuilt.
    ///
    /// # Errors
    /// Not a number, outside the range of the surface, or a surface that does not move; the
    /// scene stays as it was.
    pub fn set_opening(&mut self, id: SurfaceId, value: f64) -> Result<(), SceneError> {
        let surface = &self.surfaces[self.check(id)?];
        let name = || surface.name.clone();
        let (min, max) = surface
            .kind
            .range()
            .ok_or_else(|| SceneError::NotMovable { surface: name() })?;
        if !value.is_finite() {
            return Err(SceneError::NonFinite {
                what: "opening",
                value,
            });
        }
        if !(min..=max).contains(&value) {
            return Err(SceneError::OpeningOutOfRange {
                surface: name(),
                value,
                min,
                max,
            });
        }
        self.openings[id.0] = value;
        self.move_part(self.geometry.part_of[id.0]);
        Ok(())
    }

    /// Puts a part where the placement and its opening say.
    fn move_part(&mut self, part: usize) {
        let geometry = &self.geometry;
        let motion = geometry
            .part_of
            .iter()
            .position(|&p| p == part)
            .map_or(Rigid::IDENTITY, |id| {
                geometry.kinds[id].motion(self.openings[id])
            });
        self.world_from_part[part] = self.world_from_file * motion * geometry.file_from_part[part];
    }

    /// Nearest surface along a ray, untouchable ones included, both sides of every face.
    ///
    /// `direction` may have any length; a hit at the origin itself counts. No ray passes between
    /// two triangles that share an edge. Everything but the search is f64: the point is good to
    /// about 1e-15 of the scene's size and 1e-16 of the distance to the origin, divided by
    /// the sine of the angle to the face where a ray grazes.
    ///
    /// # Errors
    /// NaN, infinity, or a direction of zero length.
    pub fn ray_cast(&self, origin_m: DVec3, direction: DVec3) -> Result<Option<Hit>, SceneError> {
        let (origin_m, direction) = (finite("ray origin", origin_m)?, unit(direction)?);
        let mut best: Option<(usize, PartHit)> = None;
        for (part, ray) in self.part_rays(origin_m, direction) {
            let max_m = best.map_or(f64::INFINITY, |(_, hit)| hit.distance_m);
            if let Some(hit) = self.geometry.parts[part].ray_cast(&ray, max_m) {
                best = Some((part, hit));
            }
        }
        Ok(best.map(|(part, hit)| {
            let (normal, outside) = self.facing(part, &hit, -direction);
            Hit {
                surface: SurfaceId(self.geometry.parts[part].surface(hit.triangle)),
                point_m: self.world_from_part[part].point(hit.point_m),
                normal,
                outside,
                distance_m: hit.distance_m,
            }
        }))
    }

    /// Does a ray meet anything at a distance in `[0, max_distance_m)`? Stops at the first hit.
    ///
    /// # Errors
    /// NaN, an infinite origin or direction, a direction of zero length. An infinite distance is fine.
    pub fn any_hit(
        &self,
        origin_m: DVec3,
        direction: DVec3,
        max_distance_m: f64,
    ) -> Result<bool, SceneError> {
        let (origin_m, direction) = (finite("ray origin", origin_m)?, unit(direction)?);
        let max_m = distance(max_distance_m)?;
        Ok(self
            .part_rays(origin_m, direction)
            .any(|(part, ray)| self.geometry.parts[part].any_hit(&ray, max_m)))
    }

    /// Is the open line between two points free?
    ///
    /// A billionth of its length is left out at both ends, so that a point on a surface is
    /// visible; a surface within that of an end does not block.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn visible(&self, from_m: DVec3, to_m: DVec3) -> Result<bool, SceneError> {
        let line = finite("target", to_m)? - finite("viewpoint", from_m)?;
        let length_m = line.length();
        if length_m == 0.0 {
            return Ok(true);
        }
        // Coordinates far from the origin are themselves rounded.
        let margin_m = 1e-9 * length_m + 1e-14 * from_m.abs().max(to_m.abs()).max_element();
        if length_m <= 2.0 * margin_m {
            return Ok(true);
        }
        let start_m = from_m + line * (margin_m / length_m);
        Ok(!self.any_hit(start_m, line, length_m - 2.0 * margin_m)?)
    }

    /// Closest point of any surface, untouchable ones included, nearer than `max_distance_m`.
    ///
    /// Exact to rounding. On an edge, the face that faces the query point most gives the normal.
    ///
    /// # Errors
    /// NaN, an infinite point, a point more than 6e153 m away. An infinite limit is fine.
    pub fn closest_point(
        &self,
        point_m: DVec3,
        max_distance_m: f64,
    ) -> Result<Option<Closest>, SceneError> {
        self.closest(point_m, max_distance_m, |_| ALL, |_| true)
    }

    /// [`closest_point`](Self::closest_point) among the surfaces that a hand may touch.
    ///
    /// # Errors
    /// As there.
    pub fn closest_touchable(
        &self,
        point_m: DVec3,
        max_distance_m: f64,
    ) -> Result<Option<Closest>, SceneError> {
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
    pub fn project_on(&self, surface: SurfaceId, point_m: DVec3) -> Result<Closest, SceneError> {
        self.check(surface)?;
        let part = self.geometry.part_of[surface.0];
        let local = self.world_from_part[part].inverse_point(located(point_m)?);
        let wanted = self.geometry.parts[part].bit(surface.0);
        let hit =
            self.geometry.parts[part].closest(local, f64::INFINITY, wanted, |id| id == surface.0);
        // Every surface keeps at least one triangle and distances are finite.
        hit.map(|hit| self.to_closest(part, &hit, point_m))
            .ok_or(SceneError::NoFaces)
    }

    /// `wanted`: what to look for in a part, if anything.
    fn closest(
        &self,
        point_m: DVec3,
        max_distance_m: f64,
        wanted: impl Fn(usize) -> u64,
        accept: impl Fn(usize) -> bool + Copy,
    ) -> Result<Option<Closest>, SceneError> {
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
            let hit = part.closest(pose.inverse_point(point_m), bound_m, wanted, accept);
            if let Some(hit) = hit.filter(|h| h.distance_m < bound_m) {
                best = Some((index, hit));
            }
        }
        Ok(best.map(|(part, hit)| self.to_closest(part, &hit, point_m)))
    }

    fn to_closest(&self, part: usize, hit: &PartHit, query_m: DVec3) -> Closest {
        let point_m = self.world_from_part[part].point(hit.point_m);
        let (normal, outside) = self.facing(part, hit, query_m - point_m);
        Closest {
            surface: SurfaceId(self.geometry.parts[part].surface(hit.triangle)),
            point_m,
            normal,
            outside,
            distance_m: hit.distance_m,
        }
    }

    /// Planar vertical pieces of the touchable surfaces, largest first: where a wall can be
    /// touched and a board can stand.
    ///
    /// Vertical means within [`VERTICAL_TOLERANCE_RAD`](crate::VERTICAL_TOLERANCE_RAD) of the z axis. Connected
    /// triangles of one surface merge while they stay in one plane.
    #[must_use]
    pub fn vertical_patches(&self) -> Vec<Patch> {
        let touchable = self
            .surfaces
            .iter()
            .enumerate()
            .filter(|(_, s)| s.touchable());
        let mut patches: Vec<Patch> = touchable
            .filter_map(|(id, _)| Some((SurfaceId(id), self.triangles_m(SurfaceId(id)).ok()?)))
            .flat_map(|(id, triangles)| patch::vertical(id, &triangles.collect::<Vec<_>>()))
            .collect();
        patches.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2));
        patches
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
                    origin_m: pose.inverse_point(origin_m),
                    direction: pose.inverse_vector(direction),
                };
                (part, ray)
            })
    }

    /// Unit normal of a triangle on the side that `towards` points to, and whether that is the outside.
    fn facing(&self, part: usize, hit: &PartHit, towards: DVec3) -> (DVec3, bool) {
        let outward = triangle::normal(&self.geometry.parts[part].faces()[hit.triangle].corners_m);
        let normal = self.world_from_part[part].vector(outward);
        let outside = normal.dot(towards) >= 0.0;
        (if outside { normal } else { -normal }, outside)
    }

    fn check(&self, id: SurfaceId) -> Result<usize, SceneError> {
        if id.0 < self.surfaces.len() {
            Ok(id.0)
        } else {
            Err(SceneError::UnknownSurface {
                index: id.0,
                count: self.surfaces.len(),
            })
        }
    }
}

impl std::fmt::Debug for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Scene")
            .field("surfaces", &self.surfaces)
            .field("openings", &self.openings)
            .field("triangles", &self.triangle_count())
            .finish_non_exhaustive()
    }
}

/// Unit vector of a direction of any length.
fn unit(direction: DVec3) -> Result<DVec3, SceneError> {
    let largest = finite("ray direction", direction)?.abs().max_element();
    if largest == 0.0 {
        return Err(SceneError::ZeroDirection);
    }
    // Squares of 1e-200 vanish and those of 1e200 overflow; then the largest component becomes one first.
    Ok(if (1e-100..1e100).contains(&largest) {
        direction.normalize()
    } else {
        (direction / largest).normalize()
    })
}

/// Rejects NaN, infinity and points so far away that the square of the distance overflows.
fn located(point_m: DVec3) -> Result<DVec3, SceneError> {
    let value = finite("point", point_m)?.length();
    if 2.0 * value > f64::MAX.sqrt() {
        let what = "distance";
        return Err(SceneError::NonFinite { what, value });
    }
    Ok(point_m)
}

/// Rejects NaN; infinity is no limit, and nothing is nearer than a negative distance.
fn distance(max_distance_m: f64) -> Result<f64, SceneError> {
    if max_distance_m.is_nan() {
        return Err(SceneError::NonFinite {
            what: "maximum distance",
            value: max_distance_m,
        });
    }
    Ok(max_distance_m.max(0.0))
}
