//! Predictors and filters on reaches that nothing was learnt from.

use crate::bip::baselines::{MinimumJerkSearch, Seen, constant_velocity, hold, minimum_jerk};
use crate::bip::recordings::{Reaches, point};
use crate::bip::regression::{EndEstimate, EndRegression};
use crate::bip::study::{FRACTIONS, Row};
use glam::DVec3;
use hwall_bip::{
    Bank, BankConfig, Basis, BipError, Demonstration, EndPrediction, Evaluation, EvaluationConfig,
    Filter, FilterConfig, Group, Model, MotionFilter, NoiseSource, Observation, TrainingConfig,
    TuningConfig, tune,
};

/// Demonstrations that [`tune`] holds out, one at a time.
const TUNING_FOLDS: usize = 16;
/// Groups of the ablation: each is predicted by what the others taught.
pub(crate) const GROUPS: usize = 5;
/// Evidence of the regression counts with its covariance times this: it was learnt from the same
/// reaches as the model and looks at the same samples, so it is not independent of the filter.
const INFLATION: f64 = 2.0;

/// Collects predictions under the names of their predictors, in the order of their first.
#[derive(Default)]
struct Rows(Vec<Row>);

impl Rows {
    fn add(&mut self, name: &str, prediction: EndPrediction) {
        let at = self.0.iter().position(|r| r.name == name);
        let at = at.unwrap_or_else(|| {
            self.0.push(Row {
                name: name.to_owned(),
                evaluation: Evaluation::default(),
            });
            self.0.len() - 1
        });
        self.0[at].evaluation.predictions.push(prediction);
    }
}

/// One reach that nothing was learnt from, and its number.
struct HeldOut<'a> {
    number: usize,
    motion: &'a Demonstration,
    /// Last sample seen at each fraction.
    last: [usize; FRACTIONS.len()],
    actual: DVec3,
}

impl<'a> HeldOut<'a> {
    fn new(set: &'a Reaches, number: usize) -> Self {
        let motion = &set.demonstrations[number];
        let n = motion.len();
        Self {
            number,
            motion,
            // Rounded up, with room for the rounding of the product.
            last: FRACTIONS.map(|f| (f * n as f64 - 1e-9).ceil().max(1.0) as usize - 1),
            actual: point(motion, n - 1, set.scored),
        }
    }

    fn prediction(&self, at: usize, mean: DVec3, variance: [f64; 3]) -> EndPrediction {
        EndPrediction {
            motion: self.number,
            fraction: FRACTIONS[at],
            mean: mean.to_array().to_vec(),
            sd: variance.map(f64::sqrt).to_vec(),
            actual: self.actual.to_array().to_vec(),
        }
    }
}

/// Every predictor on every reach, held out by itself.
///
/// # Errors
/// Whatever training and filtering refuse.
pub(crate) fn leave_one_out(reaches: &Reaches) -> anyhow::Result<Vec<Row>> {
    let n = reaches.demonstrations.len();
    let mut rows = Rows::default();
    for number in 0..n {
        let held_out = HeldOut::new(reaches, number);
        let others = others(reaches, |i| i == number);
        simple(&mut rows, reaches, &held_out, &others);
        let evidence = evidence(reaches, &held_out, &others);
        if let Some(estimates) = &evidence {
            for (at, e) in estimates.iter().enumerate() {
                let variance = [0, 4, 8].map(|i| e.covariance_m2[i]);
                rows.add(
                    "ridge regression",
                    held_out.prediction(at, e.mean_m, variance),
                );
            }
        }
        let published = Setting::published();
        let model = published.model(reaches, &others)?;
        let filter = Filter::new(&model, &published.filter)?;
        rows.follow("BIP as published", filter, reaches, &held_out, None)?;

        let setting = Setting::default();
        let model = setting.model(reaches, &others)?;
        let filter = Filter::new(&model, &setting.filter)?;
        let bank = Bank::new(&model, &setting.bank())?;
        rows.follow("BIP, tuned", filter.clone(), reaches, &held_out, None)?;
        rows.follow("BIP, tuned, bank", bank, reaches, &held_out, None)?;
        if let Some(estimates) = &evidence {
            rows.follow(
                "BIP, tuned, with evidence of the end",
                filter,
                reaches,
                &held_out,
                Some((estimates, INFLATION)),
            )?;
        }
    }
    Ok(rows.0)
}

fn others(set: &Reaches, held_out: impl Fn(usize) -> bool) -> Vec<Demonstration> {
    let all = set.demonstrations.iter().enumerate();
    all.filter(|(i, _)| !held_out(*i))
        .map(|(_, d)| d.clone())
        .collect()
}

/// What the regression says at every fraction; `None` where there is too little to learn from.
fn evidence(
    set: &Reaches,
    held_out: &HeldOut<'_>,
    others: &[Demonstration],
) -> Option<Vec<EndEstimate>> {
    let regression = EndRegression::new(set, others).ok()?;
    Some(
        held_out
            .last
            .iter()
            .map(|k| regression.predict(held_out.motion, *k))
            .collect(),
    )
}

/// Predictors without a model of the motion.
fn simple(rows: &mut Rows, set: &Reaches, held_out: &HeldOut<'_>, others: &[Demonstration]) {
    let motion = held_out.motion;
    let points_m: Vec<DVec3> = (0..motion.len())
        .map(|k| point(motion, k, set.scored))
        .collect();
    let durations = || others.iter().map(Demonstration::duration);
    let search = MinimumJerkSearch::from_durations(durations());
    let usual_s = durations().sum::<f64>() / others.len() as f64;
    let ends = others.iter().map(|d| point(d, d.len() - 1, set.scored));
    let mean_end = ends.sum::<DVec3>() / others.len() as f64;
    for (at, &last) in held_out.last.iter().enumerate() {
        let seen = Seen {
            times_s: &motion.times()[..=last],
            points_m: &points_m[..=last],
        };
        let from_s = motion.times()[0];
        let ends = [
            ("mean end of the others", mean_end),
            ("hold", hold(seen)),
            (
                "constant velocity, usual duration",
                constant_velocity(seen, from_s + usual_s),
            ),
            (
                "constant velocity, arrival known",
                constant_velocity(seen, from_s + motion.duration()),
            ),
            ("minimum jerk", minimum_jerk(seen, &search)),
        ];
        for (name, end) in ends {
            rows.add(name, held_out.prediction(at, end, [0.0; 3]));
        }
    }
}

/// How a filter is made.
#[derive(Debug, Clone)]
struct Setting {
    basis: Basis,
    from_start: bool,
    published: bool,
    tuned: bool,
    /// Does tuning look for deviations that last?
    lasting: bool,
    filter: FilterConfig,
}

impl Default for Setting {
    fn default() -> Self {
        Self {
            basis: Basis::Legendre { count: 7 },
            from_start: false,
            published: false,
            tuned: true,
            lasting: true,
            filter: FilterConfig::default(),
        }
    }
}

impl Setting {
    fn published() -> Self {
        Self {
            basis: Basis::Polynomial { count: 8 },
            published: true,
            tuned: false,
            filter: FilterConfig {
                noise: NoiseSource::Fit,
                ..FilterConfig::default()
            },
            ..Self::default()
        }
    }

    fn bank(&self) -> BankConfig {
        BankConfig {
            filter: self.filter.clone(),
            ..BankConfig::default()
        }
    }

    fn model(&self, set: &Reaches, demonstrations: &[Demonstration]) -> anyhow::Result<Model> {
        let groups = vec![Group::observed("hand", 3 * set.points.len(), self.basis)];
        let training = if self.published {
            TrainingConfig::published(groups)
        } else {
            TrainingConfig::new(groups)
        };
        if !self.tuned {
            return Ok(Model::train(demonstrations, &training)?);
        }
        let config = TuningConfig {
            evaluation: EvaluationConfig {
                fractions: FRACTIONS[..6].to_vec(),
                scored: set.scored_dofs().to_vec(),
                ..EvaluationConfig::new(&training)
            },
            folds: TUNING_FOLDS,
            filter: self.filter.clone(),
            ..TuningConfig::new(&training)
        };
        let config = if self.lasting {
            config
        } else {
            TuningConfig {
                correlation_times: vec![0.0],
                ..config
            }
        };
        Ok(tune(demonstrations, &training, &config)?.model)
    }
}

/// A filter that also takes evidence about the end.
trait Follower: MotionFilter + Clone {
    fn observe_end(&mut self, end: &Observation<'_>) -> Result<(), BipError>;
}

impl Follower for Filter {
    fn observe_end(&mut self, end: &Observation<'_>) -> Result<(), BipError> {
        self.observe_at(1.0, end).map(|_| ())
    }
}

impl Follower for Bank {
    fn observe_end(&mut self, end: &Observation<'_>) -> Result<(), BipError> {
        self.observe_at(1.0, end).map(|_| ())
    }
}

impl Rows {
    /// Follows a held-out reach and predicts its end at every fraction. Evidence, with the factor on
    /// its covariance, is taken by a copy at each: it would otherwise count the same samples again.
    fn follow<F: Follower>(
        &mut self,
        name: &str,
        mut filter: F,
        set: &Reaches,
        held_out: &HeldOut<'_>,
        evidence: Option<(&[EndEstimate], f64)>,
    ) -> anyhow::Result<()> {
        let motion = held_out.motion;
        let all: Vec<usize> = (0..motion.dofs()).collect();
        let scored = set.scored_dofs();
        let mut at = 0;
        for k in 0..motion.len() {
            let dt_s = match k {
                0 => motion.duration() / (motion.len() - 1) as f64,
                _ => motion.times()[k] - motion.times()[k - 1],
            };
            filter.predict(dt_s)?;
            filter.observe(&Observation::new(&all, motion.sample(k)))?;
            while at < FRACTIONS.len() && held_out.last[at] <= k {
                let mut informed = filter.clone();
                if let Some((estimates, inflation)) = evidence {
                    let covariance = estimates[at].covariance_m2.map(|c| inflation * c);
                    let end_m = estimates[at].mean_m.to_array();
                    let end = Observation::new(&scored, &end_m);
                    informed.observe_end(&end.with_covariance(&covariance))?;
                }
                let (mut mean, mut variance) = ([0.0; 3], [0.0; 3]);
                informed.predict_at(1.0, &scored, &mut mean, &mut variance)?;
                let mean = DVec3::from_array(mean);
                self.add(name, held_out.prediction(at, mean, variance));
                at += 1;
            }
        }
        Ok(())
    }
}

/// What each choice is worth; groups of reaches are held out as a whole.
///
/// # Errors
/// Whatever training and filtering refuse.
pub(crate) fn ablation(raw: &Reaches) -> anyhow::Result<Vec<Row>> {
    let default = Setting::default();
    let settings = [
        ("as above", default.clone()),
        (
            "deviations independent",
            Setting {
                lasting: false,
                ..default.clone()
            },
        ),
        (
            "seen from the start of the reach",
            Setting {
                from_start: true,
                ..default.clone()
            },
        ),
        (
            "Legendre, 5 functions",
            Setting {
                basis: Basis::Legendre { count: 5 },
                ..default.clone()
            },
        ),
        (
            "Legendre, 10 functions",
            Setting {
                basis: Basis::Legendre { count: 10 },
                ..default.clone()
            },
        ),
        (
            "8 normalised Gaussians",
            Setting {
                basis: Basis::normalized_gaussian(8),
                ..default.clone()
            },
        ),
        (
            "not tuned",
            Setting {
                tuned: false,
                ..default.clone()
            },
        ),
    ];
    let mut rows = Rows::default();
    for (name, setting) in settings {
        let set = if setting.from_start {
            raw.from_start()?
        } else {
            raw.clone()
        };
        for group in 0..GROUPS {
            let others = others(&set, |i| i % GROUPS == group);
            let model = setting.model(&set, &others)?;
            let filter = Filter::new(&model, &setting.filter)?;
            for number in (group..set.demonstrations.len()).step_by(GROUPS) {
                let held_out = HeldOut::new(&set, number);
                rows.follow(name, filter.clone(), &set, &held_out, None)?;
                if name == "as above"
                    && let Some(estimates) = evidence(&set, &held_out, &others)
                {
                    for inflation in [1.0, 2.0, 4.0] {
                        let name = format!("with evidence of the end, covariance × {inflation:.0}");
                        rows.follow(
                            &name,
                            filter.clone(),
                            &set,
                            &held_out,
                            Some((&estimates, inflation)),
                        )?;
                    }
                }
            }
        }
    }
    Ok(rows.0)
}
