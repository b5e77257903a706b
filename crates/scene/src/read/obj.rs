//! Wavefront OBJ, line by line: geometry, groups and the names of materials. Material libraries are read by `tobj`.

use super::materials::Libraries;
use super::mesh::{LoadReport, SurfaceMesh};
use super::text::{BYTE_ORDER_MARK, LoadLimits};
use crate::error::{Result, SceneError, at_most};
use crate::part::triangle::is_usable;
use crate::surface::Surface;
use glam::DVec3;
use std::collections::HashMap;
use std::path::Path;

/// Surface name of faces outside all groups, as in `tobj`.
pub const UNNAMED: &str = "unnamed_object";

/// Groups of the OBJ as surfaces, in the order of their first face; material libraries are searched in `directory`.
pub(crate) fn parse(
    text: &str,
    directory: Option<&Path>,
    limits: &LoadLimits,
) -> Result<(Vec<SurfaceMesh>, LoadReport)> {
    at_most(limits.max_bytes, "bytes", text.len() as u64)?;
    let mut check = Check {
        limits: *limits,
        libraries: Libraries::new(directory),
        ..Check::default()
    };
    // A backslash at the end of a line continues it; `tobj` does not support that.
    let mut joined = String::new();
    let text = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
    let line_end = if text.contains('\n') { '\n' } else { '\r' };
    let lines = || {
        text.split(line_end)
            .map(|line| line.strip_suffix('\r').unwrap_or(line))
    };
    for (i, line) in lines().enumerate() {
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
        check.line(lines().count(), &joined)?;
    }
    Ok(check.finish())
}

/// The name that follows the keyword of a line.
fn name_after(line: &str) -> Option<&str> {
    let (_, name) = line.trim().split_once(char::is_whitespace)?;
    Some(name.trim())
}

/// Reads line by line, ignoring data that the scene does not use (normals, texture coordinates, vertex colours).
#[derive(Default)]
struct Check<'a> {
    limits: LoadLimits,
    libraries: Libraries<'a>,
    vertices: Vec<DVec3>,
    triangles: u64,
    polygon: Vec<usize>,
    /// Names of materials in the order of their first use, and their index.
    materials_used: Vec<String>,
    place_of_material: HashMap<String, usize>,
    /// Material (index into `materials_used`) and group name of the faces that follow.
    material: Option<usize>,
    group: Option<String>,
    /// Index of the current group's mesh in `groups`, once it has a face.
    open: Option<usize>,
    groups: Vec<Group>,
    place_of_group: HashMap<String, usize>,
    report: LoadReport,
}

/// All faces of one group name, even if the group or material changes in between.
struct Group {
    mesh: SurfaceMesh,
    /// Indices into `materials_used`, in face order, without consecutive repetitions.
    materials: Vec<usize>,
}

impl Check<'_> {
    fn line(&mut self, number: usize, line: &str) -> Result<()> {
        let mut words = line.split_whitespace();
        let Some(keyword) = words.next() else {
            return Ok(());
        };
        let values = words.take_while(|w| !w.starts_with('#'));
        match keyword {
            "v" => self.vertex(number, values)?,
            "f" => self.face(number, values)?,
            "o" | "g" => {
                self.group = name_after(line).map(str::to_owned);
                self.open = None;
            }
            "mtllib" => {
                if let Some(name) = name_after(line) {
                    self.libraries.read_all(name, &self.limits);
                }
            }
            "usemtl" => match name_after(line) {
                Some(name) => self.material = Some(self.place_of(name)),
                None => self.report.ignored_lines += 1,
            },
            "l" | "p" => self.report.points_and_lines += 1,
            // Not needed: normals follow from the winding, and smoothing only affects shading.
            "vn" | "vt" | "s" => {}
            _ if keyword.starts_with('#') => {}
            _ => self.report.ignored_lines += 1,
        }
        Ok(())
    }

    /// Index of a material's name.
    fn place_of(&mut self, name: &str) -> usize {
        if let Some(&place) = self.place_of_material.get(name) {
            return place;
        }
        let place = self.materials_used.len();
        self.materials_used.push(name.to_owned());
        self.place_of_material.insert(name.to_owned(), place);
        place
    }

    /// The group that a face belongs to.
    fn group(&mut self) -> &mut Group {
        let place = match self.open {
            Some(place) => place,
            None => {
                let name = self.group.as_deref().unwrap_or(UNNAMED);
                let next = self.groups.len();
                let place = *self.place_of_group.entry(name.to_owned()).or_insert(next);
                if place == next {
                    let surface = Surface {
                        name: name.to_owned(),
                        ..Surface::default()
                    };
                    self.groups.push(Group {
                        mesh: SurfaceMesh {
                            surface,
                            triangles_m: Vec::new(),
                        },
                        materials: Vec::new(),
                    });
                }
                self.open = Some(place);
                place
            }
        };
        &mut self.groups[place]
    }

    /// Assigns colours and materials to the surfaces and reports missing ones.
    fn finish(self) -> (Vec<SurfaceMesh>, LoadReport) {
        let Self {
            groups,
            materials_used,
            libraries,
            mut report,
            ..
        } = self;
        let Libraries {
            colors, missing, ..
        } = libraries;
        report.missing_material_libraries = missing;
        report.missing_materials = materials_used
            .iter()
            .filter(|used| !colors.contains_key(*used))
            .cloned()
            .collect();
        let mesh = |group: Group| {
            let mut mesh = group.mesh;
            let names = || group.materials.iter().map(|&place| &materials_used[place]);
            mesh.surface.material = names().next().cloned();
            mesh.surface.color_rgb = names().find_map(|name| *colors.get(name)?);
            mesh
        };
        (groups.into_iter().map(mesh).collect(), report)
    }

    fn vertex<'a>(&mut self, line: usize, values: impl Iterator<Item = &'a str>) -> Result<()> {
        let malformed = || SceneError::ObjLine { line, keyword: "v" };
        let numbers: Vec<f64> = values
            .map(str::parse)
            .collect::<Result<_, _>>()
            .map_err(|_| malformed())?;
        // x y z, optionally with a weight or a colour; scanners add opacity to the colour.
        let (&[x, y, z], rest) = numbers.split_first_chunk().ok_or_else(malformed)?;
        let weight = match *rest {
            [] | [_, _, _] | [_, _, _, _] => 1.0,
            [w] if w != 0.0 => w,
            _ => return Err(malformed()),
        };
        let vertex = DVec3::new(x, y, z) / weight;
        if let Some(value) = vertex.to_array().into_iter().find(|c| !is_usable(*c)) {
            return Err(SceneError::ObjVertex { line, value });
        }
        self.vertices.push(vertex);
        Ok(())
    }

    fn face<'a>(&mut self, line: usize, corners: impl Iterator<Item = &'a str>) -> Result<()> {
        let vertices = self.vertices.len();
        self.polygon.clear();
        for corner in corners {
            // Corner `v/vt/vn`: only the vertex is used.
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
        at_most(self.limits.max_triangles, "triangles", self.triangles)?;
        let cut = match self.fan_folds() {
            true => self.ears(),
            false => None,
        };
        let material = self.material;
        // Take and put back: the group borrows everything else.
        let (polygon, vertices) = (
            std::mem::take(&mut self.polygon),
            std::mem::take(&mut self.vertices),
        );
        let group = self.group();
        if let Some(material) = material
            && group.materials.last() != Some(&material)
        {
            group.materials.push(material);
        }
        let corner = |i: usize| vertices[polygon[i]];
        let triangles_m = &mut group.mesh.triangles_m;
        match cut {
            Some(ears) => triangles_m.extend(ears.into_iter().map(|ear| ear.map(corner))),
            None => {
                let fan = (1..polygon.len() - 1).map(|i| [0, i, i + 1].map(corner));
                triangles_m.extend(fan);
            }
        }
        (self.polygon, self.vertices) = (polygon, vertices);
        Ok(())
    }

    /// Ear clipping of the polygon: corners as indices into it. Bridges to holes, which visit two corners twice, are treated like any
    /// other edge. `None` for a polygon that crosses itself so that no ear is left, or has too many corners; it is then counted in
    /// the report.
    fn ears(&mut self) -> Option<Vec<[usize; 3]>> {
        let corners: Vec<DVec3> = self.polygon.iter().map(|&v| self.vertices[v]).collect();
        let ears = (corners.len() <= MOST_CORNERS).then(|| ears(&corners));
        let ears = ears.flatten();
        self.report.concave_polygons += usize::from(ears.is_none());
        ears
    }

    /// True if a fan from the first corner would flip a triangle.
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

/// Ear clipping takes time proportional to the cube of the corner count.
const MOST_CORNERS: usize = 256;

/// Triangulates a flat polygon by ear clipping, keeping the winding; `None` if it crosses itself so that no ear is left.
fn ears(corners: &[DVec3]) -> Option<Vec<[usize; 3]>> {
    let pairs = corners.iter().zip(corners.iter().cycle().skip(1));
    let normal: DVec3 = pairs
        .map(|(a, b)| (*a - corners[0]).cross(*b - corners[0]))
        .sum();
    // Twice the area of a triangle, positive if it has the winding of the polygon.
    let area = |[a, b, c]: [usize; 3]| {
        let [a, b, c] = [a, b, c].map(|i| corners[i]);
        (b - a).cross(c - a).dot(normal)
    };
    let rounding = 1e-12 * normal.length_squared();
    let is_inside = |ear: [usize; 3], point: usize| {
        let [a, b, c] = ear;
        let is_corner = ear.iter().any(|i| corners[*i] == corners[point]);
        let sides = [[a, b, point], [b, c, point], [c, a, point]];
        !is_corner && sides.into_iter().all(|side| area(side) >= -rounding)
    };
    let mut left: Vec<usize> = (0..corners.len()).collect();
    let mut cut = Vec::with_capacity(corners.len() - 2);
    while left.len() > 3 {
        let count = left.len();
        let ear_at = |k: usize| {
            [
                left[(k + count - 1) % count],
                left[k],
                left[(k + 1) % count],
            ]
        };
        let is_ear = |k: &usize| {
            let ear = ear_at(*k);
            // A corner collinear with its neighbours is clipped without area.
            let is_flat = area(ear).abs() <= rounding;
            let others = left.iter().filter(|point| !ear.contains(point));
            is_flat || area(ear) > 0.0 && !others.into_iter().any(|point| is_inside(ear, *point))
        };
        let k = (0..count).find(is_ear)?;
        cut.push(ear_at(k));
        left.remove(k);
    }
    cut.push([left[0], left[1], left[2]]);
    Some(cut)
}
