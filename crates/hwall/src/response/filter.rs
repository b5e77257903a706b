//! The posterior over the joints while a hand reaches.

use super::demonstration::Task;
use super::familiarity::Familiarity;
use super::model::ResponseModel;
use crate::error::SessionError;
use hwall_bip::{Bank, Observation, TimeToEnd};
use hwall_hand::{HandFrame, HandPoint};
use hwall_kinematics::JointPositions;
use hwall_numeric::check::finite;
use std::f64::consts::TAU;

/// The joints at the end of a reach, as inferred from the hand so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointPosterior {
    /// Mean of the most probable component, rad. It may lie outside the joint limits. It is not averaged over components, because the
    /// average would belong to none of them.
    pub q: JointPositions,
    /// Covariance of `q`, rad².
    pub covariance_rad2: [[f64; 7]; 7],
    /// The most probable component.
    pub component: usize,
    /// Probability of that component.
    pub probability: f64,
    /// Probability of each task, in the order of [`Task::ALL`].
    pub tasks: [f64; Task::ALL.len()],
    /// Mean phase, 0 to 1.
    pub phase: f64,
    /// Time until the end of the reach, s; `None` if it cannot be predicted.
    pub time_to_end: Option<TimeToEnd>,
}

impl JointPosterior {
    /// The moments of the most probable component.
    pub(super) const fn moments(&self) -> JointMoments {
        JointMoments {
            q: self.q,
            covariance_rad2: self.covariance_rad2,
        }
    }
}

/// The joints at the end of a reach according to one component.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointMoments {
    /// Mean, rad.
    pub q: JointPositions,
    /// Covariance, rad².
    pub covariance_rad2: [[f64; 7]; 7],
}

/// Follows a hand and infers the joints that answer it. Neither steps nor the start of a reach allocate.
#[derive(Debug, Clone)]
pub struct ResponseFilter {
    fresh: Bank,
    bank: Bank,
    points: Vec<HandPoint>,
    tasks: Vec<Task>,
    period_s: f64,
    joints: [usize; 7],
    /// Buffers of the observation, at most three values for each point.
    dofs: Vec<usize>,
    values: Vec<f64>,
    variances_m2: Vec<f64>,
    last_s: Option<f64>,
    familiarity: Option<Familiarity>,
    seen: Seen,
}

/// Evidence of the current reach against the mixture.
#[derive(Debug, Clone, Copy)]
struct Seen {
    began_s: f64,
    values: f64,
    /// Sum of `-2 ln p` in excess of a perfect prediction.
    evidence: f64,
    familiar: bool,
}

impl Seen {
    const NOTHING: Self = Self {
        began_s: 0.0,
        values: 0.0,
        evidence: 0.0,
        familiar: true,
    };
}

impl ResponseModel {
    /// A filter that follows reaches, one after the other.
    #[must_use]
    pub fn filter(&self) -> ResponseFilter {
        ResponseFilter::new(self)
    }
}

impl ResponseFilter {
    pub(super) fn new(model: &ResponseModel) -> Self {
        let hand = 3 * model.points().len();
        let models = model.mixture().models();
        Self {
            fresh: model.bank().clone(),
            bank: model.bank().clone(),
            points: model.points().to_vec(),
            tasks: model.tasks().to_vec(),
            period_s: models
                .first()
                .map_or(0.0, hwall_bip::Model::sampling_period),
            joints: std::array::from_fn(|i| hand + i),
            dofs: Vec::with_capacity(hand),
            values: Vec::with_capacity(hand),
            variances_m2: vec![model.variance_m2(); hand],
            last_s: None,
            familiarity: model.familiarity().cloned(),
            seen: Seen::NOTHING,
        }
    }

    /// Starts a new reach: forgets the samples of the previous one.
    pub fn begin(&mut self) {
        // Both banks belong to one model, so their sizes agree.
        if self.bank.restart_from(&self.fresh).is_err() {
            self.bank.clone_from(&self.fresh);
        }
        self.last_s = None;
        self.seen = Seen::NOTHING;
    }

    /// Takes the next sample of the reach, in the base frame. Missing points are left out; a sample at the time of the previous one is
    /// ignored.
    ///
    /// # Errors
    /// A time that is NaN, infinite or before the last one; the filter is then unchanged.
    pub fn step(&mut self, frame: &HandFrame) -> Result<(), SessionError> {
        finite("t_s", frame.t_s)?;
        let dt_s = self
            .last_s
            .map_or(self.period_s, |last_s| frame.t_s - last_s);
        self.dofs.clear();
        self.values.clear();
        for (column, point) in self.points.iter().enumerate() {
            if let Some(at_m) = frame.point(*point) {
                self.dofs.extend(3 * column..3 * column + 3);
                self.values.extend(at_m.to_array());
            }
        }
        // Nothing seen: the next sample advances the time.
        if self.dofs.is_empty() || dt_s == 0.0 {
            return Ok(());
        }
        self.bank.predict(dt_s)?;
        let began_s = match self.last_s {
            Some(_) => self.seen.began_s,
            None => frame.t_s,
        };
        self.last_s = Some(frame.t_s);
        let variances_m2 = &self.variances_m2[..self.dofs.len()];
        let seen = Observation::new(&self.dofs, &self.values).with_variances(variances_m2);
        let update = self.bank.observe(&seen)?;
        let perfect: f64 = variances_m2.iter().map(|v| (TAU * v).ln()).sum();
        self.seen = Seen {
            began_s,
            values: self.seen.values + self.dofs.len() as f64,
            evidence: self.seen.evidence - 2.0 * update.log_likelihood - perfect,
            ..self.seen
        };
        if let Some(familiarity) = &self.familiarity {
            let (periods, mean) = self.mean_evidence(frame.t_s);
            self.seen.familiar = familiarity.is_familiar(self.seen.familiar, periods, mean);
        }
        Ok(())
    }

    /// Time since the reach began, in sampling periods, and the evidence against the mixture per value seen.
    fn mean_evidence(&self, t_s: f64) -> (f64, f64) {
        let periods = 1.0 + (t_s - self.seen.began_s) / self.period_s;
        (periods, self.seen.evidence / self.seen.values)
    }

    /// The mean evidence after each sample of a reach.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub(super) fn evidence(
        &mut self,
        frames: &[HandFrame],
    ) -> Result<Vec<(f64, f64)>, SessionError> {
        self.begin();
        let mut all = Vec::with_capacity(frames.len());
        for frame in frames {
            self.step(frame)?;
            if self.has_seen() {
                all.push(self.mean_evidence(frame.t_s));
            }
        }
        Ok(all)
    }

    /// Is the reach like the training reaches, under at least one component? If not, the inferred joints are unreliable. The test compares
    /// the likelihood of all samples so far with that of held-out demonstrations, with hysteresis. `true` if there are too few
    /// demonstrations for a test.
    #[must_use]
    pub const fn is_familiar(&self) -> bool {
        self.seen.familiar
    }

    /// Has a sample been seen since the reach began?
    #[must_use]
    pub const fn has_seen(&self) -> bool {
        self.last_s.is_some()
    }

    /// The current posterior.
    ///
    /// # Errors
    /// Arithmetic that overflowed.
    pub fn posterior(&mut self) -> Result<JointPosterior, SessionError> {
        let mut tasks = [0.0; _];
        let (mut component, mut probability) = (0, 0.0);
        for (part, task) in self.tasks.iter().enumerate() {
            let share = self.bank.component_probability(part);
            tasks[*task as usize] += share;
            if share > probability {
                (component, probability) = (part, share);
            }
        }
        let JointMoments { q, covariance_rad2 } = self.of_component(component)?.unwrap_or_default();
        Ok(JointPosterior {
            q,
            covariance_rad2,
            component,
            probability,
            tasks,
            phase: self.bank.phase(),
            time_to_end: self.bank.time_to_end(),
        })
    }

    /// The joints at the end of the reach according to one component; `None` if the component is ruled out.
    ///
    /// # Errors
    /// Arithmetic that overflowed.
    pub fn of_component(&mut self, component: usize) -> Result<Option<JointMoments>, SessionError> {
        let (mut q, mut covariance) = ([0.0; 7], [0.0; 49]);
        let bank = &mut self.bank;
        let known =
            bank.component_covariance_at(component, 1.0, &self.joints, &mut q, &mut covariance)?;
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| covariance[7 * i + j]));
        Ok(known.then_some(JointMoments {
            q: JointPositions(q),
            covariance_rad2: rows,
        }))
    }

    /// Probability of a component.
    #[must_use]
    pub fn component_probability(&self, component: usize) -> f64 {
        self.bank.component_probability(component)
    }

    /// Number of components.
    #[must_use]
    pub fn components(&self) -> usize {
        self.tasks.len()
    }
}
