//! The scene as the page reads it.

use crate::arm::{ViewCapsule, ViewJoint};
use crate::scene::{ViewScene, ViewSurface};
use crate::state::ViewState;
use glam::DVec3;
use hwall::geometry::Pose;
use hwall::haptics::ObjectPath;
use serde_json::{Value, json};

impl ViewScene {
    /// The scene as JSON, with `"type":"scene"`: the page's first message. Lengths are written to 0.1 mm.
    #[must_use]
    pub fn to_json(&self) -> String {
        let states: Vec<Value> = ViewState::ALL
            .iter()
            .map(|state| json!({ "name": state.name(), "rgb": state.rgb() }))
            .collect();
        json!({
            "type": "scene",
            "title": self.title,
            "surfaces": self.surfaces.iter().map(surface).collect::<Vec<_>>(),
            "arm": {
                "joints": self.arm.joints.iter().map(joint).collect::<Vec<_>>(),
                "capsules": self.arm.capsules.iter().map(capsule).collect::<Vec<_>>(),
                "tool": pose(&self.arm.joint_from_tool),
            },
            "board": {
                "half_m": [self.board.half_width_m, self.board.half_height_m],
                "thickness_m": self.board.thickness_m,
            },
            "states": states,
        })
        .to_string()
    }
}

fn surface(surface: &ViewSurface) -> Value {
    let corners = surface.triangles_m.iter().flatten().flatten();
    let path = surface.path.map(|path| match path {
        ObjectPath::Turning {
            hinge_point_m,
            hinge_axis,
        } => json!({ "turns_about_m": vector(hinge_point_m), "axis": vector(hinge_axis) }),
        ObjectPath::Sliding { direction } => json!({ "slides_along": vector(direction) }),
    });
    json!({
        "name": surface.name,
        "kind": surface.kind,
        "triangles_m": corners.map(|c| short(f64::from(*c))).collect::<Vec<_>>(),
        "path": path,
        "color": surface.color_rgb,
    })
}

/// To 0.1 mm: fewer digits in the file.
fn short(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

fn joint(joint: &ViewJoint) -> Value {
    json!({
        "parent": pose(&joint.parent_from_joint),
        "axis": vector(joint.axis),
        "slides": joint.slides,
        "limit": [joint.limit.min_rad, joint.limit.max_rad],
    })
}

fn capsule(capsule: &ViewCapsule) -> Value {
    json!({
        "frame": capsule.frame,
        "from_m": vector(capsule.from_m),
        "to_m": vector(capsule.to_m),
        "radius_m": capsule.radius_m,
        "housing": capsule.housing,
    })
}

/// Position, and rotation by columns.
fn pose(pose: &Pose) -> Value {
    json!({
        "position_m": vector(pose.position_m()),
        "rotation": pose.rotation().to_cols_array(),
    })
}

fn vector(v: DVec3) -> [f64; 3] {
    v.to_array()
}
