//! The main job: from its options to its tables, figures and recordings.

use crate::console::note;
use crate::input::arms::{BoardArm, NamedArm};
use crate::input::file_plan::FilePlan;
use crate::input::floor_pose::FloorPose;
use crate::input::numbers::{counted, whole_within};
use crate::input::recording_units::RecordingUnits;
use crate::input::scene_file::SceneFlags;
use crate::person::kinds::PersonKind;
use crate::person::predictors::{PredictorKind, Predictors};
use crate::person::responses::{self, Scenery};
use crate::recording;
use crate::report::outputs::{self, Outputs};
use crate::report::summary::Summary;
use crate::run::people::{self, Stage};
use crate::run::simulated_arm::ArmLevel;
use crate::setting::{Setting, SettingOptions};
use anyhow::{Context, ensure};
use clap::ValueEnum;
use hwall_fri::controller::FaultConfig;
use hwall_haptics::Board;
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

/// What to do, as flags of a command line.
#[derive(Debug, Clone, clap::Args)]
pub struct JobOptions {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneFlags,
    /// CSV recording of a hand: t in seconds (or --time-unit), palm_x.. little_z in metres (or --hand-scale), optionally head_* and gaze_*; cells may be empty [default: a simulated person]
    #[arg(long, group = "recorded")]
    pub hand: Option<PathBuf>,
    /// Which trial of a recording that holds several: its name in the column trial, or person/trial
    #[arg(long, requires = "hand", value_name = "NAME")]
    pub trial: Option<String>,
    /// Units of the recording.
    #[command(flatten)]
    pub units: RecordingUnits,
    /// Axes of the recording: y-up as headsets have it, or z-up
    #[arg(long, value_enum, default_value = "y-up")]
    pub axes: Axes,
    /// auto: stand arm and recording before the nearest suitable wall; none: as --base and --hand-origin say [default: auto with --hand, else none]
    #[arg(long, value_enum)]
    pub place: Option<Place>,
    /// The arm's base in the scene: x,y,z in metres, yaw in degrees about z, counter-clockwise from the scene's x axis; with auto placing the nearest wall to it is taken [default: 0,0,0,0 without auto placing]
    #[arg(long, value_parser = FloorPose::parse, allow_hyphen_values = true)]
    pub base: Option<FloorPose>,
    /// arrival: stand the arm's base near the origin of the scene where most touches are in time; takes a minute and a half
    #[arg(long, value_enum, conflicts_with_all = ["base", "hand"])]
    pub base_from: Option<BaseFrom>,
    /// Origin of the recording (z up) in the scene: x,y,z in metres, yaw in degrees [default: 0,0,0,0 without auto placing]
    #[arg(long, value_parser = FloorPose::parse, allow_hyphen_values = true)]
    pub hand_origin: Option<FloorPose>,
    /// The recorded hand is made up: a shape that never changes is no frozen tracker
    #[arg(long, requires = "hand")]
    pub rigid_hand: bool,
    /// The arm.
    #[command(flatten)]
    pub arm: NamedArm,
    /// servo: joint targets with a delay, doors rendered by positions; torque: rigid bodies, friction and sensors, doors rendered by torques
    #[arg(long, value_enum, default_value_t)]
    pub arm_level: ArmLevel,
    /// The arm is behind FRI, and this share of the cycles begins a burst of one to four commands that do not arrive; holds and losses are told on standard error
    #[arg(long, allow_negative_numbers = true)]
    pub fri_bursts: Option<f64>,
    /// With --fri-bursts: share of the cycles that begin a stall of 20 to 200 ms, in which no command arrives
    #[arg(
        long,
        default_value_t = 0.0,
        requires = "fri_bursts",
        allow_negative_numbers = true
    )]
    pub fri_stalls: f64,
    /// With --fri-bursts: the controller's time stamps are off by at most this, ms
    #[arg(
        long,
        default_value_t = 0.0,
        requires = "fri_bursts",
        allow_negative_numbers = true
    )]
    pub fri_stamp_jitter_ms: f64,
    /// Who leads the board; the first three are always compared, the last one if it leads [default: fused, or ray-led where there is nobody to learn from]
    #[arg(long, value_enum)]
    pub predictor: Option<PredictorKind>,
    /// on: the predictor learns from every touch that the board feels; off: it stays as trained
    #[arg(long, value_enum, default_value_t)]
    pub adapt: Adapt,
    /// The board presents no roughness: it may be rolled as suits the arm, and stands still while touched
    #[arg(long)]
    pub plain: bool,
    /// What simulated people are like
    #[arg(long, value_enum, default_value_t, conflicts_with = "hand")]
    pub person: PersonKind,
    /// Touches of the simulated people: one makes a dozen, for more there are more people
    #[arg(long, default_value_t = 12, conflicts_with = "hand", value_parser = whole_within::<1, 100_000>, allow_negative_numbers = true)]
    pub touches: u64,
    /// Seed of the simulated people and the sensors' noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u64,
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
    /// (in_place: of the reachable ones), in_place_of_possible is the share of the possible ones that were in place, 0 to 1;
    /// gap_p90_m is of the reachable ones, felt_median_s of those of them that were felt; what does not exist is null
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Also records all runs to this file, for Foxglove, Rerun and --replay; the arm's capsules as URDF beside it
    #[arg(long)]
    pub mcap: Option<PathBuf>,
}

/// Axes of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Axes {
    /// y up, as headsets have it
    YUp,
    /// z up
    ZUp,
}

/// Does the predictor learn from touches?
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Adapt {
    /// From each that the board feels
    #[default]
    On,
    /// Never
    Off,
}

/// Who places arm and recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Place {
    /// The program
    Auto,
    /// The flags
    None,
}

/// What decides on the base.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BaseFrom {
    /// How many touches are in time
    Arrival,
}

/// Does the job: the tables go to `out`, what should be known about them to standard error, everything else into files.
/// `progress` hears how much is done, 0 to 1.
///
/// # Errors
/// Options that make no sense, files that cannot be read or written, whatever training and the runs refuse.
pub fn run(
    options: &JobOptions,
    out: &mut impl Write,
    mut progress: impl FnMut(f64),
) -> anyhow::Result<()> {
    let period_ms = options.period_ms;
    ensure!(
        (0.1..=20.0).contains(&period_ms),
        "--period-ms must lie in 0.1..=20"
    );
    let fri = options.fri_bursts.map(|bursts| FaultConfig {
        bursts,
        stalls: options.fri_stalls,
        stamp_jitter_ms: options.fri_stamp_jitter_ms,
        seed: options.seed,
        ..FaultConfig::default()
    });
    if let Some(faults) = &fri {
        ensure!(
            options.arm_level == ArmLevel::Servo,
            "--fri-bursts excludes --arm-level torque: the arm behind FRI is commanded by positions"
        );
        ensure!(
            period_ms.fract() == 0.0 && (1.0..=10.0).contains(&period_ms),
            "--fri-bursts with --period-ms {period_ms}: FRI has periods of 1 to 10 whole milliseconds"
        );
        (faults.validate()).context("--fri-bursts, --fri-stalls, --fri-stamp-jitter-ms")?;
    }
    let outputs = Outputs {
        folder: &options.out,
        json: options.json.as_deref(),
        glb: options.glb,
        mcap: options.mcap.as_deref(),
    };
    let inputs = FilePlan::default()
        .read_scene("--scene", options.scene.scene.as_deref())
        .read("--hand", options.hand.as_deref())
        .read_arm("--arm", &options.arm.name);
    outputs.prepare(inputs)?;
    let board = Board::default();
    let arm = BoardArm::named(options.arm.clone(), &board)?;
    let dynamics = options.arm_level.object_command(&arm, &board);
    dynamics.context("--arm-level torque needs the masses of the arm's links")?;
    let setting = Setting::new(
        &arm,
        &SettingOptions {
            scene: options.scene.file(),
            hand: options.hand.as_deref(),
            trial: options.trial.as_deref(),
            units: options.units,
            y_up: options.axes == Axes::YUp,
            rigid_hand: options.rigid_hand,
            auto: options
                .place
                .map_or(options.hand.is_some(), |p| p == Place::Auto),
            base: options.base,
            base_by_arrival: options.base_from.is_some(),
            hand_origin: options.hand_origin,
            person: options.person,
            touches: options.touches as usize,
            seed: options.seed,
        },
    )?;
    let scene = &setting.scene;
    let (predictors, learnt) =
        Predictors::train(scene, &arm, &setting.training_people, options.predictor)?;
    let predictors = predictors.with_adapting(options.adapt == Adapt::On);
    for remark in setting.remarks.iter().chain([&learnt]) {
        note(remark);
    }
    let began = Instant::now();
    let likely = setting.likely_touches.clone();
    let walls = arm.walls_of(scene, &board, likely, !options.plain)?;
    let mapping = began.elapsed();
    let scenery = Scenery {
        scene,
        arm: &arm,
        board: &board,
        walls: &walls,
        people: &setting.training_people,
        textured: !options.plain,
    };
    let (predictors, learnt) = responses::taught(predictors, &scenery)?;
    if let Some(remark) = learnt {
        eprintln!("{remark}");
    }
    let stage = Stage {
        arm: &arm,
        board: &board,
        scene,
        walls: &walls,
        predictors: &predictors,
        textured: !options.plain,
        level: options.arm_level,
        fri,
        period_s: 1e-3 * options.period_ms,
    };
    let scene_file = options.scene.file();
    let recorder = options.mcap.as_deref();
    let recorder =
        recorder.map(|path| recording::of_stage(path, &stage, &setting, scene_file, &options.arm));
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

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Program {
        #[command(flatten)]
        job: JobOptions,
    }

    /// The predictors were trained before these were refused.
    #[test]
    fn options_that_exclude_each_other_are_refused_before_the_work() {
        for (words, why) in [
            (
                "--fri-bursts 0.02 --arm-level torque",
                "commanded by positions",
            ),
            ("--fri-bursts 0.02 --period-ms 2.5", "whole milliseconds"),
            ("--fri-bursts 2", "between 0 and 1"),
            ("--fri-bursts 0.02 --fri-stalls nan", "between 0 and 1"),
        ] {
            // No work: the scene is not there.
            let words = words.split(' ').chain(["--scene", "nowhere.obj"]);
            let job = Program::parse_from([""].into_iter().chain(words)).job;
            let refused = run(&job, &mut Vec::new(), |_| {}).unwrap_err();
            assert!(format!("{refused:#}").contains(why), "{refused:#}");
        }
    }
}
