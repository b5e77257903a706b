//! Runs a candidate over every held-out reach, frame by frame.

use crate::contact::candidates::{BoxedEstimator, Candidate, Role};
use crate::contact::rows::{EstimateRows, TimedEstimate};
use crate::contact::scores::{Scores, Training};
use hwall_contact::score::{Evaluation, Fold, Split};
use hwall_contact::{ContactEstimate, ContactEstimator};
use hwall_hand::{HandFrame, LabelledReach};
use rayon::prelude::*;
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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};
    use hwall_contact::TimeToContact;
    use hwall_contact::score::{Moment, SHARES};
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
