//! Mass properties used by the dynamics recursions.

use super::inertia::Inertial;
use glam::{DMat3, DVec3};

/// Mass, first moment and inertia about the origin of a joint's axis frame, in its axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Body {
    pub(super) mass: f64,
    pub(super) moment: DVec3,
    pub(super) inertia: DMat3,
}

impl Body {
    pub(super) const EMPTY: Self = Self {
        mass: 0.0,
        moment: DVec3::ZERO,
        inertia: DMat3::ZERO,
    };

    pub(super) fn add(&mut self, part: &Inertial) {
        let (m, c) = (part.mass_kg, part.com_m);
        self.mass += m;
        self.moment += m * c;
        self.inertia += part.inertia_kg_m2 + shifted(c, m * c);
    }

    /// Turned into outer axes.
    #[inline(always)]
    pub(super) fn rotated(&self, r: DMat3) -> Self {
        Self {
            mass: self.mass,
            moment: r * self.moment,
            inertia: r * self.inertia * r.transpose(),
        }
    }

    /// About a point at `-shift` from the current one.
    #[inline(always)]
    pub(super) fn about(&self, shift: DVec3) -> Self {
        let weight = self.mass * shift;
        Self {
            mass: self.mass,
            moment: self.moment + weight,
            inertia: self.inertia + shifted(shift, 2.0 * self.moment + weight),
        }
    }
}

/// Parallel-axis term of a shift `s`: `(s·g) 1 − ½ (s gᵀ + g sᵀ)` with `g = 2 h + m s` (Steiner).
#[inline(always)]
fn shifted(s: DVec3, g: DVec3) -> DMat3 {
    let (x, y, z) = (s.x * g.x, s.y * g.y, s.z * g.z);
    let xy = -0.5 * (s.x * g.y + s.y * g.x);
    let yz = -0.5 * (s.y * g.z + s.z * g.y);
    let zx = -0.5 * (s.z * g.x + s.x * g.z);
    DMat3::from_cols(
        DVec3::new(y + z, xy, zx),
        DVec3::new(xy, z + x, yz),
        DVec3::new(zx, yz, x + y),
    )
}

/// Velocity for unit joint velocity, base axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Screw {
    pub(super) angular: DVec3,
    pub(super) linear: DVec3,
}

impl Screw {
    pub(super) const ZERO: Self = Self::new(DVec3::ZERO, DVec3::ZERO);

    pub(super) const fn new(angular: DVec3, linear: DVec3) -> Self {
        Self { angular, linear }
    }
}
