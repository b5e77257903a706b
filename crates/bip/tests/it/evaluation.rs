//! Scores, cross-validation and tuning.

use crate::common::one_group;
use hwall_bip::{
    ArgumentError, Basis, BipError, Demonstration, EndPrediction, Evaluation, EvaluationConfig,
    Filter, FilterConfig, Group, Model, NoiseSource, Onset, TrainingConfig, Tuned, TuningConfig,
    follow, leave_one_out, tune,
};
use hwall_testkit::{Sampler, minimum_jerk};

fn motions(seed: u64, count: usize, drift: f64) -> Vec<Demonstration> {
    let mut sampler = Sampler::new(seed);
    (0..count)
        .map(|_| {
            let samples = 50 + sampler.index(40);
            let goal: [f64; 3] = [0; 3].map(|_| sampler.uniform(0.2, 0.7));
            // Slow wandering of each motion, which demonstrations do not share.
            let wander: Vec<[f64; 2]> = (0..9)
                .map(|_| [sampler.normal(), sampler.uniform(0.0, 6.3)])
                .collect();
            let mut values = Vec::new();
            for k in 0..samples {
                let t = k as f64 / (samples - 1) as f64;
                let r = minimum_jerk(t);
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

fn make(model: &Model) -> Result<Filter, BipError> {
    Filter::new(model, &FilterConfig::default())
}

fn prediction(mean: f64, sd: f64, actual: f64) -> EndPrediction {
    EndPrediction {
        motion: 0,
        fraction: 1.0,
        mean: vec![mean],
        sd: vec![sd],
        actual: vec![actual],
        time: None,
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
                // Twice the probability between mean and x.
                let within = if x >= mean { 1.0 } else { -1.0 } * two_sided(&below);
                let cdf = 0.5 * (1.0 + within);
                let step = if x >= actual { 1.0 } else { 0.0 };
                (cdf - step) * (cdf - step)
            })
            .sum();
        let integral = sum * (high - low) / f64::from(n);
        let score = p.crps(0);
        assert!((score - integral).abs() < 2e-4 * sd, "{score} {integral}");
    }
}

/// Smallest probability whose central interval contains the truth, from `covered` alone.
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
fn held_out_motions_are_predicted_and_intervals_hold() {
    let motions = motions(21, 24, 0.004);
    let training = training();
    let Tuned { model, trials } = tune(&motions, &training, &TuningConfig::new(&training)).unwrap();
    let tuning = model.tuning().unwrap();
    let best = trials.iter().map(|t| t.log_score).fold(f64::MIN, f64::max);
    let mut found = trials.iter().filter(|t| t.tuning == tuning);
    assert!(found.any(|t| t.log_score == best));
    // Each motion wanders in its own way, so independent noise must be larger than the residual.
    assert!(tuning.noise_factor > 1.0, "{tuning:?}");

    let config = EvaluationConfig::new(&training);
    let mut fresh = Evaluation::default();
    let unseen = self::motions(22, 24, 0.004);
    for (i, motion) in unseen.iter().enumerate() {
        let mut filter = make(&model).unwrap();
        let ends = follow(&mut filter, i, motion, &config).unwrap();
        fresh.predictions.extend(ends);
    }
    let error = |e: &Evaluation, f: f64| {
        let mut d: Vec<f64> = e.at(f).map(|p| p.distance(&[0, 1])).collect();
        d.sort_by(f64::total_cmp);
        d[d.len() / 2]
    };
    assert!(error(&fresh, 0.9) < 0.02);
    assert!(error(&fresh, 0.1) > 5.0 * error(&fresh, 0.9));
    let coverage = fresh.coverage(&[0, 1, 2], 0.9);
    assert!((0.82..=0.97).contains(&coverage), "{coverage}");
    let fit = FilterConfig {
        noise: NoiseSource::Fit,
        ..FilterConfig::default()
    };
    let naive = leave_one_out(&motions, &training, &config, |m| Filter::new(m, &fit)).unwrap();
    assert_eq!(naive.predictions.len(), 24 * 10);
    assert!(naive.coverage(&[0, 1, 2], 0.9) < coverage);
    assert!(naive.log_score(&[0, 1]) < fresh.log_score(&[0, 1]));
    assert!(naive.crps(&[0]) > 0.0);
    assert!(naive.spread(&[0, 1, 2], 0.9).unwrap() > 1.0);
}

/// Regression test: equal demonstrations show one error without scatter, so all ends lay on the edges of the intervals, and no interval
/// contained one.
#[test]
fn intervals_of_equal_demonstrations_hold_another_one() {
    for count in [3, 12] {
        let reach = |k: i32| (f64::from(k) / 59.0).powi(9).sin();
        let values = (0..60).flat_map(|k| [reach(k), 0.3 * reach(k), -0.5 * reach(k)]);
        let motion = Demonstration::from_samples(0.02, 3, values.collect()).unwrap();
        let motions = vec![motion.clone(); count];
        let config = TuningConfig::new(&training());
        let model = tune(&motions, &training(), &config).unwrap().model;
        let mut filter = make(&model).unwrap();
        let config = EvaluationConfig::new(&training());
        let ends = follow(&mut filter, 0, &motion, &config).unwrap();
        for end in ends {
            assert!((0..3).all(|i| end.covered(i, 0.9)), "{count}: {end:?}");
            // No wider than Student's t with two degrees of freedom, 2.92 in place of 1.64.
            assert!((0..3).any(|i| !end.covered(i, 0.3)), "{count}: {end:?}");
        }
    }
}

#[test]
fn cross_validation_is_training_on_the_others() {
    let motions = motions(23, 5, 0.002);
    let training = training();
    let config = EvaluationConfig::new(&training);
    let all = leave_one_out(&motions, &training, &config, make).unwrap();
    let model = Model::train(&motions[1..], &training).unwrap();
    let first = follow(&mut make(&model).unwrap(), 0, &motions[0], &config).unwrap();
    assert_eq!(&all.predictions[..10], &first[..]);
}

#[test]
fn malformed_evaluations_are_typed_errors() {
    let motions = motions(24, 4, 0.002);
    let training = training();
    let out_of_range =
        |e: BipError| matches!(e, BipError::Argument(ArgumentError::OutOfRange { .. }));
    let evaluated = |count: usize, change: &dyn Fn(&mut EvaluationConfig)| {
        let mut config = EvaluationConfig::new(&training);
        change(&mut config);
        leave_one_out(&motions[..count], &training, &config, make).unwrap_err()
    };
    for fractions in [vec![0.0], vec![0.5, 0.5], vec![0.9, 1.1], vec![f64::NAN]] {
        assert!(out_of_range(
            evaluated(4, &|c| c.fractions = fractions.clone())
        ));
    }
    let unknown = BipError::UnknownDof { dof: 3, dofs: 3 };
    assert_eq!(evaluated(4, &|c| c.scored = vec![3]), unknown);
    let too_few = |e| matches!(e, BipError::TooFewDemonstrations { .. });
    assert!(too_few(evaluated(1, &|_| ())));
    let tuned = |count: usize, change: &dyn Fn(&mut TuningConfig)| {
        let mut config = TuningConfig::new(&training);
        change(&mut config);
        tune(&motions[..count], &training, &config).unwrap_err()
    };
    assert!(too_few(tuned(2, &|_| ())));
    assert!(out_of_range(tuned(4, &|c| c.noise_factors = vec![])));
    assert!(out_of_range(tuned(4, &|c| c.velocity_changes = vec![-0.1])));
    assert!(out_of_range(tuned(4, &|c| c.folds = 0)));
    // Nothing to score.
    assert!(out_of_range(tuned(4, &|c| c.evaluation.fractions = vec![])));
    assert!(out_of_range(tuned(4, &|c| c.evaluation.scored = vec![])));
}

/// Constant columns are predicted without error; they must not narrow the intervals of the others.
#[test]
fn constant_columns_do_not_spoil_the_tuning() {
    let moving = motions(25, 16, 0.004);
    let with_constants = |constants: usize| -> Vec<Demonstration> {
        moving
            .iter()
            .map(|d| {
                let rows = (0..d.len()).map(|k| [d.sample(k), &vec![0.7; constants][..]].concat());
                let values = rows.flatten().collect();
                Demonstration::from_samples(0.02, 3 + constants, values).unwrap()
            })
            .collect()
    };
    let spread = |constants: usize| {
        let basis = Basis::Legendre { count: 7 };
        let mut groups = training().groups;
        if constants > 0 {
            groups.push(Group::observed("fixed", constants, basis));
        }
        let training = TrainingConfig::new(groups);
        let config = TuningConfig::new(&training);
        let tuned = tune(&with_constants(constants), &training, &config).unwrap();
        tuned.model.tuning().unwrap()
    };
    let (none, many) = (spread(0), spread(9));
    let off = many.spread / none.spread - 1.0;
    assert!(off.abs() < 0.2, "{none:?} {many:?}");
    let all_fixed = one_group(2, Basis::Legendre { count: 3 });
    let still = vec![Demonstration::from_samples(0.02, 2, vec![1.0; 60]).unwrap(); 4];
    tune(&still, &all_fixed, &TuningConfig::new(&all_fixed)).unwrap();
}

/// Rest before and after is cut from the test motion as from the training motions.
#[test]
fn onset_is_that_of_training() {
    let mut sampler = Sampler::new(26);
    let rested: Vec<Demonstration> = motions(27, 14, 0.002)
        .iter()
        .map(|d| {
            let (before, after) = (20 + sampler.index(40), sampler.index(20));
            let mut values = Vec::new();
            for k in 0..before + d.len() + after {
                let at = k.saturating_sub(before).min(d.len() - 1);
                values.extend(d.sample(at).iter().map(|x| x + 2e-4 * sampler.normal()));
            }
            Demonstration::from_samples(0.02, 3, values).unwrap()
        })
        .collect();
    let onset = Onset::new(vec![0, 1]);
    let cut: Vec<_> = rested.iter().map(|d| d.trimmed(&onset).unwrap()).collect();
    let config = EvaluationConfig::new(&training());
    let with = TrainingConfig {
        onset: Some(onset),
        ..training()
    };
    let by_config = leave_one_out(&rested, &with, &config, make).unwrap();
    let by_hand = leave_one_out(&cut, &training(), &config, make).unwrap();
    assert_eq!(by_config, by_hand);
    let tuning = TuningConfig::new(&with);
    let a = tune(&rested, &with, &tuning).unwrap().model;
    let b = tune(&cut, &training(), &tuning).unwrap().model;
    assert_eq!(a.tuning(), b.tuning());
    let still = Demonstration::from_samples(0.02, 3, vec![0.0; 300]).unwrap();
    let result = Model::train(&[rested[0].clone(), still], &with);
    assert!(matches!(result, Err(BipError::NothingMoves { .. })));
}
