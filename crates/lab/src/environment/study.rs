//! The runs of the study.

use crate::environment::journey::{self, Journey};
use crate::environment::modes::{self, BASE_ABOVE_FLOOR_M, Mode, Placed};
use crate::environment::outcome::Touch;
use crate::environment::presenter::{self, Presenter};
use crate::environment::{gym, speed};
use crate::reach::arrival::extent;
use crate::report::quantiles;
use glam::DVec3;
use hwall_arrival::{Surfaces, WaitingConfig, WaitingPosture, WeightedTarget, waiting_posture};
use hwall_haptics::{Board, PlaceTolerance};
use hwall_motion::{MotionConfig, MotionLimits};
use hwall_reachability::{Interval, Target, WallFacet};
use hwall_redirection::{ReachThresholds, SampledOrientations};
use hwall_scene::Scene;
use hwall_stage::input::arms::BoardArm;
use hwall_stage::numbers::counted;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::run::judged::least_time::LeastTime;
use hwall_stage::setting::load_scene;
use hwall_testkit::Timing;
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
    /// Kinds of people, in the order of the tables; their pace is what counts here.
    pub people: Vec<PersonKind>,
    /// `iiwa7` or `iiwa14`.
    pub arm: String,
    /// The orientations for which there are maps.
    pub orientations: SampledOrientations,
}

/// What became of the touches in one mode.
#[derive(Debug, Clone)]
pub struct Row {
    /// Who touches.
    pub person: PersonKind,
    /// How orientations are presented.
    pub mode: Mode,
    /// May the hand be shifted?
    pub shifted: bool,
    /// Index of the journey.
    pub(super) way: usize,
    /// The touches in order.
    pub touches: Vec<Touch>,
}

/// The whole study.
#[derive(Debug)]
pub struct Results {
    /// For each kind of people one for each mode without shifts, then one for each with.
    pub rows: Vec<Row>,
    /// Where the arm waits for each kind of people.
    pub waiting: Vec<WaitingPosture>,
    /// What a scene holds and how far the avatar went.
    pub journey: String,
    /// What single steps cost.
    pub speed: Vec<(&'static str, Timing)>,
    /// What the loader had to repair.
    pub remarks: Vec<String>,
    pub(super) scene: Scene,
    /// One for each kind of people.
    pub(super) ways: Vec<Journey>,
}

/// The people who tell where the arm waits have another seed than those who are judged.
const REHEARSAL: u64 = 0x7265_6865_6172_7361;
const REHEARSED: usize = 120;
/// Share of their walls that are nearer to the arm than the wall behind which it waits: behind all of them there is hardly
/// room for an arm.
const NEAREST: f64 = 0.5;
/// A waiting posture is not asked for less time than this, s.
const LEAST_BUDGET_S: f64 = 0.1;

/// Draws the environment and the person, and judges every touch in every mode.
///
/// # Errors
/// A scene that cannot be read or has no wall to go to; an arm that reaches none of the places.
pub fn run(request: &Request) -> anyhow::Result<Results> {
    let (scene, remarks) = match &request.scene {
        Some(path) => load_scene(Some(path.as_path().into()))?,
        None => (gym::of_seed(request.seed)?, Vec::new()),
    };
    let board = Board::default();
    let arm = BoardArm::named(request.arm.as_str(), &board)?;
    let limits = MotionLimits::of_arm(&**arm.kinematics(), &MotionConfig::default())?;
    let mut results = Results {
        rows: Vec::new(),
        waiting: Vec::new(),
        journey: String::new(),
        speed: Vec::new(),
        remarks,
        scene,
        ways: Vec::new(),
    };
    for (number, &person) in request.people.iter().enumerate() {
        let (touches, seed) = (request.touches, request.seed);
        let way = journey::of_seed(&results.scene, &person.config(), touches, seed)?;
        let waiting = rehearsed(&results.scene, &arm, &board, &limits, person, request)?;
        let presenter = |shifted: bool| -> anyhow::Result<Presenter<'_>> {
            Ok(Presenter {
                arm: &arm,
                least: LeastTime::new(&arm, &PlaceTolerance::default(), limits)?,
                waiting: waiting.q,
                thresholds: shifted.then(ReachThresholds::default),
            })
        };
        let both = [false, true].into_iter();
        let kinds = both.flat_map(|shifted| Mode::ALL.map(|mode| (mode, shifted)));
        let kinds: Vec<(Mode, bool)> = kinds.collect();
        let judged = |&(mode, shifted): &(Mode, bool)| -> anyhow::Result<Row> {
            let presenter = presenter(shifted)?;
            let placed = modes::placed(&results.scene, &way, &request.orientations, mode)?;
            let mut course = None;
            let touches = placed.iter().zip(&way.encounters);
            let touches = touches
                .map(|(placed, encounter)| presenter.present(&mut course, placed, encounter))
                .collect::<anyhow::Result<Vec<Touch>>>()?;
            Ok(Row {
                person,
                way: number,
                mode,
                shifted,
                touches,
            })
        };
        let rows: anyhow::Result<Vec<Row>> = kinds.par_iter().map(judged).collect();
        results.rows.extend(rows?);
        if results.ways.is_empty() {
            let least = &presenter(true)?.least;
            results.speed = speed::costs(&results.scene, &way, &arm, least, waiting.q)?;
            results.journey = described(request, &results.scene, &way);
        }
        results.waiting.push(waiting);
        results.ways.push(way);
    }
    Ok(results)
}

/// The waiting posture for touches such as another person makes here.
fn rehearsed(
    scene: &Scene,
    arm: &BoardArm,
    board: &Board,
    limits: &MotionLimits,
    person: PersonKind,
    request: &Request,
) -> anyhow::Result<WaitingPosture> {
    let seed = request.seed ^ REHEARSAL;
    let journey = journey::of_seed(scene, &person.config(), REHEARSED, seed)?;
    let placed = modes::placed(scene, &journey, &request.orientations, Mode::Exact)?;
    let target = |placed: &Placed| {
        let (point_m, normal) = (placed.point_m, placed.normal);
        WeightedTarget::from(Target { point_m, normal })
    };
    let targets: Vec<WeightedTarget> = placed.iter().map(target).collect();
    let Some(srs) = arm.closed_form() else {
        anyhow::bail!(
            "--arm {}: this study needs an arm with a closed form",
            request.arm
        );
    };
    let board = extent(board);
    let budgets = journey.encounters.iter().map(presenter::budget_s);
    let config = WaitingConfig {
        budget_s: quantiles(budgets, [0.5])[0].max(LEAST_BUDGET_S),
        // That wall stands for others: it tells where to wait, not which ways are free.
        blocked_s_per_m: 0.0,
        ..WaitingConfig::default()
    };
    // Nobody knows which wall comes next: the arm waits behind a wall across, as far as most that came.
    let distances = placed.iter().map(|p| p.normal.dot(p.point_m).max(0.0));
    let near_m = quantiles(distances, [NEAREST])[0];
    let corner = |y_m: f64| DVec3::new(near_m, y_m, 0.0);
    let facet = WallFacet {
        point_m: corner(0.0),
        normal: DVec3::X,
        heights: Interval::new(-BASE_ABOVE_FLOOR_M, 2.0),
        outline_m: vec![corner(-1.5), corner(1.5)],
    };
    let surfaces = Surfaces::from_facets(&[facet], config.clearance.margin_m)?;
    Ok(waiting_posture(
        srs, &targets, &surfaces, board, limits, &config,
    )?)
}

fn described(request: &Request, scene: &Scene, way: &Journey) -> String {
    let bounds = scene.bounds();
    let size = bounds.max_m - bounds.min_m;
    let name = request.scene.as_ref().map(|path| path.file_name());
    let what = match name {
        Some(name) => name.unwrap_or("the scene".as_ref()).to_string_lossy(),
        None => format!("the gym of seed {}", request.seed).into(),
    };
    let minutes = way.encounters.last().map_or(0.0, |e| e.leaves_s / 60.0);
    format!(
        "{} in {what}, {:.1} x {:.1} m with {}; the avatar travels {:.0} m in {minutes:.1} minutes, the \
         person stays within 0.3 m of one place before the arm ({})",
        counted(way.encounters.len(), "touch", "touches"),
        size.x,
        size.y,
        counted(scene.surfaces().len(), "surface", "surfaces"),
        way.length_m,
        request.arm
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::outcome::Outcome;

    #[test]
    fn outcomes_say_what_the_numbers_say_and_follow_from_the_seed() {
        let request = Request {
            touches: 10,
            seed: 5,
            scene: None,
            people: vec![PersonKind::Fast],
            arm: "iiwa7".to_owned(),
            orientations: SampledOrientations::default(),
        };
        let results = run(&request).unwrap();
        assert_eq!(results.rows.len(), 2 * Mode::ALL.len());
        let thresholds = ReachThresholds::default();
        for row in &results.rows {
            assert_eq!(row.touches.len(), 10);
            for touch in &row.touches {
                match (touch.outcome, touch.travel_s) {
                    (Outcome::InTime, Some(travel_s)) => assert!(travel_s <= touch.budget_s),
                    (Outcome::Late, Some(travel_s)) => assert!(travel_s > touch.budget_s),
                    (Outcome::OutOfReach(_), None) => {}
                    other => panic!("{other:?}"),
                }
                if let Some(used) = touch.used {
                    assert!(row.shifted && touch.outcome == Outcome::InTime);
                    assert!(thresholds.check(&used.shift).is_ok() && used.offset_m > 0.0);
                }
                if let Some([with_s, without_s]) = touch.shortest_s {
                    assert!(with_s > 0.0 && without_s > touch.budget_s);
                }
                assert!(row.mode != Mode::Exact || touch.residual_rad == 0.0);
            }
        }
        // Somebody fast is late somewhere, and a shift is tried there.
        let tried = results.rows.iter().flat_map(|row| &row.touches);
        assert!(tried.filter(|t| t.shortest_s.is_some()).count() > 0);
        let again = run(&request).unwrap();
        for (a, b) in results.rows.iter().zip(&again.rows) {
            assert_eq!(a.touches, b.touches);
        }
    }
}
