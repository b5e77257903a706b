//! Board poses: every normal has one, bad input is named.

use glam::{DMat3, DVec3};
use hwall_haptics::{Board, QUARTER_TURNS_RAD, board_pose};
use hwall_testkit::{Sampler, refusal, refused};

fn check(normal: DVec3, roll_rad: f64) {
    let point_m = DVec3::new(0.5, -0.2, 0.6);
    let pose = board_pose(point_m, normal, roll_rad).unwrap();
    let r = pose.rotation();
    let off = (r.transpose() * r - DMat3::IDENTITY)
        .to_cols_array()
        .into_iter()
        .fold(0.0, |m: f64, x| m.max(x.abs()));
    assert!(off < 4e-15, "{normal}: {off}");
    assert!((r.determinant() - 1.0).abs() < 1e-14);
    assert!(r.z_axis.distance(normal.normalize()) < 4e-15);
    assert_eq!(pose.position_m(), point_m);
}

#[test]
fn orthonormal_for_random_normals_and_rolls() {
    let mut s = Sampler::new(1);
    for _ in 0..20_000 {
        let length = 10.0_f64.powf(s.uniform(-9.0, 9.0));
        check(s.unit_vector() * length, s.uniform(-10.0, 10.0));
    }
}

#[test]
fn orthonormal_on_floor_ceiling_and_around_the_lying_threshold() {
    for z in [1.0, -1.0] {
        check(DVec3::Z * z, 0.0);
        for slope in [
            1e-300,
            1e-16,
            1e-8,
            1e-3,
            0.1,
            0.1_f64.next_down(),
            0.1_f64.next_up(),
            0.2,
        ] {
            check(DVec3::new(slope, 0.0, z), 0.3);
            check(DVec3::new(0.0, -slope, z), 0.3);
        }
    }
    // A floor: "up" is undefined, and the board points along world x.
    let floor = board_pose(DVec3::ZERO, DVec3::Z, 0.0).unwrap().rotation();
    assert_eq!(floor.y_axis, DVec3::X);
}

#[test]
fn at_roll_zero_the_board_stands_upright() {
    let mut s = Sampler::new(2);
    for _ in 0..1000 {
        let normal = s.unit_vector();
        if normal.truncate().length() < 0.11 {
            continue;
        }
        let upright = board_pose(DVec3::ZERO, normal, 0.0).unwrap().rotation();
        assert!(upright.x_axis.z.abs() < 1e-15, "x stays level");
        assert!(upright.y_axis.z > 0.0);
        let turned = board_pose(DVec3::ZERO, normal, s.uniform(-3.0, 3.0))
            .unwrap()
            .rotation();
        assert!(turned.y_axis.z <= upright.y_axis.z + 1e-15);
    }
}

#[test]
fn quarter_turns_exchange_the_axes() {
    let normal = DVec3::new(-1.0, 0.4, 0.2);
    let [r0, r1, r2, r3] =
        QUARTER_TURNS_RAD.map(|roll| board_pose(DVec3::ZERO, normal, roll).unwrap().rotation());
    assert!(r1.x_axis.distance(r0.y_axis) < 1e-15 && r1.y_axis.distance(-r0.x_axis) < 1e-15);
    assert!(r2.x_axis.distance(-r0.x_axis) < 1e-15);
    assert!(r3.y_axis.distance(r0.x_axis) < 1e-15);
}

#[test]
fn bad_input_is_named() {
    let o = DVec3::ZERO;
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for (point_m, normal, roll_rad, named) in [
            (o, DVec3::new(0.0, bad, 1.0), 0.0, "normal[1]"),
            (DVec3::new(0.0, 0.0, bad), DVec3::X, 0.0, "point_m[2]"),
            (o, DVec3::X, bad, "roll_rad"),
        ] {
            let said = refusal(board_pose(point_m, normal, roll_rad));
            assert_eq!(said, format!("{named} is {bad}, not a finite number"));
        }
    }
    assert!(refusal(board_pose(o, o, 0.0)).contains("no direction"));
    assert!(board_pose(o, DVec3::splat(f64::MAX), 0.0).is_ok());
}

#[test]
fn the_tool_frame_is_the_middle_of_the_face() {
    let face = Board::default().flange_from_board_face().unwrap();
    assert_eq!(face.position_m(), DVec3::new(0.0, 0.0, 0.02));
    assert_eq!(face.rotation(), DMat3::IDENTITY);
    let make = |board: Board| board.flange_from_board_face();
    refused!(Board::default(), make, {
        thickness_m = -0.01, f64::NAN, f64::INFINITY;
    });
    refused!(Board::default(), |board: Board| board.validate(), {
        half_width_m = 0.0;
    });
}
