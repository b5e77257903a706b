//! Every candidate over every held-out reach, frame by frame, and how far off it was.

use crate::contact::candidates::{Candidate, Role, Trained};
use crate::contact::moments::Moment;
use crate::contact::recordings::Split;
use crate::contact::rows::Rows;
use anyhow::Context;
use glam::DVec3;
use hwall_bip::EndPrediction;
use hwall_contact::ContactEstimate;
use hwall_hand::LabelledReach;
use hwall_testkit::quantile;
use rayon::prelude::*;
use std::time::Instant;

/// Nominal probabilities of regions, and the square of their radius in three dimensions.
pub const REGIONS: [(f64, f64); 10] = [
    (0.1, 0.584_374),
    (0.2, 1.005_174),
    (0.3, 1.423_652),
    (0.4, 1.869_168),
    (0.5, 2.365_974),
    (0.6, 2.946_166),
    (0.7, 3.664_871),
    (0.8, 4.641_628),
    (0.9, 6.251_389),
    (0.95, 7.814_728),
];
/// Half of a board's edge, m.
const HALF_BOARD_M: f64 = 0.1;
/// Half widths of the intervals of 50 % and 90 % of a normal distribution, deviations.
const INTERVALS: [f64; 2] = [0.674_489_750_196, 1.644_853_626_951];

/// What a candidate said at one moment of one reach.
#[derive(Debug, Clone, Copy)]
pub struct Judged {
    /// Predicted minus true contact, m.
    pub error_m: DVec3,
    /// Does a board of 0.2 m, centred on the prediction, miss the hand? Along the surface where its normal
    /// is known; else: are the two more than 0.1 m apart?
    pub missed: bool,
    /// Deviations per axis, m, and the squared distance in deviations, where it states a covariance.
    pub spread: Option<(DVec3, f64)>,
    /// Predicted minus true time to contact, s, and the deviation stated.
    pub time_s: Option<(f64, Option<f64>)>,
}

impl Judged {
    fn new(reach: &LabelledReach, frame: usize, estimate: &ContactEstimate) -> Self {
        let error_m = estimate.point_m - reach.contact_m;
        let left_s = reach.contact_s - reach.frames[frame].t_s;
        let spread = estimate.covariance_m2.map(|c| {
            let sd = DVec3::new(c.x_axis.x, c.y_axis.y, c.z_axis.z);
            (sd.map(f64::sqrt), error_m.dot(c.inverse() * error_m))
        });
        Self {
            error_m,
            missed: missed(error_m, reach.normal),
            spread,
            time_s: estimate
                .time_to_contact_s
                .map(|left| (left.mean_s - left_s, left.sd_s)),
        }
    }

    /// Mean over the axes of the continuous ranked probability score, m; without a covariance the
    /// absolute error, to which it comes down.
    #[must_use]
    pub fn crps_m(&self) -> f64 {
        let Some((sd, _)) = self.spread else {
            return self.error_m.abs().element_sum() / 3.0;
        };
        let prediction = EndPrediction {
            motion: 0,
            fraction: 0.0,
            mean: self.error_m.to_array().to_vec(),
            sd: sd.to_array().to_vec(),
            actual: vec![0.0; 3],
        };
        (0..3).map(|axis| prediction.crps(axis)).sum::<f64>() / 3.0
    }
}

/// The last frame by a moment; `None` in a reach that starts later.
fn frame_at(reach: &LabelledReach, moment: Moment) -> Option<usize> {
    moment.index(reach.frames.iter().map(|f| f.t_s), span_s(reach))
}

/// Start and contact, s.
pub(crate) fn span_s(reach: &LabelledReach) -> [f64; 2] {
    [reach.contact_s - reach.duration_s(), reach.contact_s]
}

/// Does a board of 0.2 m, upright and centred on the prediction, miss the hand: is the error along the
/// surface more than half of it to a side or up? What the prediction is off along the normal does not
/// count: the arm has the surface's plane from the scene. Where nobody named the normal, the plane is not
/// known either, and the whole distance counts, which is the harder test.
fn missed(error_m: DVec3, normal: Option<DVec3>) -> bool {
    let Some(normal) = normal else {
        return error_m.length() > HALF_BOARD_M;
    };
    let across = DVec3::Z.cross(normal).try_normalize().unwrap_or(DVec3::X);
    let along = normal.cross(across);
    error_m.dot(across).abs() > HALF_BOARD_M || error_m.dot(along).abs() > HALF_BOARD_M
}

/// A candidate over all held-out reaches.
#[derive(Debug, Clone)]
pub struct Scores {
    /// The candidate.
    pub name: String,
    /// What it is compared as.
    pub role: Role,
    /// At every moment of [`Moment::all`], of every reach that is as long: what it said, `None` if nothing.
    pub judged: Vec<Vec<Option<Judged>>>,
    /// Time for one frame, µs, sorted.
    pub step_us: Vec<f64>,
}

/// Averages over the reaches at one moment, or over several.
#[derive(Debug, Clone, Copy)]
pub struct Summary {
    /// Predictions.
    pub count: usize,
    /// Reaches about which nothing was said.
    pub silent: usize,
    /// Median distance, m.
    pub median_m: f64,
    /// Mean distance, m.
    pub mean_m: f64,
    /// Mean error of each axis, m.
    pub axis_mean_m: DVec3,
    /// Largest error of each axis, m.
    pub axis_max_m: DVec3,
    /// Boards missed.
    pub missed: usize,
    /// Share of the 50 % and 90 % intervals per axis that hold the truth.
    pub intervals: Option<[f64; 2]>,
    /// Share of the regions of [`REGIONS`] that hold the truth.
    pub regions: Option<[f64; REGIONS.len()]>,
    /// Mean continuous ranked probability score per axis, m.
    pub crps_m: f64,
    /// Mean error of the time to contact, s.
    pub time_mean_s: Option<f64>,
    /// Share of its 90 % intervals that hold the truth.
    pub time_interval: Option<f64>,
}

impl Scores {
    /// Over the reaches at some moments together.
    #[must_use]
    pub fn at(&self, moments: impl Fn(Moment) -> bool) -> Summary {
        let chosen = Moment::all().zip(&self.judged).filter(|(m, _)| moments(*m));
        let (mut all, mut silent) = (Vec::new(), 0);
        for judged in chosen.flat_map(|(_, judged)| judged) {
            match judged {
                Some(judged) => all.push(*judged),
                None => silent += 1,
            }
        }
        let n = all.len() as f64;
        let mean = |value: &dyn Fn(&Judged) -> f64| all.iter().map(value).sum::<f64>() / n;
        let mut distances: Vec<f64> = all.iter().map(|j| j.error_m.length()).collect();
        distances.sort_by(f64::total_cmp);
        let axes = |j: &Judged| j.error_m.abs();
        let share = |hits: usize, of: usize| (of > 0).then(|| hits as f64 / of as f64);
        let spreads: Vec<(DVec3, DVec3, f64)> = all
            .iter()
            .filter_map(|j| j.spread.map(|(sd, square)| (j.error_m.abs(), sd, square)))
            .collect();
        let within = |deviations: f64| {
            let hits = |(e, sd, _): &(DVec3, DVec3, f64)| {
                (0..3).filter(|&i| e[i] <= deviations * sd[i]).count()
            };
            share(spreads.iter().map(hits).sum(), 3 * spreads.len())
        };
        let regions = REGIONS.map(|(_, radius)| {
            let hits = spreads.iter().filter(|s| s.2 <= radius).count();
            hits as f64 / spreads.len() as f64
        });
        let times: Vec<f64> = all
            .iter()
            .filter_map(|j| j.time_s.map(|t| t.0.abs()))
            .collect();
        let timed: Vec<(f64, f64)> = all
            .iter()
            .filter_map(|j| j.time_s.and_then(|(e, sd)| Some((e.abs(), sd?))))
            .collect();
        let in_time = timed
            .iter()
            .filter(|(e, sd)| *e <= INTERVALS[1] * sd)
            .count();
        Summary {
            count: all.len(),
            silent,
            median_m: quantile(&distances, 0.5),
            mean_m: mean(&|j| j.error_m.length()),
            axis_mean_m: all.iter().map(axes).sum::<DVec3>() / n,
            axis_max_m: all.iter().map(axes).fold(DVec3::ZERO, DVec3::max),
            missed: all.iter().filter(|j| j.missed).count(),
            intervals: within(INTERVALS[0])
                .zip(within(INTERVALS[1]))
                .map(|(a, b)| [a, b]),
            regions: (!spreads.is_empty()).then_some(regions),
            crps_m: mean(&Judged::crps_m),
            time_mean_s: (!times.is_empty())
                .then(|| times.iter().sum::<f64>() / times.len() as f64),
            time_interval: share(in_time, timed.len()),
        }
    }

    /// Over the reaches at one moment.
    #[must_use]
    pub fn at_moment(&self, moment: Moment) -> Summary {
        self.at(|m| m == moment)
    }

    /// Over 30 to 90 % of the time: while it is worth knowing.
    #[must_use]
    pub fn under_way(&self) -> Summary {
        self.at(|m| matches!(m, Moment::Share(share) if share < 0.95))
    }
}

/// What was said at every frame of a reach, and the time that took, µs.
pub type Told = Vec<(Option<ContactEstimate>, f64)>;

/// Trains a candidate on every fold, folds side by side, and follows the reaches held out one after the
/// other: the times are those of a prediction that has the machine for itself.
///
/// # Errors
/// A candidate that cannot be trained.
pub fn run(
    candidate: &Candidate,
    reaches: &[LabelledReach],
    split: &Split,
    rows: Option<&mut Rows>,
) -> anyhow::Result<Scores> {
    let train = |numbers: &[usize]| -> anyhow::Result<Trained> {
        let learnt: Vec<LabelledReach> = numbers.iter().map(|&i| reaches[i].clone()).collect();
        (candidate.train)(&learnt)
    };
    let bound = candidate.role == Role::Bound;
    let trained: Vec<Option<Trained>> = split
        .folds
        .par_iter()
        .map(|fold| (!bound).then(|| train(&fold.train)).transpose())
        .collect::<anyhow::Result<_>>()?;
    let mut told: Vec<Vec<(usize, Told)>> = Vec::new();
    for (fold, mut estimator) in split.folds.iter().zip(trained) {
        let mut of_fold = Vec::new();
        for &number in &fold.test {
            if bound {
                estimator = Some(train(&[number])?);
            }
            let estimator = estimator.as_mut().context("an estimator")?;
            estimator.begin();
            let follow = |frame| {
                let start = Instant::now();
                let estimate = estimator.step(frame);
                (estimate, 1e6 * start.elapsed().as_secs_f64())
            };
            of_fold.push((number, reaches[number].frames.iter().map(follow).collect()));
        }
        told.push(of_fold);
    }
    let mut scores = Scores {
        name: candidate.name.clone(),
        role: candidate.role,
        judged: Moment::all().map(|_| Vec::new()).collect(),
        step_us: Vec::new(),
    };
    let mut rows = rows;
    for (fold, told) in told.iter().enumerate() {
        for (number, told) in told {
            let reach = &reaches[*number];
            for (moment, judged) in Moment::all().zip(&mut scores.judged) {
                if let Some(frame) = frame_at(reach, moment) {
                    let estimate = told[frame].0;
                    judged.push(estimate.map(|e| Judged::new(reach, frame, &e)));
                }
            }
            scores.step_us.extend(told.iter().map(|t| t.1));
            if let Some(rows) = &mut rows {
                rows.add(&candidate.name, fold, reach, told)?;
            }
        }
    }
    scores.step_us.sort_by(f64::total_cmp);
    Ok(scores)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::recordings::Fold;
    use glam::DMat3;
    use hwall_contact::{ContactEstimator, TimeToContact};
    use hwall_hand::{HandFrame, HandPoint};

    /// Knows everything, and is off by what it is told.
    struct Off(DVec3);

    impl ContactEstimator for Off {
        fn begin(&mut self) {}

        fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
            // Nothing is said about the first half of the time.
            (frame.t_s > 0.45).then(|| ContactEstimate {
                covariance_m2: Some(DMat3::from_diagonal(DVec3::splat(0.02_f64.powi(2)))),
                time_to_contact_s: Some(TimeToContact {
                    mean_s: 1.1 - frame.t_s,
                    sd_s: Some(0.05),
                }),
                ..ContactEstimate::of_point(frame.t_s, DVec3::ONE + self.0)
            })
        }
    }

    fn reaches() -> Vec<LabelledReach> {
        let frame = |k: usize| {
            let mut frame = HandFrame::empty(k as f64 * 0.01);
            frame.set_point(HandPoint::Index, Some(DVec3::splat(frame.t_s)));
            frame
        };
        let one = LabelledReach {
            person: None,
            trial: None,
            point: HandPoint::Index,
            frames: (0..=100).map(frame).collect(),
            contact_m: DVec3::ONE,
            contact_s: 1.0,
            normal: Some(DVec3::X),
        };
        vec![one; 4]
    }

    fn scores(off_m: DVec3) -> Scores {
        let candidate = Candidate {
            name: "off".into(),
            role: Role::Baseline,
            train: Box::new(move |_| Ok(Box::new(Off(off_m)))),
        };
        let split = Split {
            description: String::new(),
            folds: vec![
                Fold {
                    train: vec![0, 1],
                    test: vec![2, 3],
                },
                Fold {
                    train: vec![2, 3],
                    test: vec![0, 1],
                },
            ],
        };
        run(&candidate, &reaches(), &split, None).unwrap()
    }

    #[test]
    fn errors_are_those_that_were_made() {
        let scores = scores(DVec3::new(0.03, -0.04, 0.0));
        let half = scores.at_moment(Moment::Share(0.7));
        assert_eq!((half.count, half.silent, half.missed), (4, 0, 0));
        assert!((half.median_m - 0.05).abs() < 1e-12 && (half.mean_m - 0.05).abs() < 1e-12);
        assert!(half.axis_mean_m.distance(DVec3::new(0.03, 0.04, 0.0)) < 1e-12);
        assert!((half.time_mean_s.unwrap() - 0.1).abs() < 1e-12);
        // 0.1 s is two deviations, 0.03 and 0.04 m one and a half and two.
        assert_eq!(half.time_interval, Some(0.0));
        let [in_half, in_most] = half.intervals.unwrap();
        assert!((in_half - 1.0 / 3.0).abs() < 1e-12 && (in_most - 2.0 / 3.0).abs() < 1e-12);
        // 2.5 deviations in space: in 90 % and more, not in 80 %.
        assert_eq!(
            half.regions.unwrap(),
            [0., 0., 0., 0., 0., 0., 0., 0., 1., 1.]
        );
        // Nothing was said early.
        let early = scores.at_moment(Moment::Share(0.3));
        assert_eq!((early.count, early.silent), (0, 4));
        // At 200 ms before contact the last frame by then counts.
        let judged = scores.judged[crate::contact::moments::SHARES.len() + 3][0].unwrap();
        assert!((judged.time_s.unwrap().0 - 0.1).abs() < 1e-12);
    }

    #[test]
    fn a_board_is_missed_along_it_not_across_it() {
        let missed = |off_m: DVec3, normal| missed(off_m, normal);
        assert!(!missed(DVec3::new(0.3, 0.09, -0.09), Some(DVec3::X)));
        assert!(missed(DVec3::new(0.0, 0.11, 0.0), Some(DVec3::X)));
        assert!(missed(DVec3::new(0.0, 0.0, 0.11), Some(-DVec3::X)));
        // A table top: both directions along it are level.
        assert!(!missed(DVec3::new(0.0, 0.0, 0.5), Some(DVec3::Z)));
        // Nobody knows the surface: the distance counts.
        assert!(missed(DVec3::new(0.08, 0.08, 0.0), None));
        assert!(!missed(DVec3::new(0.06, 0.06, 0.0), None));
    }

    #[test]
    fn reaches_that_start_later_are_not_judged_earlier() {
        let mut short = reaches().remove(0);
        short.frames.drain(..80);
        assert_eq!(frame_at(&short, Moment::Before(0.3)), None);
        assert_eq!(frame_at(&short, Moment::Before(0.1)), Some(10));
        assert_eq!(frame_at(&short, Moment::Share(1.0)), Some(20));
    }

    #[test]
    fn regions_are_those_of_three_dimensions() {
        // Distribution of the squared radius: chi square with three degrees of freedom.
        let mut sampler = hwall_testkit::Sampler::new(1);
        let n = 200_000;
        let squares: Vec<f64> = (0..n)
            .map(|_| (0..3).map(|_| sampler.normal().powi(2)).sum())
            .collect();
        for (probability, radius) in REGIONS {
            let within = squares.iter().filter(|s| **s <= radius).count() as f64 / f64::from(n);
            assert!(
                (within - probability).abs() < 5e-3,
                "{probability}: {within}"
            );
        }
    }
}
