//! A scene's file, the unit and axes of its coordinates, and a check of their plausibility.

use super::numbers::positive;
use glam::DVec3;
use hwall_scene::{FileFrame, Scene, SurfaceId, VERTICAL_TOLERANCE_RAD};
use std::path::{Path, PathBuf};

/// Which scene, as flags.
#[derive(Debug, Clone, clap::Args)]
pub struct SceneFlags {
    /// OBJ scene, z up, metres, in the frame of the arm's base unless the base is placed; a sidecar of the same name with .toml describes
    /// the surfaces [default: the built-in room]
    #[arg(long)]
    pub scene: Option<PathBuf>,
    /// Metres in one unit of the OBJ: 0.01 for centimetres, 0.001 for millimetres
    #[arg(long, requires = "scene", default_value_t = 1.0, allow_negative_numbers = true, value_parser = positive)]
    pub scale: f64,
    /// Which axis of the OBJ points up; with y the file's -z becomes x, as with the axes of headsets
    #[arg(long, requires = "scene", default_value = "z", value_parser = ["y", "z"])]
    pub up: String,
}

impl SceneFlags {
    /// `None`: the built-in room.
    #[must_use]
    pub fn file(&self) -> Option<SceneFile<'_>> {
        let frame = FileFrame {
            metres_per_unit: self.scale,
            y_up: self.up == "y",
        };
        let path = self.scene.as_deref()?;
        Some(SceneFile { path, frame })
    }
}

/// A scene's file, and how to read it.
#[derive(Debug, Clone, Copy)]
pub struct SceneFile<'a> {
    /// The OBJ.
    pub path: &'a Path,
    /// Unit and axes of its coordinates.
    pub frame: FileFrame,
}

impl<'a> From<&'a Path> for SceneFile<'a> {
    fn from(path: &'a Path) -> Self {
        Self {
            path,
            frame: FileFrame::default(),
        }
    }
}

/// Extents of a scene without reachable points, with the likely unit and axes.
#[must_use]
pub fn looks_like(scene: &Scene) -> String {
    let bounds = scene.bounds();
    let size = bounds.max_m - bounds.min_m;
    let mut text = format!(
        "the scene measures {:.2} x {:.2} x {:.2} m along x, y and z",
        size.x, size.y, size.z
    );
    if let Some(hint) = unit_hint(scene) {
        text += &format!("; {hint}");
    }
    if is_y_up(scene, size) {
        text += "; looks y-up: --up y";
    }
    text
}

/// Hint for a scene that is far too high for metres: its likely unit.
#[must_use]
pub fn unit_hint(scene: &Scene) -> Option<String> {
    let bounds = scene.bounds();
    let size = bounds.max_m - bounds.min_m;
    let height = if is_y_up(scene, size) { size.y } else { size.z };
    // Heights of rooms and halls, m: fits at most one unit.
    let fits = |(scale, _): &(f64, &str)| (1.0..10.0).contains(&(height * scale));
    let (scale, name) = [(0.01, "centimetres"), (0.001, "millimetres")]
        .into_iter()
        .find(fits)?;
    Some(format!("looks like {name}: --scale {scale}"))
}

/// Rooms are lower than wide, and floor and ceiling have the largest area along one axis. Or no face is upright, but would be with y up.
fn is_y_up(scene: &Scene, size: DVec3) -> bool {
    let surfaces = (0..scene.surfaces().len()).map(SurfaceId);
    let triangles = surfaces
        .filter_map(|id| scene.triangles_m(id).ok())
        .flatten();
    // Twice the area projected along each axis.
    let seen = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).abs();
    let area = triangles.map(seen).sum::<DVec3>();
    let is_lowest = size.y < size.x.min(size.z);
    let is_room = is_lowest && area.y > area.x.max(area.z) && area.x.min(area.z) > 0.0;
    is_room || area.x + area.y < VERTICAL_TOLERANCE_RAD * area.z
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A room of 4 x 5 x 2.5 m with transformed corners.
    fn room(corner: impl Fn(DVec3) -> DVec3) -> Scene {
        let mut obj = String::new();
        for k in 0..8 {
            let bit = |n: u32| f64::from(k >> n & 1);
            let p = corner(DVec3::new(4.0 * bit(0), 5.0 * bit(1), 2.5 * bit(2)));
            obj += &format!("v {} {} {}\n", p.x, p.y, p.z);
        }
        obj += "f 1 2 4 3\nf 5 6 8 7\nf 1 2 6 5\nf 3 4 8 7\nf 1 3 7 5\nf 2 4 8 6\n";
        Scene::from_obj_str(&obj, None).unwrap().0
    }

    #[test]
    fn units_and_axes_show_in_the_extents() {
        let y_up = |p: DVec3| DVec3::new(p.x, p.z, p.y);
        for (scene, hints) in [
            (room(|p| p), [false; 3]),
            (room(|p| 100.0 * p), [true, false, false]),
            (room(|p| 1000.0 * p), [false, true, false]),
            (room(y_up), [false, false, true]),
            (room(|p| 100.0 * y_up(p)), [true, false, true]),
        ] {
            let said = looks_like(&scene);
            let flags = ["--scale 0.01", "--scale 0.001", "--up y"];
            let found = flags.map(|flag| said.split("; ").any(|s| s.ends_with(flag)));
            assert_eq!(found, hints, "{said}");
        }
        assert!(looks_like(&room(|p| 100.0 * p)).contains("400.00 x 500.00 x 250.00 m"));
        // A single wall is not a floor, whatever it faces; a flat one is not a wall.
        let wall = |obj: &str| looks_like(&Scene::from_obj_str(obj, None).unwrap().0);
        assert!(!wall("v 0 1 0\nv 1 1 0\nv 0 1 2\nf 1 2 3\n").contains("--up"));
        assert!(wall("v 0 0 1\nv 1 0 1\nv 0 2 1\nf 1 2 3\n").contains("--up y"));
    }
}
