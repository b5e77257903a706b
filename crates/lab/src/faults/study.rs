//! All combinations, on all cores.

use super::bench::Setup;
use super::fault::{Fault, Phase};
use super::run::{self, Bounds, Impact, MASSES_KG, Outcome, STIFFNESSES_N_PER_M};
use anyhow::bail;
use hwall::haptics::ContactLimits;
use hwall::session_supervisor;
use hwall_stage::run::simulated_arm::ArmLevel;
use hwall_stage::run::stage::HEAD_FROZEN_S;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Settings of the study.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Request {
    /// Seeds of the sensors' noise; the worst of all runs counts
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "1",
        allow_negative_numbers = true
    )]
    pub seeds: Vec<u64>,
    /// How much of the arm is simulated; default both
    #[arg(long)]
    pub arm_level: Option<ArmLevel>,
    /// Only faults whose names contain this
    #[arg(long)]
    pub only: Option<String>,
}

impl Request {
    /// The levels of the arm that are simulated.
    pub fn levels(&self) -> Vec<ArmLevel> {
        match self.arm_level {
            Some(level) => vec![level],
            None => vec![ArmLevel::Servo, ArmLevel::Torque],
        }
    }
}

/// The whole matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct Results {
    /// One for each fault, phase and level, in this order.
    pub outcomes: Vec<Outcome>,
    /// One for each level, mass and stiffness.
    pub impacts: Vec<Impact>,
    /// Limits for the evaluation.
    pub bounds: Bounds,
}

impl Results {
    /// Combinations without a safe state in time.
    pub fn unsafe_ones(&self) -> impl Iterator<Item = &Outcome> {
        let outcomes = self.outcomes.iter();
        outcomes.filter(|outcome| outcome.is_unsafe(&self.bounds))
    }
}

/// Reaction time allowed in addition to the age of an input, s.
const CYCLES_S: f64 = 0.06;

/// Limits for the evaluation, from the settings of a session.
pub fn bounds() -> Bounds {
    let limits = ContactLimits::default();
    let supervisor = session_supervisor();
    // The largest age limit of missing or frozen inputs.
    let slowest_s = [
        supervisor.hand.max_age_s,
        supervisor.head.max_age_s,
        supervisor.largest_tick_s,
        HEAD_FROZEN_S,
    ];
    let slowest_s = slowest_s.into_iter().fold(0.0, f64::max);
    Bounds {
        safe_s: slowest_s + CYCLES_S,
        impact_n: limits.impact_force_n(),
        impact_s: limits.transient_s,
        energy_j: limits.energy_j,
        reduced_mass_kg: limits.reduced_mass_kg(supervisor.effective_mass_kg),
    }
}

/// Runs every combination; `progress` receives the number done, and the total.
///
/// # Errors
/// A phase that never comes, or a simulation that fails.
pub fn run(request: &Request, progress: impl Fn(usize, usize) + Sync) -> anyhow::Result<Results> {
    let setup = Setup::new()?;
    let mut jobs = Vec::new();
    let asked = |fault: &Fault| {
        let name = fault.name();
        request.only.as_ref().is_none_or(|only| name.contains(only))
    };
    for level in request.levels() {
        for fault in Fault::all().into_iter().filter(asked) {
            // Only a servo arm is behind FRI.
            if !matches!(fault, Fault::Link(_)) || level == ArmLevel::Servo {
                jobs.extend(Phase::ALL.map(|phase| (fault, phase, level)));
            }
        }
    }
    if jobs.is_empty() {
        // An empty table would look like one without faults.
        let only = request.only.as_deref().unwrap_or_default();
        bail!("no fault contains {only:?}");
    }
    let done = AtomicUsize::new(0);
    let worst = |job: &(Fault, Phase, ArmLevel)| {
        let runs = request.seeds.iter();
        let runs = runs.map(|seed| run::run(&setup, *job, *seed));
        let runs = runs.collect::<anyhow::Result<Vec<Outcome>>>();
        progress(1 + done.fetch_add(1, Ordering::Relaxed), jobs.len());
        Ok(runs?.into_iter().reduce(Outcome::worse_of))
    };
    let outcomes = jobs.par_iter().map(worst);
    let outcomes = outcomes.collect::<anyhow::Result<Vec<Option<Outcome>>>>()?;
    let seed = request.seeds.first().copied().unwrap_or(1);
    let mut impacts = Vec::new();
    for level in request.levels() {
        for mass_kg in MASSES_KG {
            for stiffness in STIFFNESSES_N_PER_M {
                impacts.push(run::hit(&setup, (level, mass_kg, stiffness), seed)?);
            }
        }
    }
    Ok(Results {
        outcomes: outcomes.into_iter().flatten().collect(),
        impacts,
        bounds: bounds(),
    })
}
