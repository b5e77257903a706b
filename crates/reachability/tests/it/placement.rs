//! Base placement against brute force, in rotated scenes, and in hard cases.

use crate::common::{exact_solver, place, scattered_targets, small_config, steps, with_limit};
use glam::{DMat3, DVec3};
use hwall_kinematics::{Pose, SrsArm};
use hwall_reachability::{
    Interval, Placement, PlacementConfig, PlacementScores, Roll, Target, WallPlane,
    position_margin_m,
};

/// y and x of a base, in the order of the grid, m.
fn place_of(placement: &Placement) -> (f64, f64) {
    let at = placement.room_from_base.position_m();
    (at.y, at.x)
}

/// The board in the frame of the base.
fn board_from_base(placement: &Placement, target: &Target, roll_rad: f64) -> Pose {
    let plane = WallPlane::through(target.point_m, target.normal).expect("a wall");
    let room = Pose::new(plane.board_rotation(roll_rad), target.point_m).expect("finite");
    placement.room_from_base.inverse() * room
}

fn rolls(roll: &Roll) -> Vec<f64> {
    match roll {
        Roll::Fixed(roll) => vec![*roll],
        Roll::AnyOf(rolls) => rolls.clone(),
        Roll::Free => vec![0.0],
    }
}

/// Brute force, one verdict after another: targets reached, worst margin, mean margin.
fn by_hand(
    arm: &SrsArm,
    targets: &[Target],
    config: &PlacementConfig,
    placement: &Placement,
) -> (usize, f64, f64) {
    let arm = match config.roll {
        Roll::Free => with_limit(arm, 6, [-360.0, 360.0]),
        _ => arm.clone(),
    };
    let (mut count, mut worst, mut sum) = (0, f64::INFINITY, 0.0);
    for target in targets {
        let base = placement.room_from_base.position_m();
        let behind = target.normal.normalize().dot(target.point_m - base);
        if config.least_behind_m.is_some_and(|least| behind < least) {
            continue;
        }
        let poses = rolls(&config.roll)
            .into_iter()
            .map(|roll| board_from_base(placement, target, roll));
        let reached: Vec<Pose> = poses.filter(|pose| arm.is_reachable(pose)).collect();
        if reached.is_empty() {
            continue;
        }
        let margins = reached.iter().map(|pose| {
            let margin = position_margin_m(&arm, pose, 0.0).expect("finite");
            margin.unwrap_or(0.0)
        });
        let margin = margins.fold(0.0, f64::max);
        (count, worst, sum) = (count + 1, margin.min(worst), sum + margin);
    }
    (count, worst, sum / count as f64)
}

/// All counts, and the list of the best, against brute force.
fn check(arm: &SrsArm, targets: &[Target], config: &PlacementConfig) -> PlacementScores {
    let scores = place(arm, targets, config);
    let mut ranked: Vec<(usize, f64)> = Vec::new();
    for iy in 0..config.y.count() {
        for ix in 0..config.x.count() {
            let mut best = (0, -1.0);
            for (index, &heading_rad) in config.headings_rad.iter().enumerate() {
                let base_m = DVec3::new(config.x.at(ix), config.y.at(iy), config.z_m);
                let candidate = Placement {
                    room_from_base: Pose::from_yaw(heading_rad, base_m).expect("finite"),
                    heading_rad,
                    reachable: 0,
                    total: targets.len(),
                    worst_margin_m: None,
                    mean_margin_m: None,
                };
                let (count, worst, _) = by_hand(arm, targets, config, &candidate);
                let found = scores.reachable(ix, iy, index);
                assert_eq!(found, Some(count), "{candidate:?}");
                let worst = if count > 0 { worst } else { -1.0 };
                if count > best.0 || (count == best.0 && worst > best.1) {
                    best = (count, worst);
                }
            }
            assert_eq!(scores.cell(ix, iy).map(|c| c.reachable), Some(best.0));
            ranked.push(best);
        }
    }
    ranked.sort_by(|a, b| b.0.cmp(&a.0).then(b.1.total_cmp(&a.1)));
    assert_eq!(scores.best().len(), config.best.min(ranked.len()));
    for (placement, (count, worst)) in scores.best().iter().zip(ranked) {
        assert_eq!(placement.reachable, count);
        let alone = by_hand(arm, targets, config, placement);
        assert_eq!(alone.0, count);
        let Some(found) = placement.worst_margin_m else {
            assert_eq!((count, placement.mean_margin_m), (0, None));
            continue;
        };
        // Margins come in steps of 1 %; rounding can make one step of difference.
        for by_hand in [worst, alone.1] {
            assert!(
                (found - by_hand).abs() <= 0.025 * by_hand,
                "{placement:?} {by_hand}"
            );
        }
        let mean = placement.mean_margin_m.expect("some are reached");
        assert!((mean - alone.2).abs() <= 0.025 * alone.2, "{placement:?}");
        assert!(mean >= found);
    }
    scores
}

#[test]
fn counts_and_ranking_are_those_of_brute_force() {
    let iiwa = SrsArm::iiwa7();
    let targets = scattered_targets(50);
    let config = small_config();
    check(&iiwa, &targets, &config);
    let arms = [
        SrsArm::iiwa14(),
        with_limit(&iiwa, 0, [-30.0, 30.0]),
        with_limit(&iiwa, 0, [20.0, 140.0]),
        with_limit(&iiwa, 0, [-400.0, 400.0]),
        with_limit(&iiwa, 0, [200.0, 500.0]),
        with_limit(&iiwa, 2, [-40.0, 75.0]),
        with_limit(&iiwa, 0, [f64::NEG_INFINITY, 0.0]),
    ];
    for arm in &arms {
        check(arm, &targets, &config);
    }
    let changes: [fn(&mut PlacementConfig); 5] = [
        |c| c.roll = Roll::Fixed(0.4),
        |c| c.roll = Roll::quarter_turns(),
        |c| c.roll = Roll::Free,
        |c| c.headings_rad = vec![2.0],
        |c| c.least_behind_m = Some(0.6),
    ];
    for change in changes {
        let mut config = config.clone();
        change(&mut config);
        check(&iiwa, &targets, &config);
        check(&arms[1], &targets, &config);
    }
    let tool = Pose::new(
        DMat3::from_euler(glam::EulerRot::XYZ, 0.2, -0.3, 0.4),
        DVec3::new(0.05, -0.02, 0.1),
    );
    check(&iiwa.with_tool(tool.expect("valid")), &targets, &config);
}

#[test]
fn ties_at_full_share_are_ranked_by_the_worst_margin() {
    let config = PlacementConfig {
        best: 7,
        ..PlacementConfig::new(steps(1.1, 0.06, 14), steps(-0.4, 0.08, 11), 0.8)
    };
    let wall = DVec3::new(2.0, 0.0, 0.0);
    let targets =
        Target::on_wall(wall, DVec3::X, 0.2, Interval::new(1.1, 1.3), 0.1).expect("valid");
    let scores = check(&SrsArm::iiwa7(), &targets, &config);
    assert!(scores.best().iter().all(|p| p.share() == 1.0));
    let full = scores.shares().iter().filter(|&&s| s == 1.0).count();
    assert!(full > 20, "{full} positions tie");
    // Each position once.
    for (i, a) in scores.best().iter().enumerate() {
        let same = |b: &&Placement| place_of(a) == place_of(b);
        assert_eq!(scores.best()[i..].iter().filter(same).count(), 1);
    }
}

#[test]
fn a_free_roll_of_a_tool_off_the_last_axis() {
    let offset = Pose::new(DMat3::IDENTITY, DVec3::new(0.12, 0.0, 0.05)).expect("valid");
    let arm = SrsArm::iiwa7().with_tool(offset);
    let targets = scattered_targets(8);
    let config = PlacementConfig {
        roll: Roll::Free,
        headings_rad: vec![0.3, 2.0],
        best: 2,
        ..PlacementConfig::new(steps(1.2, 0.4, 3), steps(-0.3, 0.35, 2), 0.7)
    };
    let scores = place(&arm, &targets, &config);
    let solver = exact_solver(&arm, |c| c.roll = Roll::Free);
    for (index, &heading) in config.headings_rad.iter().enumerate() {
        let turn = DMat3::from_rotation_z(-heading);
        for (iy, y) in config.y.iter().enumerate() {
            for (ix, x) in config.x.iter().enumerate() {
                let base = DVec3::new(x, y, config.z_m);
                let reached = targets.iter().filter(|t| {
                    let point = turn * (t.point_m - base);
                    let plane = WallPlane::through(point, turn * t.normal).expect("a wall");
                    let line = plane.line(point.z);
                    solver
                        .is_reachable(&line, plane.project(point).at.s_m)
                        .expect("finite")
                });
                assert_eq!(scores.reachable(ix, iy, index), Some(reached.count()));
            }
        }
    }
    assert!(scores.best()[0].worst_margin_m > Some(0.0));
}

#[test]
fn nothing_in_reach_gives_zeros_in_the_order_of_the_grid() {
    let far = Target {
        point_m: DVec3::new(20.0, 0.0, 1.0),
        normal: DVec3::Y,
    };
    let mut config = small_config();
    let scores = place(&SrsArm::iiwa7(), &[far, far], &config);
    assert!(scores.shares().iter().all(|&share| share == 0.0));
    let firsts: Vec<_> = scores.best().iter().map(place_of).collect();
    assert_eq!(
        firsts,
        [0, 1, 2, 3].map(|i| (config.y.at(0), config.x.at(i)))
    );
    for best in scores.best() {
        assert_eq!((best.reachable, best.total, best.share()), (0, 2, 0.0));
        assert_eq!((best.worst_margin_m, best.mean_margin_m), (None, None));
    }
    config.best = 0;
    assert!(place(&SrsArm::iiwa7(), &[far], &config).best().is_empty());
    config.best = 1000;
    let all = place(&SrsArm::iiwa7(), &scattered_targets(10), &config);
    assert_eq!(all.best().len(), 20);
    let order = all.best().iter().map(|p| p.reachable);
    assert!(order.is_sorted_by(|a, b| a >= b));
}

#[test]
fn ties_go_to_the_first_of_the_grid_and_repeat() {
    // A scene that is its own mirror image: y and -y tie.
    let wall = DVec3::new(1.8, 0.0, 0.0);
    let targets =
        Target::on_wall(wall, DVec3::X, 0.5, Interval::new(0.9, 1.3), 0.25).expect("valid");
    let config = PlacementConfig::new(steps(1.0, 0.125, 6), steps(-0.25, 0.125, 5), 0.7);
    let scores = place(&SrsArm::iiwa7(), &targets, &config);
    assert_eq!(scores, place(&SrsArm::iiwa7(), &targets, &config));
    let twice: Vec<Target> = targets.iter().chain(&targets).copied().collect();
    let doubled = place(&SrsArm::iiwa7(), &twice, &config);
    for (a, b) in scores.best().iter().zip(doubled.best()) {
        assert_eq!(place_of(a), place_of(b));
        assert_eq!(a.worst_margin_m, b.worst_margin_m);
        assert_eq!(2 * a.reachable, b.reachable);
    }
    let shares = scores.shares();
    for iy in 0..5 {
        for ix in 0..6 {
            assert_eq!(shares[iy * 6 + ix], shares[(4 - iy) * 6 + ix]);
        }
    }
    for pair in scores.best().windows(2) {
        let key = |p: &Placement| (p.reachable, p.worst_margin_m);
        assert!(key(&pair[0]) >= key(&pair[1]));
        if key(&pair[0]) == key(&pair[1]) {
            assert!(place_of(&pair[0]) < place_of(&pair[1]));
        }
    }
}
