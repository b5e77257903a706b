//! The runs of the study.

use crate::environment::journey::{self, Journey};
use crate::environment::modes::{self, Mode};
use crate::environment::outcome::Touch;
use crate::environment::presenter::{Course, Presenter};
use crate::environment::{gym, speed};
use glam::DVec3;
use hwall_arrival::{
    BoardExtent, Surfaces, WaitingConfig, WaitingPosture, WeightedTarget, waiting_posture,
};
use hwall_haptics::{Board, PlaceTolerance};
use hwall_motion::{MotionConfig, MotionLimits};
use hwall_reachability::Target;
use hwall_redirection::{ReachThresholds, SampledOrientations};
use hwall_scene::Scene;
use hwall_stage::input::arms::BoardArm;
use hwall_stage::run::least_time::LeastTime;
use hwall_stage::setting::load_scene;
use rayon::prelude::*;
use std::path::PathBuf;

/// What is asked for.
#[derive(Debug, Clone)]
pub struct Request {
    /// Touches, the same in every mode.
    pub touches: usize,
    /// Seed of the gym and of the person.
    pub seed: u64,
    /// OBJ file; `None`: a gym of the seed.
    pub scene: Option<PathBuf>,
    /// `iiwa7` or `iiwa14`.
    pub arm: String,
    /// The orientations for which there are maps.
    pub orientations: SampledOrientations,
}

/// What became of the touches in one mode.
#[derive(Debug, Clone)]
pub struct Row {
    /// How orientations are presented.
    pub mode: Mode,
    /// May the hand be shifted?
    pub shifted: bool,
    /// The touches in order.
    pub touches: Vec<Touch>,
}

/// The whole study.
#[derive(Debug)]
pub struct Results {
    /// One for each mode without shifts, then one for each with.
    pub rows: Vec<Row>,
    /// Where the arm waits.
    pub waiting: WaitingPosture,
    /// What a scene holds and how far the avatar went.
    pub journey: String,
    /// What single steps cost.
    pub speed: Vec<speed::Cost>,
    /// What the loader had to repair.
    pub remarks: Vec<String>,
    pub(super) scene: Scene,
    pub(super) way: Journey,
}

/// The people who tell where the arm waits have another seed than those who are judged.
const REHEARSAL: u64 = 0x7265_6865_6172_7361;
const REHEARSED: usize = 120;

/// Draws the environment and the person, and judges every touch in every mode.
///
/// # Errors
/// A scene that cannot be read or has no wall to go to; an arm that reaches none of the places.
pub fn run(request: &Request) -> anyhow::Result<Results> {
    let (scene, remarks) = match &request.scene {
        Some(path) => load_scene(Some(path))?,
        None => (gym::of_seed(request.seed)?, Vec::new()),
    };
    let board = Board::default();
    let arm = BoardArm::named(&request.arm, &board)?;
    let limits = MotionLimits::of_arm(&**arm.kinematics(), &MotionConfig::default())?;
    let waiting = rehearsed(&scene, &arm, &board, &limits, request)?;
    let way = journey::of_seed(&scene, request.touches, request.seed)?;
    let presenter = |shifted: bool| -> anyhow::Result<Presenter<'_>> {
        Ok(Presenter {
            arm: &arm,
            least: LeastTime::new(&arm, &board, &PlaceTolerance::default(), limits)?,
            waiting: waiting.q,
            thresholds: shifted.then(ReachThresholds::default),
        })
    };
    let kinds: Vec<(Mode, bool)> = [false, true]
        .into_iter()
        .flat_map(|shifted| Mode::ALL.map(|mode| (mode, shifted)))
        .collect();
    let rows: anyhow::Result<Vec<Row>> = kinds
        .par_iter()
        .map(|&(mode, shifted)| {
            let presenter = presenter(shifted)?;
            let placed = modes::placed(&scene, &way, &request.orientations, mode)?;
            let mut course: Course = presenter.course();
            let touches: anyhow::Result<Vec<Touch>> = placed
                .iter()
                .zip(&way.encounters)
                .map(|(placed, encounter)| presenter.present(&mut course, placed, encounter))
                .collect();
            Ok(Row {
                mode,
                shifted,
                touches: touches?,
            })
        })
        .collect();
    let speed = speed::costs(&scene, &way, &arm, &presenter(true)?.least, waiting.q)?;
    let journey = described(request, &scene, &way);
    Ok(Results {
        rows: rows?,
        waiting,
        journey,
        speed,
        remarks,
        scene,
        way,
    })
}

/// The waiting posture for touches such as another person makes here.
fn rehearsed(
    scene: &Scene,
    arm: &BoardArm,
    board: &Board,
    limits: &MotionLimits,
    request: &Request,
) -> anyhow::Result<WaitingPosture> {
    let journey = journey::of_seed(scene, REHEARSED, request.seed ^ REHEARSAL)?;
    let placed = modes::placed(scene, &journey, &request.orientations, Mode::Exact)?;
    let target = |point_m: DVec3, normal: DVec3| WeightedTarget::from(Target { point_m, normal });
    let targets: Vec<WeightedTarget> = placed
        .iter()
        .map(|placed| target(placed.point_m, placed.normal))
        .collect();
    let Some(srs) = arm.closed_form() else {
        anyhow::bail!(
            "--arm {}: this study needs an arm with a closed form",
            request.arm
        );
    };
    let board = BoardExtent {
        half_width_m: board.half_width_m,
        half_height_m: board.half_height_m,
    };
    let config = WaitingConfig::default();
    let surfaces = Surfaces::default();
    Ok(waiting_posture(
        srs, &targets, &surfaces, board, limits, &config,
    )?)
}

fn described(request: &Request, scene: &Scene, way: &Journey) -> String {
    let bounds = scene.bounds();
    let size = bounds.max_m - bounds.min_m;
    let what = match &request.scene {
        Some(path) => path.file_name().map_or("the scene".to_owned(), |name| {
            name.to_string_lossy().into_owned()
        }),
        None => format!("the gym of seed {}", request.seed),
    };
    let minutes = way.encounters.last().map_or(0.0, |e| e.leaves_s / 60.0);
    let joystick = way.length_m;
    format!(
        "{} touches in {what}, {:.1} x {:.1} m with {} surfaces; the avatar travels {joystick:.0} m in {minutes:.1} minutes, the \
         person stays within 0.2 m of one place before the arm ({})",
        way.encounters.len(),
        size.x,
        size.y,
        scene.surfaces().len(),
        request.arm
    )
}
