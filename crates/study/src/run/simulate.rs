//! A whole study with simulated participants.

use super::progress::NextStep;
use super::study::{Answer, Study};
use crate::error::StudyError;
use crate::participant::{ParticipantConfig, SimulatedParticipant};
use crate::present::{Presentation, Rendered, SimulatedStage, Stimulus};
use crate::protocol::{Participants, Planned, PlannedTrial, Procedure, Protocol};
use hwall_numeric::parallel;
use std::collections::HashMap;
use std::ops::ControlFlow;

/// Settings of a simulated study.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Simulation {
    /// Who takes part.
    pub participants: ParticipantConfig,
    /// Present every condition only once and reuse its rendering for all its trials? Much faster; trials of one
    /// condition then differ only by the participant.
    pub once_per_condition: bool,
    /// Stop after so many trials, as if the program had been killed; for tests.
    pub kill_after: Option<usize>,
}

/// Presentations computed in advance, by subject, trial and attempt, or by condition only.
type Made = HashMap<(usize, usize, u32), Rendered>;

/// Runs a study to its end, every trial presented by a session on the simulated arm, on all cores.
///
/// Returns the number of trials presented in this call. Same study and settings, same result, even with a stop
/// and a resumption.
///
/// # Errors
/// A study with people, or one that began with another [`Simulation::once_per_condition`]
/// ([`StudyError::OtherParticipants`]); as [`Study::presented`] and [`Study::answered`]; settings outside their range.
pub fn simulate(
    study: &mut Study,
    stage: &SimulatedStage,
    simulation: &Simulation,
) -> Result<usize, StudyError> {
    simulate_and_tell(study, stage, simulation, &mut |_| ControlFlow::Continue(()))
}

/// As [`simulate`]; `tell` is called after every answer and may stop the run.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_and_tell(
    study: &mut Study,
    stage: &SimulatedStage,
    simulation: &Simulation,
    tell: &mut dyn FnMut(&Study) -> ControlFlow<()>,
) -> Result<usize, StudyError> {
    study.expect(Participants::Simulated {
        once_per_condition: simulation.once_per_condition,
    })?;
    let protocol = study.protocol().clone();
    let participants = (0..protocol.subjects)
        .map(|number| SimulatedParticipant::new(&simulation.participants, protocol.seed, number));
    let participants: Vec<_> = participants.collect::<Result<_, _>>()?;
    let mut made = Made::new();
    let mut ahead_of = None;
    let mut count = 0;
    loop {
        match study.next_step() {
            NextStep::Done => return Ok(count),
            NextStep::Rest { .. } => study.rested()?,
            NextStep::Present {
                subject,
                trial,
                attempt,
            } => {
                if simulation.kill_after == Some(count) {
                    return Ok(count);
                }
                if ahead_of != Some(subject)
                    && (ahead_of.is_none() || !simulation.once_per_condition)
                {
                    made = make_ahead(&protocol, stage, subject, simulation)?;
                    ahead_of = Some(subject);
                }
                let of = |condition: usize| -> Result<Rendered, StudyError> {
                    let key = key(simulation, subject, &trial, condition, attempt);
                    match made.get(&key) {
                        Some(rendered) => Ok(*rendered),
                        None => one(&protocol, stage, condition, key),
                    }
                };
                let shown = Presentation {
                    rendered: of(trial.condition)?,
                    reference: match protocol.procedure.is_two_intervals() {
                        true => Some(of(protocol.reference())?),
                        false => None,
                    },
                };
                study.presented(&shown)?;
                count += 1;
            }
            NextStep::Answer { subject, trial } => {
                let said = match (participants.get(subject), study.shown()) {
                    (Some(who), Some(shown)) => who.answer(protocol.procedure, &trial, shown),
                    _ => None,
                };
                match said {
                    Some((value, answered_s)) => study.answered(Answer { value, answered_s })?,
                    None => study.spoilt("not felt")?,
                }
                if tell(study).is_break() {
                    return Ok(count);
                }
            }
        }
    }
}

/// Key of a rendering: subject, trial and attempt, or the condition only. The highest bit marks the reference of two
/// intervals.
fn key(
    simulation: &Simulation,
    subject: usize,
    trial: &PlannedTrial,
    condition: usize,
    attempt: u32,
) -> (usize, usize, u32) {
    if simulation.once_per_condition {
        return (0, condition, attempt);
    }
    let reference = condition != trial.condition;
    let number = 2 * trial.number + usize::from(reference);
    (subject + 1, number, attempt)
}

fn one(
    protocol: &Protocol,
    stage: &SimulatedStage,
    condition: usize,
    (subject, number, attempt): (usize, usize, u32),
) -> Result<Rendered, StudyError> {
    let stimulus = Stimulus::of(protocol, condition)?;
    let seed = [subject as u64, number as u64, attempt.into()]
        .into_iter()
        .fold(protocol.seed, |seed, part| {
            (seed.rotate_left(23) ^ part).wrapping_mul(0x9e6c_63d0_876a_3f35)
        });
    stage.present(&stimulus, seed)
}

/// Computes all first attempts of a subject, or all conditions, on all cores.
fn make_ahead(
    protocol: &Protocol,
    stage: &SimulatedStage,
    subject: usize,
    simulation: &Simulation,
) -> Result<Made, StudyError> {
    let mut jobs: Vec<(usize, (usize, usize, u32))> = Vec::new();
    if simulation.once_per_condition {
        let all = 0..protocol.conditions().max(protocol.reference() + 1);
        jobs.extend(all.map(|condition| (condition, (0, condition, 1))));
    } else if matches!(protocol.procedure, Procedure::Staircase | Procedure::Quest) {
        // Adaptive conditions are not known in advance.
        return Ok(Made::new());
    } else {
        for step in protocol.plan(subject)? {
            let Planned::Trial(trial) = step else {
                continue;
            };
            let mut shown = vec![trial.condition];
            let reference = protocol.reference();
            if protocol.procedure.is_two_intervals() && trial.condition != reference {
                shown.push(reference);
            }
            jobs.extend(
                shown
                    .into_iter()
                    .map(|c| (c, key(simulation, subject, &trial, c, 1))),
            );
        }
    }
    let made = parallel::map(jobs.len(), |job| {
        let (condition, key) = jobs[job];
        Ok((key, one(protocol, stage, condition, key)?))
    });
    made.into_iter().collect()
}
