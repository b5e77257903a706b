//! The reference motion keeps its limits, arrives in the least time and may be retargeted at any time.

use hwall_kinematics::{JointPositions, SrsArm};
use hwall_motion::{JointState, JointTiming, MotionConfig, MotionLimits, ReferenceMotion};
use hwall_testkit::Sampler;

fn arm() -> (SrsArm, MotionLimits) {
    let arm = SrsArm::iiwa7();
    let limits = MotionLimits::of_arm(&arm, &MotionConfig::default()).expect("valid");
    (arm, limits)
}

fn random_q(sampler: &mut Sampler, arm: &SrsArm) -> JointPositions {
    JointPositions(arm.limits().map(|l| sampler.uniform(l.min_rad, l.max_rad)))
}

#[test]
fn from_rest_to_rest_takes_the_closed_form_time() {
    let (arm, limits) = arm();
    let mut sampler = Sampler::new(1);
    for _ in 0..2000 {
        let (from, to) = (random_q(&mut sampler, &arm), random_q(&mut sampler, &arm));
        // Small moves too: other cases of the profile.
        let scale = [1.0, 0.1, 0.01, 1e-4][sampler.index(4)];
        let to = JointPositions(std::array::from_fn(|i| from[i] + scale * (to[i] - from[i])));
        let mut motion = ReferenceMotion::new(&arm, &limits, &from).expect("finite");
        motion.set_goal(&to).expect("inside");
        let least_s = limits.travel_time_s(&from, &to);
        assert!(
            (motion.left_s() - least_s).abs() < 1e-9,
            "{} {least_s}",
            motion.left_s()
        );
    }
}

#[test]
fn how_far_and_how_soon_are_inverse() {
    let (arm, limits) = arm();
    let mut sampler = Sampler::new(6);
    for _ in 0..2000 {
        let from = random_q(&mut sampler, &arm);
        let joint = sampler.index(7);
        // All cases of the profile, from rising only to full speed.
        let way = sampler.uniform(0.0, 3.0) * [1.0, 0.1, 0.01, 1e-4][sampler.index(4)];
        let mut to = from;
        to[joint] += way;
        let way = (to[joint] - from[joint]).abs();
        let far = limits.farthest_rad(limits.travel_time_s(&from, &to))[joint];
        assert!((far - way).abs() < 1e-9 * way.max(1e-3), "{far} {way}");
    }
    assert_eq!(limits.farthest_rad(-1.0), [0.0; 7]);
    assert_eq!(limits.farthest_rad(0.0), [0.0; 7]);
    assert!(limits.farthest_rad(f64::NAN)[0].is_nan());
    assert_eq!(limits.farthest_rad(f64::INFINITY), [f64::INFINITY; 7]);
}

/// Goals that change every few milliseconds: largest speed, acceleration and jerk as shares of their limits.
fn retargeted(timing: JointTiming) -> [f64; 3] {
    let (arm, limits) = arm();
    let mut sampler = Sampler::new(2);
    let mut motion = ReferenceMotion::new(&arm, &limits, &random_q(&mut sampler, &arm))
        .expect("finite")
        .with_timing(timing);
    let mut most = [0.0_f64; 3];
    let mut before = *motion.state();
    for _ in 0..1500 {
        motion
            .set_goal(&random_q(&mut sampler, &arm))
            .expect("a motion");
        for _ in 0..sampler.index(300) + 1 {
            let now = motion.step(1e-3).expect("a step");
            for i in 0..7 {
                let jump = (now.q[i] - before.q[i]).abs();
                assert!(jump <= limits.velocity_rad_per_s[i] * 1e-3 * (1.0 + 1e-6));
                assert!(arm.limits()[i].distance_rad(now.q[i]) >= 0.0);
                let jerk = (now.qdd_rad_per_s2[i] - before.qdd_rad_per_s2[i]).abs() / 1e-3;
                let shares = [
                    now.qd[i].abs() / limits.velocity_rad_per_s[i],
                    now.qdd_rad_per_s2[i].abs() / limits.acceleration_rad_per_s2[i],
                    jerk / limits.jerk_rad_per_s3[i],
                ];
                most = std::array::from_fn(|k| most[k].max(shares[k]));
            }
            before = now;
        }
    }
    most
}

#[test]
fn limits_are_kept_whatever_goals_come() {
    for timing in [
        JointTiming::Together,
        JointTiming::Soonest,
        JointTiming::Straight,
    ] {
        let most = retargeted(timing);
        assert!(most.iter().all(|m| *m <= 1.0 + 1e-6), "{timing:?} {most:?}");
    }
}

#[test]
fn braking_ends_at_rest_and_a_restart_forgets_the_goal() {
    let (arm, limits) = arm();
    let mut sampler = Sampler::new(3);
    let (from, to) = (random_q(&mut sampler, &arm), random_q(&mut sampler, &arm));
    let mut motion = ReferenceMotion::new(&arm, &limits, &from).expect("finite");
    motion.set_goal(&to).expect("inside");
    for _ in 0..200 {
        motion.step(1e-3).expect("a step");
    }
    motion.brake();
    assert_eq!(motion.goal(), None);
    let left_s = motion.left_s();
    assert!(left_s > 0.0 && left_s < 0.6, "{left_s}");
    motion.step(left_s).expect("a step");
    assert_eq!(motion.state().qd.0, [0.0; 7]);
    motion.restart(&JointState::at_rest(from)).expect("finite");
    assert_eq!((motion.left_s(), motion.state().q), (0.0, from));
}

#[test]
fn nothing_is_allocated_after_construction() {
    let (arm, limits) = arm();
    let mut sampler = Sampler::new(4);
    let goals: Vec<_> = (0..200).map(|_| random_q(&mut sampler, &arm)).collect();
    let mut motion = ReferenceMotion::new(&arm, &limits, &goals[0]).expect("finite");
    let counted = allocation_counter::measure(|| {
        for goal in &goals {
            motion.set_goal(goal).expect("a motion");
            motion.step(0.05).expect("a step");
            motion.set_speed_share(0.5).expect("a share");
            motion.step(0.05).expect("a step");
            motion.set_speed_share(1.0).expect("a share");
        }
        motion.brake();
    });
    assert_eq!(counted.count_total, 0);
}
