//! Simulated demonstrations: people reach for points within the arm's reach. Same format as real recordings.

use anyhow::{Context, ensure};
use glam::DVec3;
use hwall_hand::{HandPoint, LabelledReach, Recording, Sample};
use hwall_haptics::Board;
use hwall_kinematics::SrsArm;
use hwall_reachability::{ExactConfig, Interval, ReachabilityMap, Roll, WallGrid, WallLine};
use hwall_sim::{Gesture, PersonConfig, Population, TouchPlan, TouchSequence};
use hwall_stage::named;
use hwall_testkit::Sampler;

/// Period of the tracker, s.
const TRACKER_S: f64 = 1.0 / 90.0;
/// A recording begins this long before the hand starts, s, if the person rests by then.
const BEFORE_S: f64 = 0.3;

/// Settings of demonstrations.
#[derive(Debug, Clone, PartialEq)]
pub struct DemonstrationConfig {
    /// Settings of the people.
    pub person: PersonConfig,
    /// The same seed gives the same demonstrations.
    pub seed: u64,
    /// Training reaches.
    pub train: PartSize,
    /// Test reaches, by other people.
    pub test: PartSize,
    /// Targets of the touches.
    pub targets: Targets,
    /// Tracked points of the hand; must include the tip of the index finger.
    pub points: Vec<HandPoint>,
    /// Is the gaze tracked? The head always is.
    pub gaze: bool,
}

/// Number of people and reaches, evenly distributed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PartSize {
    /// Different people.
    pub people: usize,
    /// Total number of reaches.
    pub reaches: usize,
}

impl DemonstrationConfig {
    /// The dissertation's experiment: 47 training reaches, 30 test reaches, one static
    /// panel in front of the arm; here by people who differ.
    pub fn dissertation() -> Self {
        let panel = Panel {
            centre_m: DVec3::new(0.6, 0.0, 0.55),
            normal: DVec3::X,
            half_width_m: 0.45,
            half_height_m: 0.4,
        };
        Self {
            person: PersonConfig::varied(),
            seed: 1,
            train: PartSize {
                people: 6,
                reaches: 47,
            },
            test: PartSize {
                people: 5,
                reaches: 30,
            },
            targets: Targets::Panel(panel),
            points: HandPoint::ALL.to_vec(),
            gaze: true,
        }
    }

    /// As a study of pointing in VR: 13 people with 125 reaches each of about 0.8 m and 0.87 s; palm, tip of
    /// the index finger and head are tracked. There is no test part: hold out one person at a time.
    pub fn pointing() -> Self {
        let person = PersonConfig {
            hand_rest_m: DVec3::new(1.15, 0.20, 0.45),
            rest_scatter_m: 0.04,
            gesture: Some(Gesture::Pointing),
            mean_reach_s: [0.62, 1.00],
            speed_peak: [0.36, 0.46],
            corrections: 0.8,
            press_depth_m: [0.002, 0.006],
            ..PersonConfig::varied()
        };
        Self {
            person,
            train: PartSize {
                people: 13,
                reaches: 13 * 125,
            },
            test: PartSize::default(),
            targets: Targets::Box(TargetBox {
                low_m: DVec3::new(0.45, -0.35, 0.60),
                high_m: DVec3::new(0.60, 0.45, 1.10),
                normal: DVec3::X,
            }),
            points: vec![HandPoint::Palm, HandPoint::Index],
            gaze: false,
            ..Self::dissertation()
        }
    }

    fn validate(&self) -> anyhow::Result<()> {
        for (name, size) in [("train", self.train), ("test", self.test)] {
            ensure!(
                size.reaches == 0 || size.people > 0,
                "{name}: {} reaches by nobody",
                size.reaches
            );
        }
        ensure!(
            self.points.contains(&HandPoint::Index),
            "the tip of the index finger touches: the tracker must follow it"
        );
        Ok(())
    }
}

named! {
    /// Purpose of a reach, as used in the names of files and people.
    pub enum Part {
        /// Training.
        Train = "train",
        /// Test.
        Test = "test",
    }
}

/// One reach, as trackers measured it.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedReach {
    /// Its purpose.
    pub part: Part,
    /// From a little before the hand starts until the first sample in contact.
    pub recording: Recording,
    /// From the start of the movement to the contact.
    pub labelled: LabelledReach,
}

/// Generates demonstrations, training first; person by person, in order of time.
///
/// Person `i` of a seed makes the same reaches regardless of the number of others.
///
/// # Errors
/// A value outside its range, a panel that the arm cannot reach, a target beside or behind the resting hand.
pub fn generate(config: &DemonstrationConfig) -> anyhow::Result<Vec<SimulatedReach>> {
    config.validate()?;
    let places = Places::new(&config.targets, &Board::default())?;
    let population = Population::new(config.person, config.seed)?;
    let mut made = Vec::with_capacity(config.train.reaches + config.test.reaches);
    let mut number = 0;
    for (part, size) in [(Part::Train, config.train), (Part::Test, config.test)] {
        for i in 0..size.people {
            let name = format!("{}-{:02}", part.name(), i + 1);
            let count = size.reaches / size.people + usize::from(i < size.reaches % size.people);
            let mut sampler = Sampler::new(config.seed ^ ((number + 1) << 32));
            let plans = places.plans(count, &mut sampler)?;
            let sequence = population.person(number).plan(&plans);
            let sequence = sequence.with_context(|| name.clone())?;
            for trial in 0..count {
                let names = (name.as_str(), trial + 1);
                let one = record(&sequence, trial, config, part, names)?;
                made.push(one);
            }
            number += 1;
        }
    }
    Ok(made)
}

/// Cuts one reach out of a person's sequence.
fn record(
    sequence: &TouchSequence,
    trial: usize,
    config: &DemonstrationConfig,
    part: Part,
    (person, number): (&str, usize),
) -> anyhow::Result<SimulatedReach> {
    let truth = sequence.touches()[trial];
    let before = trial.checked_sub(1).map(|last| sequence.touches()[last]);
    let rests_from_s = before.map_or(0.0, |before| before.end_s);
    let first_s = (truth.start_s - BEFORE_S).max(rests_from_s);
    let frame_at = |t_s: f64| (t_s / TRACKER_S).ceil() as usize;
    let (mut samples, mut frames) = (Vec::new(), Vec::new());
    let (first, last) = (frame_at(first_s), frame_at(truth.contact_s));
    for k in first..=last {
        let t_s = k as f64 * TRACKER_S;
        let tracked = sequence.tracked(t_s);
        let frame = tracked.limited_to(&config.points, config.gaze);
        samples.push(Sample {
            frame,
            object_m: None,
            target_m: Some(truth.target_m),
            contact: Some(t_s >= truth.contact_s),
        });
        if (truth.start_s..=truth.contact_s).contains(&t_s) {
            frames.push(frame);
        }
    }
    let (person, trial) = (Some(person.to_owned()), Some(number.to_string()));
    let recording = Recording {
        person: person.clone(),
        trial: trial.clone(),
        samples,
        ignored_columns: [].into(),
        zero_rows: 0,
    };
    let labelled = LabelledReach {
        person,
        trial,
        point: HandPoint::Index,
        frames,
        contact_m: truth.target_m,
        contact_s: truth.contact_s,
        normal: Some(truth.normal),
    };
    recording.validate()?;
    labelled.validate()?;
    Ok(SimulatedReach {
        part,
        recording,
        labelled,
    })
}

/// Spacing of the lines of a panel's map, m.
const SPACING_M: f64 = 0.025;
/// Largest number of draws for a reachable point near a reachable line.
const MOST_DRAWS: usize = 1000;

/// Targets, in the arm's base frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Targets {
    /// An upright panel: uniform over the parts where the arm can present its board.
    Panel(Panel),
    /// Uniform in a box, reachable or not.
    Box(TargetBox),
}

/// A box between two corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetBox {
    /// Lowest corner, m.
    pub low_m: DVec3,
    /// Highest corner, m.
    pub high_m: DVec3,
    /// Normal of the surfaces touched, towards the person.
    pub normal: DVec3,
}

/// An upright rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Panel {
    /// Its middle, m.
    pub centre_m: DVec3,
    /// Horizontal normal, towards the person.
    pub normal: DVec3,
    /// Half its width, m.
    pub half_width_m: f64,
    /// Half its height, m.
    pub half_height_m: f64,
}

/// The set from which targets are drawn.
enum Places {
    /// The heights of the panel, m, its map, and the reachable stretches of the lines.
    Lines([f64; 2], Box<ReachabilityMap>, Vec<Stretch>),
    Box(TargetBox),
}

struct Stretch {
    line: WallLine,
    span: Interval,
    /// Length of all stretches up to the end of this one, m.
    until_m: f64,
}

impl Places {
    fn new(targets: &Targets, board: &Board) -> anyhow::Result<Self> {
        match targets {
            Targets::Panel(panel) => Self::reachable(panel, board),
            Targets::Box(within) => {
                let (low_m, high_m) = (within.low_m, within.high_m);
                ensure!(
                    low_m.is_finite() && high_m.is_finite() && low_m.cmple(high_m).all(),
                    "the box from {low_m} to {high_m} m is empty or not finite"
                );
                Ok(Self::Box(*within))
            }
        }
    }

    fn reachable(panel: &Panel, board: &Board) -> anyhow::Result<Self> {
        let arm = SrsArm::iiwa7().with_tool(board.flange_from_board_face()?);
        let config = ExactConfig {
            roll: Roll::quarter_turns(),
            ..ExactConfig::default()
        };
        let map = ReachabilityMap::build(&arm, &config, vec![wall(panel)?])?;
        let mut stretches = Vec::new();
        let mut until_m = 0.0;
        for index in map.lines() {
            let line = map.line(index).context("a line of the map")?;
            for interval in map.intervals(index) {
                until_m += interval.span.length_m();
                stretches.push(Stretch {
                    line,
                    span: interval.span,
                    until_m,
                });
            }
        }
        ensure!(until_m > 0.0, "the arm does not reach the panel");
        let (middle_m, half_m) = (panel.centre_m.z, panel.half_height_m);
        let heights_m = [middle_m - half_m, middle_m + half_m];
        Ok(Self::Lines(heights_m, Box::new(map), stretches))
    }

    /// Touches of one person.
    fn plans(&self, count: usize, sampler: &mut Sampler) -> anyhow::Result<Vec<TouchPlan>> {
        let touch = |_| {
            let touch = self.draw(sampler)?;
            // These draws once decided on changes of mind; without them, published numbers would change.
            self.draw(sampler)?;
            sampler.uniform(0.0, 1.0);
            Ok(touch)
        };
        (0..count).map(touch).collect()
    }

    fn draw(&self, sampler: &mut Sampler) -> anyhow::Result<TouchPlan> {
        match self {
            Self::Box(within) => Ok(TouchPlan {
                target_m: sampler.point_in_box(within.low_m, within.high_m),
                normal: within.normal,
            }),
            Self::Lines(heights_m, map, stretches) => {
                let near = |_| near_a_line(*heights_m, map, stretches, sampler);
                let found = (0..MOST_DRAWS).find_map(near);
                found.context("found no reachable point beside the lines of the map")
            }
        }
    }
}

/// A uniformly drawn point near the reachable stretches; `None` if it is not reachable.
fn near_a_line(
    [low_m, high_m]: [f64; 2],
    map: &ReachabilityMap,
    stretches: &[Stretch],
    sampler: &mut Sampler,
) -> Option<TouchPlan> {
    let at_m = sampler.uniform(0.0, stretches.last()?.until_m);
    let stretch = stretches.get(stretches.partition_point(|s| s.until_m <= at_m))?;
    let s_m = sampler.uniform(stretch.span.lo_m, stretch.span.hi_m);
    let mut target_m = stretch.line.point_m(s_m);
    target_m.z += sampler.uniform(-0.5 * SPACING_M, 0.5 * SPACING_M);
    let normal = stretch.line.plane.normal();
    let inside = low_m <= target_m.z && target_m.z <= high_m;
    let reachable = inside && map.is_reachable(target_m, normal).unwrap_or(false);
    reachable.then_some(TouchPlan { target_m, normal })
}

fn wall(panel: &Panel) -> anyhow::Result<WallGrid> {
    let Panel {
        centre_m,
        normal,
        half_width_m,
        half_height_m,
    } = *panel;
    ensure!(
        half_width_m > 0.0 && half_height_m > 0.0,
        "a panel of {} by {} m",
        2.0 * half_width_m,
        2.0 * half_height_m
    );
    let heights = Interval::new(centre_m.z - half_height_m, centre_m.z + half_height_m);
    let aside_m = DVec3::Z.cross(normal).normalize_or_zero() * half_width_m;
    let wall = WallGrid::for_wall(centre_m, normal, heights, SPACING_M)?;
    Ok(wall.within([centre_m - aside_m, centre_m + aside_m])?)
}
