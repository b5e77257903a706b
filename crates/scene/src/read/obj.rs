//! Wavefront OBJ, read by `tobj` after checks that `tobj` does not make.
//!
//! `tobj` takes NaN for a number, gives an empty mesh for binary junk, panics on a material
//! colour of two components and names no line in its errors. So every line is looked at
//! first, and only geometry, groups and materials are passed on.

use super::mesh::{LoadReport, SurfaceMesh};
use crate::error::SceneError;
use crate::part::triangle::is_usable;
use crate::surface::Surface;
use glam::DVec3;
use std::cell::RefCell;
use std::collections::HashMap;
use std::fmt::Write as _;
use std::io::Read as _;
use std::path::Path;

/// Name of the surface of faces outside all groups, as `tobj` calls it.
pub const UNNAMED: &str = "unnamed_object";

/// Limits of what is read. The defaults need at most about two gigabytes of memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LoadLimits {
    /// Bytes of the OBJ, of its sidecar and of each material library; default 256 MiB.
    pub max_bytes: u64,
    /// Triangles after polygons are cut up; default four million.
    pub max_triangles: u64,
}

impl Default for LoadLimits {
    fn default() -> Self {
        Self {
            max_bytes: 256 << 20,
            max_triangles: 4_000_000,
        }
    }
}

/// Reads a text file, at most the limit of bytes.
pub(crate) fn read_text(path: &Path, limits: &LoadLimits) -> Result<String, SceneError> {
    let io = |e: std::io::Error| SceneError::Io {
        path: path.display().to_string(),
        kind: e.kind(),
        message: e.to_string(),
    };
    let file = std::fs::File::open(path).map_err(io)?;
    let mut bytes = Vec::new();
    file.take(limits.max_bytes.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(io)?;
    let got = bytes.len() as u64;
    if got > limits.max_bytes {
        return Err(SceneError::TooLarge {
            what: "bytes",
            got,
            limit: limits.max_bytes,
        });
    }
    String::from_utf8(bytes).map_err(|e| SceneError::NotText {
        offset: e.utf8_error().valid_up_to(),
    })
}

/// Groups of the OBJ as surfaces, in the order of their first face; material libraries are
/// looked for in `directory`.
pub(crate) fn parse(
    text: &str,
    directory: Option<&Path>,
    limits: &LoadLimits,
) -> Result<(Vec<SurfaceMesh>, LoadReport), SceneError> {
    let got = text.len() as u64;
    if got > limits.max_bytes {
        return Err(SceneError::TooLarge {
            what: "bytes",
            got,
            limit: limits.max_bytes,
        });
    }
    let mut check = Check {
        clean: String::with_capacity(text.len()),
        limits: *limits,
        group: UNNAMED.to_owned(),
        ..Check::default()
    };
    // A backslash at the end of a line continues it; `tobj` does not know that.
    let mut joined = String::new();
    for (i, line) in text.lines().enumerate() {
        if let Some(start) = line.strip_suffix('\\') {
            joined.push_str(start);
            joined.push(' ');
        } else if joined.is_empty() {
            check.line(i + 1, line)?;
        } else {
            joined.push_str(line);
            check.line(i + 1, &joined)?;
            joined.clear();
        }
    }
    if !joined.is_empty() {
        check.line(text.lines().count(), &joined)?;
    }
    let Check {
        clean,
        materials_used,
        material_of,
        mut report,
        ..
    } = check;

    let libraries = RefCell::new(Vec::new());
    let (models, materials) =
        tobj::load_obj_buf(&mut clean.as_bytes(), &tobj::GPU_LOAD_OPTIONS, |name| {
            let library = directory
                .ok_or(tobj::LoadError::OpenFileFailed)
                .and_then(|d| read_materials(&d.join(name), limits));
            if library.is_err() {
                libraries.borrow_mut().push(name.display().to_string());
            }
            library
        })
        .map_err(|e| SceneError::Obj {
            message: e.to_string(),
        })?;
    report.missing_material_libraries = libraries.into_inner();
    // Missing libraries are in the report already; a scene needs no colours.
    let materials = materials.unwrap_or_default();
    report.missing_materials = materials_used
        .iter()
        .filter(|used| materials.iter().all(|m| m.name != **used))
        .cloned()
        .collect();
    let mut meshes = surfaces(&models, &materials);
    for SurfaceMesh { surface, .. } in &mut meshes {
        surface.material = material_of
            .get(&surface.name)
            .map(|&used| materials_used[used].clone());
    }
    Ok((meshes, report))
}

/// One surface per group name, however often the group or its material changes in between.
fn surfaces(models: &[tobj::Model], materials: &[tobj::Material]) -> Vec<SurfaceMesh> {
    let mut meshes: Vec<SurfaceMesh> = Vec::new();
    let mut by_name = HashMap::new();
    for tobj::Model { mesh, name } in models.iter().filter(|m| !m.mesh.indices.is_empty()) {
        let id = *by_name.entry(name).or_insert_with(|| {
            let surface = Surface {
                name: name.clone(),
                ..Surface::default()
            };
            meshes.push(SurfaceMesh {
                surface,
                triangles_m: Vec::new(),
            });
            meshes.len() - 1
        });
        let SurfaceMesh {
            surface,
            triangles_m,
        } = &mut meshes[id];
        let color = mesh.material_id.and_then(|m| materials[m].diffuse);
        surface.color_rgb = surface.color_rgb.or(color);
        let corner = |i: u32| DVec3::from_slice(&mesh.positions[3 * i as usize..]);
        triangles_m.extend(
            mesh.indices
                .chunks_exact(3)
                .map(|t| [corner(t[0]), corner(t[1]), corner(t[2])]),
        );
    }
    meshes
}

/// A material library; refuses the colours that `tobj` would panic on.
fn read_materials(path: &Path, limits: &LoadLimits) -> tobj::MTLLoadResult {
    let text = read_text(path, limits).map_err(|_| tobj::LoadError::OpenFileFailed)?;
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let color = matches!(words.next(), Some("Ka" | "Kd" | "Ks" | "Ke"));
        if color
            && words
                .filter(|w| w.parse().is_ok_and(f64::is_finite))
                .take(3)
                .count()
                < 3
        {
            return Err(tobj::LoadError::MaterialParseError);
        }
    }
    tobj::load_mtl_buf(&mut text.as_bytes())
}

/// The name that follows the keyword of a line.
fn name_after(line: &str) -> Option<&str> {
    let (_, name) = line.trim().split_once(char::is_whitespace)?;
    Some(name.trim())
}

/// Checks line by line and passes on those that matter, without what the scene
/// does not use (normals, texture coordinates, vertex colours).
#[derive(Default)]
struct Check {
    clean: String,
    limits: LoadLimits,
    vertices: Vec<DVec3>,
    triangles: u64,
    polygon: Vec<usize>,
    materials_used: Vec<String>,
    /// Of the faces that follow: index into `materials_used`, group.
    material: Option<usize>,
    group: String,
    /// First material of each group, if it has one.
    material_of: HashMap<String, usize>,
    report: LoadReport,
}

impl Check {
    fn line(&mut self, number: usize, line: &str) -> Result<(), SceneError> {
        let mut words = line.split_whitespace();
        let Some(keyword) = words.next() else {
            return Ok(());
        };
        let values = words.take_while(|w| !w.starts_with('#'));
        match keyword {
            "v" => self.vertex(number, values)?,
            "f" => self.face(number, values)?,
            "o" | "g" => {
                name_after(line)
                    .unwrap_or(UNNAMED)
                    .clone_into(&mut self.group);
                self.pass_on(line);
            }
            "mtllib" => self.pass_on(line),
            "usemtl" => match name_after(line) {
                Some(name) => {
                    let used = self.materials_used.iter().position(|m| m == name);
                    self.material = Some(used.unwrap_or_else(|| {
                        self.materials_used.push(name.to_owned());
                        self.materials_used.len() - 1
                    }));
                    self.pass_on(line);
                }
                None => self.report.ignored_lines += 1,
            },
            "l" | "p" => self.report.points_and_lines += 1,
            // Not needed: normals follow from the winding, smoothing only changes the shading.
            "vn" | "vt" | "s" => {}
            _ if keyword.starts_with('#') => {}
            _ => self.report.ignored_lines += 1,
        }
        Ok(())
    }

    fn pass_on(&mut self, line: &str) {
        self.clean.push_str(line.trim());
        self.clean.push('\n');
    }

    fn vertex<'a>(
        &mut self,
        line: usize,
        values: impl Iterator<Item = &'a str>,
    ) -> Result<(), SceneError> {
        let malformed = || SceneError::ObjLine { line, keyword: "v" };
        let numbers: Vec<f64> = values
            .map(str::parse)
            .collect::<Result<_, _>>()
            .map_err(|_| malformed())?;
        // x y z, or with a weight, or with a colour.
        let (&[x, y, z], rest) = numbers.split_first_chunk().ok_or_else(malformed)?;
        let weight = match *rest {
            [] | [_, _, _] => 1.0,
            [w] if w != 0.0 => w,
            _ => return Err(malformed()),
        };
        let vertex = DVec3::new(x, y, z) / weight;
        if let Some(value) = vertex.to_array().into_iter().find(|c| !is_usable(*c)) {
            return Err(SceneError::ObjVertex { line, value });
        }
        self.vertices.push(vertex);
        // `{}` prints the shortest digits that read back as the same number.
        let _ = writeln!(self.clean, "v {} {} {}", vertex.x, vertex.y, vertex.z);
        Ok(())
    }

    fn face<'a>(
        &mut self,
        line: usize,
        corners: impl Iterator<Item = &'a str>,
    ) -> Result<(), SceneError> {
        let vertices = self.vertices.len();
        self.polygon.clear();
        for corner in corners {
            // Corner `v/vt/vn`: only the vertex matters.
            let index: i64 = corner
                .split('/')
                .next()
                .and_then(|v| v.parse().ok())
                .ok_or(SceneError::ObjLine { line, keyword: "f" })?;
            let from_one = if index < 0 {
                index.saturating_add(vertices as i64 + 1)
            } else {
                index
            };
            match usize::try_from(from_one) {
                Ok(v) if (1..=vertices).contains(&v) => self.polygon.push(v - 1),
                _ => {
                    return Err(SceneError::ObjIndex {
                        line,
                        index,
                        vertices,
                    });
                }
            }
        }
        if self.polygon.len() < 3 {
            self.report.points_and_lines += 1;
            return Ok(());
        }
        self.triangles += self.polygon.len() as u64 - 2;
        if self.triangles > self.limits.max_triangles {
            let (got, limit) = (self.triangles, self.limits.max_triangles);
            return Err(SceneError::TooLarge {
                what: "triangles",
                got,
                limit,
            });
        }
        if let Some(material) = self.material
            && !self.material_of.contains_key(&self.group)
        {
            self.material_of.insert(self.group.clone(), material);
        }
        self.report.concave_polygons += usize::from(self.fan_folds());
        self.clean.push('f');
        for v in &self.polygon {
            let _ = write!(self.clean, " {}", v + 1);
        }
        self.clean.push('\n');
        Ok(())
    }

    /// Does cutting the polygon as a fan from its first corner turn a triangle over?
    fn fan_folds(&self) -> bool {
        let corner = |i: usize| self.vertices[self.polygon[i]];
        let area = |i: usize| (corner(i) - corner(0)).cross(corner(i + 1) - corner(0));
        let triangles = 1..self.polygon.len() - 1;
        let whole = triangles.clone().fold(DVec3::ZERO, |sum, i| sum + area(i));
        triangles
            .clone()
            .any(|i| area(i).dot(whole) < -1e-9 * whole.length_squared())
    }
}
