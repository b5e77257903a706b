//! Arms without a closed form: six joints, a prismatic joint, unlimited joints.

use crate::common::{BOARD, check_nodes, coarse, range, room};
use glam::{DMat3, DVec3};
use hwall_arrival::kinematics::{
    ArmKinematics, Chain, ChainArm, ChainJoint, JointLimit, JointPositions, Pose,
};
use hwall_arrival::motion::{MotionConfig, MotionLimits};
use hwall_arrival::{
    Atlas, Surfaces, WaitingConfig, WeightedTarget, judge_posture, targets_of_facets,
    waiting_posture,
};
use hwall_testkit::Sampler;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Position in the previous link, m, its rotation about x, rad, half the range, rad, and speed, rad/s; all axes are z.
type Row = ([f64; 3], f64, f64, f64);

/// The lengths of a UR5e.
const SIX: [Row; 6] = [
    ([0.0, 0.0, 0.1625], 0.0, TAU, PI),
    ([0.0, 0.0, 0.0], FRAC_PI_2, TAU, PI),
    ([-0.425, 0.0, 0.0], 0.0, PI, PI),
    ([-0.3922, 0.0, 0.1333], 0.0, TAU, PI),
    ([0.0, -0.0997, 0.0], FRAC_PI_2, TAU, PI),
    ([0.0, 0.0996, 0.0], -FRAC_PI_2, TAU, PI),
];

/// Seven joints in the order of a Gen3, every other one unlimited.
const ENDLESS: [Row; 7] = [
    ([0.0, 0.0, 0.156], PI, f64::INFINITY, 1.39),
    ([0.0, 0.005, -0.128], FRAC_PI_2, 2.41, 1.39),
    ([0.0, -0.21, -0.006], -FRAC_PI_2, f64::INFINITY, 1.39),
    ([0.0, 0.006, -0.21], FRAC_PI_2, 2.66, 1.39),
    ([0.0, -0.208, -0.006], -FRAC_PI_2, f64::INFINITY, 1.22),
    ([0.0, 0.0, -0.106], FRAC_PI_2, 2.23, 1.22),
    ([0.0, -0.106, 0.0], -FRAC_PI_2, f64::INFINITY, 1.22),
];

fn joint(number: usize, &(at_m, turn_rad, half_rad, rad_per_s): &Row) -> ChainJoint {
    let previous_from_link = Pose::new(DMat3::from_rotation_x(turn_rad), DVec3::from_array(at_m));
    let limit = JointLimit::new(-half_rad, half_rad);
    let name = format!("turn {number}");
    let place = previous_from_link.expect("finite");
    ChainJoint {
        max_velocity: Some(rad_per_s),
        max_acceleration: Some(4.0 * rad_per_s),
        ..ChainJoint::revolute(name, place, DVec3::Z, limit)
    }
}

fn turning(rows: &[Row]) -> impl Iterator<Item = ChainJoint> {
    rows.iter().enumerate().map(|(i, row)| joint(i, row))
}

fn arm_of(joints: impl Iterator<Item = ChainJoint>, last_turn_rad: f64) -> ChainArm {
    let tip = Pose::new(DMat3::from_rotation_x(last_turn_rad), DVec3::ZERO).expect("finite");
    ChainArm::new(Chain::new(joints.collect(), tip).expect("a chain")).expect("an arm")
}

fn six() -> ChainArm {
    arm_of(turning(&SIX), 0.0)
}

/// The same on a rail along the wall.
fn on_a_rail() -> ChainArm {
    let limit = JointLimit::new(-0.3, 0.3);
    let rail = ChainJoint {
        max_velocity: Some(1.0),
        max_acceleration: Some(4.0),
        ..ChainJoint::prismatic("rail", Pose::IDENTITY, DVec3::Y, limit)
    };
    arm_of(std::iter::once(rail).chain(turning(&SIX)), 0.0)
}

fn endless() -> ChainArm {
    arm_of(turning(&ENDLESS), PI)
}

fn limits_of(arm: &ChainArm) -> MotionLimits {
    MotionLimits::of_arm(arm, &MotionConfig::default()).expect("valid")
}

fn targets() -> Vec<WeightedTarget> {
    targets_of_facets(&room(), &range()).expect("walls")
}

/// Fewer targets and starts: these tests check what is found, not its quality.
fn quick() -> WaitingConfig {
    WaitingConfig {
        most_targets: 12,
        starts: 3,
        ..WaitingConfig::default()
    }
}

fn wait_of(arm: &ChainArm) -> JointPositions {
    let surfaces = Surfaces::from_facets(&room(), 0.02).expect("upright");
    let (limits, config) = (limits_of(arm), quick());
    let found = waiting_posture(arm, &targets(), &surfaces, BOARD, &limits, &config);
    let found = found.expect("found");
    assert!(
        found.reached_share > 0.5 && found.standoff_m > 0.03,
        "{found:?}"
    );
    for (limit, q) in arm.limits().iter().zip(found.q.0) {
        assert!(limit.contains(q), "{found:?}");
    }
    found.q
}

/// Every node is presented, within the limits, by the shorter rotation, and nearly as early as the best of many searches.
fn check_atlas(arm: &ChainArm) -> Atlas {
    let (limits, waiting) = (limits_of(arm), wait_of(arm));
    let search = || Atlas::search(arm, &room(), BOARD, &limits, &waiting, &coarse());
    let atlas = search().expect("within reach");
    assert_eq!(Ok(&atlas), search().as_ref(), "the same bits");
    check_nodes(&atlas, arm, 1e-6);
    let mut sampler = Sampler::new(6);
    let (mut places, mut missed, mut later_s) = (0, 0, Vec::new());
    for wall in atlas.walls() {
        for place in wall.places() {
            let point_m = wall.point_m(place);
            let held = wall.node(place);
            if let Some(node) = held {
                for (joint, limit) in arm.limits().iter().enumerate() {
                    let (q, from) = (node.q[joint], waiting[joint]);
                    let is_endless = limit.max_rad == f64::INFINITY;
                    assert!(!is_endless || (q - from).abs() <= PI + 1e-9, "{q} {from}");
                }
            }
            // One in four places is searched from everywhere.
            if sampler.index(4) > 0 {
                continue;
            }
            let mut earliest_s = f64::INFINITY;
            for roll_rad in [0.0, FRAC_PI_2, PI, -FRAC_PI_2] {
                let pose = Pose::new(wall.plane().board_rotation(roll_rad), point_m);
                let pose = pose.expect("finite");
                for number in 10..30 {
                    let from = JointPositions::spread(arm.limits(), number);
                    let config = Default::default();
                    let found = arm.nearest(&pose, &from, &config, &mut arm.scratch());
                    let Ok(found) = found else { continue };
                    let mut q = found.q;
                    for (joint, limit) in arm.limits().iter().enumerate() {
                        if limit.max_rad - limit.min_rad >= TAU {
                            q[joint] = limit.nearest_turn(q[joint], waiting[joint]);
                        }
                    }
                    earliest_s = earliest_s.min(limits.travel_time_s(&waiting, &q));
                }
            }
            if earliest_s.is_finite() {
                places += 1;
                match held {
                    Some(node) => later_s.push(node.arrival_s - earliest_s),
                    None => missed += 1,
                }
            }
        }
    }
    later_s.sort_by(f64::total_cmp);
    let [median_s, p90_s] = [50, 90].map(|percent| later_s[later_s.len() * percent / 100]);
    println!("{places} places, {missed} missed, later by {median_s:.3} s, p90 {p90_s:.3} s");
    assert!(places > 10 && 20 * missed <= places, "{missed} of {places}");
    assert!(median_s < 0.1 && p90_s < 0.5, "{median_s} {p90_s}");
    atlas
}

#[test]
fn six_joints() {
    let atlas = check_atlas(&six());
    assert!(atlas.nodes().all(|node| node.q[6] == 0.0));
}

#[test]
fn a_joint_that_slides() {
    let atlas = check_atlas(&on_a_rail());
    // It is used, and does not count as an angle.
    let slides = atlas.nodes().map(|node| node.q[0]);
    let (low, high) = slides.fold((0.0_f64, 0.0_f64), |(l, h), q| (l.min(q), h.max(q)));
    assert!(
        high - low > 0.1 && low >= -0.3 && high <= 0.3,
        "{low} {high}"
    );
}

#[test]
fn joints_without_an_end() {
    check_atlas(&endless());
}

/// A posture one full turn further is equivalent.
#[test]
fn full_turns_of_an_endless_joint_change_no_time() {
    let arm = endless();
    let (limits, config) = (limits_of(&arm), quick());
    let surfaces = Surfaces::from_facets(&room(), 0.02).expect("upright");
    let targets = targets();
    let judged = |q: &JointPositions| {
        let judged = judge_posture(q, &arm, &targets, &surfaces, BOARD, &limits, &config);
        judged.expect("valid")
    };
    let here = JointPositions([2.9, 0.9, -2.8, 1.6, 3.0, 0.8, 0.0]);
    let nominal = judged(&here);
    for joint in [0, 2, 4, 6] {
        for turns in [-1.0, 1.0, 3.0] {
            let mut turned = here;
            turned[joint] += TAU * turns;
            let there = judged(&turned);
            let pairs = nominal.arrivals_s.iter().zip(&there.arrivals_s);
            let worst = pairs.fold(0.0, |worst: f64, (a, b)| match (a, b) {
                (Some(a), Some(b)) => worst.max((a - b).abs()),
                (None, None) => worst,
                _ => f64::INFINITY,
            });
            assert!(worst < 1e-9, "joint {joint}, {turns} turns: {worst} s");
        }
    }
}
