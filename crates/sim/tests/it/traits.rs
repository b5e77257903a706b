//! Traits: each setting has its effect, and none moves the contact.

use crate::common::{changing, height, plan, sequence};
use glam::DVec3;
use hwall_sim::{
    Gesture, Person, PersonConfig, ReachPlan, SimError, TouchPlan, TouchSequence, TouchTruth,
};
use hwall_testkit::{Tol, assert_close};

fn assert_touches_at_the_target(sequence: &TouchSequence) {
    let tremor_m = sequence.person().config().tremor_m[1];
    for touch in sequence.touches() {
        let height = |t_s| height(touch, sequence.true_index_tip(t_s));
        for (t_s, into) in [(touch.contact_s, 1.0), (touch.release_s, -1.0)] {
            let off_m = sequence.true_index_tip(t_s).distance(touch.target_m);
            assert!(off_m <= tremor_m + 1e-9, "{off_m} m");
            assert!(height(t_s).abs() < 1e-9);
            assert!(height(t_s - 0.01 * into) > 0.0 && height(t_s + 0.01 * into) < 0.0);
        }
        let velocity = sequence.true_index_velocity_m_per_s(touch.contact_s);
        assert!(-velocity.dot(touch.normal) > 0.01, "{velocity}");
        let times = [
            touch.look_s,
            touch.start_s,
            touch.contact_s,
            touch.press_s,
            touch.withdraw_s,
            touch.release_s,
            touch.end_s,
        ];
        assert!(times.is_sorted_by(|a, b| a < b), "{times:?}");
    }
}

#[test]
fn every_trait_leaves_the_contact_at_the_target() {
    let varied = PersonConfig::varied();
    let extreme = PersonConfig {
        speed_peak: [0.3, 0.7],
        corrections: 1.0,
        undershoot: [0.05, 0.3],
        reach_scatter: 0.5,
        curvature: [0.0, 0.3],
        rest_scatter_m: 0.05,
        posture_rad: 0.2,
        distance_exponent: 1.0,
        ..varied
    };
    for seed in 0..60 {
        for config in [PersonConfig::default(), varied, extreme] {
            assert_touches_at_the_target(&sequence(config, seed, 8));
            assert_touches_at_the_target(&changing(config, seed, 8));
        }
    }
}

#[test]
fn the_hand_never_jumps() {
    for gesture in Gesture::ALL {
        let config = PersonConfig {
            gesture: Some(gesture),
            ..PersonConfig::varied()
        };
        for seed in 0..4 {
            for sequence in [sequence(config, seed, 4), changing(config, seed, 4)] {
                let steps = (sequence.duration_s() / 1e-3) as u32;
                let mut last = sequence.truth(0.0);
                for i in 1..steps {
                    let truth = sequence.truth(f64::from(i) * 1e-3);
                    let moved = |a: DVec3, b: DVec3| a.distance(b) < 8e-3;
                    assert!(moved(truth.palm_m, last.palm_m), "palm at {}", truth.t_s);
                    assert!(moved(truth.head_m, last.head_m), "head at {}", truth.t_s);
                    for (tip_m, last_m) in truth.tips_m.into_iter().zip(last.tips_m) {
                        assert!(moved(tip_m, last_m), "tip at {}", truth.t_s);
                    }
                    last = truth;
                }
            }
        }
    }
}

/// Time of peak speed of a straight reach, as a fraction of its duration.
fn measured_peak(config: PersonConfig, seed: u64) -> f64 {
    let person = Person::new(config, seed).unwrap();
    let straight = TouchPlan {
        target_m: config.hand_rest_m - DVec3::X * 0.4,
        normal: DVec3::X,
    };
    let sequence = person.plan(&[straight]).unwrap();
    let TouchTruth {
        start_s, press_s, ..
    } = sequence.touches()[0];
    let speed = |share: f64| {
        let t_s = start_s + share * (press_s - start_s);
        sequence.true_index_velocity_m_per_s(t_s).length()
    };
    let shares = (0..=1000).map(|i| f64::from(i) / 1000.0);
    shares
        .max_by(|&a, &b| speed(a).total_cmp(&speed(b)))
        .unwrap()
}

#[test]
fn the_speed_peaks_where_it_was_asked_to() {
    for peak in [0.3, 0.35, 0.42, 0.5, 0.6, 0.7] {
        let config = PersonConfig {
            speed_peak: [peak; 2],
            curvature: [0.0; 2],
            tremor_m: [0.0; 2],
            ..PersonConfig::default()
        };
        assert_close!(measured_peak(config, 1), peak, Tol::abs(2e-3));
        // The first part of a corrected reach takes 80 % of the time.
        let corrected = PersonConfig {
            corrections: 1.0,
            undershoot: [0.05; 2],
            ..config
        };
        if 0.8 * peak < 0.55 {
            assert_close!(measured_peak(corrected, 1), 0.8 * peak, Tol::abs(5e-3));
        }
    }
}

#[test]
fn a_corrected_reach_is_short_of_its_target_first() {
    for short in [0.05, 0.1, 0.3] {
        let config = PersonConfig {
            corrections: 1.0,
            undershoot: [short; 2],
            tremor_m: [0.0; 2],
            ..PersonConfig::default()
        };
        let sequence = sequence(config, 5, 20);
        for touch in sequence.touches() {
            let left = |share: f64| {
                let at_s = touch.start_s + share * (touch.press_s - touch.start_s);
                let height = |t_s| height(touch, sequence.true_index_tip(t_s));
                let from = height(touch.start_s) + touch.depth_m;
                (height(at_s) + touch.depth_m) / from
            };
            // The first part ends after 80 % of the time; the correction is then half done.
            assert_close!(left(0.8), 0.5 * short, Tol::abs(1e-9));
            assert_close!(left(1.0), 0.0, Tol::abs(1e-9));
            let shares = (0..=100).map(|i| left(f64::from(i) / 100.0));
            assert!(shares.is_sorted_by(|a, b| a >= b));
        }
    }
}

#[test]
fn an_opening_hand_opens_steadily_and_the_others_do_not() {
    for gesture in Gesture::ALL {
        let config = PersonConfig {
            gesture: Some(gesture),
            ..PersonConfig::default()
        };
        for seed in 0..10 {
            let sequence = sequence(config, seed, 3);
            let touch = sequence.touches()[1];
            let opening = |i: u32| {
                let at_s = touch.start_s + (touch.contact_s - touch.start_s) * f64::from(i) / 200.0;
                let truth = sequence.truth(at_s);
                // The little finger is moved back at the surface; the index finger never is.
                truth.tips_m[1].distance(truth.palm_m)
            };
            let openings: Vec<f64> = (0..=200).map(opening).collect();
            let size = sequence.person().hand_length_m() / 0.19;
            match gesture {
                Gesture::Opening => {
                    assert!(openings.is_sorted_by(|a, b| *a <= b + 1e-12));
                    assert!(openings[200] - openings[0] > 0.035 * size);
                }
                _ => {
                    assert_close!(openings[200], openings[0], Tol::abs(1e-12));
                }
            }
        }
    }
}

#[test]
fn a_change_of_mind_is_smooth_and_told() {
    let config = PersonConfig::default();
    for seed in 0..10 {
        let sequence = changing(config, seed, 5);
        let touches = plan(seed, 6);
        for (i, touch) in sequence.touches().iter().enumerate() {
            let meant = touch.changed.expect("each of them");
            assert_eq!(meant.target_m, touches[i].target_m);
            assert_close!(meant.normal, touches[i].normal.normalize(), Tol::abs(1e-12));
            let share = (meant.switch_s - touch.start_s) / (touch.contact_s - touch.start_s);
            assert!((0.24..0.61).contains(&share), "{share}");
            // Until then, the path is that to the other target.
            let from_m = sequence.true_index_tip(touch.start_s);
            let gone_m = sequence.true_index_tip(meant.switch_s) - from_m;
            let off_rad = gone_m.angle_between(meant.target_m - from_m);
            assert!(off_rad < 0.35, "{off_rad}");
            // Position, velocity and acceleration stay bounded, tested in steps of 0.2 ms.
            let h = 2e-4;
            let steps = ((touch.press_s - touch.start_s) / h) as u32;
            let mut last = DVec3::ZERO;
            for k in 0..steps {
                let t_s = touch.start_s + f64::from(k) * h;
                let velocity = sequence.true_index_velocity_m_per_s(t_s);
                assert!(velocity.length() < 8.0, "{velocity}");
                if k > 0 {
                    let acceleration = (velocity - last).length() / h;
                    assert!(acceleration < 150.0, "{acceleration} m/s2");
                }
                last = velocity;
            }
            // The gaze has switched by contact.
            let truth = sequence.truth(touch.contact_s);
            let off = truth.gaze.angle_between(touch.target_m - truth.head_m);
            assert!(off < 0.09, "{off}");
        }
    }
    // Without a change of mind, the sequence equals that of a plan of touches.
    let touches = plan(3, 4);
    let reaches: Vec<ReachPlan> = touches.iter().map(|&t| t.into()).collect();
    let person = Person::new(config, 3).unwrap();
    assert_eq!(person.plan(&touches), person.plan_reaches(&reaches));
    let impossible = ReachPlan {
        touch: touches[0],
        meant_first: Some(TouchPlan {
            target_m: DVec3::X * 3.0,
            normal: DVec3::X,
        }),
    };
    let refused = person.plan_reaches(&[impossible]);
    assert!(matches!(
        refused,
        Err(SimError::BehindSurface { touch: 0, .. })
    ));
}

/// A stroking hand crosses the surface at its target while it moves along it, and rests where others do; the palm of a pushing hand faces the surface.
#[test]
fn hands_that_stroke_move_along_the_surface_and_palms_that_push_face_it() {
    let plan = TouchPlan {
        target_m: DVec3::new(0.6, 0.1, 0.5),
        normal: DVec3::X,
    };
    for (gesture, seed) in Gesture::TASKS.into_iter().zip([1, 2, 3, 4]) {
        let config = PersonConfig {
            gesture: Some(gesture),
            takes_shape: true,
            ..PersonConfig::default()
        };
        let person = Person::new(config, seed).unwrap();
        let hand = person.plan(&[plan; 2]).unwrap();
        let [first, second] = [hand.touches()[0], hand.touches()[1]];
        let tip_m = |t_s: f64| hand.true_index_tip(t_s);
        assert!(tip_m(first.contact_s).distance(plan.target_m) < 1e-3);
        let along = |v: DVec3| v.with_x(0.0).length();
        let slid_m = along(tip_m(first.withdraw_s) - tip_m(first.contact_s));
        let speed = along(hand.true_index_velocity_m_per_s(first.contact_s));
        let strokes = [gesture == Gesture::Stroking; 2];
        assert_eq!([slid_m > 0.04, speed > 0.03], strokes, "{slid_m} {speed}");
        // Position and velocity have no leap, and both rests are those of other hands.
        for at in [
            first.contact_s,
            first.press_s,
            first.withdraw_s,
            first.end_s,
        ] {
            assert!(tip_m(at - 1e-5).distance(tip_m(at + 1e-5)) < 1e-4);
        }
        assert!(tip_m(first.end_s).distance(tip_m(second.start_s)) < 1e-3);
        let [rest, touch] = [0.0, first.contact_s].map(|t_s| hand.truth(t_s));
        let back =
            |s: &hwall_sim::PersonSample| (s.tips_m[1] - s.palm_m).cross(s.tips_m[4] - s.palm_m);
        let faces = |s| -back(s).normalize().x;
        let pushes = gesture == Gesture::Pushing;
        assert_eq!(faces(&touch) > 0.9, pushes, "{gesture:?}");
        assert!(faces(&rest) < 0.5);
        assert!(touch.tips_m.iter().all(|tip| tip.x > 0.599), "{gesture:?}");
    }
}
