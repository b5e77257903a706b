//! Waiting postures, and occlusion between surfaces.

use crate::common::{self, BOARD, arm, limits, maps_of, range, room, wall};
use glam::DVec3;
use hwall_arrival::kinematics::{Chain, ChainArm, JointPositions, SrsArm};
use hwall_arrival::reachability::{Target, WallFacet, WallMaps};
use hwall_arrival::{
    ArrivalError, PostureArrivals, Surfaces, TouchRange, WaitingConfig, WaitingPosture, WallShare,
    WeightedTarget, judge_posture, targets_of_facets, targets_of_maps, waiting_posture,
    waiting_posture_from, waiting_posture_of_maps,
};
use hwall_testkit::refused;

/// Fewer targets and starts: these tests check what is found, not its quality.
fn quick() -> WaitingConfig {
    WaitingConfig {
        most_targets: 20,
        starts: 4,
        arm_angle_step_rad: 15_f64.to_radians(),
        ..WaitingConfig::default()
    }
}

/// The arm, the room, and the places that people touch there.
struct Scene {
    arm: SrsArm,
    maps: WallMaps,
    surfaces: Surfaces,
    targets: Vec<WeightedTarget>,
}

impl Scene {
    /// The surfaces extend beyond the borders of the walls by a margin.
    fn new(margin_m: f64) -> Self {
        let arm = arm();
        let maps = maps_of(&arm, &room());
        Self {
            surfaces: Surfaces::from_maps(&maps, margin_m).expect("valid"),
            targets: targets_of_maps(&maps, &range()).expect("within reach"),
            arm,
            maps,
        }
    }

    fn found(
        &self,
        targets: &[WeightedTarget],
        config: &WaitingConfig,
    ) -> Result<WaitingPosture, ArrivalError> {
        let (arm, surfaces) = (&self.arm, &self.surfaces);
        waiting_posture(arm, targets, surfaces, BOARD, &limits(), config)
    }

    fn judged(
        &self,
        q: &JointPositions,
        config: &WaitingConfig,
    ) -> Result<PostureArrivals, ArrivalError> {
        let (arm, targets, surfaces) = (&self.arm, &self.targets, &self.surfaces);
        judge_posture(q, arm, targets, surfaces, BOARD, &limits(), config)
    }
}

#[test]
fn the_posture_is_behind_the_walls_and_in_time() {
    let config = quick();
    let scene = Scene::new(config.clearance.margin_m);
    let (arm, maps) = (&scene.arm, &scene.maps);
    let find = || waiting_posture_of_maps(arm, maps, &range(), BOARD, &limits(), &config);
    let found = find().expect("found");
    assert_eq!(Ok(found), find());
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
    for point_m in BOARD.points_m(&arm.forward(&found.q)) {
        assert!(scene.surfaces.intrusion_m(point_m) <= -found.standoff_m + 1e-12);
    }
    // Not worse than hand-picked postures.
    let judged = |q: JointPositions| scene.judged(&q, &config).expect("valid");
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
    let scene = Scene::new(0.02);
    let (arm, targets, surfaces) = (&scene.arm, &scene.targets, &scene.surfaces);
    let hurried = WaitingConfig {
        budget_s: 0.5,
        ..quick()
    };
    let limits = limits();
    let found = scene.found(targets, &quick()).expect("found");
    let from = |from: &JointPositions| {
        waiting_posture_from(from, arm, targets, surfaces, BOARD, &limits, &hurried)
    };
    let near = from(&found.q).expect("found");
    assert_eq!(Ok(near), from(&found.q));
    let stays = scene.judged(&found.q, &hurried).expect("valid").posture;
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
        assert!(from(&JointPositions([bad; 7])).is_err(), "{bad}");
    }
}

#[test]
fn arrivals_are_what_they_amount_to() {
    let mut scene = Scene::new(0.05);
    // One out of reach, and one with zero weight.
    let far = Target {
        point_m: DVec3::new(5.0, 0.0, 0.5),
        normal: DVec3::X,
    };
    scene.targets.push(far.into());
    scene.targets[0].weight = 0.0;
    let config = quick();
    let judged = |config: &WaitingConfig| scene.judged(&common::waiting(), config).expect("valid");
    let exact = WaitingConfig {
        slack_m: 0.0,
        ..config.clone()
    };
    let arrivals = judged(&exact);
    assert_eq!(arrivals.arrivals_s.len(), scene.targets.len());
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
    let scene = Scene::new(0.05);
    let targets = &scene.targets;
    let config = WaitingConfig {
        most_targets: targets.len() / 4,
        starts: 2,
        ..quick()
    };
    let find = |targets: &[WeightedTarget]| scene.found(targets, &config).expect("found").q;
    let mut in_turn: Vec<WeightedTarget> = Vec::new();
    for first in 0..3 {
        in_turn.extend(targets.iter().skip(first).step_by(3));
    }
    assert_ne!(&in_turn, targets);
    assert_eq!(find(&in_turn), find(targets));
}

#[test]
fn targets_are_where_people_touch() {
    let arm = arm();
    let maps = maps_of(&arm, &room());
    let map = maps.map().expect("walls");
    let middle_m = DVec3::new(0.9, 0.0, 0.6);
    for share in [WallShare::Equal, WallShare::Area] {
        let range = TouchRange {
            share,
            ball: Some((middle_m, 0.5)),
            ..TouchRange::default()
        };
        let targets = targets_of_maps(&maps, &range).expect("within reach");
        let (mut front, mut aside) = (0.0_f64, 0.0_f64);
        for t in targets {
            let (p, normal) = (t.target.point_m, t.target.normal);
            assert!((0.18..=1.02).contains(&p.z) && p.distance(middle_m) <= 0.5);
            assert!(map.is_reachable(p, normal).expect("finite"));
            let side = match normal.x > 0.99 {
                true => &mut front,
                false => &mut aside,
            };
            *side += t.weight;
        }
        match share {
            WallShare::Equal => assert!((front - aside).abs() < 1e-12),
            WallShare::Area => assert!(front > aside),
        }
    }
    let everywhere = targets_of_facets(&room(), &TouchRange::default()).expect("places");
    let reached = targets_of_maps(&maps, &TouchRange::default()).expect("places");
    assert!(everywhere.len() > reached.len());
}

#[test]
fn what_is_in_front_of_what() {
    let mut facets = room();
    let shelf = [0.3, 0.6];
    facets.push(wall([0.74, -0.4], [0.74, -0.1], shelf));
    // Across the room: the base is on the touched side.
    facets.push(wall([3.0, 1.0], [3.0, -1.0], shelf));
    let surfaces = Surfaces::from_facets(&facets, 0.05).expect("valid");
    assert_eq!(surfaces.len(), 3);
    // Beyond the left edge: in front of the other wall.
    let off = 0.8 * 0.60 + 0.6 * 0.3 - (0.8 * 0.62 + 0.6 * 0.2);
    for (x, y, z, wanted) in [
        (0.60, -0.5, 0.8, -0.02),
        (0.65, -0.5, 0.8, 0.03),
        // Inside the shelf, in front of it, behind wall and shelf, beside the shelf.
        (0.70, -0.2, 0.5, -0.04),
        (0.75, -0.2, 0.5, 0.01),
        (0.60, -0.2, 0.5, -0.14),
        (0.70, 0.0, 0.5, 0.08),
        (0.60, 0.3, 0.5, off),
        // Above all walls.
        (0.70, 0.0, 2.0, f64::NEG_INFINITY),
    ] {
        let found = surfaces.intrusion_m(DVec3::new(x, y, z));
        let agrees = (found - wanted).abs() < 1e-9 || found == wanted;
        assert!(agrees, "{x}, {y}, {z}: {found}, not {wanted}");
    }
    assert!(surfaces.intrusion_m(DVec3::NAN) == f64::NEG_INFINITY);
}

#[test]
fn bad_input_is_named() {
    let scene = Scene::new(0.05);
    let good = &scene.targets;
    let find = |targets: &[WeightedTarget]| scene.found(targets, &quick()).expect_err("bad");
    assert_eq!(find(&[]), ArrivalError::Empty { what: "targets" });
    let far = Target {
        point_m: DVec3::new(5.0, 0.0, 0.5),
        normal: DVec3::X,
    };
    assert!(matches!(
        find(&[far.into()]),
        ArrivalError::OutOfReach { places: 1 }
    ));
    let mut weightless = good.clone();
    for target in &mut weightless {
        target.weight = 0.0;
    }
    assert!(matches!(find(&weightless), ArrivalError::Empty { .. }));
    let with = |target: WeightedTarget| scene.found(&[target], &quick());
    refused!(good[0], with, {
        weight = f64::NAN, -1.0;
        target.point_m.y = f64::NAN => "target[1] ";
        target.normal = DVec3::ZERO => "length of the normal";
        target.normal = DVec3::new(1.0, 0.0, 1.0) => "the wall's normal leans";
    });
    refused!(quick(), |config| scene.found(good, &config), {
        budget_s = 0.0;
        softness_s = f64::NAN;
        standoff_m = -0.1;
        slack_m = f64::NAN;
        rolls_rad = Vec::new() => "no rolls";
        arm_angle_step_rad = 0.0;
        most_targets = 0;
        starts = 0;
        start_from = vec![JointPositions([f64::NAN; 7])];
        blocked_s_per_m = f64::NAN;
    });
    let error = scene.judged(&JointPositions([3.0; 7]), &quick());
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
        targets_of_maps(&scene.maps, &dense),
        Err(ArrivalError::TooMany { .. })
    ));
    let nan = TouchRange {
        inset_m: f64::NAN,
        ..range()
    };
    assert!(matches!(
        targets_of_maps(&scene.maps, &nan),
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
    let mut scene = Scene::new(0.05);
    scene.surfaces = Surfaces::default();
    let mut config = quick();
    config.clearance.own_body_m = 0.0;
    let found = scene.found(&scene.targets, &config).expect("found");
    assert_eq!(found.clear_share, 1.0);
    assert_eq!(found.standoff_m, f64::INFINITY);
}

/// The same arm as a chain: a numerical search finds some of its configurations.
#[test]
fn an_arm_without_a_closed_form_waits_nearly_as_well() {
    let config = quick();
    let mut scene = Scene::new(config.clearance.margin_m);
    scene.surfaces = Surfaces::from_facets(&room(), config.clearance.margin_m).expect("upright");
    let (targets, surfaces) = (&scene.targets, &scene.surfaces);
    let chain = ChainArm::new(Chain::iiwa7()).expect("seven joints");
    let chain = chain.with_tool(*scene.arm.flange_from_tool());
    let exact = scene.found(targets, &config).expect("found");
    let found = waiting_posture(&chain, targets, surfaces, BOARD, &limits(), &config);
    let found = found.expect("found");
    let judged = scene.judged(&found.q, &config);
    let judged = judged.expect("within the limits").posture;
    assert!(found.standoff_m >= config.standoff_m - 0.005, "{found:?}");
    let [best, in_time] = [exact.in_time_share, judged.in_time_share];
    assert!(in_time > best - 0.1, "{in_time} {best}");
    // Targets not found count as late.
    assert!(found.in_time_share < in_time + 0.02, "{found:?} {judged:?}");
}
