//! The main job: from its options to its tables, figures and recordings.

use crate::console::note;
use crate::corridor::{self, CorridorRequest};
use crate::input::arms::{BoardArm, NamedArm};
use crate::input::base_flag::{BaseFlag, BaseKind};
use crate::input::file_plan::FilePlan;
use crate::input::numbers::{counted, up_to};
use crate::person::gestures;
use crate::person::predictors::{PredictorKind, Predictors};
use crate::person::responses::{self, Scenery};
use crate::recording;
use crate::report::outputs::{self, Outputs};
use crate::report::summary::Summary;
use crate::run::people;
use crate::run::simulated_arm::ArmLevel;
use crate::run::stage::Stage;
use crate::setting::{Setting, SettingFlags};
use anyhow::{Context, ensure};
use clap::ValueEnum;
use hwall_fri::controller::FaultConfig;
use hwall_haptics::Board;
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

/// What to do, as flags of a command line.
#[derive(Debug, Clone, clap::Parser)]
pub struct JobOptions {
    /// Scene, poses and people.
    #[command(flatten)]
    pub setting: SettingFlags,
    /// The arm.
    #[command(flatten)]
    pub arm: NamedArm,
    /// servo: joint targets with a delay, doors rendered by positions; torque: rigid bodies, friction and sensors, doors rendered by torques
    #[arg(long, value_enum, default_value_t)]
    pub arm_level: ArmLevel,
    /// The arm is behind FRI, and this share of the cycles begins a burst of one to four commands that do not arrive; holds and losses are
    /// reported on standard error
    #[arg(long, allow_negative_numbers = true, value_parser = up_to::<1>)]
    pub fri_bursts: Option<f64>,
    /// With --fri-bursts: share of the cycles that begin a stall of 20 to 200 ms, in which no command arrives
    #[arg(
        long,
        default_value_t = 0.0,
        requires = "fri_bursts",
        allow_negative_numbers = true,
        value_parser = up_to::<1>
    )]
    pub fri_stalls: f64,
    /// With --fri-bursts: the controller's time stamps are off by at most this, ms
    #[arg(
        long,
        default_value_t = 0.0,
        requires = "fri_bursts",
        allow_negative_numbers = true,
        value_parser = up_to::<50>
    )]
    pub fri_stamp_jitter_ms: f64,
    /// The predictor that leads the board; the first three are always compared, the last one only if it leads [default: fused, or ray-led
    /// without training data]
    #[arg(long, value_enum)]
    pub predictor: Option<PredictorKind>,
    /// on: the predictor learns from every touch that the board feels; off: it stays as trained
    #[arg(long, value_enum, default_value_t)]
    pub adapt: Adapt,
    /// The board presents no roughness: its roll is free, and it stands still while touched
    #[arg(long)]
    pub plain: bool,
    /// Prints on standard error why the board is sent or not, at this time or whenever the choice changes (for every person; --touches 12 has one)
    #[arg(long, num_args = 0..=1, value_name = "SECONDS")]
    pub explain: Option<Option<f64>>,
    /// With --base drives or both: largest speed at which the base may meet a hand, m/s, at most 0.3 [default: 0.21]
    #[arg(long, allow_negative_numbers = true, value_name = "M_PER_S")]
    pub hand_meets: Option<f64>,
    /// Control period in milliseconds, 0.1 to 20
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    pub period_ms: f64,
    /// Output folder
    #[arg(long, default_value = "out/hwall")]
    pub out: PathBuf,
    /// Also writes hwall.glb, the animation for Blender and other viewers
    #[arg(long)]
    pub glb: bool,
    /// Also writes every touch and a summary to this file. In the summary `reachable`, `possible` and `in_place` count touches
    /// (in_place: of the reachable ones), in_place_of_possible is the share of the possible touches that were in place, 0 to 1; gap_p90_m
    /// is over the reachable touches, felt_median_s over those of them that were felt; absent values are null
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Also records all runs to this file, for Foxglove, Rerun and --replay, with the arm's capsules as URDF in the same folder
    #[arg(long)]
    pub mcap: Option<PathBuf>,
}

/// Does the predictor learn from touches?
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Adapt {
    /// From each touch that the board feels
    #[default]
    On,
    /// Never
    Off,
}

/// Runs the job: tables go to `out`, remarks on them to standard error, everything else into files.
/// `progress` receives the share done, 0 to 1.
///
/// # Errors
/// Invalid options, files that cannot be read or written, errors of training and of the runs.
pub fn run(
    options: &JobOptions,
    out: &mut impl Write,
    mut progress: impl FnMut(f64) + Send,
) -> anyhow::Result<()> {
    if let Some(BaseFlag::Corridor(kind)) = options.setting.base {
        return corridor::run(&in_corridor(options, kind)?, out, progress);
    }
    ensure!(
        options.hand_meets.is_none(),
        "--hand-meets applies to a base that drives: --base drives or both"
    );
    let period_ms = options.period_ms;
    ensure!(
        (0.1..=20.0).contains(&period_ms),
        "--period-ms must lie in 0.1..=20"
    );
    let fri = options.fri_bursts.map(|bursts| FaultConfig {
        bursts,
        stalls: options.fri_stalls,
        stamp_jitter_ms: options.fri_stamp_jitter_ms,
        seed: options.setting.seed,
        ..FaultConfig::default()
    });
    if fri.is_some() {
        ensure!(
            options.arm_level == ArmLevel::Servo,
            "--fri-bursts excludes --arm-level torque: the arm behind FRI is commanded by positions"
        );
        ensure!(
            period_ms.fract() == 0.0 && (1.0..=10.0).contains(&period_ms),
            "--fri-bursts with --period-ms {period_ms}: FRI has periods of 1 to 10 whole milliseconds"
        );
    }
    ensure!(
        !(options.setting.gestures && options.mcap.is_some()),
        "--gestures excludes --mcap: a replay does not learn gestures"
    );
    ensure!(
        !(options.setting.gestures && options.setting.hand.is_some()),
        "--gestures excludes --hand: a recording does not say what the hand did"
    );
    let outputs = Outputs {
        folder: &options.out,
        json: options.json.as_deref(),
        glb: options.glb,
        mcap: options.mcap.as_deref(),
    };
    let inputs = FilePlan::default()
        .read_scene("--scene", options.setting.scene.scene.as_deref())
        .read("--hand", options.setting.hand.as_deref())
        .read_arm("--arm", &options.arm.name);
    outputs.prepare(inputs)?;
    let arm = BoardArm::named(options.arm.clone(), &Board::default())?;
    let dynamics = options.arm_level.object_command(&arm);
    dynamics.context("--arm-level torque needs the masses of the arm's links")?;
    let setting = Setting::new(&arm, &options.setting)?;
    let scene = &setting.scene;
    let (predictors, learnt) =
        Predictors::train(scene, &arm, &setting.training_people, options.predictor)?;
    let predictors = predictors.with_adapting(options.adapt == Adapt::On);
    for remark in setting.remarks.iter().chain([&learnt]) {
        note(remark);
    }
    let began = Instant::now();
    let likely = setting.likely_touches.clone();
    let walls = arm.walls_of(scene, likely, !options.plain)?;
    let mapping = began.elapsed();
    let people = &setting.training_people;
    let scenery = Scenery::of(scene, &arm, &walls, people).textured(!options.plain);
    let (predictors, learnt) = responses::taught(predictors, &scenery)?;
    if let Some(remark) = learnt {
        note(remark);
    }
    let gestures = options.setting.gestures;
    let gestures = gestures.then(|| gestures::model(&scenery)).transpose()?;
    let stage = Stage {
        level: options.arm_level,
        gestures: gestures.as_ref(),
        fri,
        explain: options.explain,
        ..Stage::of(&scenery, &predictors, 1e-3 * options.period_ms)
    };
    let file = options.setting.scene.file();
    let recorder = options.mcap.as_deref();
    let recorder =
        recorder.map(|path| recording::of_stage(path, &stage, &setting, file, &options.arm));
    let mut recorder = recorder.transpose()?;
    let runs = people::run_recorded(
        &stage,
        &setting.participants,
        recorder.as_mut(),
        &mut progress,
    )?;
    if let (Some(recorder), Some(path)) = (recorder, &options.mcap) {
        writeln!(out, "{}", recording::finish(recorder, path)?)?;
    }
    for (stop, count) in Summary::new(&runs).stops {
        let touches = counted(count, "touch", "touches");
        note(format_args!("the arm was stopped before {touches}: {stop}"));
    }
    let table = outputs::text(&runs, &walls.maps, mapping)?;
    writeln!(out, "{table}")?;
    let written = outputs.write(&table, &runs, &stage, setting.participants[0].hand.span_s())?;
    writeln!(out, "{written}")?;
    Ok(())
}

/// Checks that only flags valid in a corridor are given.
///
/// # Errors
/// A flag that a corridor does not support.
fn in_corridor(options: &JobOptions, kind: BaseKind) -> anyhow::Result<CorridorRequest> {
    let setting = &options.setting;
    for (flag, given) in [
        ("--scene", setting.scene.scene.is_some()),
        ("--hand", setting.hand.is_some()),
        ("--base-from", setting.base_from.is_some()),
        ("--place", setting.place.is_some()),
        ("--gestures", setting.gestures),
        ("--hand-origin", setting.hand_origin.is_some()),
        ("--fri-bursts", options.fri_bursts.is_some()),
        ("--explain", options.explain.is_some()),
        ("--glb", options.glb),
        ("--mcap", options.mcap.is_some()),
        ("--arm-level torque", options.arm_level != ArmLevel::Servo),
        ("--adapt off", options.adapt == Adapt::Off),
        ("--plain", options.plain),
        ("--period-ms", options.period_ms != 1.0),
    ] {
        let name = kind.name();
        ensure!(
            !given,
            "--base {name} excludes {flag}: the corridor has its own rooms, walker and files"
        );
    }
    ensure!(
        options.predictor != Some(PredictorKind::EndToEnd),
        "--base {} excludes --predictor end-to-end: its joints are learnt for walls that stand still before the arm",
        kind.name()
    );
    let hand_meets = options.hand_meets;
    ensure!(
        hand_meets.is_none_or(|most| (0.0..=0.3).contains(&most)),
        "--hand-meets must lie in 0..=0.3 m/s"
    );
    Ok(CorridorRequest {
        kind,
        arm: options.arm.clone(),
        person: setting.person,
        touches: setting.touches as usize,
        seed: setting.seed,
        predictor: options.predictor,
        hand_meets_m_per_s: options.hand_meets,
        out: options.out.clone(),
        json: options.json.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    /// Regression: predictors were trained before these were refused.
    #[test]
    fn options_that_exclude_each_other_are_refused_before_the_work() {
        for (words, why) in [
            (
                "--fri-bursts 0.02 --arm-level torque",
                "commanded by positions",
            ),
            ("--fri-bursts 0.02 --period-ms 2.5", "whole milliseconds"),
            ("--period-ms 21", "--period-ms must lie in"),
            ("--hand-meets 0.2", "--base drives or both"),
            ("--gestures --mcap a.mcap", "--gestures excludes --mcap"),
            ("--gestures --hand a.csv", "--gestures excludes --hand"),
        ] {
            // No work is done: the scene does not exist.
            let words = words.split(' ').chain(["--scene", "nowhere.obj"]);
            let job = JobOptions::parse_from([""].into_iter().chain(words));
            let refused = run(&job, &mut Vec::new(), |_| {}).unwrap_err();
            assert!(format!("{refused:#}").contains(why), "{refused:#}");
        }
        for flags in [
            "--scene nowhere.obj",
            "--hand nowhere.csv",
            "--place none",
            "--gestures",
            "--predictor end-to-end",
            "--hand-origin 0,0,0,0",
            "--fri-bursts 0.02",
            "--explain",
            "--glb",
            "--mcap nowhere.mcap",
            "--arm-level torque",
            "--adapt off",
            "--plain",
            "--period-ms 2",
            "--period-ms nan",
        ] {
            let words = ["", "--base", "drives"].into_iter();
            let job = JobOptions::parse_from(words.chain(flags.split(' ')));
            let refused = run(&job, &mut Vec::new(), |_| {}).unwrap_err().to_string();
            let flag = flags.split(' ').next().unwrap();
            assert!(
                refused.contains(&format!("drives excludes {flag}")),
                "{refused}"
            );
        }
        for speed in ["0.31", "-0.1", "nan"] {
            let words = ["", "--base", "both", "--hand-meets", speed];
            let refused = run(&JobOptions::parse_from(words), &mut Vec::new(), |_| {});
            let refused = refused.unwrap_err().to_string();
            assert!(refused.contains("--hand-meets must lie in"), "{refused}");
        }
        for (words, why) in [
            ("--fri-bursts -0.1", "--fri-bursts"),
            ("--fri-bursts 2", "from 0 to 1"),
            ("--fri-bursts 0.02 --fri-stalls nan", "from 0 to 1"),
            ("--fri-bursts 0.02 --fri-stamp-jitter-ms 51", "from 0 to 50"),
        ] {
            let words = [""].into_iter().chain(words.split(' '));
            let refused = JobOptions::try_parse_from(words).unwrap_err().to_string();
            assert!(refused.contains(why), "{refused}");
        }
    }
}
