//! The main job: from its options to its tables, figures and recordings.

use crate::console::note;
use crate::corridor;
use crate::input::arms::BoardArm;
use crate::input::base_flag::{BaseFlag, BaseKind};
use crate::input::file_plan::FilePlan;
use crate::input::numbers::counted;
use crate::job_options::Adapt;
use crate::person::gestures;
use crate::person::predictors::{PredictorKind, Predictors};
use crate::person::responses::{self, Scenery};
use crate::recording;
use crate::report::outputs;
use crate::report::summary::Summary;
use crate::run::people;
use crate::run::simulated_arm::ArmLevel;
use crate::run::stage::Stage;
use crate::setting::Setting;
use anyhow::{Context, ensure};
use hwall_fri::controller::FaultConfig;
use hwall_haptics::Board;
use std::io::Write;
use std::time::Instant;

pub use crate::job_options::JobOptions;

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
        check_in_corridor(options, kind)?;
        return corridor::run(options, kind, out, progress);
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
    let inputs = FilePlan::default()
        .read_scene("--scene", options.setting.scene.scene.as_deref())
        .read("--hand", options.setting.hand.as_deref())
        .read_arm("--arm", &options.arm.name);
    outputs::prepare(options, inputs)?;
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
    let written = outputs::write(
        options,
        &table,
        &runs,
        &stage,
        setting.participants[0].hand.span_s(),
    )?;
    writeln!(out, "{written}")?;
    Ok(())
}

/// Checks that only flags valid in a corridor are given.
///
/// # Errors
/// A flag that a corridor does not support.
fn check_in_corridor(options: &JobOptions, kind: BaseKind) -> anyhow::Result<()> {
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
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    /// Regression: predictors were trained before these were refused.
    #[test]
    fn options_that_exclude_each_other_are_refused_before_the_work() {
        let refused = |line: &str, why: &str| {
            let words = [""].into_iter().chain(line.split(' '));
            let refused = run(&JobOptions::parse_from(words), &mut Vec::new(), |_| {});
            let said = format!("{:#}", refused.unwrap_err());
            assert!(said.contains(why), "{line}: {said}");
        };
        let positions = "commanded by positions";
        for (line, why) in [
            ("--fri-bursts 0.02 --arm-level torque", positions),
            ("--fri-bursts 0.02 --period-ms 2.5", "whole milliseconds"),
            ("--period-ms 21", "--period-ms must lie in"),
            ("--hand-meets 0.2", "--base drives or both"),
            ("--gestures --mcap a.mcap", "--gestures excludes --mcap"),
            ("--gestures --hand a.csv", "--gestures excludes --hand"),
        ] {
            // No work is done: the scene does not exist.
            refused(&format!("{line} --scene nowhere.obj"), why);
        }
        let excluded = "--scene nowhere.obj, --hand nowhere.csv, --place none, --gestures, --predictor end-to-end, \
                        --hand-origin 0,0,0,0, --fri-bursts 0.02, --explain, --glb, --mcap nowhere.mcap, \
                        --arm-level torque, --adapt off, --plain, --period-ms 2, --period-ms nan";
        for flags in excluded.split(", ") {
            let flag = flags.split(' ').next().unwrap();
            let why = format!("drives excludes {flag}");
            refused(&format!("--base drives {flags}"), &why);
        }
        for speed in ["0.31", "-0.1", "nan"] {
            let line = format!("--base both --hand-meets {speed}");
            refused(&line, "--hand-meets must lie in");
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
