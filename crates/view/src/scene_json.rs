//! The scene as the page reads it, and frames for other programs.

use crate::arm::{ViewArm, ViewCapsule, ViewJoint};
use crate::frame::{ViewFrame, ViewPrediction};
use crate::scene::{ViewScene, ViewSurface};
use crate::state::ViewState;
use data_encoding::BASE64;
use glam::{DQuat, DVec3};
use hwall::geometry::Pose;
use hwall::haptics::ObjectPath;
use serde_json::{Value, json};

/// Version of the messages: it increases when a field changes its meaning or is removed, not when one is added.
const PROTOCOL: u32 = 1;

impl ViewScene {
    /// The scene as JSON, with `"type":"scene"`: the page's first message. Surface corners are accurate to 1e-5 of the longest side.
    #[must_use]
    pub fn to_json(&self) -> String {
        let states: Vec<Value> = ViewState::ALL
            .iter()
            .map(|state| json!({ "name": state.name(), "rgb": state.rgb() }))
            .collect();
        json!({
            "type": "scene",
            "version": PROTOCOL,
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

impl ViewFrame {
    /// The frame as JSON, with `"type":"view"`, in the base frame: m, rad, s, N, quaternions as x, y, z, w. Numbers that are not finite,
    /// and absent parts, are `null`. `arm`: that of the scene, for the pose of the board.
    #[must_use]
    pub fn to_json(&self, arm: &ViewArm) -> String {
        let board = arm.poses(&self.q).last().copied().unwrap_or(Pose::IDENTITY);
        let turned = DQuat::from_mat3(&board.rotation());
        let place = |(point_m, normal): (DVec3, DVec3)| json!({ "point": vector(point_m), "normal": vector(normal) });
        let joints = self.hand.joints_m.iter().map(|at_m| at_m.map(vector));
        let hand = (!self.hand.is_lost()).then(|| joints.collect::<Vec<_>>());
        let predicted = |contact: ViewPrediction| {
            json!({
                "point": vector(contact.point_m),
                "normal": vector(contact.normal),
                "surface": contact.surface,
                "contact_s": contact.contact_s,
                "region": contact.region_m.map(|axes_m| axes_m.map(vector)),
            })
        };
        json!({
            "type": "view",
            "t": self.t_s,
            "state": self.state.name(),
            "q": self.q.0,
            "board": { "position": vector(board.position_m()), "orientation": turned.to_array() },
            "hand": hand,
            "head": self.head_m.map(vector),
            "gaze": self.gaze.map(|(from_m, to)| json!({ "origin": vector(from_m), "direction": vector(to) })),
            "predicted": self.predicted.map(predicted),
            "goal": self.goal.map(place),
            "left_s": self.left_s,
            "force": self.force_n.map(vector),
            "openings": self.openings,
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

/// Corners on a grid of 65536 steps along the longest side, as base64 of little-endian u16: a quarter of the size of decimal text.
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
            // The cast clamps values out of range, and maps NaN to zero.
            let steps = (f64::from(value - low) / step_m).round() as u16;
            bytes.extend(steps.to_le_bytes());
        }
    }
    json!({ "origin_m": low.map(f64::from), "step_m": step_m, "corners": BASE64.encode(&bytes) })
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
