//! Measured distance of a mesh from its patch.

use super::patch::Patch;
use crate::geometry::TextonShape;
use crate::mesh::TriangleMesh;
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// Samples along each side of a triangle.
const ALONG: usize = 4;

impl Patch {
    /// Largest distance, mm, of the bumps' triangles in a mesh from the true bumps, over 15 evenly spread
    /// points of each triangle.
    ///
    /// `mesh`: of this patch, in its frame; may come from a file or another tool. Compares each triangle above the
    /// plate with the nearest bump.
    #[must_use]
    pub fn chord_error_mm(&self, mesh: &TriangleMesh) -> f64 {
        let texton = self.texture().texton();
        let [a, b] = texton.radii().to_array();
        let (height_mm, top) = (texton.height_mm(), texton.top_radii());
        let cell_mm = self.texture().layout().pitch_mm();
        let place = |at: DVec2| [0, 1].map(|i| (at[i] / cell_mm[i]).floor() as i64);
        let mut near: HashMap<[i64; 2], Vec<DVec2>> = HashMap::new();
        for centre in self.centres_mm() {
            near.entry(place(centre)).or_default().push(centre);
        }
        let mut worst: f64 = 0.0;
        for triangle in mesh.triangles() {
            let corners = triangle.map(|i| DVec3::from(mesh.points_mm()[i as usize]));
            if corners.iter().all(|p| p.z <= 0.0) {
                continue;
            }
            let middle = corners.iter().sum::<DVec3>().truncate() / 3.0;
            let [column, row] = place(middle);
            let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| [column + i, row + j]));
            let away = |c: &DVec2| ((c.x - middle.x) / a).hypot((c.y - middle.y) / b);
            let nearest = around
                .filter_map(|place| near.get(&place))
                .flatten()
                .min_by(|p, q| away(p).total_cmp(&away(q)));
            let Some(centre) = nearest else {
                // No bump matches this triangle.
                return f64::INFINITY;
            };
            for i in 0..=ALONG {
                for j in 0..=ALONG - i {
                    let share = [i, j, ALONG - i - j].map(|k| k as f64 / ALONG as f64);
                    let at =
                        (0..3).map(|k| share[k] * corners[k]).sum::<DVec3>() - centre.extend(0.0);
                    let above = (at.z - height_mm).abs();
                    let on_top = texton.shape() != TextonShape::Hemiellipsoid
                        && (at.x / top.long_mm).hypot(at.y / top.short_mm) <= 1.0;
                    let side = texton.side_distance_mm(at);
                    worst = worst.max(if on_top { side.min(above) } else { side });
                }
            }
        }
        worst
    }
}
