//! Runs a candidate over every held-out reach, frame by frame.

use crate::contact::candidates::{BoxedEstimator, Candidate, Role};
use glam::{DMat3, DVec3};
use hwall_contact::score::{Evaluation, Fold, Moment, Span, Split, Summary, written};
use hwall_contact::{ContactEstimate, ContactEstimator};
use hwall_hand::{HandFrame, LabelledReach};
use hwall_stage::numbers;
use hwall_testkit::cells;
use rayon::prelude::*;
use std::path::Path;
use std::time::Instant;

/// One fold: the first `learnt` reaches are for training, the rest for testing.
pub fn first_learnt(learnt: usize, reaches: usize) -> Split {
    Split {
        description: String::new(),
        folds: vec![Fold {
            train: (0..learnt).collect(),
            test: (learnt..reaches).collect(),
        }],
    }
}

/// Trains a candidate on every fold, folds in parallel, then runs it sequentially over the held-out reaches,
/// so that every estimate is timed without competing load.
///
/// # Errors
/// A candidate that cannot be trained.
pub fn run(
    candidate: &Candidate,
    reaches: &[LabelledReach],
    split: &Split,
    mut rows: Option<&mut EstimateRows>,
) -> anyhow::Result<Scores> {
    let train = |fold: &Fold| -> anyhow::Result<(BoxedEstimator, Training)> {
        let learnt: Vec<&LabelledReach> = fold.train.iter().map(|&i| &reaches[i]).collect();
        let start = Instant::now();
        let estimator = (candidate.train)(&learnt)?;
        let training = Training {
            reaches: learnt.len(),
            took_s: start.elapsed().as_secs_f64(),
        };
        Ok((estimator, training))
    };
    let folds = split.folds.par_iter().map(train);
    let trained: Vec<(BoxedEstimator, Training)> = folds.collect::<anyhow::Result<_>>()?;
    let training = trained.iter().map(|(_, training)| *training);
    let mut scores = Scores {
        name: candidate.name.clone(),
        role: candidate.role,
        alone: Evaluation::default(),
        told: (candidate.role == Role::Learned).then(Evaluation::default),
        step_us: Vec::new(),
        training: training.max_by(|a, b| a.took_s.total_cmp(&b.took_s)),
    };
    for (number, (fold, (estimator, _))) in split.folds.iter().zip(trained).enumerate() {
        let mut timed = Timed {
            estimator,
            reaches: Vec::new(),
        };
        let alone = Evaluation::follow(&mut timed, reaches, &fold.test, false);
        scores.alone.reaches.extend(alone.reaches);
        for (&reach, frames) in fold.test.iter().zip(&timed.reaches) {
            scores.step_us.extend(frames.iter().map(|f| f.took_us));
            if let Some(rows) = &mut rows {
                rows.add(&candidate.name, number, &reaches[reach], frames)?;
            }
        }
        if let Some(told) = &mut scores.told {
            let followed = Evaluation::follow(&mut timed.estimator, reaches, &fold.test, true);
            told.reaches.extend(followed.reaches);
        }
    }
    scores.step_us.sort_by(f64::total_cmp);
    Ok(scores)
}

/// An estimator that records its estimates and their computing times.
struct Timed {
    estimator: BoxedEstimator,
    reaches: Vec<Vec<TimedEstimate>>,
}

impl ContactEstimator for Timed {
    fn begin(&mut self) {
        self.estimator.begin();
        self.reaches.push(Vec::new());
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        let start = Instant::now();
        let estimate = self.estimator.step(frame);
        let took_us = 1e6 * start.elapsed().as_secs_f64();
        let frames = self.reaches.last_mut();
        frames?.push(TimedEstimate { estimate, took_us });
        estimate
    }

    fn forget(&mut self) {
        self.estimator.forget();
    }
}

/// A candidate over all held-out reaches.
#[derive(Debug, Clone)]
pub struct Scores {
    /// The candidate.
    pub name: String,
    /// Its role.
    pub role: Role,
    /// Every held-out reach at every moment, without feedback about touches.
    pub alone: Evaluation,
    /// The same for the learned estimator with feedback about the person's previous touches.
    pub told: Option<Evaluation>,
    /// Time for one frame, µs, sorted.
    pub step_us: Vec<f64>,
    /// The longest training of a fold; `None` without training.
    pub training: Option<Training>,
}

/// Training time; as many folds as there are cores are trained in parallel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Training {
    /// Training reaches.
    pub reaches: usize,
    /// s.
    pub took_s: f64,
}

/// Ranges of previous touches for the learning curve: from the first number up to the second.
pub const TOUCHES: [(usize, usize); 6] =
    [(0, 1), (1, 3), (3, 6), (6, 11), (11, 26), (26, usize::MAX)];

impl Scores {
    /// Over the reaches at one moment.
    pub fn at_moment(&self, moment: Moment) -> Summary {
        self.alone.at(moment)
    }

    /// Over 30 to 90 % of the time, while an estimate is still useful.
    pub fn under_way(&self) -> Summary {
        self.alone.among(|_| true, under_way)
    }
}

/// From 30 to 90 % of the time, while an estimate is still useful.
pub fn under_way(moment: Moment) -> bool {
    matches!(moment, Moment::Share(share) if share < 0.95)
}

/// An estimate at one frame, and its computing time.
#[derive(Debug, Clone, Copy)]
pub struct TimedEstimate {
    /// `None` if the estimator gives none.
    pub estimate: Option<ContactEstimate>,
    /// Time for the frame, µs.
    pub took_us: f64,
}

/// A CSV with one row per estimate: at the moments of the tables, and every 50 ms.
pub struct EstimateRows {
    source: String,
    out: numbers::TableWriter,
}

impl EstimateRows {
    /// Writes the header.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(path: &Path, source: &str) -> anyhow::Result<Self> {
        let mut out = numbers::writer(Some(path))?;
        let names = "source,method,fold,person,trial,t,share,to_contact,x,y,z,true_x,true_y,true_z,\
                     var_xx,var_xy,var_xz,var_yy,var_yz,var_zz,left,left_sd,us";
        out.write_record(names.split(','))?;
        Ok(Self {
            source: source.to_owned(),
            out,
        })
    }

    /// Adds the estimates of one reach, one for each of its frames.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn add(
        &mut self,
        method: &str,
        fold: usize,
        reach: &LabelledReach,
        estimates: &[TimedEstimate],
    ) -> anyhow::Result<()> {
        let [person, trial] = [&reach.person, &reach.trial].map(|n| n.as_deref().unwrap_or(""));
        let first = [&*self.source, method, &fold.to_string(), person, trial];
        let metres = |point_m: Option<DVec3>| -> [String; 3] {
            point_m.map_or_else(Default::default, |p| {
                p.to_array().map(|x| format!("{x:.6}"))
            })
        };
        let covariance = |covariance_m2: Option<DMat3>| -> [String; 6] {
            covariance_m2.map_or_else(Default::default, |c| {
                let [x, y, z] = [c.x_axis, c.y_axis, c.z_axis];
                [x.x, x.y, x.z, y.y, y.z, z.z].map(|v| format!("{v:.4e}"))
            })
        };
        let seconds = |s: Option<f64>| s.map_or_else(String::new, |s| format!("{s:.5}"));
        let times_s: Vec<f64> = reach.frames.iter().map(|f| f.t_s).collect();
        for index in written(&times_s, Span::of(reach)) {
            let t_s = times_s[index];
            let TimedEstimate { estimate, took_us } = estimates[index];
            let left_s = reach.contact_s - t_s;
            let share = 1.0 - left_s / reach.duration_s();
            let times = [
                format!("{t_s:.6}"),
                format!("{share:.4}"),
                format!("{left_s:.6}"),
            ];
            let mut row = cells(first, times);
            row.extend(metres(estimate.map(|e| e.point_m)));
            row.extend(metres(Some(reach.contact_m)));
            row.extend(covariance(estimate.and_then(|e| e.covariance_m2)));
            let left = estimate.and_then(|e| e.time_to_contact_s);
            row.extend([left.map(|l| l.mean_s), left.and_then(|l| l.sd_s)].map(seconds));
            row.push(format!("{took_us:.2}"));
            self.out.write_record(&row)?;
        }
        Ok(())
    }

    /// Flushes.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(mut self) -> anyhow::Result<()> {
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_contact::TimeToContact;
    use hwall_contact::score::SHARES;
    use hwall_hand::HandPoint;

    /// Knows the contact, with a given error.
    struct Off(DVec3);

    impl ContactEstimator for Off {
        fn begin(&mut self) {}

        fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
            // No estimate in the first half of the time.
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
        let fold = |train: [usize; 2], test: [usize; 2]| Fold {
            train: train.to_vec(),
            test: test.to_vec(),
        };
        let split = Split {
            description: String::new(),
            folds: vec![fold([0, 1], [2, 3]), fold([2, 3], [0, 1])],
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
        // 0.1 s is two standard deviations, 0.03 and 0.04 m one and a half and two.
        assert_eq!(half.time_interval, Some(0.0));
        let [in_half, in_most] = half.intervals.unwrap();
        assert!((in_half - 1.0 / 3.0).abs() < 1e-12 && (in_most - 2.0 / 3.0).abs() < 1e-12);
        // 2.5 standard deviations in space: in 90 % and more, not in 80 %.
        assert_eq!(
            half.regions.unwrap(),
            [0., 0., 0., 0., 0., 0., 0., 0., 1., 1.]
        );
        // There was no estimate early.
        let early = scores.at_moment(Moment::Share(0.3));
        assert_eq!((early.count, early.silent), (0, 4));
        // At 200 ms before contact the last earlier frame counts.
        let judged = scores.alone.reaches[0].errors[SHARES.len() + 3]
            .flatten()
            .unwrap();
        assert!((judged.time.unwrap().error_s - 0.1).abs() < 1e-12);
    }
}
