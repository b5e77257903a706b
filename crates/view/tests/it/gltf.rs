//! The glTF file: its structure, and that it moves like the arm.

use crate::common::{self, frames, scene};
use glam::{DMat4, DQuat, DVec3};
use hwall_view::{ViewFrame, ViewHand, glb};
use serde_json::Value;

/// The JSON and binary parts.
fn parts(file: &[u8]) -> (Value, Vec<u8>) {
    let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!(&file[..4], b"glTF");
    assert_eq!((word(4), word(8)), (2, file.len()));
    let json_length = word(12);
    assert_eq!(&file[16..20], b"JSON");
    let json = serde_json::from_slice(&file[20..20 + json_length]).unwrap();
    let at = 20 + json_length;
    assert_eq!((json_length % 4, word(at) % 4), (0, 0));
    assert_eq!(&file[at + 4..at + 8], b"BIN\0");
    assert_eq!(at + 8 + word(at), file.len());
    (json, file[at + 8..].to_vec())
}

fn index(value: &Value) -> usize {
    value.as_u64().unwrap() as usize
}

/// Numbers in a row of an accessor.
fn width(accessor: &Value) -> usize {
    match accessor["type"].as_str().unwrap() {
        "SCALAR" => 1,
        "VEC3" => 3,
        "VEC4" => 4,
        other => panic!("{other}"),
    }
}

/// Rows of an accessor of floats.
fn floats(json: &Value, bytes: &[u8], accessor: usize) -> Vec<Vec<f64>> {
    let accessor = &json["accessors"][accessor];
    let view = &json["bufferViews"][index(&accessor["bufferView"])];
    let start = index(&view["byteOffset"]);
    let words = bytes[start..start + index(&view["byteLength"])].chunks(4);
    let values = words.map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap())));
    let values: Vec<f64> = values.collect();
    let rows = values.chunks(width(accessor));
    rows.map(<[f64]>::to_vec).collect()
}

#[test]
fn accessors_lie_within_the_buffer_and_say_their_extremes() {
    let (json, bytes) = parts(&glb(&scene(), &frames(3.0)));
    assert!(index(&json["buffers"][0]["byteLength"]) <= bytes.len());
    let views = json["bufferViews"].as_array().unwrap();
    for (i, accessor) in json["accessors"].as_array().unwrap().iter().enumerate() {
        let view = &views[index(&accessor["bufferView"])];
        let (start, length) = (index(&view["byteOffset"]), index(&view["byteLength"]));
        assert!(start % 4 == 0 && start + length <= bytes.len());
        let width = width(accessor);
        assert_eq!(length, 4 * width * index(&accessor["count"]));
        if accessor["componentType"] == 5126 {
            let rows = floats(&json, &bytes, i);
            for k in 0..width {
                let values = rows.iter().map(|row| row[k]);
                let low = values.clone().fold(f64::INFINITY, f64::min);
                assert_eq!(accessor["min"][k], low);
                assert_eq!(accessor["max"][k], values.fold(f64::NEG_INFINITY, f64::max));
            }
        }
    }
    for mesh in json["meshes"].as_array().unwrap() {
        for primitive in mesh["primitives"].as_array().unwrap() {
            let [corners, normals, indices] = [
                &primitive["attributes"]["POSITION"],
                &primitive["attributes"]["NORMAL"],
                &primitive["indices"],
            ]
            .map(|of| &json["accessors"][index(of)]);
            assert_eq!(corners["count"], normals["count"]);
            assert!(index(&indices["max"][0]) < index(&corners["count"]));
            assert_eq!(index(&indices["count"]) % 3, 0);
        }
    }
    let times = index(&json["animations"][0]["samplers"][0]["input"]);
    let times_s = floats(&json, &bytes, times);
    assert!(times_s.windows(2).all(|pair| pair[0][0] < pair[1][0]));
    assert_eq!(times_s[0][0], 0.0);
}

/// Pose of a node in the scene at a key of the animation, z up again.
fn placed(json: &Value, bytes: &[u8], name: &str, key: usize) -> DMat4 {
    let nodes = json["nodes"].as_array().unwrap();
    let local = |i: usize| {
        let channels = json["animations"][0]["channels"].as_array().unwrap();
        let value = |path: &str, fallback: &[f64]| -> Vec<f64> {
            let channel = channels
                .iter()
                .find(|c| index(&c["target"]["node"]) == i && c["target"]["path"] == path);
            if let Some(channel) = channel {
                let sampler = &json["animations"][0]["samplers"][index(&channel["sampler"])];
                return floats(json, bytes, index(&sampler["output"]))[key].clone();
            }
            let value = nodes[i].get(path).cloned();
            value.map_or(fallback.to_vec(), |v| serde_json::from_value(v).unwrap())
        };
        let t = value("translation", &[0.0; 3]);
        let r = value("rotation", &[0.0, 0.0, 0.0, 1.0]);
        let s = value("scale", &[1.0; 3]);
        DMat4::from_scale_rotation_translation(
            DVec3::from_slice(&s),
            DQuat::from_slice(&r).normalize(),
            DVec3::from_slice(&t),
        )
    };
    let mut at = nodes.iter().position(|node| node["name"] == name).unwrap();
    let mut place = local(at);
    let has = |node: &Value, child: usize| {
        node["children"]
            .as_array()
            .is_some_and(|c| c.iter().any(|v| index(v) == child))
    };
    while let Some(parent) = nodes.iter().position(|node| has(node, at)) {
        place = local(parent) * place;
        at = parent;
    }
    // From y up back to z up.
    DMat4::from_rotation_x(std::f64::consts::FRAC_PI_2) * place
}

#[test]
fn board_hand_and_doors_are_where_the_frames_have_them() {
    let (scene, frames) = (scene(), frames(3.0));
    let (json, bytes) = parts(&glb(&scene, &frames));
    // One key for every three frames.
    for key in [0, 7, 20] {
        let frame = &frames[3 * key];
        let tool = *scene.arm.poses(&frame.q).last().unwrap();
        let board = placed(&json, &bytes, "board", key);
        let (at, normal) = (board.w_axis.truncate(), board.z_axis.truncate());
        assert!(at.distance(tool.position_m()) < 1e-5);
        assert!(normal.distance(tool.rotation().z_axis) < 1e-5);
        let tip = placed(&json, &bytes, "hand_10", key).transform_point3(DVec3::ZERO);
        assert!(tip.distance(frame.hand.joints_m[10].unwrap()) < 1e-5);
        let bone = placed(&json, &bytes, "bone_9_10", key);
        assert!(bone.transform_point3(DVec3::Z).distance(tip) < 1e-5);
        // The far edge of the door, 0.8 m from its hinge.
        let opening = frame.openings[0];
        let edge = placed(&json, &bytes, "door", key).transform_point3(DVec3::Y * 0.8);
        let expected = DVec3::new(0.6 - 0.8 * opening.sin(), 1.0 + 0.8 * opening.cos(), 0.0);
        assert!(edge.distance(expected) < 1e-5, "{edge} {expected}");
        let drawer = placed(&json, &bytes, "drawer", key).transform_point3(DVec3::ZERO);
        assert!((drawer.x - frame.openings[1]).abs() < 1e-6);
    }
}

#[test]
fn a_hand_that_is_lost_is_scaled_to_nothing() {
    let mut frames = frames(2.0);
    for frame in &mut frames[15..30] {
        frame.hand = ViewHand::LOST;
    }
    let (json, bytes) = parts(&glb(&scene(), &frames));
    let size = |key: usize| placed(&json, &bytes, "hand_10", key).x_axis.length();
    assert!(size(2) > 0.99 && size(7) == 0.0 && size(12) > 0.99);
}

#[test]
fn without_frames_or_with_bad_ones_it_is_a_still() {
    let mut bad = common::full_frame(1.0);
    bad.q.0[0] = f64::NAN;
    let mut timeless = common::full_frame(1.0);
    timeless.t_s = f64::NAN;
    for frames in [Vec::<ViewFrame>::new(), vec![bad, timeless]] {
        let (json, _) = parts(&glb(&scene(), &frames));
        assert!(json.get("animations").is_none());
        assert!(json["nodes"].as_array().unwrap().len() > 8);
    }
}
