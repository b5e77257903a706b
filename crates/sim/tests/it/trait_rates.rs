//! Traits visible only over many reaches or people: rates, scatter, durations; and invalid settings.

use crate::common::{plan, sequence};
use glam::DVec3;
use hwall_sim::{Gesture, Person, PersonConfig, Population, TouchPlan};
use hwall_testkit::{Tol, assert_close};

#[test]
fn a_population_is_the_same_however_many_are_drawn() {
    let config = PersonConfig::varied();
    let population = Population::new(config, 3).unwrap();
    let drawn: Vec<Person> = (0..50).map(|i| population.person(i)).collect();
    // Each person again, alone, and in reverse order.
    for i in (0..50_u64).rev() {
        let alone = Population::new(config, 3).unwrap().person(i);
        assert_eq!(alone, drawn[i as usize]);
    }
    let touches = plan(1, 3);
    let all = |person: &Person| {
        let sequence = person.plan(&touches).unwrap();
        let times = (0..500).map(|k| sequence.tracked(f64::from(k) / 90.0));
        times.collect::<Vec<_>>()
    };
    assert_eq!(all(&drawn[7]), all(&population.person(7)));
    assert_ne!(all(&drawn[7]), all(&drawn[8]));
    // No person occurs twice, nor in the population of the next seed.
    let next = Population::new(config, 4).unwrap();
    for i in 0..50 {
        let same = |p: &&Person| p.mean_reach_s() == next.person(i).mean_reach_s();
        assert_eq!(drawn.iter().filter(same).count(), 0);
        let same = |p: &&Person| p.mean_reach_s() == drawn[i as usize].mean_reach_s();
        assert_eq!(drawn.iter().filter(same).count(), 1);
    }
    // Habits cover their ranges, and every gesture occurs.
    let mean = drawn.iter().map(Person::mean_reach_s).sum::<f64>() / 50.0;
    assert_close!(mean, 0.9, Tol::abs(0.08));
    for gesture in Gesture::ALL {
        let count = drawn.iter().filter(|p| p.gesture() == gesture).count();
        assert!((6..=30).contains(&count), "{gesture:?}: {count}");
    }
    let heads = drawn.iter().map(|p| p.head_m().distance(config.head_m));
    let furthest = heads.fold(0.0, f64::max);
    assert!((0.08..0.27).contains(&furthest), "{furthest}");
}

#[test]
fn dropouts_occur_at_the_asked_rate_and_last() {
    for (dropout, dropout_s) in [(0.05, 0.05), (0.3, 0.1), (0.1, 1e-3)] {
        let config = PersonConfig {
            dropout,
            dropout_s,
            ..PersonConfig::default()
        };
        let sequence = sequence(config, 2, 1);
        let n = 60_000;
        let samples: Vec<_> = (0..n)
            .map(|k| sequence.tracked(f64::from(k) / 90.0))
            .collect();
        let seen = |place: usize| {
            let at = |s: &hwall_sim::hand::HandFrame| match place {
                0 => s.palm_m.is_some(),
                6 => s.gaze.is_some(),
                tip => s.tips_m[tip - 1].is_some(),
            };
            samples.iter().map(at).collect::<Vec<bool>>()
        };
        let points: Vec<Vec<bool>> = (0..7).map(seen).collect();
        for point in &points {
            let lost = point.iter().filter(|seen| !**seen).count();
            assert_close!(lost as f64 / f64::from(n), dropout, Tol::rel(0.12));
            // Cells are independent, so the mean length of a loss in cells is 1 over the kept
            // fraction.
            let losses = point.windows(2).filter(|w| w[0] && !w[1]).count();
            let mean_s = lost as f64 / losses as f64 / 90.0;
            let wanted_s = (dropout_s.max(1.0 / 90.0)) / (1.0 - dropout);
            assert_close!(mean_s, wanted_s, Tol::rel(0.1));
        }
        // Points are lost independently of each other.
        let both = (0..n as usize).filter(|&k| !points[0][k] && !points[1][k]);
        let share = both.count() as f64 / f64::from(n);
        assert_close!(share, dropout * dropout, Tol::new(1e-3, 0.25));
        // Visible points equal the tracker measurement.
        for sample in samples.iter().take(1000) {
            let measured = sequence.sample(sample.t_s);
            assert!(sample.palm_m.is_none_or(|p| p == measured.palm_m));
            assert!(sample.gaze.is_none_or(|g| g == measured.gaze));
            assert_eq!(sample.head_m, Some(measured.head_m));
        }
    }
    let never = sequence(PersonConfig::default(), 2, 1);
    for k in 0..5000 {
        let tips_m = never.tracked(f64::from(k) * 0.01).tips_m;
        assert!(tips_m.iter().all(Option::is_some), "{tips_m:?}");
    }
    let nothing = never.tracked(f64::NAN);
    assert!(nothing.palm_m.is_none() && nothing.head_m.is_none() && nothing.gaze.is_none());
}

#[test]
fn durations_grow_with_the_distance_as_asked() {
    for exponent in [0.0, 0.5, 1.0] {
        let config = PersonConfig {
            distance_exponent: exponent,
            ..PersonConfig::default()
        };
        let person = Person::new(config, 4).unwrap();
        let duration_s = |length_m: f64| {
            let touch = TouchPlan {
                target_m: config.hand_rest_m - DVec3::X * length_m,
                normal: DVec3::X,
            };
            let sequence = person.plan(&[touch]).unwrap();
            sequence.touches()[0].press_s - sequence.touches()[0].start_s
        };
        let ratio = duration_s(0.8) / duration_s(0.2);
        assert_close!(ratio, 4_f64.powf(exponent), Tol::rel(1e-9));
    }
}

#[test]
fn the_gaze_misses_and_leaves_as_often_as_asked() {
    let config = PersonConfig {
        gaze_misses: 0.25,
        gaze_leaves: 0.4,
        ..PersonConfig::default()
    };
    let (mut missed, mut left, mut all) = (0.0, 0.0, 0.0);
    for seed in 0..40 {
        let sequence = sequence(config, seed, 10);
        for touch in sequence.touches() {
            let off = |t_s| {
                let truth = sequence.truth(t_s);
                let to_target_m = touch.target_m - truth.head_m;
                truth.gaze.angle_between(to_target_m).to_degrees()
            };
            let (early, late) = (off(touch.start_s), off(touch.contact_s + 0.01));
            assert_eq!(touch.gaze_missed, early > 10.0, "{early}");
            missed += f64::from(u8::from(touch.gaze_missed));
            left += f64::from(u8::from(!touch.gaze_missed && late > 6.0));
            all += 1.0;
        }
    }
    assert_close!(missed / all, 0.25, Tol::abs(0.06));
    assert_close!(left / all, 0.4 * 0.75, Tol::abs(0.07));
}

#[test]
fn rests_scatter_and_the_hand_dwells() {
    let config = PersonConfig {
        rest_scatter_m: 0.02,
        onset_dwell_s: [0.3, 0.5],
        tremor_m: [0.0; 2],
        ..PersonConfig::default()
    };
    let sequence = sequence(config, 9, 200);
    let mut sum = DVec3::ZERO;
    for touch in sequence.touches() {
        let rest_m = sequence.true_index_tip(touch.start_s);
        assert_eq!(rest_m, sequence.true_index_tip(touch.look_s));
        let off = rest_m - config.hand_rest_m;
        sum += off * off;
        assert!((0.47..1.0).contains(&(touch.start_s - touch.look_s)));
    }
    for axis in (sum / 200.0).to_array() {
        assert_close!(axis.sqrt(), 0.02, Tol::rel(0.2));
    }
}

type Spoil = fn(&mut PersonConfig);
/// A setting by name, and how to set it.
type Setting = (&'static str, fn(&mut PersonConfig, f64));

/// Settings whose single number must be between 0 and 1, or in a smaller range.
const SHARES: &[Setting] = &[
    ("posture_rad", |c, x| c.posture_rad = x),
    ("distance_exponent", |c, x| c.distance_exponent = x),
    ("corrections", |c, x| c.corrections = x),
    ("reach_scatter", |c, x| c.reach_scatter = x),
    ("gaze_misses", |c, x| c.gaze_misses = x),
    ("gaze_leaves", |c, x| c.gaze_leaves = x),
    ("glances_back", |c, x| c.glances_back = x),
    ("dropout", |c, x| c.dropout = x),
    ("speed_peak", |c, x| c.speed_peak = [0.5, x]),
    ("speed_peak", |c, x| c.speed_peak = [x, 0.5]),
    ("undershoot", |c, x| c.undershoot = [0.05, x]),
];

/// Other settings that must not be negative.
const SIZES: &[Setting] = &[
    ("head_scatter_m", |c, x| c.head_scatter_m = x),
    ("rest_scatter_m", |c, x| c.rest_scatter_m = x),
    ("lean_m", |c, x| c.lean_m = [x, 0.1]),
    ("onset_dwell_s", |c, x| c.onset_dwell_s = [x, 0.1]),
    ("gaze_lead_s", |c, x| c.gaze_lead_s = [0.1, x]),
    ("gaze_lead_s", |c, x| c.gaze_lead_s = [x, 0.3]),
    ("tremor_m", |c, x| c.tremor_m = [x, 1e-4]),
    ("dropout_s", |c, x| c.dropout_s = x),
    ("hand_length_m", |c, x| c.hand_length_m = [x, 0.2]),
    ("mean_reach_s", |c, x| c.mean_reach_s = [0.6, x]),
    ("curvature", |c, x| c.curvature = [x, 0.05]),
    ("press_depth_m", |c, x| c.press_depth_m = [0.01, x]),
    ("hold_s", |c, x| c.hold_s = [x, 1.0]),
    ("pause_s", |c, x| c.pause_s = [x, 1.0]),
    ("glance_s", |c, x| c.glance_s = [x, 0.6]),
    ("glance_s", |c, x| c.glance_s = [0.2, x]),
    ("gaze_offset_rad", |c, x| c.gaze_offset_rad = x),
    ("gaze_noise_rad", |c, x| c.gaze_noise_rad = x),
    ("tracker_noise_m", |c, x| c.tracker_noise_m = x),
];

const OTHERS: &[(&str, Spoil)] = &[
    ("speed_peak", |c| c.speed_peak = [0.2, 0.5]),
    ("dropout_s", |c| c.dropout_s = 0.0),
    ("press_depth_m", |c| c.tremor_m = [0.0, 0.005]),
    ("head_m", |c| c.head_m = DVec3::NAN),
    ("hand_rest_m", |c| c.hand_rest_m = DVec3::NAN),
    ("facing", |c| c.facing = DVec3::Z),
    ("facing", |c| c.facing = DVec3::NAN),
    ("mean_reach_s", |c| c.mean_reach_s = [1.2, 0.6]),
    ("glances", |c| c.glances = [0, 4]),
    ("glances", |c| c.glances = [2, 1]),
    ("glance_s", |c| c.glance_s = [0.0, 0.6]),
    ("glance_s", |c| c.glance_s = [0.6, 0.2]),
];

#[test]
fn settings_out_of_their_range_are_named() {
    let refused = |name: &str, spoil: &dyn Fn(&mut PersonConfig)| {
        for mut config in [PersonConfig::varied(), PersonConfig::glancing()] {
            spoil(&mut config);
            let refused = config.validate().expect_err(name).to_string();
            assert!(refused.contains(name), "{name}: {refused}");
            assert!(Population::new(config, 0).is_err() && Person::new(config, 0).is_err());
        }
    };
    for bad in [f64::NAN, -1.0, f64::INFINITY] {
        for (name, spoil) in SHARES.iter().chain(SIZES) {
            refused(name, &|config| spoil(config, bad));
        }
    }
    for (name, spoil) in SHARES {
        refused(name, &|config| spoil(config, 9.0));
    }
    for (name, spoil) in OTHERS {
        refused(name, spoil);
    }
}

#[test]
fn random_people_are_sound_and_unlike_each_other() {
    let people: Vec<_> = (0..1000).map(PersonConfig::random).collect();
    for (seed, config) in people.iter().enumerate() {
        assert_eq!(config.validate(), Ok(()), "{seed}");
        assert_eq!(*config, PersonConfig::random(seed as u64));
    }
    assert!(people.windows(2).all(|pair| pair[0] != pair[1]));
}
