//! Polygons with holes.

use crate::wall::WallPoint;

/// A connected part of the reachable set of a wall, seen from the person's side.
#[derive(Debug, Clone, PartialEq)]
pub struct WallPolygon {
    /// Counter-clockwise; the last point is joined to the first.
    pub outline: Vec<WallPoint>,
    /// Clockwise, each within the outline, none within another.
    pub holes: Vec<Vec<WallPoint>>,
}

impl WallPolygon {
    /// Outline and holes.
    pub fn rings(&self) -> impl Iterator<Item = &[WallPoint]> {
        std::iter::once(&self.outline)
            .chain(&self.holes)
            .map(Vec::as_slice)
    }

    /// Area without the holes, m², from the outline alone (shoelace formula).
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        self.rings().map(signed_area_m2).sum()
    }
}

/// Every edge of a ring.
pub(super) fn edges(ring: &[WallPoint]) -> impl Iterator<Item = [WallPoint; 2]> {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(&a, &b)| [a, b])
}

/// Positive for rings that run counter-clockwise, m².
pub(super) fn signed_area_m2(ring: &[WallPoint]) -> f64 {
    // Relative to the first corner, so that small distant rings keep their digits.
    let Some(&origin) = ring.first() else {
        return 0.0;
    };
    let from = |p: &WallPoint| (p.s_m - origin.s_m, p.z_m - origin.z_m);
    let cross = |pair: &[WallPoint]| {
        let ((a, b), (c, d)) = (from(&pair[0]), from(&pair[1]));
        a * d - b * c
    };
    0.5 * ring.windows(2).map(cross).sum::<f64>()
}

/// True if a point that is not a corner is inside a ring.
fn encloses(ring: &[WallPoint], at: WallPoint) -> bool {
    let mut inside = false;
    let mut a = ring[ring.len() - 1];
    for &b in ring {
        if (a.z_m > at.z_m) != (b.z_m > at.z_m) {
            let share = (at.z_m - a.z_m) / (b.z_m - a.z_m);
            inside ^= at.s_m < a.s_m + share * (b.s_m - a.s_m);
        }
        a = b;
    }
    inside
}

/// Assigns each hole to the smallest outline around it.
pub(super) fn nested(rings: Vec<Vec<WallPoint>>) -> Vec<WallPolygon> {
    let (outer, holes): (Vec<_>, Vec<_>) = rings.into_iter().partition(|r| signed_area_m2(r) > 0.0);
    let polygon = |outline: Vec<WallPoint>| {
        (
            signed_area_m2(&outline),
            WallPolygon {
                outline,
                holes: Vec::new(),
            },
        )
    };
    let mut polygons: Vec<(f64, WallPolygon)> = outer.into_iter().map(polygon).collect();
    for hole in holes {
        let around = polygons
            .iter_mut()
            .filter(|(_, p)| encloses(&p.outline, hole[0]));
        if let Some((_, polygon)) = around.min_by(|a, b| a.0.total_cmp(&b.0)) {
            polygon.holes.push(hole);
        }
    }
    polygons.into_iter().map(|(_, polygon)| polygon).collect()
}
