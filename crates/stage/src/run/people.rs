//! The closed loop for several people: a separate run and a fresh session for each.

use crate::person::gestures::{self, GestureAtTouch};
use crate::person::participants::Participant;
use crate::person::predictors::PREDICTORS;
use crate::person::responses::Scenery;
use crate::run::closed_loop;
use crate::run::evaluation::judge::{self, Outcome};
use crate::run::evaluation::least_time::LeastTime;
use crate::run::evaluation::regret::{Regret, Regrets};
use crate::run::logs::log::Run;
use crate::run::logs::snapshots;
use crate::run::logs::view_log::ViewLog;
use crate::run::stage::Stage;
use hwall_haptics::PlaceTolerance;
use hwall_motion::{MotionConfig, MotionLimits};
use hwall_record::Recorder;

/// One evaluated touch.
#[derive(Debug, Clone)]
pub struct JudgedTouch {
    /// The arm's result.
    pub outcome: Outcome,
    /// The optimum.
    pub regret: Regret,
    /// What was inferred of the gesture; `None` without gestures.
    pub gesture: Option<GestureAtTouch>,
    /// Lead of each predictor, see [`judge::leads`].
    pub leads_s: [Option<f64>; PREDICTORS],
}

/// Results of one person's run.
pub struct PersonRun {
    /// The log of the run, without its steps ([`Run::ticks`]), which are already evaluated.
    pub run: Run,
    /// The touches, in order of time.
    pub touches: Vec<JudgedTouch>,
}

/// Runs the loop for every participant and evaluates all touches, calling `progress` with the share done.
///
/// A participant's result does not depend on the other participants; only the computing times differ.
///
/// # Errors
/// A configuration that a crate refuses, or a touch that cannot be evaluated.
pub fn run(
    stage: &Stage<'_>,
    participants: &[Participant],
    progress: impl FnMut(f64),
) -> anyhow::Result<Vec<PersonRun>> {
    run_recorded(stage, participants, None, progress)
}

/// As [`run`], with every person's run in a recording.
///
/// # Errors
/// As for [`run`].
pub fn run_recorded(
    stage: &Stage<'_>,
    participants: &[Participant],
    mut recorder: Option<&mut Recorder>,
    mut progress: impl FnMut(f64),
) -> anyhow::Result<Vec<PersonRun>> {
    let scenery = &stage.scenery;
    let limits = MotionLimits::of_arm(&**scenery.arm.kinematics(), &MotionConfig::default())?;
    let least = LeastTime::new(scenery.arm, &PlaceTolerance::default(), limits)?;
    let regrets = Regrets {
        least: &least,
        scene: scenery.scene,
        waiting: scenery.start(),
        delay_s: stage.level.delay_s(),
    };
    let all = participants.len() as f64;
    participants
        .iter()
        .enumerate()
        .map(|(done, participant)| {
            let report = |share: f64| progress((done as f64 + share) / all);
            let recorded = (done, recorder.as_deref_mut());
            let mut run = person(stage, &regrets, participant, recorded, report)?;
            if done > 0 {
                // Megabytes per person, and only the first is shown.
                run.run.view = ViewLog::default();
            }
            Ok(run)
        })
        .collect()
}

fn person(
    stage: &Stage<'_>,
    regrets: &Regrets<'_>,
    participant: &Participant,
    recorded: (usize, Option<&mut Recorder>),
    progress: impl FnMut(f64),
) -> anyhow::Result<PersonRun> {
    let Scenery { arm, scene, .. } = stage.scenery;
    let Participant { hand, seed, .. } = participant;
    let mut run = closed_loop::run(stage, hand, *seed, recorded, progress)?;
    let touches = &participant.touches;
    let outcomes = judge::judge(arm, touches, &run.ticks)?;
    let regret = regrets.of_run(&run, &outcomes)?;
    let leads = judge::leads(scene, touches, &run.predictions);
    run.trace.mark_touches(&outcomes, &run.predictions);
    let known_s: Vec<f64> = regret.iter().map(|regret| regret.known_s).collect();
    run.trace.boards = snapshots::at_contacts(arm, &run.ticks, &outcomes);
    run.trace.arms = snapshots::of_one_touch(arm, &run.ticks, &outcomes, &known_s);
    let actual = stage.gestures.and_then(|_| gestures::task_of(hand));
    let inferred = |outcome: &Outcome| {
        let contact_s = outcome.touch.contact_s;
        let slid_m = judge::slid_m(&outcome.touch, &run.ticks);
        Some(GestureAtTouch::new(
            actual?,
            contact_s,
            &run.gestures,
            slid_m,
        ))
    };
    let gestures: Vec<_> = outcomes.iter().map(inferred).collect();
    // Free tens of thousands of steps per person, which are no longer needed.
    run.ticks = Vec::new();
    let touches = outcomes.into_iter().zip(regret).zip(leads).zip(gestures);
    let touches = touches.map(|(((outcome, regret), leads_s), gesture)| JudgedTouch {
        outcome,
        regret,
        gesture,
        leads_s,
    });
    Ok(PersonRun {
        touches: touches.collect(),
        run,
    })
}
