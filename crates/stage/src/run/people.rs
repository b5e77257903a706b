//! The closed loop for several people: each in a run of their own, with a session that knows nobody before.

use crate::input::arms::BoardArm;
use crate::person::participants::Participant;
use crate::person::predictors::{PREDICTORS, Predictors};
use crate::person::responses::Scenery;
use crate::run::closed_loop::{self, Run, RunSetup};
use crate::run::judged::judge::{self, Outcome};
use crate::run::judged::least_time::LeastTime;
use crate::run::judged::regret::{Regret, Regrets, RunLog};
use crate::run::kept::snapshots;
use crate::run::kept::view_log::ViewLog;
use crate::run::simulated_arm::ArmLevel;
use hwall::Walls;
use hwall::haptics::Board;
use hwall_fri::controller::FaultConfig;
use hwall_haptics::PlaceTolerance;
use hwall_motion::{MotionConfig, MotionLimits};
use hwall_record::Recorder;
use hwall_scene::Scene;

/// What all runs share: made once, however many people there are.
pub struct Stage<'a> {
    /// The arm, with the face of the board as its tool.
    pub arm: &'a BoardArm,
    /// The board.
    pub board: &'a Board,
    /// What is touched.
    pub scene: &'a Scene,
    /// What is known of its walls. Its usual waiting posture is the one from which regret asks what was possible; where it has
    /// none, that is the posture in which the arm starts.
    pub walls: &'a Walls,
    /// Who foresees the touches, as trained; every person meets a copy that has seen nobody.
    pub predictors: &'a Predictors,
    /// Does the board present the roughness of surfaces?
    pub textured: bool,
    /// How much of the arm is simulated.
    pub level: ArmLevel,
    /// The arm is behind FRI, and this goes wrong.
    pub fri: Option<FaultConfig>,
    /// Control period, s.
    pub period_s: f64,
}

impl<'a> Stage<'a> {
    /// At servo level, the usual one for many touches.
    #[must_use]
    pub const fn of(scenery: &Scenery<'a>, predictors: &'a Predictors, period_s: f64) -> Self {
        Self {
            arm: scenery.arm,
            board: scenery.board,
            scene: scenery.scene,
            walls: scenery.walls,
            predictors,
            textured: scenery.textured,
            level: ArmLevel::Servo,
            fri: None,
            period_s,
        }
    }
}

/// One touch, judged.
#[derive(Debug, Clone)]
pub struct JudgedTouch {
    /// How the arm did.
    pub outcome: Outcome,
    /// What was possible.
    pub regret: Regret,
    /// How long before the touch each predictor had been right, see [`judge::leads`].
    pub leads_s: [Option<f64>; PREDICTORS],
}

/// What became of one person's touches.
pub struct PersonRun {
    /// The log of the run, without its steps ([`Run::ticks`]), which are judged by then.
    pub run: Run,
    /// The touches, in order of time.
    pub touches: Vec<JudgedTouch>,
}

/// Runs the loop for every participant and judges all touches, calling `progress` with the share done.
///
/// The same participants give the same answer, whoever else takes part; only the times that steps took differ.
///
/// # Errors
/// A configuration that a crate refuses, or a touch that no run can be judged by.
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
    let kinematics = &**stage.arm.kinematics();
    let limits = MotionLimits::of_arm(kinematics, &MotionConfig::default())?;
    let place = PlaceTolerance::default();
    let least = LeastTime::new(stage.arm, stage.board, &place, limits)?;
    let regrets = Regrets {
        least: &least,
        arm: kinematics,
        board: stage.board,
        scene: stage.scene,
        waiting: stage.walls.waiting.unwrap_or(stage.arm.start()),
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
                // Megabytes for each person, and only the first one is shown.
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
    (number, recorder): (usize, Option<&mut Recorder>),
    progress: impl FnMut(f64),
) -> anyhow::Result<PersonRun> {
    let setup = RunSetup {
        arm: stage.arm,
        board: stage.board,
        scene: stage.scene,
        walls: stage.walls,
        hand: &participant.hand,
        textured: stage.textured,
        level: stage.level,
        fri: stage.fri,
        period_s: stage.period_s,
        seed: participant.seed,
    };
    let predictors = stage.predictors.for_another_person();
    let mut run = closed_loop::run_recorded(&setup, predictors, number, recorder, progress)?;
    let touches = &participant.touches;
    let outcomes = judge::judge(stage.arm, stage.board, touches, &run.ticks)?;
    let log = RunLog {
        ticks: &run.ticks,
        led: &run.led,
        sent: &run.sent,
    };
    let regret = regrets.of_run(&log, &outcomes)?;
    let leads = judge::leads(stage.scene, touches, &run.predictions);
    run.trace.mark_touches(&outcomes, &run.predictions);
    let known_s: Vec<f64> = regret.iter().map(|regret| regret.known_s).collect();
    run.trace.boards = snapshots::at_contacts(stage.board, &run.ticks, &outcomes);
    run.trace.arms =
        snapshots::of_one_touch(stage.arm, stage.board, &run.ticks, &outcomes, &known_s);
    // Tens of thousands of steps for each person: nobody asks for them any more.
    run.ticks = Vec::new();
    let touches = outcomes.into_iter().zip(regret).zip(leads);
    let touches = touches.map(|((outcome, regret), leads_s)| JudgedTouch {
        outcome,
        regret,
        leads_s,
    });
    Ok(PersonRun {
        touches: touches.collect(),
        run,
    })
}
