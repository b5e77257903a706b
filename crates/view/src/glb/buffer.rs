//! The binary part of a glTF file and its accessors.

use serde_json::{Value, json};

/// Component type of glTF: f32.
const FLOAT: u32 = 5126;
/// Component type of glTF: u32.
const UNSIGNED_INT: u32 = 5125;

/// Purpose of an array, as in glTF.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Use {
    /// Positions and normals.
    Vertices,
    /// Indices of triangles.
    Indices,
    /// Times and values of an animation.
    Animation,
}

/// Collects arrays; an accessor is the number by which nodes and meshes refer to an array.
#[derive(Debug, Default)]
pub(super) struct Buffer {
    pub(super) bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Rows of `N` floats: 1 a scalar, 3 a vector, 4 a quaternion.
    pub(super) fn floats<const N: usize>(&mut self, rows: &[[f32; N]], purpose: Use) -> usize {
        let (mut low, mut high) = ([f32::INFINITY; N], [f32::NEG_INFINITY; N]);
        let offset = self.bytes.len();
        for row in rows {
            for (i, value) in row.iter().enumerate() {
                low[i] = low[i].min(*value);
                high[i] = high[i].max(*value);
                self.bytes.extend(value.to_le_bytes());
            }
        }
        let kind = match N {
            1 => "SCALAR",
            3 => "VEC3",
            _ => "VEC4",
        };
        let view = self.view(offset, purpose);
        let mut accessor = json!({ "bufferView": view, "componentType": FLOAT, "count": rows.len(), "type": kind });
        // Readers rely on the extremes of positions and times.
        if low.iter().all(|v| v.is_finite()) {
            accessor["min"] = json!(low.as_slice());
            accessor["max"] = json!(high.as_slice());
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Corners of triangles, by row.
    pub(super) fn indices(&mut self, indices: &[u32]) -> usize {
        let offset = self.bytes.len();
        for index in indices {
            self.bytes.extend(index.to_le_bytes());
        }
        let view = self.view(offset, Use::Indices);
        let most = indices.iter().max().copied().unwrap_or(0);
        self.accessors.push(json!({
            "bufferView": view, "componentType": UNSIGNED_INT, "count": indices.len(), "type": "SCALAR", "min": [0], "max": [most],
        }));
        self.accessors.len() - 1
    }

    fn view(&mut self, offset: usize, purpose: Use) -> usize {
        let length = self.bytes.len() - offset;
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
        match purpose {
            Use::Vertices => view["target"] = json!(34962),
            Use::Indices => view["target"] = json!(34963),
            Use::Animation => {}
        }
        self.views.push(view);
        self.views.len() - 1
    }

    /// Views and accessors as glTF lists them.
    pub(super) fn lists(&self) -> (Value, Value) {
        (json!(self.views), json!(self.accessors))
    }
}
