//! Objects in space: rigid motions, velocities and forces agree with each other.

use hwall_haptics::glam::{DMat3, DVec3};
use hwall_haptics::kinematics::{Pose, Wrench};
use hwall_haptics::{ObjectPath, board_pose};
use hwall_testkit::{Sampler, Tol, assert_close, refusal};

fn random_paths(sampler: &mut Sampler) -> [ObjectPath; 2] {
    let hinge_point_m = sampler.unit_vector();
    let axis = sampler.unit_vector() * sampler.uniform(0.1, 5.0);
    let direction = sampler.unit_vector() * sampler.uniform(0.1, 5.0);
    [
        ObjectPath::turning(hinge_point_m, axis).unwrap(),
        ObjectPath::sliding(direction).unwrap(),
    ]
}

fn random_pose(sampler: &mut Sampler) -> Pose {
    Pose::new(sampler.rotation(), sampler.unit_vector()).unwrap()
}

#[test]
fn motions_add_up_and_can_be_taken_back() {
    let mut sampler = Sampler::new(6);
    for _ in 0..500 {
        for path in random_paths(&mut sampler) {
            let pose = random_pose(&mut sampler);
            let (a, b) = (sampler.uniform(-2.0, 2.0), sampler.uniform(-2.0, 2.0));
            let twice = path.moved(&path.moved(&pose, a), b);
            let distance = twice.distance(&path.moved(&pose, a + b));
            assert!(distance.position_m < 1e-14 && distance.angle_rad < 1e-7);
            let back = path.moved(&path.moved(&pose, a), -a).distance(&pose);
            assert!(back.position_m < 1e-14);
            assert_eq!(path.moved(&pose, 0.0), pose);
        }
    }
}

#[test]
fn velocities_are_the_derivatives_of_the_motion() {
    let mut sampler = Sampler::new(7);
    for _ in 0..500 {
        for path in random_paths(&mut sampler) {
            let pose = random_pose(&mut sampler);
            let rate = sampler.uniform(-2.0, 2.0);
            let h = 1e-5;
            let [ahead, behind] = [h, -h].map(|h| path.moved(&pose, rate * h));
            let twist = path.velocity_at(pose.position_m(), rate);
            let linear = (ahead.position_m() - behind.position_m()) / (2.0 * h);
            assert_close!(twist.linear_m_per_s, linear, Tol::abs(1e-9));
            let spin =
                (ahead.rotation() - behind.rotation()) * (0.5 / h) * pose.rotation().transpose();
            let angular = DVec3::new(spin.y_axis.z, spin.z_axis.x, spin.x_axis.y);
            assert_close!(twist.angular_rad_per_s, angular, Tol::abs(1e-9));
        }
    }
}

#[test]
fn virtual_work_is_the_same_along_the_path_and_in_space() {
    let mut sampler = Sampler::new(8);
    for _ in 0..500 {
        for path in random_paths(&mut sampler) {
            let point_m = sampler.unit_vector() * 2.0;
            let rate = sampler.uniform(-2.0, 2.0);
            let wrench = Wrench {
                force_n: sampler.unit_vector() * 50.0,
                moment_n_m: sampler.unit_vector() * 5.0,
            };
            let twist = path.velocity_at(point_m, rate);
            let power_w = wrench.force_n.dot(twist.linear_m_per_s)
                + wrench.moment_n_m.dot(twist.angular_rad_per_s);
            let along_w = path.generalized_force(point_m, &wrench) * rate;
            assert_close!(along_w, power_w, Tol::abs(1e-12));
            // The same wrench about another point does the same.
            let other_m = sampler.unit_vector();
            let moved = Wrench {
                moment_n_m: wrench.moment_n_m + (point_m - other_m).cross(wrench.force_n),
                ..wrench
            };
            let same = path.generalized_force(other_m, &moved) * rate;
            assert_close!(same, power_w, Tol::abs(1e-12));
        }
    }
}

#[test]
fn a_board_on_a_door_turns_with_it() {
    // A door in the plane x = 1 with its hinge at y = 0.2 and its handle at y = −0.6, seen from the far side (+x).
    let door = ObjectPath::turning(DVec3::new(1.0, 0.2, 0.0), DVec3::Z).unwrap();
    let handle_m = DVec3::new(1.0, -0.6, 0.4);
    let board = board_pose(handle_m, DVec3::X, 0.0).unwrap();
    let quarter = door.moved(&board, std::f64::consts::FRAC_PI_2);
    let turned_m = DVec3::new(1.8, 0.2, 0.4);
    assert_close!(quarter.position_m(), turned_m, Tol::abs(1e-15));
    assert_close!(quarter.rotation().z_axis, DVec3::Y, Tol::abs(1e-15));
    let expected = DMat3::from_rotation_z(std::f64::consts::FRAC_PI_2) * board.rotation();
    assert_close!(quarter.rotation(), expected, Tol::abs(1e-15));
    // 10 N against the board, 0.8 m from the hinge: 8 N m that turn it towards the arm.
    let push = Wrench {
        force_n: DVec3::NEG_X * 10.0,
        moment_n_m: DVec3::ZERO,
    };
    let moment_n_m = door.generalized_force(handle_m, &push);
    assert_close!(moment_n_m, -8.0, Tol::abs(1e-14));
    let velocity = door.velocity_at(handle_m, -0.5).linear_m_per_s;
    assert_close!(velocity, DVec3::NEG_X * 0.4, Tol::abs(1e-15));
}

#[test]
fn paths_without_a_direction_are_refused() {
    let o = DVec3::ZERO;
    for (path, named) in [
        (ObjectPath::turning(o, o), "no direction"),
        (ObjectPath::sliding(o), "no direction"),
        (ObjectPath::sliding(DVec3::NAN), "direction[0] is NaN"),
        (
            ObjectPath::turning(DVec3::new(0.0, f64::NAN, 0.0), DVec3::Z),
            "hinge_point_m[1] is NaN",
        ),
        (
            ObjectPath::turning(o, DVec3::new(0.0, f64::INFINITY, 0.0)),
            "[1] is inf",
        ),
    ] {
        let said = refusal(path);
        assert!(said.contains(named), "{said}");
    }
}
