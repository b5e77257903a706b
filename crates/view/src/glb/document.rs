//! The JSON part of a glTF file, and how both parts become one file.

use super::animation::Keys;
use super::buffer::{Buffer, Use};
use super::mesh::Mesh;
use glam::{DQuat, DVec3, Quat};
use serde_json::{Value, json};

/// Materials, by their index in the document.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Material {
    Link,
    Housing,
    Board,
    Skin,
    Wall,
    Door,
    Ground,
}

/// All materials in order, with red, green, blue, opacity.
const MATERIALS: [(Material, [f64; 4]); 7] = [
    (Material::Link, [0.86, 0.88, 0.90, 1.0]),
    (Material::Housing, [0.95, 0.38, 0.05, 1.0]),
    (Material::Board, [0.0, 0.36, 0.18, 1.0]),
    (Material::Skin, [0.74, 0.42, 0.28, 1.0]),
    (Material::Wall, [0.55, 0.65, 0.78, 0.3]),
    (Material::Door, [0.45, 0.28, 0.14, 0.6]),
    (Material::Ground, [0.6, 0.62, 0.65, 1.0]),
];

impl Material {
    fn to_json(self, rgba: [f64; 4]) -> Value {
        let mut material = json!({
            "name": format!("{self:?}"),
            "pbrMetallicRoughness": { "baseColorFactor": rgba, "metallicFactor": 0.0, "roughnessFactor": 0.6 },
        });
        if rgba[3] < 1.0 {
            material["alphaMode"] = json!("BLEND");
            material["doubleSided"] = json!(true);
        }
        material
    }
}

/// Nodes, meshes and animations so far.
#[derive(Debug, Default)]
pub(super) struct Document {
    title: String,
    buffer: Buffer,
    /// The accessor of the times of all animations, if there are any.
    times: Option<usize>,
    nodes: Vec<Value>,
    meshes: Vec<Value>,
    samplers: Vec<Value>,
    channels: Vec<Value>,
}

impl Document {
    /// With the times of all animations.
    pub(super) fn new(title: &str, keys: &Keys) -> Self {
        let mut document = Self {
            title: title.to_owned(),
            ..Self::default()
        };
        let rows: Vec<[f32; 1]> = keys.times_s.iter().map(|t_s| [*t_s]).collect();
        let times = || document.buffer.floats(&rows, Use::Animation);
        document.times = (!rows.is_empty()).then(times);
        document
    }

    /// Parts with one material each; `None` if none of them has a triangle.
    pub(super) fn mesh(&mut self, name: &str, parts: &[(&Mesh, Material)]) -> Option<usize> {
        let filled = parts.iter().filter(|(mesh, _)| !mesh.indices.is_empty());
        let primitives: Vec<Value> = filled
            .map(|(mesh, material)| {
                let position = self.buffer.floats(&mesh.corners_m, Use::Vertices);
                let normal = self.buffer.floats(&mesh.normals, Use::Vertices);
                json!({
                    "attributes": { "POSITION": position, "NORMAL": normal },
                    "indices": self.buffer.indices(&mesh.indices),
                    "material": *material as usize,
                })
            })
            .collect();
        if primitives.is_empty() {
            return None;
        }
        self.meshes
            .push(json!({ "name": name, "primitives": primitives }));
        Some(self.meshes.len() - 1)
    }

    /// A node, with its mesh if it has one.
    pub(super) fn node(&mut self, mut node: Value, mesh: Option<usize>) -> usize {
        if let Some(mesh) = mesh {
            node["mesh"] = json!(mesh);
        }
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// Animates the rotation of a node.
    pub(super) fn turns(&mut self, node: usize, turns: impl Iterator<Item = DQuat>) {
        // Take the shorter rotation between two keys.
        let mut before = Quat::IDENTITY;
        let turns = turns.map(|turn| {
            let turn = turn.as_quat();
            before = if turn.dot(before) < 0.0 { -turn } else { turn };
            before.to_array()
        });
        self.channel(node, "rotation", "LINEAR", turns);
    }

    /// Animates the position of a node, m.
    pub(super) fn moves(&mut self, node: usize, places_m: impl Iterator<Item = DVec3>) {
        let places_m = places_m.map(|place_m| place_m.as_vec3().to_array());
        self.channel(node, "translation", "LINEAR", places_m);
    }

    /// Animates the scale of a node; scales that are always one are left out.
    pub(super) fn sizes(&mut self, node: usize, sizes: impl Iterator<Item = [f32; 3]> + Clone) {
        if sizes.clone().any(|size| size != [1.0; 3]) {
            self.channel(node, "scale", "STEP", sizes);
        }
    }

    fn channel<const N: usize>(
        &mut self,
        node: usize,
        path: &str,
        interpolation: &str,
        rows: impl Iterator<Item = [f32; N]>,
    ) {
        let Some(input) = self.times else { return };
        let rows: Vec<_> = rows.collect();
        let output = self.buffer.floats(&rows, Use::Animation);
        self.channels.push(
            json!({ "sampler": self.samplers.len(), "target": { "node": node, "path": path } }),
        );
        self.samplers
            .push(json!({ "input": input, "output": output, "interpolation": interpolation }));
    }

    /// The file. `top`: the nodes of the base frame.
    pub(super) fn finish(mut self, top: &[usize]) -> Vec<u8> {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        // z up to y up: a quarter turn about x, backwards.
        let root = self.node(
            json!({ "name": self.title, "rotation": [-half, 0.0, 0.0, half], "children": top }),
            None,
        );
        let (views, accessors) = self.buffer.lists();
        let materials: Vec<Value> = MATERIALS.iter().map(|(m, rgba)| m.to_json(*rgba)).collect();
        let mut document = json!({
            "asset": { "version": "2.0", "generator": "hwall-view" },
            "scene": 0,
            "scenes": [{ "nodes": [root] }],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": materials,
            "accessors": accessors,
            "bufferViews": views,
            "buffers": [{ "byteLength": self.buffer.bytes.len() }],
        });
        if !self.channels.is_empty() {
            document["animations"] =
                json!([{ "name": "run", "samplers": self.samplers, "channels": self.channels }]);
        }
        packed(document.to_string().into_bytes(), self.buffer.bytes)
    }
}

/// Combines header, JSON and bytes into one file, each part padded to four bytes. Source: glTF 2.0, section 4.
fn packed(mut json: Vec<u8>, mut bytes: Vec<u8>) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let length = 12 + 8 + json.len() + 8 + bytes.len();
    let mut out = Vec::with_capacity(length);
    let word = |out: &mut Vec<u8>, value: usize| out.extend((value as u32).to_le_bytes());
    out.extend(b"glTF");
    word(&mut out, 2);
    word(&mut out, length);
    word(&mut out, json.len());
    out.extend(b"JSON");
    out.extend(json);
    word(&mut out, bytes.len());
    out.extend(b"BIN\0");
    out.extend(bytes);
    out
}
