//! A file that describes the obstacles around the arm.

use crate::console::note;
use anyhow::{Context, bail, ensure};
use glam::DVec3;
use hwall::geometry::Pose;
use hwall::haptics::body::{Obstacle, Room};
use hwall_scene::{LoadLimits, read_text};
use serde::Deserialize;
use std::path::Path;

/// The real room, and its source text, which a recording stores.
#[derive(Debug, Clone)]
pub struct RealRoom {
    /// Obstacles for all parts of the arm.
    pub room: Room,
    /// Source text.
    pub text: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    plane: Vec<PlaneEntry>,
    #[serde(default, rename = "box")]
    boxes: Vec<BoxEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaneEntry {
    point_m: [f64; 3],
    normal: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BoxEntry {
    middle_m: [f64; 3],
    size_m: [f64; 3],
    #[serde(default)]
    yaw_deg: f64,
}

impl RealRoom {
    /// From a TOML file: `[[plane]]` for floors, ceilings and walls (`point_m`, `normal` towards the arm), `[[box]]` for everything else
    /// (`middle_m`, `size_m`, `yaw_deg`). In the arm's base frame, z up.
    ///
    /// # Errors
    /// A file that cannot be read, an entry that is malformed, more than 16 of them, none at all.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let shown = || path.display().to_string();
        Self::parse(read_text(path, &LoadLimits::default())?).with_context(shown)
    }

    /// From its text.
    ///
    /// # Errors
    /// As for [`read`](Self::read).
    pub fn parse(text: String) -> anyhow::Result<Self> {
        let File { plane, boxes } = toml::from_str(&text)?;
        if !plane.iter().any(|plane| plane.normal[2] > 0.0) {
            note("no [[plane]] of the room faces up: nothing keeps the arm off the floor");
        }
        let mut obstacles = Vec::new();
        for (number, PlaneEntry { point_m, normal }) in (1..).zip(plane) {
            let made = Obstacle::half_space(point_m.into(), normal.into());
            obstacles.push(made.with_context(|| format!("plane {number}"))?);
        }
        for (number, entry) in (1..).zip(boxes) {
            let made = || -> anyhow::Result<Obstacle> {
                let size_m = DVec3::from(entry.size_m);
                ensure!(
                    size_m.is_finite() && size_m.min_element() > 0.0,
                    "size_m is {size_m} m; all three must be positive"
                );
                let pose = Pose::from_yaw(entry.yaw_deg.to_radians(), entry.middle_m.into())?;
                Ok(Obstacle::cuboid(pose, 0.5 * size_m)?)
            };
            obstacles.push(made().with_context(|| format!("box {number}"))?);
        }
        if obstacles.is_empty() {
            bail!("the room is empty: give at least the floor, as a [[plane]]");
        }
        let room = Room::new(&obstacles)?;
        Ok(Self { room, text })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_and_boxes_are_read_in_their_order() {
        let text = "[[box]]\nmiddle_m = [1, 0, 0.2]\nsize_m = [0.4, 0.2, 0.4]\nyaw_deg = 90\n\
                    [[plane]]\npoint_m = [0, 0, -0.6]\nnormal = [0, 0, 2]\n";
        let read = RealRoom::parse(text.to_owned()).unwrap();
        let floor = Obstacle::half_space(-0.6 * DVec3::Z, DVec3::Z).unwrap();
        assert_eq!(read.room.obstacles().len(), 2);
        assert_eq!(read.room.obstacles()[0], floor);
        assert_eq!(read.text, text);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let said = |text: &str| format!("{:#}", RealRoom::parse(text.to_owned()).unwrap_err());
        let plane = "[[plane]]\npoint_m = [0, 0, 0]\nnormal = [0, 0, 0]\n";
        assert!(said(plane).starts_with("plane 1: "), "{}", said(plane));
        for (text, word) in [
            ("", "floor"),
            ("[[plane]]\npoint_m = [0, 0, 0]\n", "normal"),
            ("[[table]]\n", "table"),
        ] {
            assert!(said(text).contains(word), "{}", said(text));
        }
        for (middle, size, word) in [
            ("0, 0, 0", "1, 0, 1", "box 1: "),
            ("1, 0, 0", "1, -0.56, 1", "box 1: size_m is [1, -0.56, 1] m"),
            ("nan, 0, 0", "1, 1, 1", "box 1"),
        ] {
            let said = said(&format!(
                "[[box]]\nmiddle_m = [{middle}]\nsize_m = [{size}]\n"
            ));
            assert!(said.contains(word), "{said}");
        }
    }
}
