//! Evaluates an estimator on every held-out reach.

use super::errors::EstimateError;
use super::folds::Split;
use super::moment::Moment;
use super::summary::Summary;
use crate::error::ContactError;
use crate::estimate::ContactEstimator;
use hwall_hand::LabelledReach;

/// The errors of one reach at all moments.
#[derive(Debug, Clone)]
pub struct JudgedReach {
    /// Its index.
    pub reach: usize,
    /// Who made it.
    pub person: Option<String>,
    /// Number of earlier touches of this person; with feedback the estimator has learned from them.
    pub touches: usize,
    /// At every moment of [`Evaluation::moments`]; the outer `None` if the reach starts later, the inner one without an estimate.
    pub errors: Vec<Option<Option<EstimateError>>>,
}

/// Every held-out reach, evaluated once.
#[derive(Debug, Clone, Default)]
pub struct Evaluation {
    /// By fold, then in the order of the reaches.
    pub reaches: Vec<JudgedReach>,
}

impl Evaluation {
    /// The evaluated moments: the default ones, and the onset of the hand.
    #[must_use]
    pub fn moments() -> Vec<Moment> {
        Moment::all().chain([Moment::Started]).collect()
    }

    /// Trains on the training part of every fold and evaluates the test reaches in order. With `tell`, each touch is reported to the
    /// estimator after its reach was evaluated, as in a system that measures contacts; the estimator forgets the touches when the person
    /// changes.
    ///
    /// # Errors
    /// Errors of training.
    pub fn run<E: ContactEstimator>(
        reaches: &[LabelledReach],
        split: &Split,
        tell: bool,
        mut train: impl FnMut(&[&LabelledReach]) -> Result<E, ContactError>,
    ) -> Result<Self, ContactError> {
        let mut judged = Vec::with_capacity(reaches.len());
        for fold in &split.folds {
            let known: Vec<&LabelledReach> = fold.train.iter().map(|&i| &reaches[i]).collect();
            let mut estimator = train(&known)?;
            judged.extend(Self::follow(&mut estimator, reaches, &fold.test, tell).reaches);
        }
        Ok(Self { reaches: judged })
    }

    /// Evaluates the reaches with these indices with an estimator not trained on them.
    pub fn follow<E: ContactEstimator + ?Sized>(
        estimator: &mut E,
        reaches: &[LabelledReach],
        numbers: &[usize],
        tell: bool,
    ) -> Self {
        let moments = Self::moments();
        let mut judged = Vec::with_capacity(numbers.len());
        let (mut person, mut touches) = (None, 0);
        for &number in numbers {
            let reach = &reaches[number];
            if person != Some(&reach.person) {
                estimator.forget();
                (person, touches) = (Some(&reach.person), 0);
            }
            estimator.begin();
            let estimates: Vec<_> = reach.frames.iter().map(|f| estimator.step(f)).collect();
            let error = |m: &Moment| {
                let frame = m.frame(reach)?;
                Some(estimates[frame].map(|e| EstimateError::new(reach, frame, &e)))
            };
            judged.push(JudgedReach {
                reach: number,
                person: reach.person.clone(),
                touches,
                errors: moments.iter().map(error).collect(),
            });
            if tell {
                estimator.touched(reach.contact_m, reach.contact_s);
            }
            touches += 1;
        }
        estimator.forget();
        Self { reaches: judged }
    }

    /// Statistics over all reaches at one moment.
    #[must_use]
    pub fn at(&self, moment: Moment) -> Summary {
        self.among(|_| true, |m| m == moment)
    }

    /// Statistics over some reaches and some moments together.
    #[must_use]
    pub fn among(
        &self,
        reaches: impl Fn(&JudgedReach) -> bool,
        moments: impl Fn(Moment) -> bool,
    ) -> Summary {
        let all = Self::moments();
        let chosen = self.reaches.iter().filter(|r| reaches(r));
        Summary::of(chosen.flat_map(|r| {
            let at = all.iter().zip(&r.errors).filter(|(m, _)| moments(**m));
            at.filter_map(|(_, e)| *e).collect::<Vec<_>>()
        }))
    }

    /// The people evaluated, each once, in order of their names.
    #[must_use]
    pub fn people(&self) -> Vec<Option<&str>> {
        let mut people: Vec<_> = self.reaches.iter().map(|r| r.person.as_deref()).collect();
        people.sort_unstable();
        people.dedup();
        people
    }

    /// Statistics of every person over some moments together, from the reach with `touches` earlier touches on.
    #[must_use]
    pub fn by_person(
        &self,
        touches: usize,
        moments: impl Fn(Moment) -> bool,
    ) -> Vec<(Option<&str>, Summary)> {
        let of = |p: Option<&str>| {
            self.among(
                |r| r.person.as_deref() == p && r.touches >= touches,
                &moments,
            )
        };
        self.people().into_iter().map(|p| (p, of(p))).collect()
    }
}
