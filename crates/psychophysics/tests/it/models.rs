//! Power, Stevens' law and psychometric functions with planted truth.

use crate::common::{factors, observed, pairs};
use hwall_psychophysics::{
    ErrorModel, MagnitudeAnswer, PairAnswers, PowerStudy, PowerTest, PsychophysicsError, Sigmoid,
    fit_psychometric, noncentral_t_cdf, normal_cdf, power, stevens_fit, t_quantile_two_sided,
};
use hwall_testkit::Sampler;

fn population(means: Vec<f64>, sizes: &[usize]) -> PowerStudy {
    PowerStudy {
        within: factors(sizes),
        means,
        subjects: 16,
        between_sd: 2.0,
        level_sd: 0.0,
        within_sd: 1.0,
        test: PowerTest::default(),
        alpha: 0.05,
        studies: 4000,
        seed: 1,
    }
}

/// Power for 16 differences with dz = 0.5 / √2.
#[test]
fn two_levels_have_the_power_of_a_t_test() {
    let found = power(&population(vec![0.0, 0.5], &[2])).expect("power");
    let t = t_quantile_two_sided(0.05, 15.0);
    let shift = 0.5 / 2_f64.sqrt() * 4.0;
    let want = 1.0 - noncentral_t_cdf(t, 15.0, shift) + noncentral_t_cdf(-t, 15.0, shift);
    let covers = found[0].ci_low < want && want < found[0].ci_high;
    assert!(covers, "{found:?}, {want}");
}

#[test]
fn nothing_is_found_with_probability_alpha() {
    let study = PowerStudy {
        studies: 2000,
        ..population(vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], &[2, 3])
    };
    for ranks in [false, true] {
        for errors in [ErrorModel::Strata, ErrorModel::Pooled] {
            let mut study = study.clone();
            (study.test.errors, study.test.ranks) = (errors, ranks);
            let found = power(&study).expect("power");
            assert!(found[0].power > 0.99, "{found:?}");
            for effect in &found[1..] {
                let off = effect.power - 0.05;
                assert!(off.abs() < 0.015, "{ranks} {errors:?} {effect:?}");
            }
        }
    }
}

/// The reason why the error model is a choice: if subjects differ in their effects, pooled
/// errors give false effects; strata do not.
#[test]
fn pooled_errors_need_subjects_that_differ_by_a_constant() {
    let study = PowerStudy {
        level_sd: 1.0,
        studies: 2000,
        ..population(vec![0.0; 9], &[3, 3])
    };
    let mut pooled = study.clone();
    pooled.test.errors = ErrorModel::Pooled;
    let [strata, pooled] = [study, pooled].map(|study| power(&study).expect("power"));
    assert!(strata[0].power < 0.07, "{strata:?}");
    assert!(pooled[0].power > 0.12, "{pooled:?}");
}

#[test]
fn power_has_one_answer_a_seed() {
    let study = PowerStudy {
        studies: 200,
        ..population(vec![0.0, 0.3, 0.6], &[3])
    };
    let found = power(&study).expect("power");
    assert_eq!(power(&study).expect("power"), found);
    let other = PowerStudy { seed: 2, ..study };
    assert_ne!(power(&other).expect("power"), found);
}

#[test]
fn impossible_populations_are_refused() {
    let base = population(vec![0.0, 0.5], &[2]);
    let spoil: [fn(&mut PowerStudy); 14] = [
        |s| s.subjects = 1,
        |s| s.subjects = 0,
        |s| s.studies = 0,
        |s| s.within_sd = 0.0,
        |s| s.between_sd = -1.0,
        |s| s.level_sd = f64::NAN,
        |s| s.alpha = 1.0,
        |s| s.means = vec![0.0; 3],
        |s| s.means = vec![0.0, f64::NAN],
        |s| (s.within, s.means) = (vec![], vec![]),
        |s| s.subjects = usize::MAX,
        |s| s.subjects = 5_000_001,
        |s| s.within_sd = 1e200,
        |s| s.between_sd = f64::INFINITY,
    ];
    for spoil in spoil {
        let mut wrong = base.clone();
        spoil(&mut wrong);
        assert!(power(&wrong).is_err(), "{wrong:?}");
    }
    let mut corrected = base;
    corrected.test.errors = ErrorModel::Pooled;
    corrected.test.greenhouse_geisser = true;
    assert_eq!(power(&corrected), Err(PsychophysicsError::PooledCorrection));
}

fn magnitudes(stimuli: &[f64], magnitudes: &[f64]) -> Vec<MagnitudeAnswer> {
    let pairs = stimuli.iter().zip(magnitudes);
    let answer = |(&stimulus, &magnitude)| MagnitudeAnswer {
        stimulus,
        magnitude,
    };
    pairs.map(answer).collect()
}

#[test]
fn an_exact_law_is_found() {
    let x = [0.5, 1.0, 2.0, 5.0, 9.0];
    let y = x.map(|x: f64| 3.0 * x.powf(0.7));
    let law = stevens_fit(&magnitudes(&x, &y), 0.95).expect("a law");
    assert!((law.exponent - 0.7).abs() < 1e-12 && (law.constant - 3.0).abs() < 1e-12);
    assert!((law.r2 - 1.0).abs() < 1e-12 && law.ln_sd < 1e-12);
    assert!((law.magnitude(4.0) - 3.0 * 4_f64.powf(0.7)).abs() < 1e-12);
}

#[test]
fn intervals_of_the_law_cover() {
    let mut sampler = Sampler::new(3);
    let x = [1.0, 2.0, 3.0, 5.0, 8.0, 13.0];
    let (mut exponent, mut constant) = (0, 0);
    for _ in 0..2000 {
        let y = x.map(|x: f64| 2.0 * x.powf(1.3) * (0.2 * sampler.normal()).exp());
        let law = stevens_fit(&magnitudes(&x, &y), 0.9).expect("a law");
        let inside = |[low, high]: [f64; 2], truth| i32::from(low < truth && truth < high);
        exponent += inside(law.exponent_ci, 1.3);
        constant += inside(law.constant_ci, 2.0);
    }
    assert!((1755..1845).contains(&exponent), "{exponent}");
    assert!((1755..1845).contains(&constant), "{constant}");
}

#[test]
fn laws_without_a_fit_are_refused() {
    for (x, y) in [
        (vec![1.0, 2.0], vec![1.0, 2.0]),
        (vec![0.0, 2.0, 3.0], vec![1.0, 2.0, 3.0]),
        (vec![1.0, 2.0, 3.0], vec![1.0, -2.0, 3.0]),
        (vec![1.0, 2.0, 3.0], vec![1.0, f64::NAN, 3.0]),
        (vec![2.0, 2.0, 2.0], vec![1.0, 2.0, 3.0]),
    ] {
        assert!(stevens_fit(&magnitudes(&x, &y), 0.95).is_err());
    }
}

fn answers(shares: &[(f64, f64)], trials: u32) -> Vec<PairAnswers> {
    let one = |&(stimulus, share): &(f64, f64)| PairAnswers {
        stimulus,
        greater: (share * f64::from(trials)).round() as u32,
        trials,
    };
    shares.iter().map(one).collect()
}

#[test]
fn exact_shares_give_the_function_back() {
    let stimuli = [80.0, 90.0, 95.0, 100.0, 105.0, 110.0, 120.0];
    let gauss = stimuli.map(|x| (x, normal_cdf((x - 102.0) / 8.0)));
    let logistic = stimuli.map(|x| (x, 1.0 / (1.0 + (-(x - 102.0) / 8.0_f64).exp())));
    for (sigmoid, shares, jnd) in [
        (Sigmoid::CumulativeGaussian, gauss, 0.674_489_750_196_081_7),
        (Sigmoid::Logistic, logistic, 3_f64.ln()),
    ] {
        let fit = fit_psychometric(&answers(&shares, 1_000_000_000), sigmoid).expect("a fit");
        assert!((fit.pse - 102.0).abs() < 1e-5, "{fit:?}");
        assert!((fit.scale - 8.0).abs() < 1e-5, "{fit:?}");
        assert!((fit.jnd - 8.0 * jnd).abs() < 1e-5);
        assert!((fit.share(fit.pse + fit.jnd) - 0.75).abs() < 1e-12);
        assert!(fit.deviance < 1e-3 && fit.deviance_p.expect("p") > 0.9);
    }
}

#[test]
fn standard_errors_are_those_of_repetition() {
    let mut sampler = Sampler::new(4);
    let stimuli = [-4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0];
    for sigmoid in [Sigmoid::CumulativeGaussian, Sigmoid::Logistic] {
        let mut fits = Vec::new();
        while fits.len() < 400 {
            let share = |stimulus: f64| normal_cdf((stimulus - 0.5) / 2.0);
            let draw = |stimulus| observed(&mut sampler, (stimulus, share(stimulus)), 60);
            fits.push(fit_psychometric(&stimuli.map(draw), sigmoid).expect("a fit"));
        }
        let n = fits.len() as f64;
        type Pick = fn(&hwall_psychophysics::Psychometric) -> (f64, f64);
        let pick: [Pick; 2] = [|f| (f.pse, f.pse_se), |f| (f.jnd, f.jnd_se)];
        for (of, truth) in pick.into_iter().zip([0.5, 2.0 * 0.674_489_75]) {
            let mean = fits.iter().map(|f| of(f).0).sum::<f64>() / n;
            let squares: f64 = fits.iter().map(|f| (of(f).0 - mean).powi(2)).sum();
            let told = fits.iter().map(|f| of(f).1).sum::<f64>() / n;
            let sd = (squares / (n - 1.0)).sqrt();
            let off = told / sd - 1.0;
            assert!(off.abs() < 0.12, "{sigmoid:?}: told {told}, is {sd}");
            assert!((mean - truth).abs() < 0.08, "{sigmoid:?}: {mean}");
        }
    }
}

#[test]
fn answers_without_a_fit_are_refused() {
    let no_fit = |shares: &[(f64, f64)]| {
        let fit = fit_psychometric(&answers(shares, 10), Sigmoid::default());
        let is_refused = matches!(fit, Err(PsychophysicsError::NoFit { .. }));
        assert!(is_refused, "{fit:?}");
    };
    no_fit(&[]);
    no_fit(&[(1.0, 0.5)]);
    no_fit(&[(1.0, 0.5), (1.0, 0.7)]);
    no_fit(&[(1.0, 0.0), (2.0, 0.0), (3.0, 1.0)]);
    no_fit(&[(1.0, 0.0), (2.0, 0.5), (3.0, 1.0)]);
    no_fit(&[(1.0, 1.0), (2.0, 0.0)]);
    no_fit(&[(1.0, 0.0), (2.0, 0.0)]);
    no_fit(&[(1.0, 0.9), (2.0, 0.5), (3.0, 0.1)]);
    no_fit(&[(1.0, 0.5), (2.0, 0.5), (3.0, 0.5)]);
    for answers in [(1.0, 3, 2), (1.0, 0, 0), (f64::NAN, 1, 2)] {
        assert!(fit_psychometric(&pairs([answers]), Sigmoid::Logistic).is_err());
    }
}

/// Nearly separated answers, with so many trials that scoring overshoots.
#[test]
fn fits_that_do_not_converge_are_refused() {
    let answers = pairs([
        (0.0, 0, 100_000),
        (1.0, 0, 1_000_000),
        (2.0, 1, 1_000_000_000),
        (3.0, 78_112_259, 100_000_000),
    ]);
    let fit = fit_psychometric(&answers, Sigmoid::Logistic);
    assert_eq!(fit, Err(PsychophysicsError::NotConverged { steps: 200 }));
}
