//! The options of the main job.

use crate::input::arms::NamedArm;
use crate::input::numbers::up_to;
use crate::person::predictors::PredictorKind;
use crate::run::simulated_arm::ArmLevel;
use crate::setting::SettingFlags;
use clap::ValueEnum;
use std::path::PathBuf;

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
