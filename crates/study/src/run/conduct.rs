//! A study with people: a presenter and a respondent.

use super::progress::NextStep;
use super::study::{Answer, Study};
use crate::error::StudyError;
use crate::present::{Presentation, Presenter, Rendered, Stimulus, Surface};
use crate::protocol::{Participants, PlannedTrial, Procedure, TrialKind};

/// A question to a subject.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ask {
    /// The question of the procedure.
    Procedure(Procedure),
    /// Waits until the subject is ready; any answer is accepted.
    GoOn,
}

/// The interface to the subject. It never learns the condition.
pub trait Respondent {
    /// Shows a text.
    ///
    /// # Errors
    /// A text that cannot be shown.
    fn tell(&mut self, text: &str) -> Result<(), StudyError>;

    /// Called after each answer is in the log; does nothing by default.
    ///
    /// # Errors
    /// Failures that stop the study.
    fn recorded(&mut self, study: &Study) -> Result<(), StudyError> {
        let _ = study;
        Ok(())
    }

    /// Asks; `None` ends the session, which can be resumed later.
    ///
    /// # Errors
    /// A question that cannot be asked.
    fn ask(&mut self, text: &str, ask: Ask) -> Result<Option<Answer>, StudyError>;
}

/// Runs a study with people until it is done or the session ends; returns the number of answered trials.
///
/// Questions show the number of the trial and of all trials, never the condition. The subject is told when a spoilt trial will be repeated.
/// Before a trial on another patch than the last one, the experimenter is asked to mount it, by its number.
///
/// # Errors
/// A study with simulated participants, or on another kind of arm; as [`Presenter::present`] and [`Respondent`]; a log that cannot be
/// written. Everything up to the error is in the log.
pub fn conduct(
    study: &mut Study,
    presenter: &mut dyn Presenter,
    respondent: &mut dyn Respondent,
) -> Result<usize, StudyError> {
    study.expect(Participants::People)?;
    study.expect_arm(presenter.arm())?;
    let protocol = study.protocol().clone();
    let mut greeted = None;
    let mut on_board = None;
    let mut answered = 0;
    loop {
        match study.next_step() {
            NextStep::Done => {
                respondent.tell("That was all. Thank you.")?;
                return Ok(answered);
            }
            NextStep::Rest { subject } => {
                let text = format!(
                    "{}: time for a break. Go on when you are ready.",
                    protocol.pseudonym(subject)
                );
                if respondent.ask(&text, Ask::GoOn)?.is_none() {
                    return Ok(answered);
                }
                study.rested()?;
            }
            NextStep::Present {
                subject,
                trial,
                attempt,
            } => {
                if greeted != Some(subject) {
                    let text = format!("{}: ready to begin?", protocol.pseudonym(subject));
                    if respondent.ask(&text, Ask::GoOn)?.is_none() {
                        return Ok(answered);
                    }
                    greeted = Some(subject);
                }
                let patch = Stimulus::of(&protocol, trial.condition)?.patch;
                if let Some(patch) = patch.filter(|_| patch != on_board) {
                    let number = patch.number();
                    let text = format!("Put patch {number} on the board. Go on when it is there.");
                    if respondent.ask(&text, Ask::GoOn)?.is_none() {
                        return Ok(answered);
                    }
                    on_board = Some(patch);
                }
                respondent.tell(&announcement(&trial, protocol.procedure))?;
                let [who, what] = [subject as u64, trial.number as u64];
                let seed = protocol.seed ^ who << 40 ^ what << 8 ^ u64::from(attempt);
                let Some(shown) = present(study, presenter, respondent, &trial, seed)? else {
                    return Ok(answered);
                };
                let because = presenter.because();
                study.presented_because(&shown, because.as_deref())?;
                if shown.why_not().is_some() {
                    respondent.tell("That did not work; it comes again later.")?;
                }
            }
            NextStep::Answer { trial, .. } => {
                let ask = Ask::Procedure(protocol.procedure);
                let own = protocol.question(trial.condition).map(str::to_owned);
                let text = own.unwrap_or_else(|| question(protocol.procedure));
                let Some(answer) = respondent.ask(&text, ask)? else {
                    return Ok(answered);
                };
                match study.answered(answer) {
                    // Ask again.
                    Err(StudyError::BadAnswer { wanted, .. }) => {
                        respondent.tell(&format!("Please answer with {wanted}."))?;
                    }
                    Err(error) => return Err(error),
                    Ok(()) => {
                        answered += 1;
                        respondent.recorded(study)?;
                    }
                }
            }
        }
    }
}

/// Presents both intervals in order, or the single touch; `None` if the session ends at a whiteboard.
fn present(
    study: &Study,
    presenter: &mut dyn Presenter,
    respondent: &mut dyn Respondent,
    trial: &PlannedTrial,
    seed: u64,
) -> Result<Option<Presentation>, StudyError> {
    let protocol = study.protocol();
    let mut show = |condition: usize, seed: u64| -> Result<Option<Rendered>, StudyError> {
        let stimulus = Stimulus::of(protocol, condition)?;
        if stimulus.surface != Surface::Whiteboard {
            return presenter.present(&stimulus, seed).map(Some);
        }
        let text = "Touch the whiteboard now. Go on when you have let it go.";
        let touched = respondent.ask(text, Ask::GoOn)?;
        Ok(touched.map(|_| Rendered::default()))
    };
    if !protocol.procedure.is_two_intervals() {
        let rendered = show(trial.condition, seed)?;
        return Ok(rendered.map(|rendered| Presentation {
            rendered,
            reference: None,
        }));
    }
    let mut shown = [trial.condition, protocol.reference()];
    if trial.second {
        shown.reverse();
    }
    let Some(first) = show(shown[0], seed ^ 1 << 60)? else {
        return Ok(None);
    };
    let Some(second) = show(shown[1], seed ^ 2 << 60)? else {
        return Ok(None);
    };
    let (rendered, reference) = match trial.second {
        true => (second, first),
        false => (first, second),
    };
    Ok(Some(Presentation {
        rendered,
        reference: Some(reference),
    }))
}

fn announcement(trial: &PlannedTrial, procedure: Procedure) -> String {
    let practice = match trial.kind {
        TrialKind::Practice => " (practice)",
        TrialKind::Main | TrialKind::Catch => "",
    };
    let what = match procedure.is_two_intervals() {
        true => "touch the board, twice",
        false => "touch the board",
    };
    format!("Trial {}{practice}: {what}.", trial.number)
}

fn question(procedure: Procedure) -> String {
    match procedure {
        Procedure::Magnitude => {
            "How rough was it? Any number above zero: twice as rough, twice the number.".to_owned()
        }
        Procedure::Likert { points } => {
            format!("How rough was it, from 1 (smooth) to {points} (rough)?")
        }
        Procedure::MoreReal { points } => format!(
            "Which one felt more like a real wall, from 1 (the first, clearly) to {points} (the second, clearly)?"
        ),
        Procedure::TwoIntervals | Procedure::Staircase | Procedure::Quest => {
            "Which one was rougher?".to_owned()
        }
    }
}
