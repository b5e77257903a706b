//! The bank: hypotheses weighted by their predictive density.

use super::branching::{CHANGE_OF_SPEED, Hypotheses, Room};
use super::component::{Component, ComponentFilter, total_probability};
use super::config::BankConfig;
use super::hypothesis::{Hypothesis, HypothesisView, Mode};
use crate::error::{BipError, length};
use crate::filter::{Filter, FilterConfig, Health, Observation, Update};
use crate::model::{Model, PhaseVelocity};
use hwall_numeric::check;

/// Initial phases of hypotheses for a motion under way.
const UNDER_WAY: [f64; 18] = [
    0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85,
    0.9,
];
/// Variance of these phases: small enough for linearisation, because from a tenth of a motion away the shape is adapted instead of the phase.
const UNDER_WAY_VARIANCE: f64 = 0.000_625;

/// Share of a motion in which two hypotheses per component and those under way have places.
const SETTLING: f64 = 0.1;

/// An estimate as a mixture over components of the prior and over modes of the motion.
///
/// A jump Markov system. At every step a moving hypothesis may pause, suddenly or by slowing down, or change its mind; a resting one may continue
/// with a new random velocity or gather speed. Each event gives a new hypothesis. Nearly equal hypotheses are merged, the lightest are dropped. An
/// interacting multiple model would instead mix all histories of a mode into one Gaussian at every step, which fails after a change of mind, where
/// the ends lie far apart.
///
/// Steps do not allocate. After an error the bank is unchanged, unless the arithmetic overflows in some hypotheses, which are then dropped.
#[derive(Debug, Clone)]
pub struct Bank {
    pub(super) components: Vec<ComponentFilter>,
    pub(super) hypotheses: Hypotheses,
    pub(super) config: BankConfig,
    /// Scratch for the moments of one hypothesis.
    pub(super) moments: [Vec<f64>; 2],
    /// Shares of a motion since the last branching, and since the start.
    since_branching: f64,
    elapsed: f64,
    /// Has there been evidence since the last branching? Without evidence, unlikely hypotheses would be dropped untested.
    weighed: bool,
    health: Health,
}

impl Bank {
    /// A bank of one model.
    ///
    /// # Errors
    /// As [`Filter::new`]; rates and times that are negative or not finite, no hypothesis.
    pub fn new(model: &Model, config: &BankConfig) -> Result<Self, BipError> {
        let component = Component {
            model,
            probability: 1.0,
        };
        Self::of_components(&[component], config)
    }

    /// A bank of several models with the same degrees of freedom, with prior probabilities.
    ///
    /// # Errors
    /// As [`new`](Self::new); no model, different degrees of freedom, probabilities that are
    /// negative, not finite or all zero.
    pub fn of_components(
        components: &[Component<'_>],
        config: &BankConfig,
    ) -> Result<Self, BipError> {
        config.validate()?;
        let total = total_probability(components)?;
        // Several components already give enough initial hypotheses.
        let split = config.split_velocity && components.len() == 1;
        let (mut filters, mut list) = (Vec::new(), Vec::new());
        for (at, component) in components.iter().enumerate() {
            let filter = ComponentFilter::new(component, total, &config.filter)?;
            add_first_hypotheses(&mut list, at, component.model, &filter, config, split)?;
            filters.push(filter);
        }
        let dofs = components[0].model.dofs();
        let most = room(config, filters.len(), 0.0).total();
        let hypotheses = Hypotheses::new(list, &filters, most);
        for component in &mut filters {
            component.filter.make_room_for(hypotheses.largest());
        }
        Ok(Self {
            hypotheses,
            components: filters,
            config: config.clone(),
            moments: [vec![0.0; dofs * dofs], vec![0.0; dofs * dofs]],
            since_branching: 0.0,
            elapsed: 0.0,
            weighed: false,
            health: Health::NEW,
        })
    }

    /// Forgets all observations and copies the state of another bank of the same components, without allocation. The caller must ensure that the
    /// components have the same models.
    ///
    /// # Errors
    /// A bank with another number of components, or of other sizes.
    pub fn restart_from(&mut self, other: &Self) -> Result<(), BipError> {
        length("components", self.components.len(), other.components.len())?;
        for (own, others) in self.components.iter().zip(&other.components) {
            length("states", own.blank.size(), others.blank.size())?;
            length("dofs", own.filter.dofs(), others.filter.dofs())?;
        }
        self.hypotheses.copy_from(&other.hypotheses);
        self.config.clone_from(&other.config);
        self.since_branching = other.since_branching;
        self.elapsed = other.elapsed;
        self.weighed = other.weighed;
        self.health = other.health;
        Ok(())
    }

    /// Lets `dt` pass.
    ///
    /// # Errors
    /// A `dt` that is negative or not finite, or so long that something overflows.
    pub fn predict(&mut self, dt: f64) -> Result<(), BipError> {
        check::non_negative("dt", dt)?;
        let speeds = self.components.iter().map(|c| c.velocity.mean.abs());
        let mean = speeds.sum::<f64>() / self.components.len() as f64;
        check::finite("dt", dt * mean)?;
        for h in &self.hypotheses.list {
            let moved = h.posterior.phase() + dt * h.posterior.phase_velocity();
            let component = &self.components[h.component];
            let dynamics = component.filter.dynamics();
            let dynamics = dynamics.faster(change_of_speed(component.velocity.mean));
            let noise = dynamics.acceleration_sd * dt;
            check::all_finite("dt", &[moved, noise * noise, noise * dt])?;
        }
        self.since_branching += dt * mean;
        // Waiting before the first evidence does not count.
        if self.weighed || self.elapsed > 0.0 {
            self.elapsed += dt * mean;
        }
        if self.weighed {
            let room = room(&self.config, self.components.len(), self.elapsed);
            let (share, components) = (self.since_branching, &mut self.components);
            self.hypotheses
                .branch(share, room, &self.config, components);
            self.since_branching = 0.0;
            self.weighed = false;
        }
        let mut failed = None;
        for h in &mut self.hypotheses.list {
            h.score = h.weight.ln();
            let component = &self.components[h.component];
            let (dynamics, nominal) = (component.filter.dynamics(), component.velocity.mean);
            match h.mode {
                Mode::Resting => h.posterior.rest(dt),
                Mode::Moving | Mode::ChangingSpeed => {
                    let dynamics = match h.mode {
                        Mode::ChangingSpeed => dynamics.faster(change_of_speed(nominal)),
                        _ => dynamics,
                    };
                    if let Err(error) = h.posterior.advance(dt, dynamics) {
                        h.score = f64::NEG_INFINITY;
                        failed = Some(error);
                    }
                }
            }
        }
        self.hypotheses.adopt_scores(failed).map(|_| ())
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

    /// Statistics since the start; accepted and rejected values are those of the most probable hypothesis at each time.
    #[must_use]
    pub fn health(&self) -> Health {
        let heaviest = self.hypotheses.heaviest();
        Health {
            condition: heaviest.map_or(1.0, |h| h.posterior.condition()),
            ..self.health
        }
    }

    /// Hypotheses, in no order; their probabilities sum to one.
    pub fn hypotheses(&self) -> impl Iterator<Item = HypothesisView> + '_ {
        self.hypotheses.list.iter().map(|h| HypothesisView {
            probability: h.weight,
            mode: h.mode,
            component: h.component,
            phase: h.posterior.phase(),
            phase_velocity: h.posterior.phase_velocity(),
        })
    }

    /// Updates every hypothesis and its weight, by the density of the evidence.
    fn weigh(
        &mut self,
        mut update: impl FnMut(&mut Filter) -> Result<Update, BipError>,
    ) -> Result<Update, BipError> {
        let mut failed = None;
        let mut best = (f64::NEG_INFINITY, Update::NOTHING);
        for h in &mut self.hypotheses.list {
            let component = &mut self.components[h.component];
            match component.with(&mut h.posterior, &mut update) {
                Ok(update) => {
                    h.score = h.weight.ln() + update.log_likelihood;
                    if h.score > best.0 {
                        best = (h.score, update);
                    }
                }
                // This hypothesis has diverged; the others continue.
                Err(error @ BipError::Overflow { .. }) => {
                    h.score = f64::NEG_INFINITY;
                    failed = Some(error);
                }
                // The first hypothesis rejects invalid evidence before anything has changed.
                Err(error) => return Err(error),
            }
        }
        let log_likelihood = self.hypotheses.adopt_scores(failed)?;
        self.weighed = true;
        let update = Update {
            log_likelihood,
            ..best.1
        };
        self.health.count(&update);
        Ok(update)
    }
}

/// Phase acceleration of a gradual stop from this velocity, 1/time².
fn change_of_speed(velocity: f64) -> f64 {
    velocity.powi(2) / CHANGE_OF_SPEED
}

/// Number of hypotheses to keep after a share of a motion.
fn room(config: &BankConfig, components: usize, elapsed: f64) -> Room {
    if elapsed < SETTLING {
        Room {
            any: config.hypotheses.max(2 * components),
            joining: if config.under_way > 0.0 {
                UNDER_WAY.len()
            } else {
                0
            },
        }
    } else {
        Room {
            any: config.hypotheses,
            joining: 0,
        }
    }
}

/// Initial hypotheses of a component.
fn add_first_hypotheses(
    list: &mut Vec<Hypothesis>,
    at: usize,
    model: &Model,
    component: &ComponentFilter,
    config: &BankConfig,
    split_velocity: bool,
) -> Result<(), BipError> {
    let prior = component.filter.posterior();
    let mut add = |posterior, share: f64, mode, joins| {
        let weight = component.probability * share;
        if weight > 0.0 {
            list.push(Hypothesis {
                joins,
                ..Hypothesis::new(posterior, weight, mode, at)
            });
        }
    };
    for part in velocity_parts(component.velocity, split_velocity) {
        let mut moving = prior.clone();
        moving.redraw_velocity(part.velocity);
        add(moving, part.share * config.begins(), Mode::Moving, false);
    }
    add(prior.clone(), config.not_begun, Mode::Resting, false);
    for phase in UNDER_WAY {
        let under_way = FilterConfig {
            phase,
            phase_variance: UNDER_WAY_VARIANCE,
            ..config.filter.clone()
        };
        let filter = Filter::new(model, &under_way)?;
        let share = config.under_way / UNDER_WAY.len() as f64;
        add(filter.posterior().clone(), share, Mode::Moving, true);
    }
    Ok(())
}

/// A component of the prior of the phase velocity.
struct VelocityPart {
    share: f64,
    velocity: PhaseVelocity,
}

/// Phase velocity of each hypothesis at the start. Three normal distributions one standard deviation apart, with half the variance each, together
/// have the mean and the variance of the distribution they replace. Phase and position are too nonlinear in the velocity for a single filter.
fn velocity_parts(velocity: PhaseVelocity, split: bool) -> Vec<VelocityPart> {
    if !split {
        return vec![VelocityPart {
            share: 1.0,
            velocity,
        }];
    }
    let sd = velocity.variance.sqrt();
    [(0.25, -1.0), (0.5, 0.0), (0.25, 1.0)]
        .into_iter()
        .map(|(share, away)| VelocityPart {
            share,
            velocity: PhaseVelocity {
                mean: velocity.mean + away * sd,
                variance: 0.5 * velocity.variance,
            },
        })
        .collect()
}
