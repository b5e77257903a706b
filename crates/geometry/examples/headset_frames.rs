//! Where is a headset-tracked hand in the robot frame? And which matrices are not valid frames?
//!
//! `cargo run -p hwall-geometry --example headset_frames`

use hwall_geometry::glam::{DMat3, DQuat, DVec3};
use hwall_geometry::{GeometryError, Pose};
use std::f64::consts::PI;

fn main() -> Result<(), GeometryError> {
    // The headset's origin is 1.2 m in front of the robot and faces it. Its y axis is up.
    let base_from_headset = Pose::from_yaw(PI, DVec3::new(1.2, 0.0, 0.0))? * Pose::Z_UP_FROM_Y_UP;
    let palm_in_headset_m = DVec3::new(0.1, 1.2, -0.5);
    let palm_m = base_from_headset.transform_point(palm_in_headset_m);
    println!("palm in the base frame: {palm_m:.3} m");

    // Names are `a_from_b`, so neighbours cancel: the palm in the frame of a board that the robot holds.
    let base_from_board =
        Pose::from_quat(DQuat::from_rotation_y(0.5 * PI), DVec3::new(0.6, 0.0, 1.1))?;
    let board_from_headset = base_from_board.inverse() * base_from_headset;
    let in_board_m = board_from_headset.transform_point(palm_in_headset_m);
    println!("palm before the board: {:.3} m", in_board_m.z);

    // A calibration printed with six digits has rounding errors: it becomes the nearest rotation.
    let printed = DMat3::from_cols(
        DVec3::new(0.5, 0.866025, 0.0),
        DVec3::new(-0.866025, 0.5, 0.0),
        DVec3::Z,
    );
    let repaired = Pose::new(printed, DVec3::ZERO)?;
    let column = repaired.rotation().x_axis.length();
    println!("a repaired axis has length 1 {:+.1e}", column - 1.0);

    // Larger deviations and reflections are errors with the reason.
    for (what, matrix) in [
        ("a scaled matrix", printed * 100.0),
        ("a mirror", DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0))),
        ("NaN", DMat3::IDENTITY * f64::NAN),
    ] {
        match Pose::new(matrix, DVec3::ZERO) {
            Ok(_) => println!("{what}: accepted"),
            Err(error) => println!("{what}: {error}"),
        }
    }
    Ok(())
}
