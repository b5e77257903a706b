//! The learned estimator: a regression of the end beside an interaction primitive.

use crate::gates::Gates;
use crate::local_ridge::{LocalRidge, Rows};
use crate::primitive::{Follower, Primitive, Training, demonstration};
use crate::reach_track::{Inputs, PROGRESS, ReachTrack, way_axes};
use crate::{
    ContactError, ContactEstimate, ContactEstimator, HandFrame, LabelledReach, TimeToContact,
};
use glam::{DMat3, DVec3};
use hwall_bip::{Basis, Demonstration};
use std::sync::Arc;

/// Fewest reaches to learn from.
const FEWEST: usize = 8;
/// Lowest standard deviation of a coordinate that is ever claimed, m: the noise of a good tracker.
const SENSOR_M: f64 = 3e-4;
/// Lowest standard deviation of a time, s.
const CLOCK_S: f64 = 2e-3;
/// 90 % of a normal variable in three dimensions lie within this Mahalanobis distance, squared.
const CHI_SQUARED_3_90: f64 = 6.251_389;
/// 90 % of a standard normal variable lie within this.
const NORMAL_90: f64 = 1.644_854;

/// Who says where the reach ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Combination {
    /// The regression alone.
    Regression,
    /// The interaction primitive alone.
    Primitive,
    /// Both, weighted by the joint covariance of their errors on held-out reaches.
    #[default]
    Both,
}

/// How a [`LearnedModel`] is learnt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LearnedConfig {
    /// Who says where the reach ends. Default both.
    pub combination: Combination,
    /// Let the regression see the direction of gaze. Default `false`: a fusion with a scene weighs the
    /// gaze by itself, and it is not there in every study.
    pub gaze: bool,
    /// Regions of progress, each with coefficients of its own. Default 16; 1 is plain ridge
    /// regression.
    pub regions: usize,
    /// Samples of each reach to learn from. Default 30.
    pub samples_per_reach: usize,
    /// Basis of the interaction primitive. Default 9 normalised Gaussians.
    pub basis: Basis,
    /// Most parts that the reaches are held out in; whole persons where there are three or more. Default 16.
    pub folds: usize,
}

impl Default for LearnedConfig {
    fn default() -> Self {
        Self {
            combination: Combination::Both,
            gaze: false,
            regions: 16,
            samples_per_reach: 30,
            basis: Basis::normalized_gaussian(9),
            folds: 16,
        }
    }
}

/// What was learnt from labelled reaches: where a reach like them ends.
///
/// Two sources. A ridge regression of the way left, linear in the motion so far, with coefficients
/// that change with the progress of the reach; and a Bayesian interaction primitive of the touching
/// point. Both look at the same samples, so their errors are correlated: the weights follow from the
/// joint covariance of their errors on people (or reaches) that were held out, which is the best
/// linear combination whatever the correlation [Bar-Shalom 1986]. The covariance of the answer is that
/// of the combination, with a factor that makes 90 % regions hold 90 % of the held-out ends.
#[derive(Debug, Clone)]
pub struct LearnedModel {
    learnt: Arc<Learnt>,
}

#[derive(Debug)]
struct Learnt {
    inputs: Inputs,
    gates: Gates,
    ridge: LocalRidge,
    normals: bool,
    primitive: Option<Primitive>,
    /// By region of progress.
    errors: Vec<Errors>,
    combination: Combination,
}

/// Second moments of held-out errors in the axes of the way, m² and s².
#[derive(Debug, Clone, Copy, Default)]
struct Errors {
    regression: DMat3,
    primitive: DMat3,
    /// `E[regression primitive']`.
    cross: DMat3,
    /// Share of the primitive in the combination.
    gain: f64,
    time: f64,
    /// Factors on the covariance and on the deviation of the time.
    spread: f64,
    time_spread: f64,
}

impl LearnedModel {
    /// Learns from reaches of one frame, as many people as there are.
    ///
    /// # Errors
    /// Fewer than eight reaches, a reach that nothing can be learnt from, no regions or samples.
    pub fn train(reaches: &[LabelledReach], config: &LearnedConfig) -> Result<Self, ContactError> {
        reaches.iter().try_for_each(LabelledReach::validate)?;
        let few = |what, value: usize, needed: usize| {
            if value >= needed {
                return Ok(());
            }
            let (value, wanted) = (value as f64, "at least 1, 2 folds");
            Err(ContactError::Parameter {
                what,
                value,
                wanted,
            })
        };
        few("regions", config.regions, 1)?;
        few("samples_per_reach", config.samples_per_reach, 1)?;
        few("folds", config.folds, 2)?;
        if reaches.len() < FEWEST {
            return Err(ContactError::TooFewReaches {
                got: reaches.len(),
                needed: FEWEST,
            });
        }
        let inputs = Inputs::of(reaches, config.gaze);
        let folds = folds(reaches, config.folds);
        let demonstrations: Vec<Demonstration> = reaches
            .iter()
            .map(|r| demonstration(&inputs, r))
            .collect::<Result<_, _>>()?;
        let training = match config.combination {
            Combination::Regression => None,
            _ => Some(Training::tuned(config.basis, &demonstrations)?),
        };
        let both = || reaches.iter().zip(&demonstrations);
        let mut samples = Vec::new();
        let count = 1 + folds.iter().copied().max().unwrap_or(0);
        for fold in 0..count {
            let primitive = match &training {
                Some(training) => Some(
                    training.primitive(
                        both()
                            .zip(&folds)
                            .filter(|(_, f)| **f != fold)
                            .map(|(r, _)| r),
                    )?,
                ),
                None => None,
            };
            for (reach, _) in reaches.iter().zip(&folds).filter(|(_, f)| **f == fold) {
                sample(
                    &inputs,
                    reach,
                    primitive.as_ref(),
                    config,
                    fold,
                    &mut samples,
                )?;
            }
        }
        let progress: Vec<_> = samples.iter().map(|s| s.progress).collect();
        let gates = Gates::of(&progress, config.regions);
        let normals = reaches.iter().all(|r| r.normal.is_some());
        let mut rows = rows(&samples, &gates, normals);
        let groups = match normals {
            true => vec![0..3, 3..4, 4..7],
            false => vec![0..3, 3..4],
        };
        let even = LocalRidge::fit(&rows, &groups)?;
        weigh(&mut rows, &even.held_out);
        let fitted = LocalRidge::fit(&rows, &groups)?;
        let errors = errors(&samples, &rows, &fitted.held_out, config.combination);
        Ok(Self {
            learnt: Arc::new(Learnt {
                inputs,
                gates,
                ridge: fitted.ridge,
                normals,
                primitive: training.map(|t| t.primitive(both())).transpose()?,
                errors,
                combination: config.combination,
            }),
        })
    }

    /// An estimator that waits for a reach. Estimators share what was learnt.
    #[must_use]
    pub fn estimator(&self) -> LearnedEstimator {
        let learnt = &self.learnt;
        LearnedEstimator {
            track: ReachTrack::new(&learnt.inputs),
            follower: learnt
                .primitive
                .as_ref()
                .map(|p| Follower::new(&learnt.inputs, p)),
            features: Vec::with_capacity(learnt.inputs.len()),
            gates: Vec::with_capacity(learnt.gates.len()),
            learnt: Arc::clone(learnt),
        }
    }
}

/// Follows a reach with a [`LearnedModel`]. No allocation in a step.
#[derive(Debug, Clone)]
pub struct LearnedEstimator {
    learnt: Arc<Learnt>,
    track: ReachTrack,
    follower: Option<Follower>,
    features: Vec<f64>,
    gates: Vec<f64>,
}

impl ContactEstimator for LearnedEstimator {
    fn begin(&mut self) {
        self.track.begin(&self.learnt.inputs);
        if let Some(follower) = &mut self.follower {
            follower.begin();
        }
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        if !self.track.push(&self.learnt.inputs, frame) {
            return None;
        }
        let (t_s, now_m) = self.track.now()?;
        let (_, start_m) = self.track.start()?;
        let primitive_m = self.follower.as_mut().and_then(|follower| {
            follower.step(&self.learnt.inputs, &self.track).ok()?;
            Some(follower.end().ok()?.0)
        });
        let learnt = &*self.learnt;
        self.track.features_into(&learnt.inputs, &mut self.features);
        learnt
            .gates
            .weights_into(&self.track.progress(), &mut self.gates);
        let mut out = [0.0; OUTPUTS];
        let out = &mut out[..learnt.ridge.outputs()];
        learnt.ridge.predict(&self.features, &self.gates, out);
        let regression_m = now_m + DVec3::from_slice(&out[..3]);
        let errors = Errors::at(&learnt.errors, &self.gates);
        let axes = way_axes(start_m, regression_m);
        let (point_m, covariance) = errors.combined(learnt.combination, regression_m, primitive_m);
        let normal = learnt.normals.then(|| DVec3::from_slice(&out[4..7]));
        let estimate = ContactEstimate {
            t_s,
            point_m,
            covariance_m2: Some(symmetric(
                axes * (covariance * errors.spread) * axes.transpose(),
            )),
            normal: normal.and_then(DVec3::try_normalize),
            time_to_contact_s: Some(TimeToContact {
                mean_s: out[3].max(0.0),
                sd_s: Some(errors.time.sqrt().max(CLOCK_S) * errors.time_spread),
            }),
        };
        estimate.point_m.is_finite().then_some(estimate)
    }
}

/// Way left, time left, normal.
const OUTPUTS: usize = 7;

/// One sample of a reach that is learnt from.
struct Sampled {
    fold: usize,
    reach_weight: f64,
    progress: [f64; PROGRESS],
    features: Vec<f64>,
    start_m: DVec3,
    now_m: DVec3,
    end_m: DVec3,
    left_s: f64,
    normal: Option<DVec3>,
    primitive_m: Option<DVec3>,
}

/// Which reaches are held out together: people where there are three, else every so-manieth reach.
fn folds(reaches: &[LabelledReach], most: usize) -> Vec<usize> {
    let mut people: Vec<&Option<String>> = reaches.iter().map(|r| &r.person).collect();
    people.sort();
    people.dedup();
    let by_person = people.len() >= 3;
    let most = most.min(reaches.len());
    reaches
        .iter()
        .enumerate()
        .map(|(i, r)| match people.binary_search(&&r.person) {
            Ok(person) if by_person => person % most,
            _ => i % most,
        })
        .collect()
}

/// Follows a reach and keeps samples at even times, the last one included.
fn sample(
    inputs: &Inputs,
    reach: &LabelledReach,
    primitive: Option<&Primitive>,
    config: &LearnedConfig,
    fold: usize,
    samples: &mut Vec<Sampled>,
) -> Result<(), ContactError> {
    let mut track = ReachTrack::new(inputs);
    let mut follower = primitive.map(|p| Follower::new(inputs, p));
    let (start_s, duration_s) = (reach.frames[0].t_s, reach.duration_s());
    let last = reach.frames.len() - 1;
    let first_new = samples.len();
    let mut next = 0;
    for (k, frame) in reach.frames.iter().enumerate() {
        if !track.push(inputs, frame) {
            continue;
        }
        let (Some((t_s, now_m)), Some((_, start_m))) = (track.now(), track.start()) else {
            continue;
        };
        if let Some(follower) = &mut follower {
            follower.step(inputs, &track)?;
        }
        // The first frame counts, and then one whenever another share of the time is over.
        let due_s = start_s + duration_s * next as f64 / config.samples_per_reach as f64;
        if t_s < due_s && k < last {
            continue;
        }
        while start_s + duration_s * next as f64 / config.samples_per_reach as f64 <= t_s {
            next += 1;
            if duration_s <= 0.0 {
                break;
            }
        }
        let mut features = Vec::new();
        track.features_into(inputs, &mut features);
        let primitive_m = follower.as_mut().map(Follower::end).transpose()?;
        samples.push(Sampled {
            fold,
            reach_weight: 1.0,
            progress: track.progress(),
            features,
            start_m,
            now_m,
            end_m: reach.contact_m,
            left_s: reach.contact_s - t_s,
            normal: reach.normal,
            primitive_m: primitive_m.map(|p| p.0),
        });
    }
    let count = (samples.len() - first_new) as f64;
    for s in &mut samples[first_new..] {
        s.reach_weight = 1.0 / count;
    }
    Ok(())
}

fn rows(samples: &[Sampled], gates: &Gates, normals: bool) -> Rows {
    let mut rows = Rows {
        width: samples.first().map_or(0, |s| s.features.len()),
        regions: gates.len(),
        outputs: if normals { OUTPUTS } else { OUTPUTS - 3 },
        ..Rows::default()
    };
    let mut weights = Vec::new();
    for s in samples {
        rows.features.extend(&s.features);
        gates.weights_into(&s.progress, &mut weights);
        rows.gates.extend(&weights);
        rows.wanted.extend((s.end_m - s.now_m).to_array());
        rows.wanted.push(s.left_s);
        if let Some(normal) = s.normal.filter(|_| normals) {
            rows.wanted.extend(normal.to_array());
        }
        rows.weights.push(s.reach_weight);
        rows.folds.push(s.fold);
    }
    rows
}

/// Weights samples by one over the squared error that is usual in their region: otherwise the first,
/// uncertain ones decide the shared coefficients and the last, nearly certain ones pay for it.
fn weigh(rows: &mut Rows, held_out: &[f64]) {
    let squares: Vec<f64> = (0..rows.len())
        .map(|row| {
            let at = row * rows.outputs;
            (at..at + 3)
                .map(|k| (held_out[k] - rows.wanted[k]).powi(2))
                .sum()
        })
        .collect();
    let usual = by_region(rows, |row, _| squares[row]);
    for row in 0..rows.len() {
        let expected: f64 = rows.gates(row).iter().zip(&usual).map(|(g, u)| g * u).sum();
        rows.weights[row] /= expected + 3.0 * SENSOR_M * SENSOR_M;
    }
}

/// Means by region, weighted.
fn by_region(rows: &Rows, value: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    (0..rows.regions)
        .map(|region| {
            let (sum, weight) = (0..rows.len()).fold((0.0, 1e-300), |(s, w), row| {
                let g = rows.gates(row)[region];
                (s + g * value(row, region), w + g)
            });
            sum / weight
        })
        .collect()
}

impl Errors {
    fn scaled_add(&mut self, share: f64, other: &Self) {
        self.regression += other.regression * share;
        self.primitive += other.primitive * share;
        self.cross += other.cross * share;
        self.gain += other.gain * share;
        self.time += other.time * share;
        self.spread += other.spread * share;
        self.time_spread += other.time_spread * share;
    }

    fn at(regions: &[Self], gates: &[f64]) -> Self {
        let mut sum = Self::default();
        for (errors, gate) in regions.iter().zip(gates) {
            sum.scaled_add(*gate, errors);
        }
        sum
    }

    /// The share of the primitive with the least squared error. One number a region: a matrix of
    /// them, though better in theory, was worse from fifty reaches.
    fn best_gain(&self) -> f64 {
        let trace = |m: &DMat3| m.x_axis.x + m.y_axis.y + m.z_axis.z;
        let apart = trace(&self.regression) + trace(&self.primitive) - 2.0 * trace(&self.cross);
        let gain = (trace(&self.regression) - trace(&self.cross)) / apart.max(f64::MIN_POSITIVE);
        gain.clamp(0.0, 1.0)
    }

    /// The best linear combination and its covariance in the axes of the way.
    fn combined(
        &self,
        combination: Combination,
        regression_m: DVec3,
        primitive_m: Option<DVec3>,
    ) -> (DVec3, DMat3) {
        let sensor = DMat3::from_diagonal(DVec3::splat(SENSOR_M * SENSOR_M));
        match (combination, primitive_m) {
            (Combination::Primitive, Some(primitive_m)) => (primitive_m, self.primitive + sensor),
            (Combination::Both, Some(primitive_m)) => {
                let (a, b) = (1.0 - self.gain, self.gain);
                let cross = self.cross + self.cross.transpose();
                let covariance =
                    self.regression * (a * a) + self.primitive * (b * b) + cross * (a * b);
                (regression_m.lerp(primitive_m, b), covariance + sensor)
            }
            _ => (regression_m, self.regression + sensor),
        }
    }
}

/// Moments of held-out errors by region, and the factors that make regions hold what they say.
fn errors(
    samples: &[Sampled],
    rows: &Rows,
    held_out: &[f64],
    combination: Combination,
) -> Vec<Errors> {
    let regression_m =
        |row: usize| samples[row].now_m + DVec3::from_slice(&held_out[row * rows.outputs..][..3]);
    let axes: Vec<DMat3> = samples
        .iter()
        .enumerate()
        .map(|(row, s)| way_axes(s.start_m, regression_m(row)))
        .collect();
    let time = |row: usize| held_out[row * rows.outputs + 3].max(0.0) - samples[row].left_s;
    let mut regions = vec![Errors::default(); rows.regions];
    let mut totals = vec![1e-300; rows.regions];
    for (row, s) in samples.iter().enumerate() {
        let inverse = axes[row].transpose();
        let r = inverse * (regression_m(row) - s.end_m);
        let p = inverse * s.primitive_m.map_or(DVec3::ZERO, |p| p - s.end_m);
        let one = Errors {
            regression: outer(r, r),
            primitive: outer(p, p),
            cross: outer(r, p),
            time: time(row).powi(2),
            ..Errors::default()
        };
        for (region, gate) in rows.gates(row).iter().enumerate() {
            let share = gate * s.reach_weight;
            regions[region].scaled_add(share, &one);
            totals[region] += share;
        }
    }
    for (region, total) in regions.iter_mut().zip(&totals) {
        let sum = *region;
        *region = Errors::default();
        region.scaled_add(1.0 / total, &sum);
        (region.spread, region.time_spread) = (1.0, 1.0);
        region.gain = region.best_gain();
    }
    let scores: Vec<(f64, f64)> = samples
        .iter()
        .enumerate()
        .map(|(row, s)| {
            let errors = Errors::at(&regions, rows.gates(row));
            let (point_m, covariance) =
                errors.combined(combination, regression_m(row), s.primitive_m);
            let miss = axes[row].transpose() * (point_m - s.end_m);
            let sd_s = errors.time.sqrt().max(CLOCK_S);
            (
                miss.dot(covariance.inverse() * miss),
                time(row).abs() / sd_s,
            )
        })
        .collect();
    for (k, region) in regions.iter_mut().enumerate() {
        let weighted = |value: &dyn Fn(&(f64, f64)) -> f64| {
            let values = scores.iter().enumerate();
            let values =
                values.map(|(row, s)| (value(s), rows.gates(row)[k] * samples[row].reach_weight));
            quantile_90(values.collect())
        };
        region.spread = weighted(&|s| s.0) / CHI_SQUARED_3_90;
        region.time_spread = weighted(&|s| s.1) / NORMAL_90;
    }
    regions
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Without the asymmetry of rounding.
fn symmetric(m: DMat3) -> DMat3 {
    (m + m.transpose()) * 0.5
}

/// The value that 90 % of the weight lie below.
fn quantile_90(mut values: Vec<(f64, f64)>) -> f64 {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = values.iter().map(|v| v.1).sum();
    let mut sum = 0.0;
    for (value, weight) in &values {
        sum += weight;
        if sum >= 0.9 * total {
            return *value;
        }
    }
    values.last().map_or(1.0, |v| v.0)
}
