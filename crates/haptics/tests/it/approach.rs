//! The board on its path: behind the surfaces, and exactly in place at the end.

use crate::support::iiwa as arm;
use glam::DVec3;
use hwall_haptics::{
    ApproachConfig, Barrier, BarrierTree, Board, BoardTarget, Follower, FollowerConfig, Planner,
    PlannerConfig, board_pose,
};
use hwall_kinematics::{JointPositions, JointVelocities};
use hwall_testkit::{Sampler, refused};
use std::sync::Arc;

const DT_S: f64 = 2e-3;
/// A wall in front of the arm, one that meets it at an outer corner, a box that stands out of the first.
const WALL_X_M: f64 = 0.6;
const SIDE: DVec3 = DVec3::new(0.8, 0.6, 0.0);

fn barriers() -> Vec<Barrier> {
    let new = |middle: [f64; 3], normal: DVec3, half: [f64; 2]| {
        Barrier::new(DVec3::from_array(middle), normal, half).unwrap()
    };
    let along = DVec3::new(-0.6, 0.8, 0.0);
    let corner = DVec3::new(WALL_X_M, 0.2, 0.6);
    vec![
        new([WALL_X_M, -0.5, 0.6], DVec3::X, [0.7, 1.2]),
        new((corner + along * 0.8).to_array(), SIDE, [0.8, 1.2]),
        new([0.7, -0.3, 0.35], DVec3::X, [0.2, 0.12]),
        new([0.65, -0.5, 0.35], DVec3::NEG_Y, [0.05, 0.12]),
        new([0.65, -0.1, 0.35], DVec3::Y, [0.05, 0.12]),
    ]
}

/// Elbow to the side, the board behind the first wall.
fn waiting() -> JointPositions {
    JointPositions::from_deg([24.0, 62.0, -104.0, -108.0, -37.0, -82.0, 36.0])
}

fn follower(barriers: &[Barrier]) -> Follower {
    follower_with(barriers, ApproachConfig::default())
}

fn follower_with(barriers: &[Barrier], config: ApproachConfig) -> Follower {
    let mut follower = Follower::new(Arc::new(arm()), FollowerConfig::default(), &waiting())
        .unwrap()
        .with_board(config, Board::default());
    follower.set_barriers(barriers);
    follower
}

fn go_on(follower: &mut Follower) {
    follower.step(DT_S).unwrap();
    follower.plan();
}

/// Most samples that a call of the planner checks.
fn most_samples() -> usize {
    PlannerConfig::default().samples + Planner::MOST_SAMPLES
}

/// A place on one of the surfaces.
fn place(sampler: &mut Sampler, shelf: bool) -> (DVec3, DVec3) {
    let z = sampler.uniform(0.2, 0.8);
    match (sampler.uniform(0.0, 5.0)) as usize {
        0 => {
            let along = sampler.uniform(0.1, 0.5);
            let corner = DVec3::new(WALL_X_M, 0.2, z);
            (corner + DVec3::new(-0.6, 0.8, 0.0) * along, SIDE)
        }
        1 if shelf => {
            let [y, z] = [sampler.uniform(-0.45, -0.15), sampler.uniform(0.28, 0.42)];
            (DVec3::new(0.7, y, z), DVec3::X)
        }
        _ => {
            let y = sampler.uniform(-0.5, 0.1);
            (DVec3::new(WALL_X_M, y, z), DVec3::X)
        }
    }
}

/// The result of many targets, most of them changed before they were reached.
#[derive(Default)]
struct Outcome {
    /// How far the face came in front of a surface in each step, m, in ascending order.
    in_front_m: Vec<f64>,
    /// Targets that were not changed meanwhile, and how many of them were reached.
    wanted: usize,
    reached: usize,
}

impl Outcome {
    fn most_m(&self) -> f64 {
        self.in_front_m[self.in_front_m.len() - 1]
    }
}

fn random_targets(
    barriers: &[Barrier],
    seed: u64,
    shelf: bool,
    count: usize,
    slows: bool,
) -> Outcome {
    let mut follower = follower(barriers);
    let mut sampler = Sampler::new(seed);
    let mut outcome = Outcome::default();
    for _ in 0..count {
        let (point_m, normal) = place(&mut sampler, shelf);
        let target = BoardTarget {
            slack_m: [0.03; 2],
            ..BoardTarget::new(point_m, normal, 0.0)
        };
        if sampler.uniform(0.0, 1.0) < 0.3 {
            follower.set_posture(&waiting(), None).unwrap();
        } else if follower.aim(&target).unwrap().is_some() {
            continue;
        }
        let stays = sampler.uniform(0.0, 1.0) < 0.5;
        let for_s = match stays {
            true => 4.0,
            false => sampler.uniform(0.05, 0.6),
        };
        for _ in 0..(for_s / DT_S) as usize {
            if slows && sampler.uniform(0.0, 1.0) < 0.01 {
                let share = [0.09, 0.25, 0.5, 0.7, 1.0][sampler.index(5)];
                follower.set_speed_share(share).unwrap();
            }
            go_on(&mut follower);
            assert!(follower.samples() <= most_samples());
            outcome.in_front_m.extend(follower.protrusion_m());
        }
        if stays {
            outcome.wanted += 1;
            let is_there = Some(follower.commanded()) == follower.goal();
            outcome.reached += usize::from(is_there);
        }
    }
    outcome.in_front_m.sort_by(f64::total_cmp);
    outcome
}

/// 3 mm for a path, 1.75 mm if no path keeps that, 0.25 mm between two samples.
const BOUND_M: f64 = 5e-3;

#[test]
fn random_targets_on_walls_keep_the_board_behind_them() {
    let seeds = [41, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];
    let outcomes = std::thread::scope(|scope| {
        let run =
            |seed| scope.spawn(move || random_targets(&barriers()[..2], seed, false, 500, false));
        seeds.map(run).map(|outcome| outcome.join().unwrap())
    });
    for (seed, outcome) in seeds.into_iter().zip(outcomes) {
        let (most_m, reached, wanted) = (outcome.most_m(), outcome.reached, outcome.wanted);
        println!("seed {seed}: {most_m} m, {reached} of {wanted}");
        assert!(most_m <= BOUND_M, "seed {seed}: {most_m} m before a wall");
        assert!(reached * 100 >= wanted * 97, "{reached} of {wanted}");
    }
}

#[test]
fn slowing_down_on_the_way_keeps_the_board_behind_walls() {
    for seed in [1, 2, 3, 4] {
        let outcome = random_targets(&barriers()[..2], seed, false, 400, true);
        let most_m = outcome.most_m();
        println!("seed {seed}: {most_m} m");
        assert!(most_m <= BOUND_M, "seed {seed}: {most_m} m before a wall");
    }
}

/// A goal may change while the board is in the box, or moving into it: it then comes out, in front of the wall.
#[test]
fn random_targets_on_a_box_are_nearly_as_well_kept() {
    let outcome = random_targets(&barriers(), 42, true, 1000, false);
    let n = outcome.in_front_m.len();
    let (most_m, most_of_100_m) = (outcome.most_m(), outcome.in_front_m[n - n / 100]);
    let (reached, wanted) = (outcome.reached, outcome.wanted);
    println!("{most_m} {most_of_100_m} {reached} of {wanted}");
    assert!(most_of_100_m <= 5e-3, "{most_of_100_m} m before a surface");
    assert!(most_m <= 0.1, "{most_m} m before a surface");
    assert!(reached * 100 >= wanted * 95, "{reached} of {wanted}");
}

#[test]
fn a_free_way_is_straight_and_least_in_time() {
    let mut follower = follower(&[]);
    let target = BoardTarget::new(DVec3::new(0.6, -0.25, 0.55), DVec3::X, 0.0);
    follower.aim(&target).unwrap();
    follower.step(1e-3).unwrap();
    follower.plan();
    assert!(!follower.is_detour() && follower.by_way_of().is_none() && !follower.is_blocked());
    let goal = follower.goal().unwrap();
    let least_s = follower.limits().travel_time_s(&waiting(), &goal);
    let left_s = follower.left_s().unwrap() + 1e-3;
    assert!((left_s - least_s).abs() < 1e-3, "{left_s} for {least_s}");
}

#[test]
fn the_board_ends_exactly_at_its_place() {
    let mut follower = follower(&barriers());
    let target = BoardTarget {
        behind_m: 0.01,
        ..BoardTarget::new(DVec3::new(WALL_X_M, -0.05, 0.6), DVec3::X, 0.0)
    };
    follower.set_target(&target).unwrap();
    for _ in 0..2000 {
        go_on(&mut follower);
    }
    let face = follower.commanded_pose();
    let wanted = DVec3::new(WALL_X_M - 0.01, -0.05, 0.6);
    assert!(face.position_m().distance(wanted) < 1e-11);
    assert_eq!(follower.left_s(), Some(0.0));
}

/// Time to each target when the board was moving to another one before, s; `None`: more than 4 s.
fn arrivals_after_a_change_s(retry_s: f64) -> Vec<Option<f64>> {
    let mut sampler = Sampler::new(43);
    let config = ApproachConfig {
        retry_s,
        ..ApproachConfig::default()
    };
    let mut follower = follower_with(&barriers()[..2], config);
    let mut arrivals = Vec::new();
    for _ in 0..200 {
        follower.restart(&waiting(), &Default::default()).unwrap();
        let before_s = sampler.uniform(0.2, 0.6);
        let [first, then] = [(); 2].map(|()| place(&mut sampler, false));
        let target = |(point_m, normal)| BoardTarget::new(point_m, normal, 0.0);
        if follower.aim(&target(first)).unwrap().is_some() {
            continue;
        }
        for _ in 0..(before_s / DT_S) as usize {
            go_on(&mut follower);
        }
        if follower.aim(&target(then)).unwrap().is_some() {
            continue;
        }
        let arrives = |_: &usize| {
            go_on(&mut follower);
            Some(follower.commanded()) == follower.goal()
        };
        let steps = (1..=(4.0 / DT_S) as usize).find(arrives);
        arrivals.push(steps.map(|steps| steps as f64 * DT_S));
    }
    arrivals
}

#[test]
fn a_way_that_is_looked_at_again_is_shorter() {
    let once = arrivals_after_a_change_s(1e3);
    let again = arrivals_after_a_change_s(ApproachConfig::default().retry_s);
    let both = once.into_iter().zip(again);
    let both: Vec<[f64; 2]> = both.filter_map(|(a, b)| Some([a?, b?])).collect();
    let mean_s = |i: usize| both.iter().map(|s| s[i]).sum::<f64>() / both.len() as f64;
    assert!(both.len() > 100, "{}", both.len());
    println!("{} {} {}", both.len(), mean_s(0), mean_s(1));
    assert!(mean_s(1) < 0.98 * mean_s(0), "{} {}", mean_s(0), mean_s(1));
}

/// A box around the goal that opens only to its front: no straight path and no bend, only from behind.
#[test]
fn a_shelf_is_reached_from_behind_its_wall() {
    let mut follower = follower(&barriers());
    let point_m = DVec3::new(0.7, -0.3, 0.35);
    follower
        .set_target(&BoardTarget::new(point_m, DVec3::X, 0.0))
        .unwrap();
    let mut most_m = f64::NEG_INFINITY;
    for _ in 0..2000 {
        go_on(&mut follower);
        most_m = most_m.max(follower.protrusion_m().unwrap_or(most_m));
    }
    assert!(follower.commanded_pose().position_m().distance(point_m) < 1e-9);
    assert!(most_m <= 5e-3, "{most_m}");
}

/// A hold begins the motion anew from wherever the board is. Regression: it forgot the shelf that the board was in, whose wall then hemmed the board
/// in for good.
#[test]
fn a_board_that_was_stopped_in_a_shelf_comes_out_of_it() {
    let mut sampler = Sampler::new(11);
    for number in 0..40 {
        let mut follower = follower(&barriers());
        let point_m = DVec3::new(0.7, sampler.uniform(-0.45, -0.15), 0.35);
        let target = BoardTarget::new(point_m, DVec3::X, 0.0);
        if follower.aim(&target).unwrap().is_some() {
            continue;
        }
        let steps = |s: f64| 0..(s / DT_S) as usize;
        steps(4.0).for_each(|_| go_on(&mut follower));
        assert_eq!(Some(follower.commanded()), follower.goal(), "{point_m}");
        // On the way out, twice.
        for _ in 0..2 {
            follower.set_posture(&waiting(), None).unwrap();
            steps(sampler.uniform(0.0, 0.4)).for_each(|_| go_on(&mut follower));
            let at = follower.commanded();
            follower.restart(&at, &JointVelocities([0.0; 7])).unwrap();
        }
        follower.set_posture(&waiting(), None).unwrap();
        for _ in steps(4.0) {
            go_on(&mut follower);
            // What was allowed on the way in, no more.
            let in_front_m = follower.protrusion_m().unwrap_or(0.0);
            assert!(in_front_m <= 5e-3, "{number}: {in_front_m}");
        }
        assert_eq!(follower.commanded(), waiting(), "{number}: from {point_m}");
    }
}

/// The plane of a shelf's top, which ends at no barrier, lies between the board and a place of the wall above it.
#[test]
fn a_shelf_that_nobody_knows_does_not_keep_the_board_for_good() {
    for y_m in [-0.35, -0.25, -0.15] {
        let mut follower = follower(&barriers()[..2]);
        let top_m = DVec3::new(0.5, y_m, 0.45);
        for (point_m, normal) in [
            (top_m, DVec3::Z),
            (DVec3::new(WALL_X_M, y_m, 0.75), DVec3::X),
        ] {
            let target = BoardTarget::new(point_m, normal, 0.0);
            assert_eq!(follower.set_target(&target).unwrap(), None);
            for _ in 0..2500 {
                go_on(&mut follower);
            }
            let off_m = follower.commanded_pose().position_m().distance(point_m);
            assert!(off_m < 1e-9, "{point_m} of {normal}: {off_m}");
        }
    }
}

/// Steps that check samples until the board starts to move to the place within the shelf, and the most samples of a step. `share` is the speed share;
/// if `restless`, target and speed change in every step.
fn steps_of_a_search(share: f64, restless: bool) -> (usize, usize) {
    let mut follower = follower(&barriers());
    follower.set_speed_share(share).unwrap();
    let target = |step: usize| {
        let y = if restless { 1e-5 * step as f64 } else { 0.0 };
        BoardTarget::new(DVec3::new(0.7, -0.3 + y, 0.35), DVec3::X, 0.0)
    };
    let (mut steps, mut most) = (0, 0);
    for step in 0..300 {
        assert_eq!(follower.set_target(&target(step)).unwrap(), None);
        if restless {
            let more = 1.0 + 1e-3 * (step % 7) as f64;
            follower.set_speed_share(share * more).unwrap();
        }
        go_on(&mut follower);
        steps += usize::from(follower.samples() > 0);
        most = most.max(follower.samples());
        if follower.commanded_velocity().0.iter().any(|qd| *qd != 0.0) {
            break;
        }
    }
    let begun = follower.commanded() != waiting();
    assert!(begun, "{steps} steps, at most {most} samples");
    // At full speed it arrives, on paths that were found meanwhile.
    follower.set_speed_share(1.0).unwrap();
    for _ in 0..2000 {
        go_on(&mut follower);
        let in_front_m = follower.protrusion_m().unwrap();
        assert!(in_front_m <= BOUND_M, "{in_front_m}");
    }
    assert_eq!(Some(follower.commanded()), follower.goal());
    (steps, most)
}

/// A nearly stopped board needs minutes to its goal, and each of its paths many samples.
#[test]
fn a_search_that_takes_long_goes_on_in_the_next_steps() {
    let (nominal_steps, _) = steps_of_a_search(1.0, false);
    assert_eq!(nominal_steps, 1);
    for restless in [false, true] {
        let (steps, most) = steps_of_a_search(0.002, restless);
        println!("{steps} steps, at most {most} samples");
        assert!((10..60).contains(&steps), "{restless}: {steps}");
        assert!(most <= most_samples(), "{restless}: {most}");
    }
}

#[test]
fn what_is_before_a_surface_is_told() {
    let mut follower = follower(&barriers());
    follower.step(0.0).unwrap();
    follower.plan();
    follower.step(0.0).unwrap();
    assert!(follower.protrusion_m().unwrap() < -0.05);
    let arm = arm();
    let before = board_pose(DVec3::new(WALL_X_M + 0.03, -0.2, 0.65), DVec3::X, 0.0).unwrap();
    let found = arm.nearest_solution(&before, &waiting(), &Default::default());
    let face = arm.forward(&found.unwrap().q);
    let tree = BarrierTree::from(barriers().as_slice());
    let told_m = tree.protrusion_m(&Board::default(), &face).unwrap();
    assert!((told_m - 0.03).abs() < 1e-9, "{told_m}");
}

#[test]
fn settings_and_barriers_out_of_range_are_refused() {
    refused!(
        ApproachConfig::default(),
        |c: ApproachConfig| c.validate(),
        {
            allowed_m = -1.0;
            detours_m = [f64::NAN; 6];
            extent_m = 0.0;
            footprint_m = f64::INFINITY;
            retry_s = 0.0;
        }
    );
    let at = DVec3::X;
    assert!(Barrier::new(at * f64::NAN, DVec3::X, [1.0; 2]).is_err());
    assert!(Barrier::new(at, DVec3::ZERO, [1.0; 2]).is_err());
    assert!(Barrier::new(at, DVec3::X, [0.0, 1.0]).is_err());
}
