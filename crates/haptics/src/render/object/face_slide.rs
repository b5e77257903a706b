//! A slide of the board within the face of an object that it moves along with.

use glam::{DMat3, DVec2, DVec3};
use hwall_geometry::{Pose, Twist};

/// Time constant of the two low-passes on the commanded velocity, s, as for a slide on a wall.
const SMOOTH_S: f64 = 0.006;
/// Largest change of the velocity, m/s², where a turn counts at a tenth of a metre from the centre.
pub(in crate::render) const MOST_M_PER_S2: f64 = 1.0;
const EDGE_M: f64 = 0.1;
/// Slower than this the board counts as standing, m/s.
const SLOWEST_M_PER_S: f64 = 1e-9;

/// A velocity within the face and a turn about its normal, face axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::render) struct InFace {
    pub(in crate::render) linear: DVec2,
    pub(in crate::render) angular: f64,
}

impl InFace {
    fn plus(self, other: Self, share: f64) -> Self {
        Self {
            linear: self.linear + share * other.linear,
            angular: self.angular + share * other.angular,
        }
    }

    pub(in crate::render) fn times(self, factor: f64) -> Self {
        Self {
            linear: self.linear * factor,
            angular: self.angular * factor,
        }
    }

    /// Largest speed of a point near the edge, m/s.
    pub(in crate::render) fn size(self) -> f64 {
        self.linear.length() + EDGE_M * self.angular.abs()
    }

    /// As a twist of a face, base axes.
    pub(in crate::render) fn twist(self, face: &Pose) -> Twist {
        let rotation = face.rotation();
        Twist {
            linear_m_per_s: rotation * self.linear.extend(0.0),
            angular_rad_per_s: rotation * DVec3::Z * self.angular,
        }
    }
}

/// The slide of the board since the touch began, in the axes of the face, which move along with the object.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::render) struct FaceSlide {
    moved: InFace,
    velocity: InFace,
    aim: InFace,
}

impl FaceSlide {
    /// Advances by one step.
    pub(in crate::render) fn next(&self, wanted: InFace, dt_s: f64) -> Self {
        let smooth = -(-dt_s / SMOOTH_S).exp_m1();
        let aim = self.aim.plus(wanted.plus(self.aim, -1.0), smooth);
        let change = aim.plus(self.velocity, -1.0);
        let most = MOST_M_PER_S2 * dt_s;
        let share = smooth.min(most / change.size().max(most));
        let velocity = self.velocity.plus(change, share);
        let moved = self
            .moved
            .plus(self.velocity, 0.5 * dt_s)
            .plus(velocity, 0.5 * dt_s);
        Self {
            moved,
            velocity,
            aim,
        }
    }

    /// The same place, at rest.
    pub(in crate::render) fn stopped(&self) -> Self {
        Self {
            moved: self.moved,
            ..Self::default()
        }
    }

    pub(in crate::render) fn is_moving(&self) -> bool {
        self.velocity.size() > SLOWEST_M_PER_S
    }

    /// The board's pose on the face of an object.
    pub(in crate::render) fn on(&self, face: &Pose) -> Pose {
        let rotation = face.rotation();
        let by_m = rotation * self.moved.linear.extend(0.0);
        let turned = rotation * DMat3::from_rotation_z(self.moved.angular);
        Pose::from_parts_unchecked(turned, face.position_m() + by_m)
    }

    /// The slide's twist relative to the object, base axes.
    pub(in crate::render) fn twist(&self, face: &Pose) -> Twist {
        self.velocity.twist(face)
    }
}
