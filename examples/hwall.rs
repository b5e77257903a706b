//! The main job: a simulated iiwa 7 carries a board to the wall that a hand is about to touch.
//!
//! `cargo run --release --example hwall`

use clap::{Parser, ValueEnum};
use hwall_haptics::Board;
use hwall_stage::exit;
use hwall_stage::input::arms::BoardArm;
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::input::floor_pose::FloorPose;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::person::predictors::{PredictorKind, Predictors};
use hwall_stage::recording;
use hwall_stage::report::outputs::{self, Outputs};
use hwall_stage::run::people::{self, Stage};
use hwall_stage::run::simulated_arm::ArmLevel;
use hwall_stage::setting::{Setting, SettingOptions};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// A simulated arm presents a board where a hand is about to touch a virtual wall.
///
/// Without options: a room made for this, a simulated person and twelve touches, foreseen by what
/// other simulated people taught. Prints four tables; writes plan.svg, time.svg, replay.html (open it in a browser), touch.svg, table.md and touches.csv to the output folder.
/// More than twelve touches are made by several people, each in a run of their own; figures and lists are then of the first.
#[derive(Parser)]
struct Args {
    /// OBJ scene, z up, metres; a sidecar of the same name with .toml says which surface is what [default: the built-in room]
    #[arg(long)]
    scene: Option<PathBuf>,
    /// CSV recording of a hand: t in seconds, palm_x.. little_z in metres, optionally head_* and gaze_*; cells may be empty [default: a simulated person]
    #[arg(long)]
    hand: Option<PathBuf>,
    /// Axes of the recording: y-up as headsets have it, or z-up
    #[arg(long, value_enum, default_value = "y-up")]
    axes: Axes,
    /// auto: stand arm and recording before the nearest suitable wall; none: as --base and --hand-origin say [default: auto with --hand, else none]
    #[arg(long, value_enum)]
    place: Option<Place>,
    /// The arm's base in the scene: x,y,z in metres, yaw in degrees about z, counter-clockwise from the scene's x axis; with auto placing the nearest wall to it is taken [default: 0,0,0,0 without auto placing]
    #[arg(long, value_parser = FloorPose::parse, allow_hyphen_values = true)]
    base: Option<FloorPose>,
    /// arrival: stand the arm's base near the origin of the scene where most touches are in time; takes a minute and a half
    #[arg(long, value_enum, conflicts_with_all = ["base", "hand"])]
    base_from: Option<BaseFrom>,
    /// Origin of the recording (z up) in the scene: x,y,z in metres, yaw in degrees [default: 0,0,0,0 without auto placing]
    #[arg(long, value_parser = FloorPose::parse, allow_hyphen_values = true)]
    hand_origin: Option<FloorPose>,
    /// The recorded hand is made up: a shape that never changes is no frozen tracker
    #[arg(long)]
    rigid_hand: bool,
    /// iiwa7, iiwa14, or PATH.urdf of an arm with at most seven joints
    #[arg(long, default_value = "iiwa7")]
    arm: String,
    /// servo: joint targets with a delay, doors rendered by positions; torque: rigid bodies, friction and sensors, doors rendered by torques
    #[arg(long, value_enum, default_value_t)]
    arm_level: ArmLevel,
    /// Who leads the board; all three are compared [default: fused, or ray-led where there is nobody to learn from]
    #[arg(long, value_enum)]
    predictor: Option<PredictorKind>,
    /// The board presents no roughness: it may be rolled as suits the arm, and stands still while touched
    #[arg(long)]
    plain: bool,
    /// What simulated people are like
    #[arg(long, value_enum, default_value_t, conflicts_with = "hand")]
    person: PersonKind,
    /// Touches of the simulated people: one makes a dozen, for more there are more people
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    touches: u64,
    /// Seed of the simulated people and the sensors' noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Control period in milliseconds, 0.1 to 20
    #[arg(long, default_value_t = 1.0)]
    period_ms: f64,
    /// Output folder
    #[arg(long, default_value = "out/hwall")]
    out: PathBuf,
    /// Also writes hwall.glb, the animation for Blender and other viewers
    #[arg(long)]
    glb: bool,
    /// Also writes every touch and a summary to this file. In the summary `reachable`, `possible` and `in_place` count touches
    /// (in_place: of the reachable ones), in_place_of_possible is the share of the possible ones that were in place, 0 to 1;
    /// gap_p90_m is of the reachable ones, felt_median_s of those that were felt; what does not exist is null
    #[arg(long)]
    json: Option<PathBuf>,
    /// Also records all runs to this file, for Foxglove, Rerun and --replay; the arm's capsules as URDF beside it
    #[arg(long)]
    mcap: Option<PathBuf>,
    /// Runs the sessions of such a file again instead, and compares every command bit by bit
    #[arg(long, exclusive = true)]
    replay: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Axes {
    YUp,
    ZUp,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Place {
    Auto,
    None,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum BaseFrom {
    Arrival,
}

fn main() -> ExitCode {
    exit(run(&Args::parse()))
}

fn run(args: &Args) -> anyhow::Result<()> {
    if let Some(path) = &args.replay {
        return recording::replay(path, &mut io::stdout());
    }
    anyhow::ensure!(
        (0.1..=20.0).contains(&args.period_ms),
        "--period-ms must lie in 0.1..=20"
    );
    let outputs = Outputs {
        folder: &args.out,
        json: args.json.as_deref(),
        glb: args.glb,
        mcap: args.mcap.as_deref(),
    };
    let inputs = FilePlan::default()
        .read_scene("--scene", args.scene.as_deref())
        .read("--hand", args.hand.as_deref())
        .read_arm("--arm", &args.arm);
    outputs.prepare(inputs)?;
    let board = Board::default();
    let arm = BoardArm::named(&args.arm, &board)?;
    let setting = Setting::new(
        &arm,
        &SettingOptions {
            scene: args.scene.as_deref(),
            hand: args.hand.as_deref(),
            y_up: args.axes == Axes::YUp,
            rigid_hand: args.rigid_hand,
            auto: args.place.map_or(args.hand.is_some(), |p| p == Place::Auto),
            base: args.base,
            base_by_arrival: args.base_from.is_some(),
            hand_origin: args.hand_origin,
            person: args.person,
            touches: args.touches as usize,
            seed: args.seed,
        },
    )?;
    let scene = &setting.scene;
    let (predictors, learnt) =
        Predictors::train(scene, &arm, &setting.training_people, args.predictor)?;
    for remark in setting.remarks.iter().chain([&learnt]) {
        eprintln!("{remark}");
    }
    let bar =
        ProgressBar::new(1000).with_style(ProgressStyle::with_template("{wide_bar} {percent} %")?);
    let began = Instant::now();
    let likely = setting.likely_touches.clone();
    let walls = arm.walls_of(scene, &board, likely, !args.plain)?;
    let mapping = began.elapsed();
    let stage = Stage {
        arm: &arm,
        board: &board,
        scene,
        walls: &walls,
        predictors: &predictors,
        textured: !args.plain,
        level: args.arm_level,
        period_s: 1e-3 * args.period_ms,
    };
    let scene_path = args.scene.as_deref();
    let recorder = args.mcap.as_deref();
    let recorder =
        recorder.map(|path| recording::of_stage(path, &stage, &setting, scene_path, &args.arm));
    let mut recorder = recorder.transpose()?;
    let runs = people::run_recorded(&stage, &setting.participants, recorder.as_mut(), |share| {
        bar.set_position((1000.0 * share) as u64);
    })?;
    bar.finish_and_clear();
    if let (Some(recorder), Some(path)) = (recorder, &args.mcap) {
        writeln!(io::stdout(), "{}", recording::finish(recorder, path)?)?;
    }
    let table = outputs::text(&runs, &walls.maps, mapping)?;
    writeln!(io::stdout(), "{table}")?;
    let written = outputs.write(&table, &runs, &stage, setting.participants[0].hand.span_s())?;
    writeln!(io::stdout(), "{written}")?;
    Ok(())
}
