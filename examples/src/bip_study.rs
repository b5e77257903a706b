//! Leave-one-out error of the predicted end of recorded reaches: the filters beside simple means.

use crate::bip_baselines::{MinimumJerkSearch, Seen, constant_velocity, hold, minimum_jerk};
use crate::bip_recordings::{Reaches, point, read};
use crate::bip_regression::{EndEstimate, EndRegression};
use glam::DVec3;
use hwall_bip::{
    Bank, BankConfig, Basis, BipError, Demonstration, EndPrediction, Evaluation, EvaluationConfig,
    Filter, FilterConfig, Group, Model, MotionFilter, NoiseSource, Observation, TrainingConfig,
    TuningConfig, tune,
};
use hwall_testkit::{MarkdownTable, quantile};
use std::fmt::Write as _;
use std::path::Path;

/// Shares of the samples after which the end is predicted.
pub const FRACTIONS: [f64; 7] = [0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 1.0];
/// Demonstrations that [`tune`] holds out, one at a time.
const TUNING_FOLDS: usize = 16;
/// Groups of the ablation: each is predicted by what the other four taught.
const GROUPS: usize = 5;
/// Fewer reaches than this are an illustration, not a result.
const FEW: usize = 10;
/// Evidence of the regression counts with its covariance times this: it was learnt from the same
/// reaches as the model and looks at the same samples, so it is not independent of the filter.
const INFLATION: f64 = 2.0;

/// One predictor over all held-out reaches.
#[derive(Debug, Clone)]
pub struct Row {
    /// Name for tables and legends.
    pub name: String,
    /// Its predictions. Those of a predictor without uncertainty have a deviation of 0.
    pub evaluation: Evaluation,
}

impl Row {
    /// Median distance of the predicted from the true end after a share of the motion, mm.
    #[must_use]
    pub fn median_mm(&self, fraction: f64) -> f64 {
        let distance = |p: &EndPrediction| 1e3 * p.distance(&[0, 1, 2]);
        let mut errors: Vec<f64> = self.evaluation.at(fraction).map(distance).collect();
        errors.sort_by(f64::total_cmp);
        quantile(&errors, 0.5)
    }

    /// Shares of 50 % and 90 % intervals, per axis, that hold the truth, and mean CRPS per axis,
    /// mm; after 10 to 90 % of the motion. `None` without uncertainty.
    #[must_use]
    pub fn calibration(&self) -> Option<[f64; 3]> {
        let under_way = |p: &&EndPrediction| p.fraction < 0.95;
        let predictions = self.evaluation.predictions.iter().filter(under_way);
        let part = Evaluation {
            predictions: predictions.cloned().collect(),
        };
        let uncertain = part
            .predictions
            .iter()
            .all(|p| p.sd.iter().all(|s| *s > 0.0));
        let axes = [0, 1, 2];
        let values = [
            part.coverage(&axes, 0.5),
            part.coverage(&axes, 0.9),
            1e3 * part.crps(&axes),
        ];
        (uncertain && !part.predictions.is_empty()).then_some(values)
    }
}

/// All predictors on one source of reaches.
#[derive(Debug, Clone)]
pub struct Study {
    /// The source.
    pub reaches: Reaches,
    /// Every reach held out by itself.
    pub rows: Vec<Row>,
    /// Variations of the filter; every fifth reach held out together. Empty for few reaches.
    pub ablation: Vec<Row>,
}

/// Everything that the recordings say.
#[derive(Debug, Clone)]
pub struct Report {
    /// Markdown, from a third-level heading a source.
    pub text: String,
    /// What the text and the figures are made of.
    pub studies: Vec<Study>,
}

/// Studies every source of recordings under a folder.
///
/// # Errors
/// No recordings there, or a file that is none.
pub fn recordings_report(dir: &Path) -> anyhow::Result<Report> {
    let mut studies = Vec::new();
    let mut text = String::from(
        "Median distance of the predicted from the measured end, mm, over reaches that were held out \
         one at a time (training, tuning and regression saw only the others), after shares of the samples. \
         Intervals are per axis; they and the CRPS are averages over 10 to 90 % of the motion.\n",
    );
    for reaches in read(dir)? {
        let study = study(reaches)?;
        write!(text, "\n{}", markdown(&study))?;
        studies.push(study);
    }
    Ok(Report { text, studies })
}

fn markdown(study: &Study) -> String {
    let set = &study.reaches;
    let (length_m, duration_s) = set.size();
    let n = set.demonstrations.len();
    let mut text = format!(
        "### {}: {n} reaches of {length_m:.2} m and {duration_s:.2} s (medians)\n\n{}.",
        set.name, set.source
    );
    if n < FEW {
        text += " Too few for conclusions: an illustration.";
    }
    if !set.left_out.is_empty() {
        text += &format!(" Left out: {}.", set.left_out.join("; "));
    }
    text += &format!("\n\n{}", table(&study.rows));
    if !study.ablation.is_empty() {
        text += &format!(
            "\nVariations of the tuned filter; here {GROUPS} groups, each held out as a whole.\n\n{}",
            table(&study.ablation)
        );
    }
    text
}

fn table(rows: &[Row]) -> MarkdownTable {
    let shares = FRACTIONS.map(|f| format!("{:.0} %", 100.0 * f));
    let columns = ["predictor".to_owned()].into_iter().chain(shares);
    let calibration = ["in 50 %", "in 90 %", "CRPS"].map(str::to_owned);
    let mut table = MarkdownTable::new(columns.chain(calibration));
    for row in rows {
        let mut cells = vec![row.name.clone()];
        cells.extend(FRACTIONS.map(|f| format!("{:.1}", row.median_mm(f))));
        cells.extend(match row.calibration() {
            Some([half, most, crps]) => [
                format!("{half:.2}"),
                format!("{most:.2}"),
                format!("{crps:.1}"),
            ],
            None => ["", "", ""].map(str::to_owned),
        });
        table.row(cells);
    }
    table
}

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

fn study(reaches: Reaches) -> anyhow::Result<Study> {
    let n = reaches.demonstrations.len();
    let mut rows = Rows::default();
    for number in 0..n {
        let held_out = HeldOut::new(&reaches, number);
        let others = others(&reaches, |i| i == number);
        simple(&mut rows, &reaches, &held_out, &others);
        let evidence = evidence(&reaches, &held_out, &others);
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
        let model = published.model(&reaches, &others)?;
        let filter = Filter::new(&model, &published.filter)?;
        rows.follow("BIP as published", filter, &reaches, &held_out, None)?;

        let setting = Setting::default();
        let model = setting.model(&reaches, &others)?;
        let filter = Filter::new(&model, &setting.filter)?;
        let bank = Bank::new(&model, &setting.bank())?;
        rows.follow("BIP, tuned", filter, &reaches, &held_out, None)?;
        rows.follow("BIP, tuned, bank", bank.clone(), &reaches, &held_out, None)?;
        if let Some(estimates) = &evidence {
            rows.follow(
                "BIP bank + ridge",
                bank,
                &reaches,
                &held_out,
                Some((estimates, INFLATION)),
            )?;
        }
    }
    let ablation = if n < FEW {
        Vec::new()
    } else {
        ablation(&reaches)?
    };
    Ok(Study {
        reaches,
        rows: rows.0,
        ablation,
    })
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
    for (at, &last) in held_out.last.iter().enumerate() {
        let seen = Seen {
            times_s: &motion.times()[..=last],
            points_m: &points_m[..=last],
        };
        let from_s = motion.times()[0];
        let ends = [
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
    filter: FilterConfig,
}

impl Default for Setting {
    fn default() -> Self {
        Self {
            basis: Basis::Legendre { count: 7 },
            from_start: false,
            published: false,
            tuned: true,
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
        Ok(tune(demonstrations, &training, &config)?.0)
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
                informed.moments_at(1.0, &scored, &mut mean, &mut variance)?;
                for (v, dof) in variance.iter_mut().zip(scored) {
                    *v += informed.residual_variance(dof).unwrap_or(0.0);
                    *v *= informed.spread().powi(2);
                }
                let mean = DVec3::from_array(mean);
                self.add(name, held_out.prediction(at, mean, variance));
                at += 1;
            }
        }
        Ok(())
    }
}

/// What each choice is worth.
fn ablation(raw: &Reaches) -> anyhow::Result<Vec<Row>> {
    let default = Setting::default();
    let settings = [
        ("as above", default.clone()),
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
