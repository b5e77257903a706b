//! The scene as the page reads it.

use crate::arm::{ViewCapsule, ViewJoint};
use crate::page::push_base64;
use crate::scene::{ViewScene, ViewSurface};
use crate::state::ViewState;
use glam::DVec3;
use hwall::geometry::Pose;
use hwall::haptics::ObjectPath;
use serde_json::{Value, json};

impl ViewScene {
    /// The scene as JSON, with `"type":"scene"`: the page's first message. Surfaces are written
    /// to within 1e-5 of their longest side.
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
            "base_from_headset": pose(&self.base_from_headset),
            "states": states,
        })
        .to_string()
    }
}

fn surface(surface: &ViewSurface) -> Value {
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
        "triangles": triangles(&surface.triangles_m),
        "path": path,
        "color": surface.color_rgb,
    })
}

/// Corners on a grid of 65536 steps along the longest side, as base64 of little-endian u16: a quarter of the text that numbers
/// would take.
fn triangles(triangles_m: &[[[f32; 3]; 3]]) -> Value {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for corner in triangles_m.iter().flatten() {
        for i in 0..3 {
            low[i] = low[i].min(corner[i]);
            high[i] = high[i].max(corner[i]);
        }
    }
    let longest_m = (0..3).fold(0.0, |m: f32, i| m.max(high[i] - low[i]));
    let step_m = f64::from(longest_m.max(1e-3)) / 65535.0;
    let mut bytes = Vec::with_capacity(triangles_m.len() * 18);
    for corner in triangles_m.iter().flatten() {
        for (value, low) in corner.iter().zip(low) {
            // The cast keeps what is out of range at its ends, and NaN at zero.
            let steps = (f64::from(value - low) / step_m).round() as u16;
            bytes.extend(steps.to_le_bytes());
        }
    }
    let mut corners = String::new();
    push_base64(&bytes, &mut corners);
    json!({ "origin_m": low.map(f64::from), "step_m": step_m, "corners": corners })
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
