//! A bank of hypotheses: what a person may be doing instead of going on as expected.
//!
//! A single filter that sees the hand at rest learns that the phase stands still, becomes certain
//! of it, and never recovers; one that sees a change of target explains it by the phase. Here
//! every such turn of events is a hypothesis of its own with its own exact filter, weighed by how
//! well it predicted what was seen.

use crate::branching::Candidate;
use crate::error::{finite, not_negative, positive};
use crate::past::Past;
use crate::square_root::{SquareRoot, Tile};
use crate::{
    BipError, Filter, FilterConfig, Gate, Health, Model, Observation, PhaseVelocity, Update,
};

/// What a hypothesis says the person is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// The motion goes on.
    Moving,
    /// The hand rests; the phase stands still.
    Resting,
}

/// Parameters of a bank. Rates are expected numbers a motion, times are shares of a motion of
/// average duration.
#[derive(Debug, Clone, PartialEq)]
pub struct BankConfig {
    /// Filter of every hypothesis; its default here refuses outliers.
    pub filter: FilterConfig,
    /// Split the prior of the phase velocity into a slow, a usual and a fast hypothesis. Default
    /// `true`.
    pub split_velocity: bool,
    /// Expected number of pauses. Default 0.3.
    pub pauses: f64,
    /// Expected length of a pause. Default 0.3.
    pub pause_length: f64,
    /// Expected number of changes of mind: the shape of the motion is drawn anew from the prior of
    /// all components, the phase goes on; evidence about the old end is forgotten. Default 0.2.
    pub changes: f64,
    /// Probability that the motion has not begun when the filter starts. Default 0.2.
    pub not_begun: f64,
    /// Probability that it is well under way by then, anywhere. Default 0.05.
    pub under_way: f64,
    /// Time between two moments at which hypotheses branch. Default 0.02.
    pub branching: f64,
    /// Most hypotheses kept. Default 8; the time of a step grows in proportion. In the first tenth
    /// of a motion two a component are kept, if that is more.
    pub hypotheses: usize,
}

impl Default for BankConfig {
    fn default() -> Self {
        Self {
            filter: FilterConfig {
                gate: Some(Gate::default()),
                ..FilterConfig::default()
            },
            split_velocity: true,
            pauses: 0.3,
            pause_length: 0.3,
            changes: 0.2,
            not_begun: 0.2,
            under_way: 0.05,
            branching: 0.02,
            hypotheses: 8,
        }
    }
}

/// Mean and square-root information of one hypothesis.
#[derive(Debug, Clone)]
pub(crate) struct Belief {
    pub(crate) state: Vec<Tile>,
    pub(crate) root: SquareRoot,
    refused: usize,
    past: Past,
}

impl Belief {
    fn of(filter: &Filter) -> Self {
        Self {
            state: filter.state.clone(),
            root: filter.root.clone(),
            refused: 0,
            past: filter.past.clone(),
        }
    }

    /// The clock of another belief.
    pub(crate) fn take_time_of(&mut self, other: &Self) {
        self.past.clock = other.past.clock;
        self.past.travelled = other.past.travelled;
    }

    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.state.clear();
        self.state.extend_from_slice(&other.state);
        self.root.copy_from(&other.root);
        self.refused = other.refused;
        self.past.copy_from(&other.past);
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Hypothesis {
    pub(crate) belief: Belief,
    pub(crate) weight: f64,
    /// Logarithm of the weight after the evidence of this step, before it is scaled.
    score: f64,
    pub(crate) mode: Mode,
    pub(crate) component: usize,
}

impl Hypothesis {
    pub(crate) fn new(belief: Belief, weight: f64, mode: Mode, component: usize) -> Self {
        Self {
            belief,
            weight,
            score: 0.0,
            mode,
            component,
        }
    }
}

/// A belief as a mixture over components of the prior and over what the person does.
///
/// A jump Markov system: every [`branching`](BankConfig::branching) a moving hypothesis may pause
/// or change its mind and a resting one may go on with a velocity drawn anew, each as a hypothesis
/// of its own; those that say the same are merged, the lightest dropped. An interacting multiple
/// model would instead mix all histories of a mode into one Gaussian at every step: a change of
/// mind, whose two sides are far apart, does not survive that.
///
/// Steps do not allocate, unless a belief passes to a component of larger rank for the first time.
/// An error leaves the bank as it was, unless it is an overflow of the
/// arithmetic in some of the hypotheses, which are then dropped.
#[derive(Debug, Clone)]
pub struct Bank {
    pub(crate) filters: Vec<Filter>,
    pub(crate) velocities: Vec<PhaseVelocity>,
    pub(crate) hypotheses: Vec<Hypothesis>,
    /// Prior probabilities of the components.
    pub(crate) priors: Vec<f64>,
    /// A belief of each component, for its size.
    pub(crate) blanks: Vec<Belief>,
    pub(crate) spare: Vec<Belief>,
    pub(crate) candidates: Vec<Candidate>,
    pub(crate) config: BankConfig,
    pub(crate) moments: [Vec<f64>; 2],
    /// Shares of a motion since the last branching, and since the start.
    since_branching: f64,
    pub(crate) elapsed: f64,
    health: Health,
}

/// Where a motion that is under way may be, and how far off that.
const UNDER_WAY: [f64; 3] = [0.25, 0.5, 0.75];
const UNDER_WAY_VARIANCE: f64 = 0.01;

/// Hypotheses beyond which a bank is no longer meant.
const MOST: usize = 10_000;

fn probability(what: &'static str, value: f64) -> Result<(), BipError> {
    if (0.0..1.0).contains(&value) {
        Ok(())
    } else {
        Err(BipError::Parameter {
            what,
            value,
            wanted: "at least 0 and below 1",
        })
    }
}

impl Bank {
    /// Of one model.
    ///
    /// # Errors
    /// As [`Filter::new`]; rates and times that are negative or not finite, no hypothesis.
    pub fn new(model: &Model, config: &BankConfig) -> Result<Self, BipError> {
        Self::of_components(&[(model, 1.0)], config)
    }

    /// Of several models with the same degrees of freedom and their prior probabilities, which
    /// are scaled to a sum of 1.
    ///
    /// # Errors
    /// As [`new`](Self::new); no model, different degrees of freedom, probabilities that are
    /// negative, not finite or all zero.
    pub fn of_components(
        components: &[(&Model, f64)],
        config: &BankConfig,
    ) -> Result<Self, BipError> {
        not_negative("pauses", config.pauses)?;
        positive("length of a pause", config.pause_length)?;
        not_negative("changes", config.changes)?;
        not_negative("branching", config.branching)?;
        probability("probability of not having begun", config.not_begun)?;
        probability("probability of being under way", config.under_way)?;
        let begins = 1.0 - config.not_begun - config.under_way;
        probability("probability of neither", 1.0 - begins)?;
        for (what, count) in [
            ("hypotheses", config.hypotheses),
            ("components", components.len()),
        ] {
            if !(1..=MOST).contains(&count) {
                return Err(BipError::Parameter {
                    what,
                    value: count as f64,
                    wanted: "1 to 10000",
                });
            }
        }
        let dofs = components[0].0.dofs();
        let mut total = 0.0;
        for (i, (model, weight)) in components.iter().enumerate() {
            not_negative("probability of a component", *weight)?;
            if model.dofs() != dofs {
                return Err(BipError::DofMismatch {
                    demonstration: i,
                    expected: dofs,
                    got: model.dofs(),
                });
            }
            total += weight;
        }
        if !(total > 0.0 && total.is_finite()) {
            return Err(BipError::Parameter {
                what: "sum of the probabilities of the components",
                value: total,
                wanted: "finite and positive",
            });
        }
        let mut bank = Self {
            filters: Vec::new(),
            velocities: Vec::new(),
            hypotheses: Vec::new(),
            priors: Vec::new(),
            blanks: Vec::new(),
            spare: Vec::new(),
            candidates: Vec::new(),
            config: config.clone(),
            moments: [vec![0.0; dofs * dofs], vec![0.0; dofs * dofs]],
            since_branching: 0.0,
            elapsed: 0.0,
            health: Health::NEW,
        };
        for (component, (model, weight)) in components.iter().enumerate() {
            let filter = Filter::new(model, &config.filter)?;
            let weight = weight / total;
            let velocity = model.phase_velocity();
            // With several components there are hypotheses enough to begin with.
            let parts = split(velocity, config.split_velocity && components.len() == 1);
            for (share, rate) in parts {
                let mut moving = filter.clone();
                moving.redraw_velocity(rate);
                bank.add(&moving, weight * share * begins, Mode::Moving, component);
            }
            bank.add(&filter, weight * config.not_begun, Mode::Resting, component);
            for phase in UNDER_WAY {
                let under_way = FilterConfig {
                    phase,
                    phase_variance: UNDER_WAY_VARIANCE,
                    ..config.filter.clone()
                };
                let share = config.under_way / UNDER_WAY.len() as f64;
                bank.add(
                    &Filter::new(model, &under_way)?,
                    weight * share,
                    Mode::Moving,
                    component,
                );
            }
            bank.velocities.push(velocity);
            bank.priors.push(weight);
            bank.blanks.push(Belief::of(&filter));
            bank.filters.push(filter);
        }
        let most = bank.most().max(bank.hypotheses.len());
        bank.candidates
            .reserve((2 + components.len()).saturating_mul(most));
        bank.hypotheses.reserve(2 * most);
        let largest = bank.blanks.iter().max_by_key(|b| b.state.len()).cloned();
        bank.spare = largest.map_or(Vec::new(), |b| vec![b; bank.most()]);
        // Each dropped hypothesis is kept for the next.
        bank.spare.reserve(2 * most);
        Ok(bank)
    }

    fn add(&mut self, filter: &Filter, weight: f64, mode: Mode, component: usize) {
        if weight > 0.0 {
            let belief = Belief::of(filter);
            self.hypotheses
                .push(Hypothesis::new(belief, weight, mode, component));
        }
    }

    /// Lets `dt` pass.
    ///
    /// # Errors
    /// A `dt` that is negative or not finite.
    pub fn predict(&mut self, dt: f64) -> Result<(), BipError> {
        not_negative("dt", dt)?;
        let mean = self.velocities.iter().map(|v| v.mean.abs()).sum::<f64>()
            / self.velocities.len() as f64;
        finite("dt", &[dt * mean])?;
        for h in &self.hypotheses {
            let [phase, velocity] = [h.belief.state[0][0], h.belief.state[0][1]];
            let noise = self.filters[h.component].acceleration_sd * dt;
            finite("dt", &[phase + dt * velocity, noise * noise, noise * dt])?;
        }
        self.since_branching += dt * mean;
        self.elapsed += dt * mean;
        if self.since_branching >= self.config.branching {
            self.branch(self.since_branching);
            self.since_branching = 0.0;
        }
        let mut failed = None;
        for h in &mut self.hypotheses {
            h.score = h.weight.ln();
            let filter = &mut self.filters[h.component];
            exchange(filter, &mut h.belief);
            let moved = match h.mode {
                Mode::Moving => filter.predict(dt),
                Mode::Resting => {
                    filter.rest(dt);
                    Ok(())
                }
            };
            exchange(filter, &mut h.belief);
            if let Err(error) = moved {
                h.score = f64::NEG_INFINITY;
                failed = Some(error);
            }
        }
        self.adopt_scores(failed).map(|_| ())
    }

    /// Takes an observation of the present.
    ///
    /// # Errors
    /// As [`Filter::observe`].
    pub fn observe(&mut self, observation: &Observation<'_>) -> Result<Update, BipError> {
        self.weigh(|filter| filter.observe(observation))
    }

    /// Takes evidence about another phase, such as an end point estimated elsewhere.
    ///
    /// # Errors
    /// As [`Filter::observe_at`].
    pub fn observe_at(
        &mut self,
        phase: f64,
        observation: &Observation<'_>,
    ) -> Result<Update, BipError> {
        self.weigh(|filter| filter.observe_at(phase, observation))
    }

    /// Takes evidence about the phase itself.
    ///
    /// # Errors
    /// As [`Filter::observe_phase`].
    pub fn observe_phase(&mut self, phase: f64, variance: f64) -> Result<Update, BipError> {
        self.weigh(|filter| filter.observe_phase(phase, variance))
    }

    /// What happened since the start; numbers taken and refused are those of the hypothesis that
    /// was the most probable one at the time.
    #[must_use]
    pub fn health(&self) -> Health {
        let condition = |h: &Hypothesis| {
            let (smallest, largest) = h.belief.root.diagonal_range();
            (largest / smallest).powi(2)
        };
        Health {
            condition: self.heaviest().map_or(1.0, condition),
            ..self.health
        }
    }

    /// Updates every hypothesis and its weight by the density it gave to the evidence.
    fn weigh(
        &mut self,
        mut update: impl FnMut(&mut Filter) -> Result<Update, BipError>,
    ) -> Result<Update, BipError> {
        let mut failed = None;
        let mut best = (f64::NEG_INFINITY, Update::NOTHING);
        for h in &mut self.hypotheses {
            let filter = &mut self.filters[h.component];
            exchange(filter, &mut h.belief);
            let updated = update(filter);
            exchange(filter, &mut h.belief);
            match updated {
                Ok(update) => {
                    h.score = h.weight.ln() + update.log_likelihood;
                    if h.score > best.0 {
                        best = (h.score, update);
                    }
                }
                // Of a hypothesis that has run away; the others go on.
                Err(error @ BipError::Overflow { .. }) => {
                    h.score = f64::NEG_INFINITY;
                    failed = Some(error);
                }
                // Bad evidence is refused by the first hypothesis, before anything has changed.
                Err(error) => return Err(error),
            }
        }
        let log_likelihood = self.adopt_scores(failed)?;
        let update = Update {
            log_likelihood,
            ..best.1
        };
        self.health.count(&update);
        Ok(update)
    }

    /// Turns scores into weights, drops what has become impossible and returns the logarithm of
    /// the sum. If everything has, the weights stay as they were.
    fn adopt_scores(&mut self, failed: Option<BipError>) -> Result<f64, BipError> {
        let best = self
            .hypotheses
            .iter()
            .fold(f64::NEG_INFINITY, |best, h| best.max(h.score));
        if let (true, Some(error)) = (best == f64::NEG_INFINITY, failed) {
            return Err(error);
        }
        let mut sum = 0.0;
        for h in &mut self.hypotheses {
            h.weight = (h.score - best).exp();
            sum += h.weight;
        }
        let mut at = 0;
        while at < self.hypotheses.len() {
            if self.hypotheses[at].weight > 0.0 {
                self.hypotheses[at].weight /= sum;
                at += 1;
            } else {
                let dropped = self.hypotheses.swap_remove(at);
                self.spare.push(dropped.belief);
            }
        }
        Ok(best + sum.ln())
    }
}

/// Share, mean and variance of the phase velocity of each hypothesis at the start. Three normal
/// distributions one standard deviation apart, with half the variance each, have the mean and the
/// variance of the one they replace; phase and position are far less linear in the velocity than
/// one filter can follow.
fn split(velocity: PhaseVelocity, split: bool) -> Vec<(f64, PhaseVelocity)> {
    if !split {
        return vec![(1.0, velocity)];
    }
    let sd = velocity.variance.sqrt();
    [(0.25, -1.0), (0.5, 0.0), (0.25, 1.0)]
        .into_iter()
        .map(|(share, away)| {
            let part = PhaseVelocity {
                mean: velocity.mean + away * sd,
                variance: 0.5 * velocity.variance,
            };
            (share, part)
        })
        .collect()
}

/// Puts a belief into the machinery of its component, or takes it out again.
pub(crate) fn exchange(filter: &mut Filter, belief: &mut Belief) {
    std::mem::swap(&mut filter.state, &mut belief.state);
    std::mem::swap(&mut filter.root, &mut belief.root);
    std::mem::swap(&mut filter.refused, &mut belief.refused);
    std::mem::swap(&mut filter.past, &mut belief.past);
}
