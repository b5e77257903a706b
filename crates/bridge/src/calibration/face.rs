//! The face of the board as seen by the person in front of it.

use glam::DVec3;
use hwall::geometry::Pose;
use hwall::haptics::Board;

/// The touched corners, in this order.
pub(super) const CORNERS: [&str; 3] = ["upper left", "upper right", "lower right"];
/// Where they are, in units of the half extents: right, up.
const SIDES: [[f64; 2]; 3] = [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]];

/// The face of a held board: its middle, its axes towards the person's right, up and out, and its half extents, in the base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Face {
    middle_m: DVec3,
    axes: [DVec3; 3],
    half_m: [f64; 2],
}

impl Face {
    /// `base_from_face`: z points to the person. "Up" is the edge direction closest to vertical.
    pub(super) fn of(base_from_face: &Pose, board: &Board) -> Self {
        let [x, y, out] =
            [DVec3::X, DVec3::Y, DVec3::Z].map(|v| base_from_face.transform_vector(v));
        let is_y_up = y.z.abs() >= x.z.abs();
        let (edge, halves) = match is_y_up {
            true => (y, [board.half_width_m, board.half_height_m]),
            false => (x, [board.half_height_m, board.half_width_m]),
        };
        let up = if edge.z < 0.0 { -edge } else { edge };
        Self {
            middle_m: base_from_face.position_m(),
            // To the right of a person who looks along `-out`.
            axes: [up.cross(out), up, out],
            half_m: halves,
        }
    }

    /// From the middle to a corner, base axes, m.
    pub(super) fn offset_m(&self, corner: usize) -> DVec3 {
        let [right, up] = SIDES[corner % SIDES.len()];
        let [right_m, up_m] = [right * self.half_m[0], up * self.half_m[1]];
        self.axes[0] * right_m + self.axes[1] * up_m
    }

    /// A corner, base frame, m.
    pub(super) fn corner_m(&self, corner: usize) -> DVec3 {
        self.middle_m + self.offset_m(corner)
    }

    /// Is every corner within this distance of the same corner of another face, m?
    pub(super) fn is_at(&self, other: &Self, within_m: f64) -> bool {
        let moved_m = |corner| self.corner_m(corner).distance(other.corner_m(corner));
        (0..SIDES.len()).all(|corner| moved_m(corner) <= within_m)
    }

    /// Is a place of the base frame on the side of the person?
    pub(super) fn is_before(&self, at_m: DVec3) -> bool {
        self.axes[2].dot(at_m - self.middle_m) > 0.0
    }

    /// A vector of the base frame as right, up, out.
    pub(super) fn axes(&self, vector: DVec3) -> [f64; 3] {
        self.axes.map(|axis| axis.dot(vector))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_face_that_is_nowhere_does_not_stand() {
        let face = Face::of(&Pose::IDENTITY, &Board::default());
        let moved = |x_m| Face {
            middle_m: DVec3::new(x_m, 0.0, 0.0),
            ..face
        };
        assert!(face.is_at(&moved(1e-3), 2e-3) && !face.is_at(&moved(1e-3), 5e-4));
        assert!(!face.is_at(&moved(f64::NAN), 1.0) && !moved(f64::NAN).is_at(&face, 1.0));
    }

    #[test]
    fn corners_are_where_the_person_sees_them() {
        let board = Board {
            half_width_m: 0.1,
            half_height_m: 0.2,
            ..Board::default()
        };
        // The person is at larger x and looks along -x, so that their right is +y.
        let out_x = glam::DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);
        for turn in 0..4 {
            let roll = glam::DMat3::from_rotation_z(f64::from(turn) * std::f64::consts::FRAC_PI_2);
            let pose = Pose::new(out_x * roll, DVec3::new(0.6, 0.0, 0.5)).expect("a pose");
            let face = Face::of(&pose, &board);
            let [y, z] = if turn % 2 == 0 {
                [0.1, 0.2]
            } else {
                [0.2, 0.1]
            };
            for (corner, [right, up]) in SIDES.iter().enumerate() {
                let wanted = DVec3::new(0.6, right * y, 0.5 + up * z);
                let found = face.corner_m(corner);
                assert!(found.distance(wanted) < 1e-12, "{turn} {corner} {found}");
            }
            let [right, up, out] = face.axes(DVec3::new(1.0, 2.0, 3.0));
            assert!((DVec3::new(right, up, out) - DVec3::new(2.0, 3.0, 1.0)).length() < 1e-12);
        }
    }
}
