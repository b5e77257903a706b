//! Locates the touching point of a hand, even while it is not seen.

use crate::hand_point::HandPoint;
use glam::DVec3;

/// Locates the touching point during one reach. While it is missing, another point of the hand replaces it, shifted by the last offset between the
/// two, or by the default offset until there is one.
#[derive(Debug, Clone)]
pub struct TouchingPoint {
    point: HandPoint,
    /// Default offset from each point of the hand to the touching one, m.
    nominal_m: [Option<DVec3>; 6],
    /// Last offset in this reach.
    last_m: [Option<DVec3>; 6],
}

impl TouchingPoint {
    /// For a touching point; `nominal_m` holds its default offset from every point of the hand, in the order of [`HandPoint::ALL`], m; `None` if
    /// unknown.
    #[must_use]
    pub const fn new(point: HandPoint, nominal_m: [Option<DVec3>; 6]) -> Self {
        Self {
            point,
            nominal_m,
            last_m: [None; 6],
        }
    }

    /// A new reach begins: forgets the offsets of the last one.
    pub fn begin(&mut self) {
        self.last_m = [None; 6];
    }

    /// Position of the touching point, m, from the visible points of the hand, in the order of [`HandPoint::ALL`]; `None` if none of them
    /// determines it.
    pub fn locate(&mut self, seen_m: &[Option<DVec3>; 6]) -> Option<DVec3> {
        let Some(own_m) = seen_m[self.point as usize] else {
            return HandPoint::BY_CONTACT
                .into_iter()
                .find_map(|other| Some(seen_m[other as usize]? + self.offset_m(other)?));
        };
        for (last_m, seen_m) in self.last_m.iter_mut().zip(seen_m) {
            *last_m = seen_m.map(|seen_m| own_m - seen_m).or(*last_m);
        }
        Some(own_m)
    }

    /// Offset from another point of the hand to the touching point, m; `None` if they were never seen together and there is no default.
    #[must_use]
    pub fn offset_m(&self, other: HandPoint) -> Option<DVec3> {
        self.last_m[other as usize].or(self.nominal_m[other as usize])
    }
}
