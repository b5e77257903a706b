//! Triangles of capsules, boxes and surfaces.

use glam::{DMat3, DVec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Corners with normals, and triangles of them, counter-clockwise from outside.
#[derive(Debug, Clone, Default)]
pub(super) struct Mesh {
    pub(super) corners_m: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    pub(super) indices: Vec<u32>,
}

/// Corners around a capsule, and rings in each of its caps.
const AROUND: usize = 20;
const RINGS: usize = 5;

impl Mesh {
    /// Adds a segment with a radius, m.
    pub(super) fn add_capsule(&mut self, from_m: DVec3, to_m: DVec3, radius_m: f64) {
        let z = (to_m - from_m).normalize_or(DVec3::Z);
        let x = z.any_orthonormal_vector();
        let turn = DMat3::from_cols(x, z.cross(x), z);
        let first = self.corners_m.len() as u32;
        for (middle_m, half) in [(from_m, 0), (to_m, 1)] {
            for ring in 0..=RINGS {
                let polar = FRAC_PI_2 * (ring as f64 / RINGS as f64 - f64::from(1 - half));
                for i in 0..AROUND {
                    let (sin, cos) = (TAU * i as f64 / AROUND as f64).sin_cos();
                    let along = DVec3::new(polar.cos() * cos, polar.cos() * sin, polar.sin());
                    let normal = turn * along;
                    self.corners_m
                        .push((middle_m + normal * radius_m).as_vec3().to_array());
                    self.normals.push(normal.as_vec3().to_array());
                }
            }
        }
        let around = AROUND as u32;
        for ring in 0..(2 * RINGS as u32 + 1) {
            for i in 0..around {
                let (a, b) = (ring * around + i, ring * around + (i + 1) % around);
                for corner in [a, b, b + around, a, b + around, a + around] {
                    self.indices.push(first + corner);
                }
            }
        }
    }

    /// Adds a box from a lower to an upper corner, m.
    pub(super) fn add_box(&mut self, low_m: DVec3, high_m: DVec3) {
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (side_m, outwards) in [(low_m, -1.0), (high_m, 1.0)] {
                let corner = |at_u: DVec3, at_v: DVec3| {
                    let mut corner_m = side_m;
                    corner_m[u] = at_u[u];
                    corner_m[v] = at_v[v];
                    corner_m
                };
                let (a, b) = (corner(low_m, low_m), corner(high_m, low_m));
                let (c, d) = (corner(high_m, high_m), corner(low_m, high_m));
                let quad = if outwards > 0.0 {
                    [a, b, c, d]
                } else {
                    [a, d, c, b]
                };
                self.add_triangle([quad[0], quad[1], quad[2]]);
                self.add_triangle([quad[0], quad[2], quad[3]]);
            }
        }
    }

    /// Adds a flat triangle, m, unless it has no area.
    pub(super) fn add_triangle(&mut self, corners_m: [DVec3; 3]) {
        let [a, b, c] = corners_m;
        let Some(normal) = (b - a).cross(c - a).try_normalize() else {
            return;
        };
        for corner_m in corners_m {
            self.indices.push(self.corners_m.len() as u32);
            self.corners_m.push(corner_m.as_vec3().to_array());
            self.normals.push(normal.as_vec3().to_array());
        }
    }
}
