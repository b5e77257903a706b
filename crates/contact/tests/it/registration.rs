//! The registration error, learned from touches: simulated truths, few touches, one wall, outliers, moved trackers, bad input.

use crate::common::{Fused, front, gaussian, scene};
use glam::{DMat3, DQuat, DVec3};
use hwall_contact::{
    FusedConfig, MeasuredTouch, Predictor, RegistrationConfig, RegistrationEstimator, TouchVerdict,
};
use hwall_hand::{MAX_COORDINATE_M, Pose};
use hwall_testkit::{Sampler, refused};

const CONFIG: RegistrationConfig = RegistrationConfig {
    offset_sd_m: 0.008,
    turn_sd_rad: 0.01,
    centre_m: DVec3::new(0.6, 0.0, 0.6),
    touch_sd_m: 0.004,
    half_life_touches: 40.0,
    moved_probability: 0.005,
};

/// Touches without noise.
const EXACT: RegistrationConfig = RegistrationConfig {
    touch_sd_m: 1e-6,
    ..CONFIG
};

fn estimator() -> RegistrationEstimator {
    RegistrationEstimator::new(CONFIG).unwrap()
}

/// The error of the tracker, as a pose: `true_from_seen`.
fn error(offset_m: DVec3, turn_rad: DVec3) -> Pose {
    let rotation = DMat3::from_quat(DQuat::from_scaled_axis(turn_rad));
    let centre_m = CONFIG.centre_m;
    Pose::new(rotation, centre_m - rotation * centre_m + offset_m).unwrap()
}

fn drawn_error(sampler: &mut Sampler) -> Pose {
    let offset_m = gaussian(sampler) * CONFIG.offset_sd_m;
    error(offset_m, gaussian(sampler) * CONFIG.turn_sd_rad)
}

/// A point of a wall that is 0.3 m from the centre; the point is 0.3 to 0.64 m from the centre.
fn on_wall(sampler: &mut Sampler, normal: DVec3) -> DVec3 {
    let (u, v) = normal.any_orthonormal_pair();
    let [a, b] = [0; 2].map(|_| sampler.uniform(-0.4, 0.4));
    CONFIG.centre_m + normal * 0.3 + u * a + v * b
}

fn touch(truth: &Pose, at_m: DVec3, normal: DVec3, noise_m: DVec3) -> MeasuredTouch {
    let (u, v) = normal.any_orthonormal_pair();
    MeasuredTouch {
        seen_m: truth.inverse_transform_point(at_m + noise_m),
        // Any point of the surface, e.g. the middle of a board.
        surface_m: at_m + u * 0.05 - v * 0.03,
        normal,
        located_sd_m: None,
    }
}

fn left_m(found: &RegistrationEstimator, truth: &Pose, at_m: DVec3) -> DVec3 {
    let seen_m = truth.inverse_transform_point(at_m);
    found.true_from_seen().transform_point(seen_m) - at_m
}

const WALLS: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::Z];

#[test]
fn without_a_touch_there_is_no_correction_and_the_error_of_the_settings() {
    let none = estimator();
    assert_eq!(none.true_from_seen(), Pose::IDENTITY);
    let at_centre = none.covariance_m2(CONFIG.centre_m);
    assert!((at_centre - DMat3::IDENTITY * 0.008_f64.powi(2)).abs_diff_eq(DMat3::ZERO, 1e-15));
    // Half a metre from the centre, rotations about the two axes across move a point.
    let beside = none.covariance_m2(CONFIG.centre_m + DVec3::X * 0.5);
    assert!((beside.x_axis.x - 0.008_f64.powi(2)).abs() < 1e-15);
    assert!((beside.y_axis.y - 0.008_f64.powi(2) - 0.005_f64.powi(2)).abs() < 1e-15);
}

#[test]
fn touches_that_fit_correct_nothing() {
    let (mut found, mut sampler) = (estimator(), Sampler::new(1));
    for k in 0..30 {
        let normal = WALLS[k % 3];
        let at_m = on_wall(&mut sampler, normal);
        let exact = touch(&Pose::IDENTITY, at_m, normal, DVec3::ZERO);
        assert_eq!(found.touched(&exact), Ok(TouchVerdict::Fits));
        assert!(found.true_from_seen().distance(&Pose::IDENTITY).position_m < 1e-12);
    }
}

/// The simulated error is as large as the settings state; the touches have no noise.
#[test]
fn a_planted_error_is_found_from_touches_of_three_walls() {
    for seed in 0..20 {
        let mut sampler = Sampler::new(seed);
        let truth = drawn_error(&mut sampler);
        let mut found = RegistrationEstimator::new(EXACT).unwrap();
        for k in 0..18 {
            let at_m = on_wall(&mut sampler, WALLS[k % 3]);
            let exact = touch(&truth, at_m, WALLS[k % 3], DVec3::ZERO);
            found.touched(&exact).unwrap();
        }
        for wall in WALLS {
            let at_m = on_wall(&mut sampler, wall);
            let left_m = left_m(&found, &truth, at_m).length();
            assert!(left_m < 1e-5, "{seed}: {left_m}");
        }
    }
}

/// If the arm measures the contact point, three touches determine everything.
#[test]
fn located_touches_say_more() {
    let mut sampler = Sampler::new(3);
    let truth = drawn_error(&mut sampler);
    let mut found = RegistrationEstimator::new(EXACT).unwrap();
    for _ in 0..4 {
        let at_m = on_wall(&mut sampler, DVec3::X);
        let located = MeasuredTouch {
            surface_m: at_m,
            located_sd_m: Some(1e-6),
            ..touch(&truth, at_m, DVec3::X, DVec3::ZERO)
        };
        found.touched(&located).unwrap();
    }
    let at_m = on_wall(&mut sampler, DVec3::Y);
    assert!(left_m(&found, &truth, at_m).length() < 2e-5);
}

#[test]
fn one_wall_tells_of_what_lies_across_it_alone() {
    let mut sampler = Sampler::new(4);
    let offset_m = DVec3::new(0.010, 0.010, -0.010);
    let truth = error(offset_m, DVec3::ZERO);
    let mut found = estimator();
    let at_m = CONFIG.centre_m + DVec3::X * 0.3;
    let before = found.covariance_m2(at_m);
    for _ in 0..40 {
        let at_m = on_wall(&mut sampler, DVec3::X);
        let noise_m = gaussian(&mut sampler) * 0.004;
        found
            .touched(&touch(&truth, at_m, DVec3::X, noise_m))
            .unwrap();
    }
    let left_m = left_m(&found, &truth, at_m);
    let after = found.covariance_m2(at_m);
    assert!(left_m.x.abs() < 0.003, "{left_m}");
    assert!(after.x_axis.x.sqrt() < 0.0015, "{after}");
    // Along the wall the error is unknown, uncorrected, and stated as such.
    for (left_m, before, after) in [
        (left_m.y - -offset_m.y, before.y_axis.y, after.y_axis.y),
        (left_m.z - -offset_m.z, before.z_axis.z, after.z_axis.z),
    ] {
        assert!(left_m.abs() < 0.003, "{left_m}");
        assert!(after > 0.6 * before && after <= before, "{before} {after}");
    }
}

#[test]
fn the_first_touch_halves_the_error_across_its_surface() {
    let truth = error(DVec3::X * 0.010, DVec3::ZERO);
    let mut found = estimator();
    let at_m = CONFIG.centre_m;
    let verdict = found.touched(&touch(&truth, at_m, DVec3::X, DVec3::ZERO));
    assert_eq!(verdict, Ok(TouchVerdict::Fits));
    let left_m = left_m(&found, &truth, at_m);
    assert!((-0.005..0.0).contains(&left_m.x), "{left_m}");
    assert!(left_m.y.abs() < 1e-4 && left_m.z.abs() < 1e-4);
}

/// Squared Mahalanobis distance of the 90 % region in space.
const IN_90: f64 = 6.251;

#[test]
fn regions_hold_what_they_say_after_any_number_of_touches() {
    for (walls, name) in [(1, "one wall"), (3, "three walls")] {
        for touches in [0, 1, 3, 10, 40] {
            let (mut inside, mut squares_m2, runs) = (0, 0.0, 600);
            for seed in 0..runs {
                let mut sampler = Sampler::new(1000 * touches as u64 + seed);
                let truth = drawn_error(&mut sampler);
                let mut found = estimator();
                for k in 0..touches {
                    let normal = WALLS[k % walls];
                    let at_m = on_wall(&mut sampler, normal);
                    let noise_m = gaussian(&mut sampler) * CONFIG.touch_sd_m;
                    found
                        .touched(&touch(&truth, at_m, normal, noise_m))
                        .unwrap();
                }
                let at_m = on_wall(&mut sampler, WALLS[seed as usize % 3]);
                let left_m = left_m(&found, &truth, at_m);
                let covariance_m2 = found.covariance_m2(truth.inverse_transform_point(at_m));
                inside += u32::from(left_m.dot(covariance_m2.inverse() * left_m) <= IN_90);
                squares_m2 += left_m.length_squared() / runs as f64;
            }
            let share = f64::from(inside) / runs as f64;
            assert!((0.87..=0.94).contains(&share), "{name} {touches}: {share}");
            if walls == 3 {
                let most_m = [(3, 0.010), (10, 0.0065), (40, 0.0035)];
                let most_m = most_m.iter().find(|(of, _)| *of == touches);
                assert!(most_m.is_none_or(|(_, m)| squares_m2.sqrt() <= *m));
            }
        }
    }
}

#[test]
fn stray_touches_hardly_count() {
    let mut sampler = Sampler::new(8);
    let truth = error(
        DVec3::new(0.008, -0.006, 0.007),
        DVec3::new(0.005, 0.0, -0.008),
    );
    let mut found = estimator();
    for k in 0..40 {
        let normal = WALLS[k % 3];
        let at_m = on_wall(&mut sampler, normal);
        let noise_m = gaussian(&mut sampler) * 0.003;
        // Every fifth touch is by an elbow, or a hand that jumped.
        let stray_m = if k % 5 == 4 {
            normal * sampler.uniform(0.03, 0.08) * if k % 2 == 0 { 1.0 } else { -1.0 }
        } else {
            DVec3::ZERO
        };
        let verdict = found.touched(&touch(&truth, at_m, normal, noise_m + stray_m));
        if k > 10 {
            let expected = match stray_m == DVec3::ZERO {
                true => TouchVerdict::Fits,
                false => TouchVerdict::Astray,
            };
            assert_eq!(verdict, Ok(expected), "{k}");
        }
    }
    for normal in WALLS {
        let at_m = on_wall(&mut sampler, normal);
        let left_m = left_m(&found, &truth, at_m).length();
        assert!(left_m < 0.005, "{left_m}");
    }
}

#[test]
fn a_tracker_that_was_moved_is_noticed_and_followed() {
    let (mut late, mut false_alarms) = (Vec::new(), 0);
    for seed in 0..100 {
        let mut sampler = Sampler::new(seed);
        let mut found = estimator();
        let before = drawn_error(&mut sampler);
        let mut tell = |truth: &Pose, k: usize| {
            let normal = WALLS[k % 3];
            let at_m = on_wall(&mut sampler, normal);
            let noise_m = gaussian(&mut sampler) * CONFIG.touch_sd_m;
            found.touched(&touch(truth, at_m, normal, noise_m)).unwrap()
        };
        for k in 0..30 {
            false_alarms += usize::from(tell(&before, k) == TouchVerdict::Moved);
        }
        // By 35 mm: someone bumped into the tripod.
        let after = error(DVec3::new(0.02, -0.02, 0.02), DVec3::ZERO);
        let noticed = (0..12).find(|&k| tell(&after, k) == TouchVerdict::Moved);
        late.push(noticed.map_or(99, |k| k + 1));
        for k in 0..12 {
            tell(&after, k);
        }
        let at_m = CONFIG.centre_m;
        assert!(left_m(&found, &after, at_m).length() < 0.008, "{seed}");
    }
    late.sort_unstable();
    assert!(late[50] <= 4 && late[90] <= 6 && late[98] <= 8, "{late:?}");
    assert!(false_alarms <= 3, "{false_alarms}");
}

#[test]
fn what_is_no_touch_is_refused_and_teaches_nothing() {
    let good = touch(&Pose::IDENTITY, CONFIG.centre_m, DVec3::X, DVec3::X * 0.002);
    let mut found = estimator();
    found.touched(&good).unwrap();
    let before = found.clone();
    for bad in [f64::NAN, f64::INFINITY, 2.0 * MAX_COORDINATE_M] {
        let point_m = DVec3::new(0.0, bad, 0.0);
        let mut wrong = [good; 2];
        (wrong[0].seen_m, wrong[1].surface_m) = (point_m, point_m);
        assert!(wrong.iter().all(|wrong| found.touched(wrong).is_err()));
    }
    let mut wrong = good;
    for normal in [DVec3::ZERO, DVec3::NAN, DVec3::X * 1e-300] {
        wrong.normal = normal;
        assert!(found.touched(&wrong).is_err());
    }
    wrong = good;
    for located_sd_m in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        wrong.located_sd_m = Some(located_sd_m);
        assert!(found.touched(&wrong).is_err());
    }
    assert_eq!(found, before);
    refused!(CONFIG, RegistrationEstimator::new, {
        offset_sd_m = -1.0;
        turn_sd_rad = f64::NAN;
        centre_m.x = f64::NAN => "centre_m";
        touch_sd_m = 0.0;
        half_life_touches = 0.0;
        moved_probability = 1.0;
    });
}

#[test]
fn learning_allocates_nothing() {
    let (mut found, mut sampler) = (estimator(), Sampler::new(6));
    for k in 0..80 {
        // The tracker is moved halfway.
        let truth = error(DVec3::X * if k < 40 { 0.0 } else { 0.03 }, DVec3::ZERO);
        let at_m = on_wall(&mut sampler, DVec3::X);
        let seen = touch(&truth, at_m, DVec3::X, DVec3::ZERO);
        let info = allocation_counter::measure(|| {
            let _ = found.touched(&seen);
        });
        assert_eq!(info.count_total, 0, "{k}");
    }
}

/// Random touches of anything: numbers stay finite, corrections rigid.
#[test]
fn touches_without_sense_leave_a_finite_correction() {
    for seed in 0..50 {
        let mut sampler = Sampler::new(seed);
        let mut found = RegistrationEstimator::new(RegistrationConfig {
            turn_sd_rad: [0.0, 0.01, 3.0][seed as usize % 3],
            offset_sd_m: [0.0, 0.008, 10.0][(seed / 3) as usize % 3],
            ..CONFIG
        })
        .unwrap();
        for k in 0..100 {
            let far = if k % 7 == 0 { MAX_COORDINATE_M } else { 1.0 };
            let mut point = || DVec3::from_array([0; 3].map(|_| sampler.uniform(-far, far)));
            let any = MeasuredTouch {
                seen_m: point(),
                surface_m: point(),
                normal: point(),
                located_sd_m: (k % 3 == 0).then_some(1e-3),
            };
            found.touched(&any).unwrap();
            let pose = found.true_from_seen();
            assert!(pose.transform_point(DVec3::ONE).is_finite());
            let covariance = found.covariance_m2(DVec3::ONE);
            assert!(covariance.is_finite(), "{covariance}");
        }
    }
}

/// The fusion corrects its input: a hand that rests on the wall is tracked 12 mm behind it; after a few touches it is
/// corrected to the wall.
#[test]
fn the_fusion_learns_where_the_wall_is_for_the_tracker() {
    let scene = scene(&[("wall", front(0.7, [-1.0, 0.5], [0.3, 2.0]))], None);
    let config = FusedConfig {
        registration: Some(RegistrationConfig::default()),
        ..FusedConfig::default()
    };
    let mut fused = Fused::new(config);
    let off_m = DVec3::X * 0.012;
    let mut sds_m = Vec::new();
    for k in 0..8 {
        let at_m = DVec3::new(0.7, -0.2 + 0.05 * f64::from(k), 1.0);
        for step in 0..30 {
            let left_m = 0.3 * (1.0 - f64::from(step) / 29.0);
            let seen_m = at_m - DVec3::X * left_m + off_m;
            fused.see(&scene, (seen_m, DVec3::X * 0.5), None, None);
        }
        let answer = fused.see(&scene, (at_m + off_m, DVec3::ZERO), None, None)[0];
        sds_m.push(answer.covariance_m2.unwrap().x_axis.x.sqrt());
        let now_s = fused.now_s();
        fused.predictor.touched(at_m + off_m, now_s);
    }
    fused.see(&scene, (DVec3::new(0.4, 0.0, 1.0), DVec3::ZERO), None, None);
    let found = fused.predictor.registration().unwrap();
    assert_eq!(found.touches(), 8);
    let seen_m = DVec3::new(0.712, 0.0, 1.0);
    let left_m = found.true_from_seen().transform_point(seen_m).x - 0.7;
    assert!(left_m.abs() < 0.002, "{left_m}");
    assert!(sds_m[7] < 0.5 * sds_m[0], "{sds_m:?}");
    // Another person, or another world.
    fused.predictor.reset();
    assert_eq!(fused.predictor.registration().unwrap().touches(), 0);
}
