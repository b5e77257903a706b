//! The scene: surfaces and their poses.

use crate::error::{Result, SceneError, at_most};
use crate::facet::{self, Facet};
use crate::part::{BuildQuality, Face, MAX_TRIANGLES, Part};
use crate::read::{self, FileFrame, LoadLimits, LoadReport, SurfaceMesh};
use crate::surface::{OpeningRange, Surface, SurfaceId, SurfaceKind};
use glam::DVec3;
use hwall_geometry::Pose;
use hwall_numeric::check::finite;
use std::path::Path;
use std::sync::Arc;

/// Named surfaces in one frame; only the openings of doors and panels change.
///
/// Lengths are metres, in the frame of the file until [`placed`](Self::placed) moves the scene (by
/// convention into the robot base frame). Geometry is shared between copies, so placing and cloning
/// are cheap; queries take `&self` and do not allocate.
#[derive(Clone)]
pub struct Scene {
    pub(crate) geometry: Arc<Geometry>,
    world_from_file: Pose,
    /// As placed: door axes are in the frame of this scene.
    surfaces: Vec<Surface>,
    /// Opening of each surface, rad or m; zero for fixed ones.
    openings: Vec<f64>,
    /// Current poses of the parts.
    pub(crate) world_from_part: Vec<Pose>,
}

/// A box along the axes of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates, m.
    pub min_m: DVec3,
    /// Largest coordinates, m.
    pub max_m: DVec3,
}

/// Geometry that does not change with motion.
pub(crate) struct Geometry {
    pub(crate) parts: Vec<Part>,
    /// Poses of the parts at opening zero.
    file_from_part: Vec<Pose>,
    /// Kinds in the frame of the file.
    pub(crate) kinds: Vec<SurfaceKind>,
    /// Part of each surface.
    pub(crate) part_of: Vec<usize>,
    /// Numbers of the triangles of each surface within its part.
    triangles_of: Vec<Vec<u32>>,
    /// For each part the bits of its touchable surfaces.
    pub(crate) touchable_bits: Vec<u64>,
}

impl Geometry {
    fn new(
        parts: Vec<Part>,
        file_from_part: Vec<Pose>,
        kinds: Vec<SurfaceKind>,
        part_of: Vec<usize>,
    ) -> Self {
        let mut triangles_of = vec![Vec::new(); kinds.len()];
        for part in &parts {
            for (i, face) in part.faces() {
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
    /// Reads an OBJ file and its sidecar; by default `room.toml` next to `room.obj`, if it exists.
    /// Limits: [`LoadLimits::default`].
    ///
    /// # Errors
    /// A missing, oversized or malformed file, a sidecar that does not match it, no face left: [`SceneError::Io`]
    /// or [`SceneError::File`], which name the file.
    pub fn from_obj_file(
        obj: impl AsRef<Path>,
        sidecar: Option<&Path>,
    ) -> Result<(Self, LoadReport)> {
        Self::from_obj_file_in(obj, sidecar, &FileFrame::default(), &LoadLimits::default())
    }

    /// [`from_obj_file`](Self::from_obj_file) with given limits, unit and up axis of the OBJ.
    ///
    /// # Errors
    /// As [`from_obj_file`](Self::from_obj_file); a unit that is not positive.
    pub fn from_obj_file_in(
        obj: impl AsRef<Path>,
        sidecar: Option<&Path>,
        frame: &FileFrame,
        limits: &LoadLimits,
    ) -> Result<(Self, LoadReport)> {
        let obj = obj.as_ref();
        let text = read::read_text(obj, limits)?;
        let beside = obj.with_extension("toml");
        let sidecar = sidecar.or_else(|| beside.is_file().then_some(beside.as_path()));
        let sidecar_text = sidecar
            .map(|path| read::read_text(path, limits))
            .transpose()?;
        let directory = obj.parent().unwrap_or(Path::new(""));
        let beside = sidecar_text.as_deref();
        Self::from_text(&text, beside, Some(directory), frame, limits)
            .map_err(|error| error.in_files(obj, sidecar))
    }

    /// Reads an OBJ and its sidecar from memory; material libraries are reported as missing.
    ///
    /// # Errors
    /// As [`from_obj_file`](Self::from_obj_file).
    pub fn from_obj_str(obj: &str, sidecar: Option<&str>) -> Result<(Self, LoadReport)> {
        Self::from_obj_str_in(obj, sidecar, &FileFrame::default())
    }

    /// [`from_obj_str`](Self::from_obj_str) with given unit and up axis of the OBJ.
    ///
    /// # Errors
    /// As [`from_obj_file_in`](Self::from_obj_file_in).
    pub fn from_obj_str_in(
        obj: &str,
        sidecar: Option<&str>,
        frame: &FileFrame,
    ) -> Result<(Self, LoadReport)> {
        Self::from_text(obj, sidecar, None, frame, &LoadLimits::default())
    }

    fn from_text(
        text: &str,
        sidecar: Option<&str>,
        directory: Option<&Path>,
        frame: &FileFrame,
        limits: &LoadLimits,
    ) -> Result<(Self, LoadReport)> {
        let (mut meshes, mut report) = read::parse(text, directory, limits)?;
        if let Some(text) = sidecar {
            read::apply(text, &mut meshes)?;
        }
        frame.apply(&mut meshes)?;
        let scene = Self::build(meshes, &mut report)?;
        Ok((scene, report))
    }

    /// From triangles in memory. Faces without area and duplicate faces are dropped and reported.
    ///
    /// # Errors
    /// A coordinate that is not finite or too large, two surfaces with one name, invalid surface properties, no face left.
    pub fn from_meshes(meshes: Vec<SurfaceMesh>) -> Result<(Self, LoadReport)> {
        let mut report = LoadReport::default();
        let scene = Self::build(meshes, &mut report)?;
        Ok((scene, report))
    }

    fn build(meshes: Vec<SurfaceMesh>, report: &mut LoadReport) -> Result<Self> {
        let meshes = read::repaired(meshes, report)?;
        let got = meshes.iter().map(|m| m.triangles_m.len()).sum::<usize>() as u64;
        at_most(MAX_TRIANGLES, "triangles", got)?;
        // All fixed surfaces form one part; each movable surface is a separate part.
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
            .map(|(part, middle)| (part, Pose::IDENTITY.at(middle)))
            .unzip();
        let surfaces: Vec<Surface> = meshes.into_iter().map(|m| m.surface).collect();
        let kinds = surfaces.iter().map(|s| s.kind.clone()).collect();
        Ok(Self {
            world_from_file: Pose::IDENTITY,
            openings: vec![0.0; surfaces.len()],
            world_from_part: file_from_part.clone(),
            surfaces,
            geometry: Arc::new(Geometry::new(parts, file_from_part, kinds, part_of)),
        })
    }

    /// The same scene with hierarchies of another quality.
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

    /// Memory of triangles and hierarchies, bytes; shared between copies.
    #[must_use]
    pub fn geometry_bytes(&self) -> usize {
        let indices = self.geometry.triangles_of.iter().map(|t| size_of_val(&**t));
        let parts = self.geometry.parts.iter().map(Part::bytes);
        parts.sum::<usize>() + indices.sum::<usize>()
    }

    /// The same scene moved by `world_from_scene`, openings and hinge axes with it.
    ///
    /// Placements compose: `scene.placed(&b).placed(&a)` is `scene.placed(&(a * b))` to rounding.
    #[must_use]
    pub fn placed(&self, world_from_scene: &Pose) -> Self {
        let mut scene = self.clone();
        scene.world_from_file = *world_from_scene * self.world_from_file;
        for (surface, kind) in scene.surfaces.iter_mut().zip(&self.geometry.kinds) {
            surface.kind = kind.transformed(&scene.world_from_file);
        }
        for part in 0..scene.world_from_part.len() {
            scene.move_part(part);
        }
        scene
    }

    /// All surfaces; a [`SurfaceId`] is an index into them.
    #[must_use]
    pub fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    /// One surface.
    ///
    /// # Panics
    /// If the id belongs to another scene.
    #[must_use]
    pub fn surface(&self, id: SurfaceId) -> &Surface {
        &self.surfaces[id.0]
    }

    /// The surface with that name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<SurfaceId> {
        self.surfaces
            .iter()
            .position(|s| s.name == name)
            .map(SurfaceId)
    }

    /// Number of triangles in the scene.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.geometry.triangles_of.iter().map(Vec::len).sum()
    }

    /// Triangles of one surface at its current pose, corners in metres, counter-clockwise from outside.
    ///
    /// # Errors
    /// An id of another scene.
    pub fn triangles_m(
        &self,
        id: SurfaceId,
    ) -> Result<impl ExactSizeIterator<Item = [DVec3; 3]> + '_> {
        self.check(id)?;
        let part = self.geometry.part_of[id.0];
        let world_from_part = self.world_from_part[part];
        let numbers = &self.geometry.triangles_of[id.0];
        let part = &self.geometry.parts[part];
        Ok(numbers.iter().map(move |&number| {
            let corners_m = part.face(number as usize).corners_m;
            corners_m.map(|p| world_from_part.transform_point(p))
        }))
    }

    /// The box around everything at the current openings.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let mut bounds = Bounds {
            min_m: DVec3::INFINITY,
            max_m: DVec3::NEG_INFINITY,
        };
        for (part, world_from_part) in self.geometry.parts.iter().zip(&self.world_from_part) {
            for corner in part.faces().flat_map(|(_, face)| face.corners_m) {
                let p = world_from_part.transform_point(corner);
                bounds.min_m = bounds.min_m.min(p);
                bounds.max_m = bounds.max_m.max(p);
            }
        }
        bounds
    }

    /// Opening of a door (rad) or panel (m); `None` for fixed surfaces.
    #[must_use]
    pub fn opening(&self, id: SurfaceId) -> Option<f64> {
        self.surfaces.get(id.0)?.kind.range()?;
        Some(self.openings[id.0])
    }

    /// Sets the opening of a door (rad) or panel (m). Nothing is rebuilt.
    ///
    /// # Errors
    /// NaN, outside the range of the surface, or a fixed surface; the scene is then unchanged.
    pub fn set_opening(&mut self, id: SurfaceId, value: f64) -> Result<()> {
        let surface = &self.surfaces[self.check(id)?];
        let name = || surface.name.clone();
        let OpeningRange { min, max } = surface
            .kind
            .range()
            .ok_or_else(|| SceneError::NotMovable { surface: name() })?;
        finite("opening", value)?;
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

    /// Moves a part according to the placement and its opening.
    fn move_part(&mut self, part: usize) {
        let geometry = &self.geometry;
        let motion = geometry
            .part_of
            .iter()
            .position(|&p| p == part)
            .map_or(Pose::IDENTITY, |id| {
                geometry.kinds[id].motion(self.openings[id])
            });
        self.world_from_part[part] = self.world_from_file * motion * geometry.file_from_part[part];
    }

    /// Planar vertical pieces of the touchable surfaces, largest first: where a wall can be touched
    /// and a board can be presented.
    ///
    /// Vertical means within [`VERTICAL_TOLERANCE_RAD`](crate::VERTICAL_TOLERANCE_RAD) of the z axis. Connected
    /// coplanar triangles of one surface are merged.
    #[must_use]
    pub fn vertical_facets(&self) -> Vec<Facet> {
        let touchable = self
            .surfaces
            .iter()
            .enumerate()
            .filter(|(_, s)| s.touchable());
        let mut facets: Vec<Facet> = touchable
            .filter_map(|(id, _)| Some((SurfaceId(id), self.triangles_m(SurfaceId(id)).ok()?)))
            .flat_map(|(id, triangles)| facet::vertical(id, &triangles.collect::<Vec<_>>()))
            .collect();
        facets.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2));
        facets
    }

    pub(crate) fn check(&self, id: SurfaceId) -> Result<usize> {
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
