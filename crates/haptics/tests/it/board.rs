//! Board poses: every normal has one, bad input has a typed error.

use glam::{DMat3, DVec3};
use hwall_haptics::{
    ArgumentError, Board, GeometryError, HapticsError, QUARTER_TURNS_RAD, board_pose,
};
use hwall_testkit::Sampler;

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
fn bad_input_is_a_typed_error() {
    let o = DVec3::ZERO;
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let normal = board_pose(o, DVec3::new(0.0, bad, 1.0), 0.0);
        assert!(matches!(
            normal,
            Err(HapticsError::Argument(ArgumentError::NonFinite {
                what: "normal",
                index: Some(1),
                ..
            }))
        ));
        let point = board_pose(DVec3::new(0.0, 0.0, bad), DVec3::X, 0.0);
        assert!(matches!(
            point,
            Err(HapticsError::Argument(ArgumentError::NonFinite {
                what: "point_m",
                index: Some(2),
                ..
            }))
        ));
        let roll = board_pose(o, DVec3::X, bad);
        assert!(matches!(
            roll,
            Err(HapticsError::Argument(ArgumentError::NonFinite {
                what: "roll_rad",
                ..
            }))
        ));
    }
    assert!(matches!(
        board_pose(o, o, 0.0),
        Err(HapticsError::Geometry(GeometryError::NoDirection { .. }))
    ));
    assert!(board_pose(o, DVec3::splat(f64::MAX), 0.0).is_ok());
}

#[test]
fn the_tool_frame_is_the_middle_of_the_face() {
    let face = Board::default().flange_from_board_face().unwrap();
    assert_eq!(face.position_m(), DVec3::new(0.0, 0.0, 0.02));
    assert_eq!(face.rotation(), DMat3::IDENTITY);
    for thickness_m in [-0.01, f64::NAN, f64::INFINITY] {
        let board = Board {
            thickness_m,
            ..Board::default()
        };
        assert!(matches!(
            board.flange_from_board_face(),
            Err(HapticsError::Argument(ArgumentError::OutOfRange {
                what: "thickness_m",
                ..
            }))
        ));
    }
    assert!(
        Board {
            half_width_m: 0.0,
            ..Board::default()
        }
        .validate()
        .is_err()
    );
}
