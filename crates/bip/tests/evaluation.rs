//! Scores, cross-validation and tuning.

use hwall_bip::{
    Basis, BipError, Demonstration, EndPrediction, EvaluationConfig, Filter, FilterConfig, Group,
    TrainingConfig, TuningConfig, follow, leave_one_out, tune,
};
use hwall_testkit::Sampler;

fn motions(seed: u64, count: usize, drift: f64) -> Vec<Demonstration> {
    let mut sampler = Sampler::new(seed);
    (0..count)
        .map(|_| {
            let samples = 50 + sampler.index(40);
            let goal: [f64; 3] = [0; 3].map(|_| sampler.uniform(0.2, 0.7));
            // What no demonstration shares: slow wandering of each motion.
            let wander: Vec<[f64; 2]> = (0..9)
                .map(|_| [sampler.normal(), sampler.uniform(0.0, 6.3)])
                .collect();
            let mut values = Vec::new();
            for k in 0..samples {
                let t = k as f64 / (samples - 1) as f64;
                let r = t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
                for d in 0..3 {
                    let own: f64 = (0..3)
                        .map(|j| {
                            let [size, phase] = wander[3 * d + j];
                            drift * size * (6.0 * (j + 1) as f64 * t + phase).sin()
                        })
                        .sum();
                    values.push(goal[d] * r + 0.2 * t + own + 1e-3 * sampler.normal());
                }
            }
            Demonstration::from_samples(0.02, 3, values).unwrap()
        })
        .collect()
}

fn training() -> TrainingConfig {
    let basis = Basis::Legendre { count: 7 };
    TrainingConfig::new(vec![
        Group::observed("hand", 2, basis),
        Group::controlled("arm", 1, basis),
    ])
}

fn prediction(mean: f64, sd: f64, actual: f64) -> EndPrediction {
    EndPrediction {
        motion: 0,
        fraction: 1.0,
        mean: vec![mean],
        sd: vec![sd],
        actual: vec![actual],
    }
}

#[test]
fn ranked_probability_score_is_its_integral() {
    for (mean, sd, actual) in [(0.0, 1.0, 0.0), (0.3, 0.1, 0.5), (-2.0, 3.0, 4.0)] {
        let p = prediction(mean, sd, actual);
        // ∫ (F(x) - [x >= actual])² dx, by the trapezoid rule on 16 standard deviations.
        let (low, high) = (mean - 12.0 * sd, mean + 12.0 * sd);
        let n = 200_000;
        let sum: f64 = (0..n)
            .map(|k| {
                let x = low + (high - low) * (f64::from(k) + 0.5) / f64::from(n);
                let below = prediction(mean, sd, x);
                // Twice the share between mean and x.
                let within = if x >= mean { 1.0 } else { -1.0 } * two_sided(&below);
                let cdf = 0.5 * (1.0 + within);
                let step = if x >= actual { 1.0 } else { 0.0 };
                (cdf - step) * (cdf - step)
            })
            .sum();
        let integral = sum * (high - low) / f64::from(n);
        assert!(
            (p.crps(0) - integral).abs() < 2e-4 * sd,
            "{} {integral}",
            p.crps(0)
        );
    }
}

/// Smallest probability whose central interval holds the truth, from `covered` alone.
fn two_sided(p: &EndPrediction) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if p.covered(0, middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

#[test]
fn intervals_and_log_score_are_those_of_a_normal_distribution() {
    let p = prediction(1.0, 2.0, 1.0 + 2.0 * 1.644_853_6);
    assert!(p.covered(0, 0.9001) && !p.covered(0, 0.8999));
    assert!((p.z(0) - 1.644_853_6).abs() < 1e-12);
    let at_mean = prediction(1.0, 2.0, 1.0).log_score(0);
    assert!((at_mean + (2.0 * std::f64::consts::TAU.sqrt()).ln()).abs() < 1e-12);
}

#[test]
fn held_out_motions_are_foreseen_and_intervals_hold() {
    let motions = motions(21, 24, 0.004);
    let training = training();
    let (model, trials) = tune(&motions, &training, &TuningConfig::new(&training)).unwrap();
    let tuning = model.tuning().unwrap();
    assert!(trials.iter().any(|t| t.tuning == tuning));
    let best = trials.iter().map(|t| t.log_score).fold(f64::MIN, f64::max);
    assert!(
        trials
            .iter()
            .any(|t| t.tuning == tuning && t.log_score == best)
    );
    // Motions of their own wandering: independent noise must be larger than the residual.
    assert!(tuning.noise_factor > 1.0, "{tuning:?}");

    let config = EvaluationConfig::new(&training);
    let mut fresh = hwall_bip::Evaluation::default();
    let unseen = self::motions(22, 24, 0.004);
    for (i, motion) in unseen.iter().enumerate() {
        let mut filter = Filter::new(&model, &FilterConfig::default()).unwrap();
        let ends = follow(&mut filter, i, motion, &config).unwrap();
        fresh.predictions.extend(ends);
    }
    let error = |e: &hwall_bip::Evaluation, f: f64| {
        let mut d: Vec<f64> = e.at(f).map(|p| p.distance(&[0, 1])).collect();
        d.sort_by(f64::total_cmp);
        d[d.len() / 2]
    };
    assert!(error(&fresh, 0.9) < 0.02);
    assert!(error(&fresh, 0.1) > 5.0 * error(&fresh, 0.9));
    let coverage = fresh.coverage(&[0, 1, 2], 0.9);
    assert!((0.82..=0.97).contains(&coverage), "{coverage}");
    let naive = leave_one_out(&motions, &training, &config, |m| {
        let fit = FilterConfig {
            noise: hwall_bip::NoiseSource::Fit,
            ..FilterConfig::default()
        };
        Filter::new(m, &fit)
    })
    .unwrap();
    assert_eq!(naive.predictions.len(), 24 * 10);
    assert!(naive.coverage(&[0, 1, 2], 0.9) < coverage);
    assert!(naive.log_score(&[0, 1]) < fresh.log_score(&[0, 1]));
    assert!(naive.crps(&[0]) > 0.0);
    assert!(naive.spread(&[0, 1, 2], 0.9).unwrap() > 1.0);
}

#[test]
fn cross_validation_is_training_on_the_others() {
    let motions = motions(23, 5, 0.002);
    let training = training();
    let config = EvaluationConfig::new(&training);
    let make = |m: &hwall_bip::Model| Filter::new(m, &FilterConfig::default());
    let all = leave_one_out(&motions, &training, &config, make).unwrap();
    let model = hwall_bip::Model::train(&motions[1..], &training).unwrap();
    let first = follow(&mut make(&model).unwrap(), 0, &motions[0], &config).unwrap();
    assert_eq!(&all.predictions[..10], &first[..]);
}

#[test]
fn malformed_evaluations_are_typed_errors() {
    let motions = motions(24, 4, 0.002);
    let training = training();
    let good = EvaluationConfig::new(&training);
    let make = |m: &hwall_bip::Model| Filter::new(m, &FilterConfig::default());
    for fractions in [vec![0.0], vec![0.5, 0.5], vec![0.9, 1.1], vec![f64::NAN]] {
        let bad = EvaluationConfig {
            fractions,
            ..good.clone()
        };
        assert!(matches!(
            leave_one_out(&motions, &training, &bad, make),
            Err(BipError::Parameter { .. })
        ));
    }
    let unknown = EvaluationConfig {
        scored: vec![3],
        ..good.clone()
    };
    assert!(matches!(
        leave_one_out(&motions, &training, &unknown, make),
        Err(BipError::UnknownDof { dof: 3, dofs: 3 })
    ));
    assert!(matches!(
        leave_one_out(&motions[..1], &training, &good, make),
        Err(BipError::TooFewDemonstrations { .. })
    ));
    let tuning = TuningConfig::new(&training);
    assert!(matches!(
        tune(&motions[..2], &training, &tuning),
        Err(BipError::TooFewDemonstrations { .. })
    ));
    for bad in [
        TuningConfig {
            noise_factors: vec![],
            ..tuning.clone()
        },
        TuningConfig {
            velocity_changes: vec![-0.1],
            ..tuning.clone()
        },
        TuningConfig {
            folds: 0,
            ..tuning.clone()
        },
    ] {
        assert!(matches!(
            tune(&motions, &training, &bad),
            Err(BipError::Parameter { .. })
        ));
    }
}
