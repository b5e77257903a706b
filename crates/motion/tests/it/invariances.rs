//! A motion does not depend on the origin, direction and unit of a joint, nor on the unit of time and the order of joints.

use hwall_kinematics::glam::DVec3;
use hwall_kinematics::{Chain, ChainArm, ChainJoint, JointLimit, JointPositions, Pose};
use hwall_motion::{JointBounds, JointPoint, MotionLimits, ReferenceMotion};
use hwall_testkit::Sampler;

const LIMITS: [f64; 3] = [1.7, 8.0, 400.0];

fn bounds(length: f64, time: f64) -> JointBounds {
    let [v, a, j] = LIMITS;
    let per = |power: i32| length / time.powi(power);
    JointBounds::new(v * per(1), a * per(2), j * per(3)).expect("valid")
}

/// The state in other units of length and time, from another origin.
fn seen(p: JointPoint, origin: f64, length: f64, time: f64) -> JointPoint {
    let per = |power: i32| length / time.powi(power);
    JointPoint::new(
        origin + length * p.q_rad,
        per(1) * p.qd_rad_per_s,
        per(2) * p.qdd_rad_per_s2,
    )
}

#[test]
fn origin_sense_and_units_of_a_joint_do_not_matter() {
    let mut sampler = Sampler::new(1);
    let plain = bounds(1.0, 1.0);
    for _ in 0..3000 {
        let [q, qd, qdd] = [0.7, 1.2, 5.0].map(|most| sampler.uniform(-most, most));
        let (start, goal) = (JointPoint::new(q, qd, qdd), sampler.uniform(-1.0, 1.0));
        let dt_s = sampler.uniform(1e-3, 0.5);
        let (least_s, next) = (
            start.time_to_s(goal, &plain),
            start.towards(goal, &plain, dt_s),
        );
        // A negative length is the mirror image.
        for (origin, length, time) in [
            (0.0, -1.0, 1.0),
            (2.5, 1.0, 1.0),
            (0.0, 30.0, 1e-1),
            (-1.0, -0.1, 10.0),
        ] {
            let limits = bounds(f64::abs(length), time);
            let there = seen(start, origin, length, time);
            let to = origin + length * goal;
            let found_s = there.time_to_s(to, &limits);
            assert!(
                (found_s - time * least_s).abs() < 1e-7 * time,
                "{start:?} {goal}: {found_s}"
            );
            let found = there.towards(to, &limits, time * dt_s);
            let wanted = seen(next, origin, length, time);
            let off = (found.q_rad - wanted.q_rad).abs() / f64::abs(length);
            assert!(off < 1e-7, "{start:?} {goal}: {found:?} {wanted:?}");
        }
    }
}

/// Seven joints whose wide ranges hinder no motion.
fn arm() -> ChainArm {
    let range = JointLimit::new(-10.0, 10.0);
    let joint = |i| ChainJoint {
        max_velocity: Some(1.0),
        ..ChainJoint::revolute(format!("{i}"), Pose::IDENTITY, DVec3::Z, range)
    };
    ChainArm::new(Chain::new((0..7).map(joint).collect(), Pose::IDENTITY).unwrap()).unwrap()
}

fn limits() -> MotionLimits {
    let scaled = |base: f64| std::array::from_fn(|i| base * (1.0 + 0.2 * i as f64));
    MotionLimits {
        velocity_rad_per_s: scaled(LIMITS[0]),
        acceleration_rad_per_s2: scaled(LIMITS[1]),
        jerk_rad_per_s3: scaled(LIMITS[2]),
    }
}

/// A path of seven joints through a sequence of goals, under a transformation of the joints.
fn path(change: impl Fn([f64; 7]) -> [f64; 7], limits: &MotionLimits) -> Vec<[f64; 7]> {
    let mut sampler = Sampler::new(2);
    let start = JointPositions(change([0.1, -0.2, 0.3, -0.4, 0.5, -0.6, 0.7]));
    let mut motion = ReferenceMotion::new(&arm(), limits, &start).unwrap();
    let mut path = Vec::new();
    for _ in 0..20 {
        let goal = sampler.array_within([(-1.5, 1.5); 7]);
        motion.set_goal(&JointPositions(change(goal))).unwrap();
        for _ in 0..sampler.index(600) {
            path.push(motion.step(1e-3).unwrap().q.0);
        }
    }
    path
}

fn worst(a: &[[f64; 7]], b: &[[f64; 7]], change: impl Fn([f64; 7]) -> [f64; 7]) -> f64 {
    assert_eq!(a.len(), b.len());
    let off = |(a, b): (&[f64; 7], &[f64; 7])| {
        let a = change(*a);
        (0..7).fold(0.0, |m: f64, i| m.max((a[i] - b[i]).abs()))
    };
    a.iter().zip(b).map(off).fold(0.0, f64::max)
}

#[test]
fn a_path_is_the_same_mirrored_shifted_and_with_joints_in_another_order() {
    let nominal = path(|q| q, &limits());
    let mirror = |q: [f64; 7]| q.map(|x| -x);
    let shift = |q: [f64; 7]| q.map(|x| x + 3.0);
    for (name, change) in [("mirror", mirror as fn([f64; 7]) -> _), ("shift", shift)] {
        let off = worst(&nominal, &path(change, &limits()), change);
        assert!(off < 1e-7, "{name}: {off}");
    }
    let back = |mut q: [f64; 7]| {
        q.reverse();
        q
    };
    let mut others = limits();
    others.velocity_rad_per_s.reverse();
    others.acceleration_rad_per_s2.reverse();
    others.jerk_rad_per_s3.reverse();
    let off = worst(&nominal, &path(back, &others), back);
    assert!(off < 1e-7, "order: {off}");
}

#[test]
fn times_of_travel_are_the_same_both_ways() {
    let (limits, mut sampler) = (limits(), Sampler::new(3));
    for _ in 0..1000 {
        let [a, b] = [(); 2].map(|()| JointPositions(sampler.array_within([(-2.0, 2.0); 7])));
        let there_s = limits.travel_time_s(&a, &b);
        assert_eq!(there_s, limits.travel_time_s(&b, &a));
        let mirrored = |q: JointPositions| JointPositions(q.0.map(|x| -x));
        assert_eq!(there_s, limits.travel_time_s(&mirrored(a), &mirrored(b)));
    }
}
