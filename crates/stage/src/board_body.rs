//! The board as a rigid body.

use glam::DVec3;
use hwall::haptics::Board;
use hwall_kinematics::Inertial;

/// Mass of the board with its mount, kg: a plate of 200 x 200 x 20 mm of light wood and an adapter.
pub(crate) const BOARD_KG: f64 = 0.6;

/// A board of this mass, kg, at the flange.
#[must_use]
pub fn board_body(board: &Board, mass_kg: f64) -> Inertial {
    let size_m = DVec3::new(
        2.0 * board.half_width_m,
        2.0 * board.half_height_m,
        board.thickness_m,
    );
    let middle_m = DVec3::Z * (0.5 * board.thickness_m);
    Inertial::solid_box("board", mass_kg, middle_m, size_m)
}
