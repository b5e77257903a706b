//! Components of the prior of a bank.

use super::config::MOST;
use crate::error::BipError;
use crate::filter::{Filter, FilterConfig, Posterior};
use crate::model::{Model, PhaseVelocity};
use hwall_numeric::check;

/// A model and its prior probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Component<'a> {
    /// The model.
    pub model: &'a Model,
    /// Its probability, up to a common factor: the probabilities of all components are normalised.
    pub probability: f64,
}

#[derive(Debug, Clone)]
pub(super) struct ComponentFilter {
    /// Processes the posteriors of all hypotheses of this component in turn.
    pub filter: Filter,
    pub velocity: PhaseVelocity,
    pub probability: f64,
    /// A posterior of the right size.
    pub blank: Posterior,
}

impl ComponentFilter {
    /// `total`: sum of the probabilities of all components.
    pub(super) fn new(
        component: &Component<'_>,
        total: f64,
        config: &FilterConfig,
    ) -> Result<Self, BipError> {
        let filter = Filter::new(component.model, config)?;
        Ok(Self {
            velocity: component.model.phase_velocity(),
            probability: component.probability / total,
            blank: filter.posterior().clone(),
            filter,
        })
    }

    /// Runs the filter on a posterior of this component.
    pub(super) fn with<T>(
        &mut self,
        posterior: &mut Posterior,
        work: impl FnOnce(&mut Filter) -> T,
    ) -> T {
        self.filter.exchange(posterior);
        let done = work(&mut self.filter);
        self.filter.exchange(posterior);
        done
    }
}

/// Sum of the probabilities.
///
/// # Errors
/// No component, different degrees of freedom, probabilities that are negative, not finite or all
/// zero.
pub(super) fn total_probability(components: &[Component<'_>]) -> Result<f64, BipError> {
    let count = components.len();
    let within = (1..=MOST).contains(&count);
    check::that(within, "components", count as f64, "1 to 10000")?;
    let expected = components[0].model.dofs();
    let mut total = 0.0;
    for (i, Component { model, probability }) in components.iter().enumerate() {
        total += check::non_negative("probability of a component", *probability)?;
        if model.dofs() != expected {
            return Err(BipError::ComponentMismatch {
                component: i,
                expected,
                got: model.dofs(),
            });
        }
    }
    let what = "sum of the probabilities of the components";
    Ok(check::positive(what, total)?)
}
