//! Waiting postures, and occlusion between surfaces.

use crate::common::{self, BOARD, arm, limits, maps_of, room, wall};
use glam::DVec3;
use hwall_arrival::kinematics::{Chain, ChainArm, JointPositions};
use hwall_arrival::reachability::{Interval, Target, WallFacet, WallMaps};
use hwall_arrival::{
    ArrivalError, Surfaces, TouchRange, WaitingConfig, WallShare, WeightedTarget, judge_posture,
    targets_of_facets, targets_of_maps, waiting_posture, waiting_posture_from,
    waiting_posture_of_maps,
};

/// Fewer targets and starts: these tests check what is found, not its quality.
fn quick() -> WaitingConfig {
    WaitingConfig {
        most_targets: 20,
        starts: 4,
        arm_angle_step_rad: 15_f64.to_radians(),
        ..WaitingConfig::default()
    }
}

fn range() -> TouchRange {
    TouchRange {
        spacing_m: 0.2,
        ..TouchRange::default()
    }
}

#[test]
fn the_posture_is_behind_the_walls_and_in_time() {
    let arm = arm();
    let maps = maps_of(&arm, &room());
    let config = quick();
    let found =
        waiting_posture_of_maps(&arm, &maps, &range(), BOARD, &limits(), &config).expect("found");
    let again = waiting_posture_of_maps(&arm, &maps, &range(), BOARD, &limits(), &config);
    assert_eq!(Ok(found), again);
    for (limit, q) in arm.limits().iter().zip(found.q.0) {
        assert!(limit.contains(q));
    }
    assert!(found.standoff_m > config.standoff_m - 0.005, "{found:?}");
    assert!(
        found.mean_arrival_s > 0.2 && found.mean_arrival_s < 0.9,
        "{found:?}"
    );
    assert!((found.reached_share - 1.0).abs() < 1e-12);
    // Corners and middle, one by one.
    let surfaces = Surfaces::from_maps(&maps, config.clearance.margin_m).expect("valid");
    for point_m in BOARD.points_m(&arm.forward(&found.q)) {
        assert!(surfaces.intrusion_m(point_m) <= -found.standoff_m + 1e-12);
    }
    // Not worse than hand-picked postures.
    let targets = targets_of_maps(&maps, &range()).expect("within reach");
    let judged = |q: JointPositions| {
        judge_posture(&q, &arm, &targets, &surfaces, BOARD, &limits(), &config).expect("valid")
    };
    let here = judged(found.q);
    assert_eq!(here.posture, found);
    for other in [
        [0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0],
        [-6.0, 18.0, 0.0, -100.0, -13.0, -29.0, 101.0],
        [20.0, 20.0, 0.0, -110.0, 0.0, -40.0, 0.0],
    ] {
        let there = judged(JointPositions::from_deg(other));
        let (here, there) = (here.posture.in_time_share, there.posture.in_time_share);
        assert!(here > there - 0.01, "{other:?}: {here}, {there}");
    }
}

#[test]
fn for_people_in_a_hurry_there_is_a_better_posture_nearby() {
    let arm = arm();
    let maps = maps_of(&arm, &room());
    let targets = targets_of_maps(&maps, &range()).expect("within reach");
    let surfaces = Surfaces::from_maps(&maps, 0.02).expect("valid");
    let nominal = quick();
    let hurried = WaitingConfig {
        budget_s: 0.5,
        ..quick()
    };
    let limits = limits();
    let found =
        waiting_posture(&arm, &targets, &surfaces, BOARD, &limits, &nominal).expect("found");
    let from = |from: &JointPositions, config: &WaitingConfig| {
        waiting_posture_from(from, &arm, &targets, &surfaces, BOARD, &limits, config)
    };
    let near = from(&found.q, &hurried).expect("found");
    assert_eq!(Ok(near), from(&found.q, &hurried));
    let judged = judge_posture(
        &found.q, &arm, &targets, &surfaces, BOARD, &limits, &hurried,
    );
    let stays = judged.expect("valid").posture;
    assert!(
        near.in_time_share > stays.in_time_share + 0.02,
        "{} after {}",
        near.in_time_share,
        stays.in_time_share
    );
    assert!(near.standoff_m > hurried.standoff_m - 0.005, "{near:?}");
    let away_s = limits.travel_time_s(&found.q, &near.q);
    assert!(away_s < 0.6, "{away_s}");
    // No start available.
    for bad in [f64::NAN, 9.0] {
        assert!(from(&JointPositions([bad; 7]), &hurried).is_err(), "{bad}");
    }
}

#[test]
fn arrivals_are_what_they_amount_to() {
    let arm = arm();
    let maps = maps_of(&arm, &room());
    let mut targets = targets_of_maps(&maps, &range()).expect("within reach");
    // One out of reach, and one with zero weight.
    targets.push(
        Target {
            point_m: DVec3::new(5.0, 0.0, 0.5),
            normal: DVec3::X,
        }
        .into(),
    );
    targets[0].weight = 0.0;
    let config = quick();
    let surfaces = Surfaces::from_maps(&maps, 0.05).expect("valid");
    let judged = |config: &WaitingConfig| {
        judge_posture(
            &common::waiting(),
            &arm,
            &targets,
            &surfaces,
            BOARD,
            &limits(),
            config,
        )
        .expect("valid")
    };
    let exact = WaitingConfig {
        slack_m: 0.0,
        ..config.clone()
    };
    let arrivals = judged(&exact);
    assert_eq!(arrivals.arrivals_s.len(), targets.len());
    assert_eq!(arrivals.arrivals_s.last(), Some(&None));
    assert_eq!(arrivals.arrivals_s[0], None);
    assert!(arrivals.posture.reached_share < 1.0);
    let late = 1.0 - arrivals.share_within(config.budget_s);
    assert!((arrivals.posture.late_share - late).abs() < 1e-12);
    assert!((arrivals.share_within(f64::INFINITY) - 1.0).abs() < 1e-12);
    assert_eq!(arrivals.share_within(f64::NAN), 0.0);
    assert!(arrivals.quantile_s(0.5) <= arrivals.quantile_s(0.9));
    let middle = arrivals.quantile_s(0.5);
    assert!(arrivals.share_within(middle) >= 0.5);
    // Expected in time: the probability that a budget exceeds the time, over all targets.
    let priceless = WaitingConfig {
        blocked_s_per_m: 0.0,
        ..exact
    };
    let expected = judged(&priceless);
    let (mut in_time, mut all) = (0.0, 0.0);
    for (arrival, weight) in expected.arrivals_s.iter().zip(&expected.weights) {
        all += weight;
        if let Some(arrival_s) = arrival {
            let beyond = (arrival_s - priceless.budget_s) / priceless.softness_s;
            in_time += weight / (1.0 + beyond.exp());
        }
    }
    assert!((expected.posture.in_time_share - in_time / all).abs() < 1e-12);
    assert!(arrivals.posture.in_time_share < expected.posture.in_time_share + 1e-12);
    // Slack brings all of them nearer.
    let slack = judged(&WaitingConfig {
        slack_m: 0.055,
        ..config
    });
    assert!(slack.posture.mean_arrival_s < arrivals.posture.mean_arrival_s - 0.01);
}

/// Regression test: lists alternate between walls; sampling every second place left a wall out, and the arm waited far from it.
#[test]
fn the_order_of_the_targets_does_not_matter() {
    let arm = arm();
    let maps = maps_of(&arm, &room());
    let surfaces = Surfaces::from_maps(&maps, 0.05).expect("valid");
    let targets = targets_of_maps(&maps, &range()).expect("within reach");
    let config = WaitingConfig {
        most_targets: targets.len() / 4,
        starts: 2,
        ..quick()
    };
    let find = |targets: &[WeightedTarget]| {
        let found = waiting_posture(&arm, targets, &surfaces, BOARD, &limits(), &config);
        found.expect("found").q
    };
    let mut in_turn: Vec<WeightedTarget> = Vec::new();
    for first in 0..3 {
        in_turn.extend(targets.iter().skip(first).step_by(3));
    }
    assert_ne!(in_turn, targets);
    assert_eq!(find(&in_turn), find(&targets));
}

#[test]
fn targets_are_where_people_touch() {
    let arm = arm();
    let maps = maps_of(&arm, &room());
    let ball = Some((DVec3::new(0.9, 0.0, 0.6), 0.5));
    for share in [WallShare::Equal, WallShare::Area] {
        let range = TouchRange {
            share,
            ball,
            ..TouchRange::default()
        };
        let targets = targets_of_maps(&maps, &range).expect("within reach");
        let front = |t: &&WeightedTarget| t.target.normal.x > 0.99;
        let weight = |of_front: bool| {
            targets
                .iter()
                .filter(|t| front(t) == of_front)
                .map(|t| t.weight)
                .sum::<f64>()
        };
        for t in &targets {
            let p = t.target.point_m;
            assert!((0.18..=1.02).contains(&p.z) && p.distance(DVec3::new(0.9, 0.0, 0.6)) <= 0.5);
            assert!(
                maps.map()
                    .expect("walls")
                    .is_reachable(p, t.target.normal)
                    .expect("finite")
            );
        }
        match share {
            WallShare::Equal => assert!((weight(true) - weight(false)).abs() < 1e-12),
            WallShare::Area => assert!(weight(true) > weight(false)),
        }
    }
    let everywhere = targets_of_facets(&room(), &TouchRange::default()).expect("places");
    assert!(
        everywhere.len()
            > targets_of_maps(&maps, &TouchRange::default())
                .expect("places")
                .len()
    );
}

#[test]
fn what_is_in_front_of_what() {
    let mut facets = room();
    let shelf = Interval::new(0.3, 0.6);
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    facets.push(wall(at(0.74, -0.4, 0.0), at(0.74, -0.1, 0.0), shelf));
    // Across the room: the base is on the touched side.
    facets.push(wall(at(3.0, 1.0, 0.0), at(3.0, -1.0, 0.0), shelf));
    let surfaces = Surfaces::from_facets(&facets, 0.05).expect("valid");
    assert_eq!(surfaces.len(), 3);
    let is = |p: DVec3, wanted: f64| {
        let found = surfaces.intrusion_m(p);
        assert!(
            (found - wanted).abs() < 1e-9 || found == wanted,
            "{p}: {found}, not {wanted}"
        );
    };
    is(at(0.60, -0.5, 0.8), -0.02);
    is(at(0.65, -0.5, 0.8), 0.03);
    // Inside the shelf, in front of it, behind wall and shelf, beside the shelf.
    is(at(0.70, -0.2, 0.5), -0.04);
    is(at(0.75, -0.2, 0.5), 0.01);
    is(at(0.60, -0.2, 0.5), -0.14);
    is(at(0.70, 0.0, 0.5), 0.08);
    // Beyond the left edge: in front of the other wall.
    let off = 0.8 * 0.60 + 0.6 * 0.3 - (0.8 * 0.62 + 0.6 * 0.2);
    is(at(0.60, 0.3, 0.5), off);
    // Above all walls.
    is(at(0.70, 0.0, 2.0), f64::NEG_INFINITY);
    assert!(surfaces.intrusion_m(DVec3::NAN) == f64::NEG_INFINITY);
}

#[test]
fn bad_input_is_named() {
    let arm = arm();
    let maps = maps_of(&arm, &room());
    let surfaces = Surfaces::from_maps(&maps, 0.05).expect("valid");
    let good = targets_of_maps(&maps, &range()).expect("within reach");
    let find = |targets: &[WeightedTarget], config: &WaitingConfig| {
        waiting_posture(&arm, targets, &surfaces, BOARD, &limits(), config).expect_err("bad")
    };
    assert_eq!(find(&[], &quick()), ArrivalError::Empty { what: "targets" });
    let far = Target {
        point_m: DVec3::new(5.0, 0.0, 0.5),
        normal: DVec3::X,
    };
    assert!(matches!(
        find(&[far.into()], &quick()),
        ArrivalError::OutOfReach { places: 1 }
    ));
    let mut weightless = good.clone();
    for target in &mut weightless {
        target.weight = 0.0;
    }
    assert!(matches!(
        find(&weightless, &quick()),
        ArrivalError::Empty { .. }
    ));
    type Spoil = fn(&mut WeightedTarget);
    let spoils: [Spoil; 5] = [
        |t| t.weight = f64::NAN,
        |t| t.weight = -1.0,
        |t| t.target.point_m.y = f64::NAN,
        |t| t.target.normal = DVec3::ZERO,
        |t| t.target.normal = DVec3::new(1.0, 0.0, 1.0),
    ];
    for (i, spoil) in spoils.iter().enumerate() {
        let mut targets = good.clone();
        spoil(&mut targets[0]);
        assert!(!find(&targets, &quick()).to_string().is_empty(), "{i}");
    }
    type Change = fn(&mut WaitingConfig);
    let changes: [Change; 10] = [
        |c| c.budget_s = 0.0,
        |c| c.softness_s = f64::NAN,
        |c| c.standoff_m = -0.1,
        |c| c.slack_m = f64::NAN,
        |c| c.rolls_rad.clear(),
        |c| c.arm_angle_step_rad = 0.0,
        |c| c.most_targets = 0,
        |c| c.starts = 0,
        |c| c.start_from = vec![JointPositions([f64::NAN; 7])],
        |c| c.blocked_s_per_m = f64::NAN,
    ];
    for (i, change) in changes.iter().enumerate() {
        let mut config = quick();
        change(&mut config);
        assert!(!find(&good, &config).to_string().is_empty(), "{i}");
    }
    let outside = JointPositions([3.0; 7]);
    let error = judge_posture(&outside, &arm, &good, &surfaces, BOARD, &limits(), &quick());
    assert!(matches!(
        error,
        Err(ArrivalError::WaitingOutsideLimits { .. })
    ));
    assert_eq!(
        targets_of_maps(&WallMaps::default(), &range()),
        Err(ArrivalError::NoWalls)
    );
    assert_eq!(targets_of_facets(&[], &range()), Err(ArrivalError::NoWalls));
    let dense = TouchRange {
        spacing_m: 1e-6,
        ..range()
    };
    assert!(matches!(
        targets_of_maps(&maps, &dense),
        Err(ArrivalError::TooMany { .. })
    ));
    let nan = TouchRange {
        inset_m: f64::NAN,
        ..range()
    };
    assert!(matches!(
        targets_of_maps(&maps, &nan),
        Err(ArrivalError::Argument(_))
    ));
    let empty = WallFacet {
        outline_m: Vec::new(),
        ..room()[0].clone()
    };
    assert!(matches!(
        Surfaces::from_facets(&[empty], 0.05),
        Err(ArrivalError::Empty { .. })
    ));
}

#[test]
fn without_surfaces_nothing_is_in_the_way() {
    let arm = arm();
    let maps = maps_of(&arm, &room());
    let targets = targets_of_maps(&maps, &range()).expect("within reach");
    let mut config = quick();
    config.clearance.own_body_m = 0.0;
    let none = Surfaces::default();
    let found = waiting_posture(&arm, &targets, &none, BOARD, &limits(), &config).expect("found");
    assert_eq!(found.clear_share, 1.0);
    assert_eq!(found.standoff_m, f64::INFINITY);
}

/// The same arm as a chain: a numerical search finds some of its configurations.
#[test]
fn an_arm_without_a_closed_form_waits_nearly_as_well() {
    let arm = arm();
    let chain = ChainArm::new(Chain::iiwa7()).expect("seven joints");
    let chain = chain.with_tool(*arm.flange_from_tool());
    let (limits, config) = (limits(), quick());
    let targets = targets_of_maps(&maps_of(&arm, &room()), &range()).expect("targets");
    let margin_m = config.clearance.margin_m;
    let surfaces = Surfaces::from_facets(&room(), margin_m).expect("upright");
    let exact = waiting_posture(&arm, &targets, &surfaces, BOARD, &limits, &config);
    let found = waiting_posture(&chain, &targets, &surfaces, BOARD, &limits, &config);
    let (exact, found) = (exact.expect("found"), found.expect("found"));
    let judged = judge_posture(&found.q, &arm, &targets, &surfaces, BOARD, &limits, &config);
    let judged = judged.expect("within the limits").posture;
    assert!(found.standoff_m >= config.standoff_m - 0.005, "{found:?}");
    let [best, in_time] = [exact.in_time_share, judged.in_time_share];
    assert!(in_time > best - 0.1, "{in_time} {best}");
    // Targets not found count as late.
    assert!(found.in_time_share < in_time + 0.02, "{found:?} {judged:?}");
}
