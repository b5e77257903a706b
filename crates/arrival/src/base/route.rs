//! Ways of the base around areas that it stays out of.

use super::drive::NEAR_M;
use glam::DVec2;

/// A rectangle along the axes that the axis of the base stays out of, except for at most 5 cm at an edge, see [`route`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeepOutArea {
    /// Its corner with the smaller coordinates, m.
    pub low_m: DVec2,
    /// Its other corner, m.
    pub high_m: DVec2,
}

impl KeepOutArea {
    /// The area and what is this near to it along the axes, m.
    #[must_use]
    pub fn grown(&self, by_m: f64) -> Self {
        Self {
            low_m: self.low_m - by_m,
            high_m: self.high_m + by_m,
        }
    }

    /// Is a place inside?
    #[must_use]
    pub fn contains(&self, at_m: DVec2) -> bool {
        at_m.cmpgt(self.low_m).all() && at_m.cmplt(self.high_m).all()
    }

    /// The nearest point of the edge if the place is inside by at most [`NEAR_M`], else the place.
    fn beside(&self, at_m: DVec2) -> DVec2 {
        if !self.contains(at_m) {
            return at_m;
        }
        let edges = [
            at_m.with_x(self.low_m.x),
            at_m.with_x(self.high_m.x),
            at_m.with_y(self.low_m.y),
            at_m.with_y(self.high_m.y),
        ];
        let nearest = edges
            .into_iter()
            .min_by(|a, b| a.distance(at_m).total_cmp(&b.distance(at_m)));
        nearest
            .filter(|edge| edge.distance(at_m) <= NEAR_M)
            .unwrap_or(at_m)
    }

    /// Does a straight way lead through the inside?
    #[must_use]
    pub fn is_crossed(&self, from_m: DVec2, to_m: DVec2) -> bool {
        let way_m = to_m - from_m;
        let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
        for axis in 0..2 {
            let (low, high) = (
                self.low_m[axis] - from_m[axis],
                self.high_m[axis] - from_m[axis],
            );
            if way_m[axis] == 0.0 {
                if low >= 0.0 || high <= 0.0 {
                    return false;
                }
                continue;
            }
            let (a, b) = (low / way_m[axis], high / way_m[axis]);
            enters = enters.max(a.min(b));
            leaves = leaves.min(a.max(b));
        }
        leaves - enters > 1e-9
    }

    /// Corners to pass, counter-clockwise.
    fn corners_m(&self) -> [DVec2; 4] {
        let (low, high) = (self.low_m, self.high_m);
        [
            low,
            DVec2::new(high.x, low.y),
            high,
            DVec2::new(low.x, high.y),
        ]
    }
}

/// The shortest way from one place to another outside an area, past its corners, without the beginning; `None` if the end is inside.
///
/// From inside it first leaves across, along y: rooms of a corridor along x are left through their outer walls. A start at most 5 cm (`NEAR_M`) inside
/// counts as on the edge: the way from there may stay inside by as much along the whole side.
#[must_use]
pub fn route(from_m: DVec2, to_m: DVec2, area: &KeepOutArea) -> Option<Vec<DVec2>> {
    let from_m = area.beside(from_m);
    if !area.contains(from_m) {
        return around(from_m, to_m, area).map(|(_, way)| way);
    }
    let exits = [area.low_m.y, area.high_m.y];
    let ways = exits.into_iter().filter_map(|y| {
        let exit_m = DVec2::new(from_m.x, y);
        let (length_m, way) = around(exit_m, to_m, area)?;
        let whole: Vec<DVec2> = std::iter::once(exit_m).chain(way).collect();
        Some((length_m + from_m.distance(exit_m), whole))
    });
    ways.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, way)| way)
}

/// The shortest way around an area and its length, m.
fn around(from_m: DVec2, to_m: DVec2, area: &KeepOutArea) -> Option<(f64, Vec<DVec2>)> {
    if !area.is_crossed(from_m, to_m) {
        return Some((from_m.distance(to_m), vec![to_m]));
    }
    let corners = area.corners_m();
    // From 1 to 3 corners, either way round.
    let ways = (0..24).map(|k| {
        let (first, turn, count) = (k % 4, [1, 3][k / 4 % 2], 1 + k / 8);
        let mut way: Vec<DVec2> = (0..count)
            .map(|i| corners[(first + turn * i) % 4])
            .collect();
        way.push(to_m);
        way
    });
    let free = ways.filter_map(|way| {
        let legs = std::iter::once(&from_m).chain(&way).zip(&way);
        let is_free = legs.clone().all(|(a, b)| !area.is_crossed(*a, *b));
        let length_m: f64 = legs.map(|(a, b)| a.distance(*b)).sum();
        is_free.then_some((length_m, way))
    });
    free.min_by(|a, b| a.0.total_cmp(&b.0))
}
