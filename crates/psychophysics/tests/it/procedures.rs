//! Staircases, QUEST+ and thresholds against closed forms and simulated observers.

use crate::common::{observed, pairs};
use hwall_psychophysics::{
    QuestGrid, QuestPlus, Sigmoid, Staircase, StaircaseConfig, normal_cdf, normal_quantile,
    threshold,
};
use hwall_testkit::Sampler;

/// Share of right answers in two intervals: a half without a stimulus.
fn right_share(x: f64, threshold: f64, scale: f64) -> f64 {
    0.5 + 0.49 * normal_cdf((x - threshold) / scale)
}

#[test]
fn a_staircase_ends_where_its_rule_balances() {
    let equal = StaircaseConfig::two_down(0.0, 1.0, [-5.0, 5.0]);
    assert!((equal.target_share() - 0.5_f64.sqrt()).abs() < 1e-15);
    let three = StaircaseConfig {
        down_after: 3,
        ..equal
    };
    assert!((three.target_share() - 0.5_f64.cbrt()).abs() < 1e-15);
    let weighted = StaircaseConfig {
        down_after: 1,
        step_up: 3.0,
        ..equal
    };
    assert!((weighted.target_share() - 0.75).abs() < 1e-15);
    // A yes-no observer: the share is the cumulative Gaussian about 0, so the target stimulus is its quantile.
    for config in [equal, three, weighted] {
        let config = StaircaseConfig {
            start: 3.0,
            step_down: 0.1 * config.step_down,
            step_up: 0.1 * config.step_up,
            reversals: 42,
            ..config
        };
        let mut sampler = Sampler::new(5);
        let mut sum = 0.0;
        let runs = 200;
        for _ in 0..runs {
            let mut stairs = Staircase::new(config).unwrap();
            while let Some(x) = stairs.stimulus() {
                stairs.answer(sampler.uniform(0.0, 1.0) < normal_cdf(x));
            }
            let estimate = stairs.estimate(0.95).unwrap().unwrap();
            assert_eq!(estimate.reversals, 40);
            assert!(estimate.ci[0] < estimate.threshold && estimate.threshold < estimate.ci[1]);
            sum += estimate.threshold;
        }
        let mean = sum / f64::from(runs);
        let truth = normal_quantile(config.target_share());
        println!("{:.3}: {mean:.3}, truth {truth:.3}", config.target_share());
        assert!((mean - truth).abs() < 0.1, "{mean} {truth}");
    }
}

#[test]
fn hostile_rules_are_refused() {
    let good = StaircaseConfig::two_down(1.0, 0.1, [0.0, 2.0]);
    let spoil: [fn(&mut StaircaseConfig); 9] = [
        |c| c.start = f64::NAN,
        |c| c.start = 3.0,
        |c| c.range = [2.0, 0.0],
        |c| c.range = [0.0, f64::INFINITY],
        |c| c.step_up = 0.0,
        |c| c.step_down = f64::NAN,
        |c| c.down_after = 0,
        |c| c.reversals = 3,
        |c| c.reversals = usize::MAX,
    ];
    for spoil in spoil {
        let mut config = good;
        spoil(&mut config);
        assert!(Staircase::new(config).is_err(), "{config:?}");
    }
    let mut stairs = Staircase::new(good).unwrap();
    assert!(stairs.estimate(0.95).unwrap().is_none());
    assert!(stairs.estimate(f64::NAN).is_err());
    // With an observer who is always right, the staircase stays at the end of the range and never ends.
    for _ in 0..1000 {
        stairs.answer(true);
    }
    assert_eq!((stairs.stimulus(), stairs.trials()), (Some(0.0), 1000));
}

#[test]
fn quest_is_bayes_rule() {
    let grid = QuestGrid {
        stimuli: vec![-1.0, 0.0, 2.0],
        thresholds: vec![0.0, 1.0],
        scales: vec![0.5],
        lapses: vec![0.02],
        guess: 0.5,
        sigmoid: Sigmoid::CumulativeGaussian,
    };
    let mut quest = QuestPlus::new(grid).unwrap();
    let share = |x: f64, t: f64| 0.5 + 0.48 * normal_cdf((x - t) / 0.5);
    let mut odds: f64 = 1.0;
    for (place, x, right) in [
        (2, 2.0, true),
        (1, 0.0, false),
        (0, -1.0, true),
        (1, 0.0, true),
    ] {
        quest.answer(place, right).unwrap();
        let p = |t| match right {
            true => share(x, t),
            false => 1.0 - share(x, t),
        };
        odds *= p(1.0) / p(0.0);
        let later = odds / (1.0 + odds);
        let estimate = quest.estimate(0.95).unwrap();
        assert!((estimate.threshold - later).abs() < 1e-12);
        let entropy = -(later * later.ln() + (1.0 - later) * (1.0 - later).ln());
        assert!((estimate.entropy - entropy).abs() < 1e-12);
    }
    assert!(quest.answer(3, true).is_err());
}

#[test]
fn quest_finds_planted_thresholds_and_says_how_surely() {
    let mut sampler = Sampler::new(11);
    let (mut inside, mut square, mut plain) = (0, 0.0, 0.0);
    let runs = 100;
    for _ in 0..runs {
        let truth = sampler.uniform(-1.0, 1.0);
        // Chosen places, and the same number of trials spread evenly over the grid.
        let mut estimate = |is_even: bool| {
            let mut quest = QuestPlus::new(QuestGrid::over([-3.0, 3.0], 41, 0.5)).unwrap();
            for i in 0..60 {
                let place = if is_even {
                    (i * 40) / 59
                } else {
                    quest.next_place()
                };
                let x = -3.0 + 0.15 * place as f64;
                let right = sampler.uniform(0.0, 1.0) < right_share(x, truth, 0.6);
                quest.answer(place, right).unwrap();
            }
            quest.estimate(0.95).unwrap()
        };
        let (chosen, even) = (estimate(false), estimate(true));
        let [low, high] = chosen.threshold_ci;
        // Interval ends are grid points.
        inside += i32::from((low - 0.075..=high + 0.075).contains(&truth));
        square += (chosen.threshold - truth).powi(2);
        plain += (even.threshold - truth).powi(2);
    }
    let rms = |sum: f64| (sum / f64::from(runs)).sqrt();
    let (square, plain) = (rms(square), rms(plain));
    println!("rms {square:.3}, evenly placed {plain:.3}; {inside} of {runs} inside");
    assert!(inside >= 90, "{inside}");
    assert!(square < 0.35 && square < plain);
}

#[test]
fn hostile_grids_are_refused() {
    let good = QuestGrid::over([0.0, 1.0], 5, 0.5);
    let spoil: [fn(&mut QuestGrid); 7] = [
        |g| g.stimuli = Vec::new(),
        |g| g.thresholds = vec![f64::NAN],
        |g| g.scales = vec![0.0],
        |g| g.lapses = vec![-0.1],
        |g| g.guess = 1.0,
        |g| g.guess = f64::NAN,
        |g| (g.stimuli, g.thresholds) = (vec![0.0; 10_000], vec![0.0; 10_000]),
    ];
    for spoil in spoil {
        let mut grid = good.clone();
        spoil(&mut grid);
        assert!(QuestPlus::new(grid).is_err());
    }
    let huge = QuestGrid::over([1.0, 2.0], 2000, 0.5);
    assert!(QuestPlus::new(huge).is_err(), "24 million entries");
}

/// Coverage of the intervals over many simulated observers equals the nominal one.
#[test]
fn intervals_of_thresholds_hold_the_truth() {
    let (reference, sd) = (10.0, 1.5);
    let jnd = sd * normal_quantile(0.75);
    let mut sampler = Sampler::new(3);
    let (mut pse, mut weber, mut fits) = (0, 0, 0);
    for _ in 0..1000 {
        let stimuli = [7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0];
        let answers = stimuli.map(|stimulus| {
            let share = normal_cdf((stimulus - reference) / sd);
            observed(&mut sampler, (stimulus, share), 20)
        });
        let Ok(found) = threshold(&answers, Sigmoid::CumulativeGaussian, reference, 0.95) else {
            continue;
        };
        fits += 1;
        pse += i32::from((found.pse_ci[0]..=found.pse_ci[1]).contains(&reference));
        weber += i32::from((found.weber_ci[0]..=found.weber_ci[1]).contains(&(jnd / reference)));
        assert!((found.weber * reference - found.function.jnd).abs() < 1e-12);
    }
    println!("{fits} fits: pse {pse}, weber {weber}");
    assert!(fits >= 995);
    for held in [pse, weber] {
        let share = f64::from(held) / f64::from(fits);
        assert!((0.92..=0.98).contains(&share), "{share}");
    }
    let answers = pairs([(1.0, 1, 2)]);
    assert!(threshold(&answers, Sigmoid::Logistic, 0.0, 0.95).is_err());
    assert!(threshold(&answers, Sigmoid::Logistic, 1.0, 1.0).is_err());
}

/// By direct computation of the expected entropy, no other stimulus is more informative.
#[test]
fn the_next_stimulus_is_the_one_that_tells_most() {
    // One and two thresholds: shares of right answers computed by hand.
    let grid = QuestGrid {
        stimuli: (0..20).map(|i| 0.1 * f64::from(i) - 1.0).collect(),
        thresholds: vec![-0.4, 0.3],
        scales: vec![0.5],
        lapses: vec![0.0],
        guess: 0.5,
        sigmoid: Sigmoid::CumulativeGaussian,
    };
    let stimuli = grid.stimuli.clone();
    let share = |x: f64, t: f64| 0.5 + 0.5 * normal_cdf((x - t) / 0.5);
    let mut quest = QuestPlus::new(grid).unwrap();
    for trial in 0..40 {
        let now = quest.estimate(0.95).unwrap();
        let upper = (now.threshold + 0.4) / 0.7;
        let expected = |place: usize| {
            let right = [-0.4, 0.3].map(|t| share(stimuli[place], t));
            let yes = (1.0 - upper) * right[0] + upper * right[1];
            let after = |right: bool| {
                let mut copy = quest.clone();
                copy.answer(place, right).unwrap();
                copy.estimate(0.95).unwrap().entropy
            };
            yes * after(true) + (1.0 - yes) * after(false)
        };
        let next = quest.next_place();
        let least = (0..20).map(expected).fold(f64::INFINITY, f64::min);
        assert!(expected(next) <= least + 1e-9, "trial {trial}");
        assert!(least <= now.entropy + 1e-9);
        quest.answer(next, trial % 4 != 0).unwrap();
    }
}
