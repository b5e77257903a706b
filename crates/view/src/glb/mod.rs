//! The animation as binary glTF, for Blender and other viewers.

mod animation;
mod buffer;
mod document;
mod mesh;

use crate::arm::ViewArm;
use crate::frame::ViewFrame;
use crate::hand::{HAND_BONES, HAND_JOINTS};
use crate::scene::{ViewScene, ViewSurface};
use animation::{Keys, opening_keys};
use document::{Document, Material};
use glam::{DQuat, DVec3};
use hwall::haptics::ObjectPath;
use mesh::Mesh;
use serde_json::json;

/// Keys per second.
const RATE_HZ: f64 = 10.0;
/// Radius of the joints and bones of the hand, m.
const HAND_RADIUS_M: f64 = 0.01;

/// The scene and its frames as one binary glTF 2.0 file: the room, the arm as a chain of animated nodes, the board, doors that open, the
/// hand. Ten keys per second; viewers interpolate between them. glTF is y up, so the root node rotates from z up.
///
/// The node of joint `i` is named `joint_i`, surfaces by their names, joints of the hand `hand_0` to `hand_25` in the order of OpenXR.
/// A hidden part of the hand is scaled to zero. Without frames, the file is a still of the arm at zero.
#[must_use]
pub fn glb(scene: &ViewScene, frames: &[ViewFrame]) -> Vec<u8> {
    let keys = Keys::of(frames, RATE_HZ);
    let mut document = Document::new(&scene.title, &keys);
    let mut top = Vec::new();
    let mut moving = 0;
    for surface in &scene.surfaces {
        let index = surface.path.map(|_| moving);
        moving += usize::from(index.is_some());
        top.extend(room(&mut document, surface, index, &keys));
    }
    top.push(arm(&mut document, scene, &keys));
    top.extend(hand(&mut document, &keys));
    document.finish(&top)
}

/// A surface; a moving one turns about its hinge or slides.
fn room(
    document: &mut Document,
    surface: &ViewSurface,
    moving: Option<usize>,
    keys: &Keys,
) -> Option<usize> {
    let hinge_m = match surface.path {
        Some(ObjectPath::Turning { hinge_point_m, .. }) => hinge_point_m,
        _ => DVec3::ZERO,
    };
    let mut mesh = Mesh::default();
    for corners in &surface.triangles_m {
        mesh.add_triangle(corners.map(|c| DVec3::from_array(c.map(f64::from)) - hinge_m));
    }
    let material = match (surface.kind, moving) {
        ("untouchable", _) => Material::Ground,
        (_, Some(_)) => Material::Door,
        _ => Material::Wall,
    };
    let mesh = document.mesh(&surface.name, &[(&mesh, material)])?;
    let node = json!({ "name": surface.name, "translation": hinge_m.to_array() });
    let node = document.node(node, Some(mesh));
    if let (Some(index), Some(path)) = (moving, surface.path) {
        let openings = opening_keys(keys, index);
        match path {
            ObjectPath::Turning { hinge_axis, .. } => {
                let turns = openings.map(|angle_rad| DQuat::from_axis_angle(hinge_axis, angle_rad));
                document.turns(node, turns);
            }
            ObjectPath::Sliding { direction } => {
                document.moves(node, openings.map(|way_m| direction * way_m));
            }
        }
    }
    Some(node)
}

/// The base, nested joints, and the board.
fn arm(document: &mut Document, scene: &ViewScene, keys: &Keys) -> usize {
    let arm = &scene.arm;
    let board = {
        let [w, h] = [scene.board.half_width_m, scene.board.half_height_m];
        let mut mesh = Mesh::default();
        let back_m = -scene.board.thickness_m.max(1e-3);
        mesh.add_box(DVec3::new(-w, -h, back_m), DVec3::new(w, h, 0.0));
        let mesh = document.mesh("board", &[(&mesh, Material::Board)]);
        let tool = &arm.joint_from_tool;
        let turn = tool.to_quat().to_array();
        let node = json!({ "name": "board", "translation": tool.position_m().to_array(), "rotation": turn });
        document.node(node, mesh)
    };
    let mut child = board;
    for (index, joint) in arm.joints.iter().enumerate().rev() {
        let parent = &joint.parent_from_joint;
        let node = json!({
            "name": format!("joint_{}", index + 1),
            "translation": parent.position_m().to_array(),
            "rotation": parent.to_quat().to_array(),
            "children": [child],
        });
        let mesh = pieces(document, arm, index + 1);
        child = document.node(node, mesh);
        let angles = keys
            .frames
            .iter()
            .map(|frame| frame.q.0.get(index).copied().unwrap_or(0.0));
        if joint.slides {
            let ways = angles.map(|q| parent.transform_point(joint.axis * q));
            document.moves(child, ways);
        } else {
            let turns = angles.map(|q| parent.to_quat() * DQuat::from_axis_angle(joint.axis, q));
            document.turns(child, turns);
        }
    }
    let mesh = pieces(document, arm, 0);
    document.node(json!({ "name": "base", "children": [child] }), mesh)
}

/// The capsules that move with a frame.
fn pieces(document: &mut Document, arm: &ViewArm, frame: usize) -> Option<usize> {
    let (mut links, mut housings) = (Mesh::default(), Mesh::default());
    for capsule in arm.capsules.iter().filter(|capsule| capsule.frame == frame) {
        let mesh = if capsule.housing {
            &mut housings
        } else {
            &mut links
        };
        mesh.add_capsule(capsule.from_m, capsule.to_m, capsule.radius_m);
    }
    let parts = [(&links, Material::Link), (&housings, Material::Housing)];
    document.mesh(&format!("link_{frame}"), &parts)
}

/// Joints as spheres, with bones as rods between them.
fn hand(document: &mut Document, keys: &Keys) -> Vec<usize> {
    let seen = |joint: usize| keys.frames.iter().any(|f| f.hand.joints_m[joint].is_some());
    let joints: Vec<usize> = (0..HAND_JOINTS).filter(|joint| seen(*joint)).collect();
    let mut ball = Mesh::default();
    ball.add_capsule(DVec3::ZERO, DVec3::ZERO, HAND_RADIUS_M);
    let mut rod = Mesh::default();
    // Of unit length, because a bone is scaled along z.
    rod.add_capsule(DVec3::ZERO, DVec3::Z, 0.8 * HAND_RADIUS_M);
    let mut nodes = Vec::new();
    if joints.is_empty() {
        return nodes;
    }
    let ball = document.mesh("joint of the hand", &[(&ball, Material::Skin)]);
    let rod = document.mesh("bone", &[(&rod, Material::Skin)]);
    for joint in &joints {
        let places: Vec<Option<DVec3>> = keys
            .frames
            .iter()
            .map(|f| f.hand.joints_m[*joint])
            .collect();
        let node = document.node(json!({ "name": format!("hand_{joint}") }), ball);
        document.moves(node, held(&places));
        let sizes = places
            .iter()
            .map(|m| if m.is_some() { [1.0; 3] } else { [0.0; 3] });
        document.sizes(node, sizes);
        nodes.push(node);
    }
    let few = joints.len() <= 6 && joints.contains(&0);
    let to_tips = joints
        .iter()
        .filter(|joint| **joint != 0)
        .map(|joint| [0, *joint]);
    let bones: Vec<[usize; 2]> = match few {
        true => to_tips.collect(),
        false => HAND_BONES
            .into_iter()
            .filter(|b| seen(b[0]) && seen(b[1]))
            .collect(),
    };
    for [from, to] in bones {
        let ends: Vec<Option<[DVec3; 2]>> = keys
            .frames
            .iter()
            .map(|f| Some([f.hand.joints_m[from]?, f.hand.joints_m[to]?]))
            .collect();
        let node = document.node(json!({ "name": format!("bone_{from}_{to}") }), rod);
        let starts: Vec<Option<DVec3>> = ends.iter().map(|e| e.map(|e| e[0])).collect();
        let ways: Vec<Option<DVec3>> = ends.iter().map(|e| e.map(|e| e[1] - e[0])).collect();
        document.moves(node, held(&starts));
        let turns = held(&ways)
            .map(|way_m| DQuat::from_rotation_arc(DVec3::Z, way_m.normalize_or(DVec3::Z)));
        document.turns(node, turns);
        let sizes = ways.iter().map(|way_m| match way_m {
            Some(way_m) => [1.0, 1.0, way_m.length() as f32],
            None => [0.0; 3],
        });
        document.sizes(node, sizes);
        nodes.push(node);
    }
    nodes
}

/// Absent values repeat the last one; before the first one, they repeat the first.
fn held(values: &[Option<DVec3>]) -> impl Iterator<Item = DVec3> + '_ {
    let mut last = values.iter().flatten().next().copied().unwrap_or_default();
    values.iter().map(move |value| {
        last = value.unwrap_or(last);
        last
    })
}
