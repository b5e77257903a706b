//! Snapped orientations and turns of the avatar: identities, bounds, faults.

use hwall_redirection::{
    AvatarTurn, PersonMotion, RedirectionError, SampledOrientations, TurnConfig, WalkingThresholds,
    wrapped_rad,
};
use hwall_testkit::{Sampler, refused};
use std::f64::consts::{PI, TAU};

const BAD: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

#[test]
fn snapped_and_turned_is_the_original_and_nothing_sampled_is_nearer() {
    let mut sampler = Sampler::new(1);
    for _ in 0..2000 {
        let step = sampler.uniform(0.05, 1.0);
        let end = sampler.uniform(0.0, PI);
        let orientations = SampledOrientations::new(step, end).unwrap();
        let heading = sampler.uniform(-3.0 * PI, 3.0 * PI);
        let snapped = orientations.snap(heading).unwrap();
        let back = wrapped_rad(snapped.heading_rad + snapped.turn_rad - heading);
        assert!(back.abs() < 1e-12, "{back}");
        assert!(snapped.heading_rad.abs() <= end + 1e-8);
        let count = (orientations.end_rad() / step).round() as i32;
        let nearest = (-count..=count)
            .map(|k| wrapped_rad(heading - f64::from(k) * step).abs())
            .fold(f64::INFINITY, f64::min);
        assert!(snapped.turn_rad.abs() <= nearest + 1e-12);
        assert_eq!(snapped.sampled, nearest <= 0.5 * step + 1e-12);
    }
}

#[test]
fn presets_hold_what_they_name() {
    let all = [
        (SampledOrientations::default(), 22.5, 45.0),
        (SampledOrientations::dissertation(), 15.0, 45.0),
    ];
    for (orientations, step, end) in all {
        assert!((orientations.step_rad().to_degrees() - step).abs() < 1e-12);
        assert!((orientations.end_rad().to_degrees() - end).abs() < 1e-12);
        let made = SampledOrientations::new(step.to_radians(), end.to_radians()).unwrap();
        assert!((made.end_rad() - orientations.end_rad()).abs() < 1e-12);
        let beyond = orientations.snap(1.5).unwrap();
        assert!(!beyond.sampled && (beyond.heading_rad - orientations.end_rad()).abs() < 1e-12);
    }
    // Full circle: every heading is sampled.
    let round = SampledOrientations::new(PI / 8.0, PI).unwrap();
    assert!((0..1000).all(|i| round.snap(f64::from(i) * 0.01 - 5.0).unwrap().sampled));
}

#[test]
fn wrapped_angles_are_in_one_turn() {
    for (angle, expected) in [(0.0, 0.0), (PI, PI), (-PI, PI), (TAU, 0.0), (3.0 * PI, PI)] {
        assert!((wrapped_rad(angle) - expected).abs() < 1e-15, "{angle}");
    }
    assert!(BAD.into_iter().all(|bad| wrapped_rad(bad).is_nan()));
}

fn turning_by(change: impl FnOnce(&mut TurnConfig)) -> Result<AvatarTurn, RedirectionError> {
    let mut config = TurnConfig::default();
    change(&mut config);
    AvatarTurn::new(config)
}

/// A person turning on the spot.
const TURNING: PersonMotion = PersonMotion {
    turn_rad_per_s: 1.0,
    speed_m_per_s: 0.0,
    steered_turn_rad_per_s: 0.0,
    steered_speed_m_per_s: 0.0,
};

fn motion(sampler: &mut Sampler) -> PersonMotion {
    PersonMotion {
        turn_rad_per_s: sampler.uniform(-3.0, 3.0),
        speed_m_per_s: sampler.uniform(0.0, 1.5),
        steered_turn_rad_per_s: sampler.uniform(-2.0, 2.0),
        steered_speed_m_per_s: sampler.uniform(-2.0, 2.0),
    }
}

#[test]
fn turns_stay_within_the_thresholds_in_rate_and_in_total() {
    let mut sampler = Sampler::new(2);
    for _ in 0..50 {
        let config = TurnConfig {
            steered_share: sampler.uniform(0.0, 1.0),
            most_rad: sampler.uniform(0.0, 1.0),
            most_rad_per_s: sampler.uniform(0.0, 2.0),
            ..TurnConfig::default()
        };
        let mut turn = AvatarTurn::new(config).unwrap();
        let mut sum = 0.0;
        for _ in 0..500 {
            let (motion, dt_s) = (motion(&mut sampler), sampler.uniform(0.0, 0.05));
            let wanted = sampler.uniform(-1.5, 1.5);
            let step = turn.step(wanted, &motion, dt_s).unwrap();
            sum += step.injected_rad;
            assert!((sum - step.turned_rad).abs() < 1e-12);
            assert!((step.turned_rad + step.residual_rad - wanted).abs() < 1e-15);
            assert!(step.turned_rad.abs() <= config.most_rad + 1e-12);
            let rate = step.injected_rad / dt_s.max(1e-12);
            assert!(rate.abs() <= config.most_rad_per_s + 1e-9);
            // Independent computation: gain between 1 / 1.49 and 1 / 0.8, or curvature of the path.
            let t = motion.turn_rad_per_s + config.steered_share * motion.steered_turn_rad_per_s;
            let v =
                motion.speed_m_per_s + config.steered_share * motion.steered_speed_m_per_s.abs();
            let gain = (t + rate) / t;
            let unnoticed = (1.0 / 1.49 - 1e-9..=1.25 + 1e-9).contains(&gain);
            assert!(
                unnoticed || rate.abs() <= v / 22.0 + 1e-9,
                "{gain} {rate} {v}"
            );
        }
    }
}

#[test]
fn the_published_shares_are_of_the_virtual_turn() {
    let thresholds = WalkingThresholds::default();
    let [least, most] = thresholds.turn_rates_rad_per_s(1.0, 0.0).unwrap();
    let real_over_virtual = [1.0 / (1.0 + least), 1.0 / (1.0 + most)];
    assert!((real_over_virtual[0] - 1.49).abs() < 1e-12);
    assert!((real_over_virtual[1] - 0.80).abs() < 1e-12);
    // A turn to the other side has mirrored bounds; curvature alone allows both signs.
    let mirrored = thresholds.turn_rates_rad_per_s(-1.0, 0.0).unwrap();
    assert_eq!(mirrored, [-most, -least]);
    let bend = thresholds.turn_rates_rad_per_s(0.0, 1.1).unwrap();
    assert_eq!(bend, [-0.05, 0.05]);
}

#[test]
fn nobody_at_rest_is_turned_and_without_gain_nothing_is() {
    let mut turn = AvatarTurn::new(TurnConfig::default()).unwrap();
    let still = PersonMotion::default();
    assert_eq!(turn.step(1.0, &still, 10.0).unwrap().turned_rad, 0.0);
    let mut none = turning_by(|c| c.thresholds = WalkingThresholds::NONE).unwrap();
    let mut sampler = Sampler::new(3);
    for _ in 0..100 {
        let step = none.step(1.0, &motion(&mut sampler), 0.1).unwrap();
        assert_eq!((step.turned_rad, step.residual_rad), (0.0, 1.0));
    }
    // A steered movement with share 0 hides nothing.
    let mut real = turning_by(|c| c.steered_share = 0.0).unwrap();
    let steered = PersonMotion {
        steered_turn_rad_per_s: 1.0,
        steered_speed_m_per_s: 1.0,
        ..still
    };
    assert_eq!(real.step(1.0, &steered, 1.0).unwrap().turned_rad, 0.0);
}

#[test]
fn a_wanted_turn_is_reached_exactly_and_kept() {
    let mut turn = AvatarTurn::new(TurnConfig::default()).unwrap();
    for _ in 0..200 {
        turn.step(0.2, &TURNING, 0.01).unwrap();
    }
    assert_eq!(turn.turned_rad(), 0.2);
    assert_eq!(turn.step(0.2, &TURNING, 0.01).unwrap().injected_rad, 0.0);
}

#[test]
fn numbers_that_make_no_sense_are_named_and_change_nothing() {
    let mut turn = AvatarTurn::new(TurnConfig::default()).unwrap();
    turn.step(0.1, &TURNING, 0.01).unwrap();
    let before = turn;
    for bad in BAD {
        assert!(turn.step(bad, &TURNING, 0.01).is_err());
        assert!(turn.step(0.1, &TURNING, bad).is_err());
        let spoil: [fn(&mut PersonMotion, f64); 4] = [
            |m, bad| m.turn_rad_per_s = bad,
            |m, bad| m.speed_m_per_s = bad,
            |m, bad| m.steered_turn_rad_per_s = bad,
            |m, bad| m.steered_speed_m_per_s = bad,
        ];
        for spoil in spoil {
            let mut motion = TURNING;
            spoil(&mut motion, bad);
            assert!(turn.step(0.1, &motion, 0.01).is_err(), "{motion:?}");
        }
        assert!(SampledOrientations::default().snap(bad).is_err());
        assert!(SampledOrientations::new(bad, 1.0).is_err());
        assert!(SampledOrientations::new(0.1, bad).is_err());
    }
    assert!(turn.step(0.1, &TURNING, -0.01).is_err());
    assert_eq!(turn, before);
    assert!(SampledOrientations::new(0.0, 1.0).is_err());
    refused!(TurnConfig::default(), AvatarTurn::new, {
        thresholds.real_turn_less = 1.0;
        steered_share = 1.1;
        thresholds.least_radius_m = 0.0;
        most_rad = f64::NAN;
    });
}

#[test]
fn steps_do_not_allocate() {
    let mut turn = AvatarTurn::new(TurnConfig::default()).unwrap();
    let orientations = SampledOrientations::default();
    let mut sampler = Sampler::new(4);
    let motion = motion(&mut sampler);
    let counted = allocation_counter::measure(|| {
        for i in 0..100 {
            let snapped = orientations.snap(f64::from(i) * 0.1).unwrap();
            turn.step(snapped.turn_rad, &motion, 0.01).unwrap();
        }
    });
    assert_eq!(counted.count_total, 0);
}
