//! Meshes as STL and OBJ files.

use super::triangle_mesh::TriangleMesh;
use crate::error::{Result, TextonError};
use hwall_files::NewFile;
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, BufReader, Write};
use std::path::Path;

/// The two kinds of STL.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum StlFormat {
    /// 50 bytes per triangle.
    #[default]
    Binary,
    /// Text, five times as large.
    Ascii,
}

impl TriangleMesh {
    /// Writes an STL file, mm, in single precision, with the normals of the rounded triangles.
    ///
    /// A solid mesh is solid again after points with equal coordinates are merged. A mesh whose points would coincide
    /// in single precision is refused.
    ///
    /// # Errors
    /// Points or triangles that vanish in single precision; a file that cannot be written.
    pub fn write_stl(&self, path: impl AsRef<Path>, format: StlFormat) -> Result<()> {
        let path = path.as_ref();
        let triangles = self.single_precision()?;
        let write = || {
            let mut file = NewFile::create(path)?;
            match format {
                StlFormat::Binary => write_binary(&mut file, &triangles)?,
                StlFormat::Ascii => write_ascii(&mut file, &triangles)?,
            }
            file.finish()
        };
        write().map_err(|error: io::Error| TextonError::io(path, &error))
    }

    /// Reads an STL file of either kind; points with equal coordinates are merged.
    ///
    /// # Errors
    /// A file that cannot be read or is not STL; coordinates that are not finite.
    pub fn read_stl(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let read = File::open(path).and_then(|file| stl_io::read_stl(&mut BufReader::new(file)));
        let mesh = read.map_err(|error| TextonError::io(path, &error))?;
        let points = mesh.vertices.iter().map(|v| v.0.map(f64::from));
        let triangles = mesh.faces.iter().map(|f| f.vertices.map(|i| i as u32));
        Self::new(points.collect(), triangles.collect())
    }

    /// Writes an OBJ file with shared points, mm, in the fewest digits that read back exactly.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_obj(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        let write = || {
            let mut file = NewFile::create(path)?;
            writeln!(file, "# millimetres")?;
            for [x, y, z] in self.points_mm() {
                writeln!(file, "v {x} {y} {z}")?;
            }
            for triangle in self.triangles() {
                // OBJ counts from 1.
                let [a, b, c] = triangle.map(|i| u64::from(i) + 1);
                writeln!(file, "f {a} {b} {c}")?;
            }
            file.finish()
        };
        write().map_err(|error: io::Error| TextonError::io(path, &error))
    }

    /// Corners in single precision, unless points or triangles vanish in it.
    fn single_precision(&self) -> Result<Vec<[[f32; 3]; 3]>> {
        // Adding zero removes negative zeros: readers that compare bits treat them as different numbers.
        let points: Vec<[f32; 3]> = self
            .points_mm()
            .iter()
            .map(|p| p.map(|x| x as f32 + 0.0))
            .collect();
        let mut first: HashMap<[u32; 3], u32> = HashMap::with_capacity(points.len());
        let mut count = points
            .iter()
            .filter(|p| {
                let met = first.entry(p.map(f32::to_bits)).or_default();
                *met += 1;
                *met > 1
            })
            .count();
        let triangles: Vec<[[f32; 3]; 3]> = self
            .triangles()
            .iter()
            .map(|t| t.map(|i| points[i as usize]))
            .collect();
        count += triangles.iter().filter(|t| normal(t) == [0.0; 3]).count();
        if count > 0 {
            return Err(TextonError::SinglePrecision { count });
        }
        Ok(triangles)
    }
}

/// Unit normal; zero for a triangle without area.
fn normal(triangle: &[[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = triangle.map(|p| glam::DVec3::from_array(p.map(f64::from)));
    let normal = (b - a).cross(c - a).normalize_or_zero();
    normal.to_array().map(|x| x as f32)
}

fn write_binary(file: &mut impl Write, triangles: &[[[f32; 3]; 3]]) -> io::Result<()> {
    let mut header = [0_u8; 80];
    // Must not begin with "solid", which marks a text file.
    let title = b"hwall-texton, millimetres";
    header[..title.len()].copy_from_slice(title);
    file.write_all(&header)?;
    let count = u32::try_from(triangles.len()).map_err(io::Error::other)?;
    file.write_all(&count.to_le_bytes())?;
    for triangle in triangles {
        let mut record = [0_u8; 50];
        let numbers = normal(triangle)
            .into_iter()
            .chain(triangle.iter().flatten().copied());
        for (bytes, number) in record.chunks_exact_mut(4).zip(numbers) {
            bytes.copy_from_slice(&number.to_le_bytes());
        }
        file.write_all(&record)?;
    }
    Ok(())
}

fn write_ascii(file: &mut impl Write, triangles: &[[[f32; 3]; 3]]) -> io::Result<()> {
    writeln!(file, "solid hwall-texton")?;
    for triangle in triangles {
        let [x, y, z] = normal(triangle);
        writeln!(file, "facet normal {x:e} {y:e} {z:e}\n outer loop")?;
        for [x, y, z] in triangle {
            writeln!(file, "  vertex {x:e} {y:e} {z:e}")?;
        }
        writeln!(file, " endloop\nendfacet")?;
    }
    writeln!(file, "endsolid hwall-texton")
}
