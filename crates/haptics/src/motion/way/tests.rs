use super::*;
use hwall_kinematics::SrsArm;
use hwall_motion::{MotionConfig, MotionLimits};
use hwall_testkit::Sampler;
use std::sync::Arc;

#[test]
fn slow_ways_are_not_looked_at_more_often_than_others() {
    for duration_s in [1e-3, 0.3, 3.0, 12.0, 300.0, 3e3, 1e9] {
        let samples = duration_s / longest_s(duration_s);
        let most = MOST_DENSE_SAMPLES as f64 * (1.0 + 1e-12);
        assert!(samples <= most, "{samples}");
    }
    assert_eq!(longest_s(3.0), LONGEST_S);
}

#[test]
fn no_way_between_two_samples_is_longer_than_its_bound() {
    let board = Board::default();
    let face = board.flange_from_board_face().unwrap();
    let arm = Arc::new(SrsArm::iiwa7().with_tool(face));
    let limits = MotionLimits::of_arm(&*arm, &MotionConfig::default()).unwrap();
    let solver = Solver::new(arm.clone());
    let barriers = Barriers::default();
    let mut check = Check {
        board: &board,
        barriers: &barriers,
        footprints: [None; PLACES + 3],
        planes: [None; PLACES + 2],
        clear: None,
        samples: 0,
    };
    let mut sampler = Sampler::new(91);
    let mut anywhere = || {
        JointPositions(
            arm.limits()
                .map(|l| sampler.uniform(0.9 * l.min_rad, 0.9 * l.max_rad)),
        )
    };
    let (mut longest, mut crooked) = (0.0_f64, 0);
    for k in 0..200 {
        let (from, to, by_way_of) = (anywhere(), anywhere(), anywhere());
        let mut reference = ReferenceMotion::new(&*arm, &limits, &from).unwrap();
        // Bends turn round: their paths are much longer than their chords.
        let by_way_of = (k % 2 == 0).then_some(&by_way_of);
        let Ok(duration_s) = reference.consider(&to, by_way_of) else {
            continue;
        };
        for i in 0..40 {
            let dt_s = [LONGEST_S, 5e-3, 1e-3, CLOSEST_S][i % 4];
            let t_s = (duration_s - dt_s) * i as f64 / 40.0;
            let mut sample = |t_s| check.dense_sample(t_s, &reference, &solver);
            let (a, b) = (sample(t_s), sample(t_s + dt_s));
            let bounds_m = a.ways_m(&b);
            let mut ways_m = [0.0; 5];
            let mut before = a.at_m;
            for step in 1..=20 {
                let at_m = sample(t_s + dt_s * f64::from(step) / 20.0).at_m;
                for (way_m, (to, from)) in ways_m.iter_mut().zip(at_m.iter().zip(&before)) {
                    *way_m += to.distance(*from);
                }
                before = at_m;
            }
            for p in 0..5 {
                let chord_m = a.at_m[p].distance(b.at_m[p]);
                crooked += usize::from(ways_m[p] > 1.05 * chord_m + 1e-9);
                longest = longest.max(ways_m[p] / bounds_m[p]);
                let shorter = ways_m[p] <= bounds_m[p] + 1e-12;
                assert!(shorter, "{k}, {i}: {ways_m:?}, {bounds_m:?}");
            }
        }
    }
    println!("at most {longest:.4} of the bound, {crooked} ways 5 % longer than their chords");
    assert!(longest > 0.9, "{longest}");
}
