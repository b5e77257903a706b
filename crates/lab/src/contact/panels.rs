//! People pointing at remembered objects in a room: their recording, its table of end points and object boxes, and predictions for each
//! person by what was learnt from the others, by the estimator alone and in a scene.

use anyhow::{Context, ensure};
use glam::DVec3;
use hwall_contact::score::Moment;
use hwall_contact::{
    ContactError, ContactPrediction, EvidenceModel, FusedConfig, FusedPredictor, HeldOutEstimator,
    LabelledStream, LearnedConfig, LearnedEstimator, LearnedModel, Predictor, PredictorInput,
    StreamContact, StreamFilters,
};
use hwall_files::{Row, Table};
use hwall_hand::{
    GazeFilter, HandError, HandFilter, HandFrame, HandPoint, LabelledReach, Recording,
    read_recordings,
};
use hwall_scene::{Scene, Surface, SurfaceId, SurfaceMesh};
use hwall_stage::numbers::counted;
use hwall_testkit::{Machine, MarkdownTable, cells, or_none, quantiles, titled};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// A reach in a room.
#[derive(Debug, Clone)]
pub struct Trial {
    /// Name of the room.
    pub room: String,
    /// The person.
    pub person: String,
    /// The target object.
    pub object: String,
    /// Centre and size of its axis-aligned box, m.
    pub box_m: [DVec3; 2],
    /// All samples, from before the reach on.
    pub frames: Vec<HandFrame>,
    /// From `t = 0` to the end of the reach.
    pub reach: LabelledReach,
}

impl Trial {
    /// From the end of the reach to where the head is first seen, m.
    ///
    /// # Errors
    /// The head is never seen.
    pub fn towards_head_m(&self) -> Result<DVec3, HandError> {
        let head_m = self.frames.iter().find_map(|frame| frame.head_m);
        let head_m = head_m.ok_or_else(|| HandError::Reach {
            reach: self.reach.name(),
            what: "the head is never seen, which the panel faces",
        })?;
        Ok(head_m - self.reach.contact_m)
    }
}

/// Reads a recording and the table of its trials.
///
/// # Errors
/// A file that cannot be opened; as [`read`].
pub fn read_files(stream: &Path, trials: &Path) -> anyhow::Result<Vec<Trial>> {
    let open = |path: &Path| File::open(path).with_context(|| path.display().to_string());
    let recordings = read_recordings(open(stream)?);
    let recordings = recordings.with_context(|| stream.display().to_string())?;
    let table = BufReader::new(open(trials)?);
    read(recordings, table).with_context(|| trials.display().to_string())
}

/// Reads the trials of a table, with their samples from the recordings; ignores other recorded data.
///
/// The table has the columns `person,trial,scene,target`, the centre `cx,cy,cz` and size `sx,sy,sz` of the box of the target, m,
/// the duration `dur` of the reach, s, and its end `rx,ry,rz`, m.
///
/// # Errors
/// A missing column, a cell that is not a number, a trial without samples, a text that is not a table.
pub fn read(recordings: Vec<Recording>, trials: impl BufRead) -> Result<Vec<Trial>, HandError> {
    let mut table = Table::new(trials)?;
    let header = table.header().to_vec();
    let named = |r: Recording| {
        let frames = r.samples.iter().map(|s| s.frame).collect();
        let name = |name: Option<String>| name.unwrap_or_default();
        ((name(r.person), name(r.trial)), frames)
    };
    let recordings = recordings.into_iter().map(named);
    let mut recorded: HashMap<_, Vec<HandFrame>> = recordings.collect();
    let (mut found, mut row) = (Vec::new(), Row::default());
    while table.next_row(&mut row)? {
        let text = |name: &str| Ok::<_, HandError>(row.cell(place(&header, name)?).to_owned());
        let vector = |name: char| {
            let number = |axis| number(&header, &row, &format!("{name}{axis}"));
            Ok::<_, HandError>(DVec3::new(number('x')?, number('y')?, number('z')?))
        };
        let name = (text("person")?, text("trial")?);
        let contact_s = number(&header, &row, "dur")?;
        let frames = recorded.remove(&name).unwrap_or_default();
        let under_way = frames.iter().filter(|f| (0.0..=contact_s).contains(&f.t_s));
        let under_way = under_way.copied().collect();
        let reach = LabelledReach::new(HandPoint::Index, under_way, vector('r')?, contact_s);
        let reach = reach.by(&*name.0, name.1);
        reach.validate()?;
        found.push(Trial {
            room: text("scene")?,
            person: name.0,
            object: text("target")?,
            box_m: [vector('c')?, vector('s')?],
            frames,
            reach,
        });
    }
    Ok(found)
}

fn place(header: &[String], column: &str) -> Result<usize, HandError> {
    let place = header.iter().position(|name| name == column);
    place.ok_or_else(|| HandError::MissingColumn {
        column: column.to_owned(),
    })
}

fn number(header: &[String], row: &Row, column: &str) -> Result<f64, HandError> {
    let place = place(header, column)?;
    let number = row.number(place).ok().flatten();
    number.ok_or_else(|| HandError::NotANumber {
        line: row.line(),
        column: column.to_owned(),
        text: row.cell(place).chars().take(40).collect(),
    })
}

/// Shares of the time of a reach at which predictions are evaluated.
const SHARES: [f64; 6] = [0.1, 0.3, 0.5, 0.7, 0.8, 0.9];
/// Evaluated predictors, in the order of the rows.
const ROWS: [&str; 6] = [
    "learned",
    "learned with gaze",
    "belief, estimator without gaze",
    "belief",
    "learned with gaze, with feedback",
    "belief, with feedback",
];
/// For each predictor, its row for the estimator alone and its row for the belief. The predictors: without gaze, with gaze, and with gaze and
/// feedback from this person's earlier touches.
const ROWS_OF: [[usize; 2]; 3] = [[0, 2], [1, 3], [4, 5]];
/// Side of the panel that is reached, m: a large touch display.
const PANEL_M: f64 = 0.3;
/// Largest offset of the touch from the middle of the panel, in each axis, m: a belief cut off by the edges has its mean
/// in the middle, which must not be the true point.
pub(crate) const MOST_OFF_M: f64 = 0.12;
/// The panel is the first surface of a scene.
const PANEL: SurfaceId = SurfaceId(0);
/// Its name.
pub(crate) const PANEL_NAME: &str = "panel";

/// One row's prediction at one moment of a reach.
#[derive(Debug, Clone, Copy, Default)]
struct Judged {
    /// Distance to the touch within the panel, m; `None` if the panel is not predicted.
    off_m: Option<f64>,
    /// Is the touch in the region of 90 %?
    in_region: Option<bool>,
    /// Is the panel the most probable surface? `None` without a scene.
    first: Option<bool>,
}

/// Every row at every moment of one reach.
type Answers = [[Judged; SHARES.len()]; ROWS.len()];

/// Leaves out each person of each room, and returns a table for each room, as Markdown. `centred`: panels with the touch in their middle.
///
/// # Errors
/// A room with fewer than two people; too little training data.
pub fn report(trials: &[Trial], config: &LearnedConfig, centred: bool) -> anyhow::Result<String> {
    let rooms = rooms_of(trials)?;
    let most_off_m = if centred { 0.0 } else { MOST_OFF_M };
    let mut text = String::new();
    for (room, trials) in rooms {
        let people = people_of(&trials);
        let judged = people.par_iter().map(|person| {
            eprintln!("room {room}: learning from all but {person}");
            let judged = judge(person, &trials, config, most_off_m);
            judged.with_context(|| format!("room {room}, without {person}"))
        });
        let answers = judged.collect::<anyhow::Result<Vec<_>>>()?.concat();
        let touch = match centred {
            true => "with the touch in their middle".to_owned(),
            false => format!("off the touch by up to {MOST_OFF_M} m in each axis"),
        };
        text += &format!(
            "### Room {room}\n\nCommit {}, {}, {}; each person is left out. Panels of {PANEL_M} m, {touch}. Numbers are at {} % of the reach.\n\n{}\n",
            Machine::detect(0).commit,
            counted(people.len(), "person", "people"),
            counted(answers.len(), "reach", "reaches"),
            SHARES
                .map(|share| format!("{:.0}", 100.0 * share))
                .join(" / "),
            table(&answers)
        );
    }
    Ok(text)
}

/// The trials of each room.
///
/// # Errors
/// A room with fewer than two people.
pub(crate) fn rooms_of(trials: &[Trial]) -> anyhow::Result<BTreeMap<&str, Vec<&Trial>>> {
    let mut rooms = BTreeMap::<&str, Vec<&Trial>>::new();
    for trial in trials {
        rooms.entry(&trial.room).or_default().push(trial);
    }
    for (room, trials) in &rooms {
        let got = people_of(trials).len();
        ensure!(got >= 2, "room {room}: {got} person, at least 2 are needed");
    }
    Ok(rooms)
}

/// The people who made these trials.
pub(crate) fn people_of<'a>(trials: &[&'a Trial]) -> BTreeSet<&'a str> {
    trials.iter().map(|trial| &*trial.person).collect()
}

/// The boxes of all objects of a room, by name.
pub(crate) fn objects_of<'a>(room: &[&'a Trial]) -> BTreeMap<&'a str, [DVec3; 2]> {
    room.iter().map(|t| (&*t.object, t.box_m)).collect()
}

/// The table of a room.
fn table(answers: &[Answers]) -> MarkdownTable {
    let mut table =
        titled(" | median error, mm | panel named, % | right object, % | in 90 % regions, %");
    for (row, name) in ROWS.iter().enumerate() {
        let each = |moment: usize| answers.iter().map(move |a| a[row][moment]);
        let percent = |moment, of: fn(Judged) -> Option<bool>| {
            let said: Vec<bool> = each(moment).filter_map(of).collect();
            let yes = said.iter().filter(|said| **said).count();
            100.0 * yes as f64 / said.len() as f64
        };
        let own: [&dyn Fn(usize) -> f64; 4] = [
            &|m| 1e3 * quantiles(each(m).filter_map(|j| j.off_m), [0.5])[0],
            &|m| percent(m, |j| Some(j.off_m.is_some())),
            &|m| percent(m, |j| j.first),
            &|m| percent(m, |j| j.in_region),
        ];
        let list = |value: &dyn Fn(usize) -> f64| {
            let finite = |moment| Some(value(moment)).filter(|v| v.is_finite());
            let all: Vec<String> = (0..SHARES.len()).map(|m| or_none(finite(m), 0)).collect();
            match all.iter().all(|one| one == "none") {
                true => all[0].clone(),
                false => all.join(" / "),
            }
        };
        table.row(cells([name], own.map(list)));
    }
    table
}

/// An estimator, and the learnt reliability of it and of the gaze.
pub(crate) struct Learnt {
    model: LearnedModel,
    evidence: EvidenceModel,
}

impl Learnt {
    pub(crate) fn of(trials: &[&Trial], config: &LearnedConfig) -> Result<Self, ContactError> {
        let reaches: Vec<&LabelledReach> = trials.iter().map(|trial| &trial.reach).collect();
        let (model, held_out) = LearnedModel::train_and_hold_out(&reaches, config)?;
        let contact = |reach: &&LabelledReach| StreamContact {
            point_m: reach.contact_m,
            contact_s: reach.contact_s,
        };
        let contacts: Vec<StreamContact> = reaches.iter().map(contact).collect();
        let streams = trials.iter().zip(contacts.chunks(1));
        let streams = streams.map(|(trial, contacts)| LabelledStream {
            frames: &trial.frames,
            contacts,
        });
        let streams: Vec<LabelledStream<'_>> = streams.collect();
        let evidence = EvidenceModel::default().fit_streams(
            &streams,
            |i| HeldOutEstimator::new([&held_out[i]], reaches.len()),
            &StreamFilters::default(),
        )?;
        Ok(Self { model, evidence })
    }

    /// The estimator in the belief. The recordings have no error of registration.
    pub(crate) fn fused(&self) -> Result<FusedPredictor<LearnedEstimator>, ContactError> {
        let config = FusedConfig {
            evidence: self.evidence,
            registration_sd_m: 0.0,
            ..FusedConfig::default()
        };
        FusedPredictor::new(self.model.estimator(), config)
    }
}

/// Trains on all but one person of a room, and evaluates the reaches of that person.
fn judge(
    person: &str,
    room: &[&Trial],
    config: &LearnedConfig,
    most_off_m: f64,
) -> anyhow::Result<Vec<Answers>> {
    let (own, others): (Vec<&Trial>, Vec<&Trial>) = room.iter().partition(|t| t.person == person);
    let learnt = |gaze| Learnt::of(&others, &LearnedConfig { gaze, ..*config });
    let learnt = [learnt(false)?, learnt(true)?];
    let objects = objects_of(room);
    let [without_gaze, with_gaze] = [learnt[0].fused()?, learnt[1].fused()?];
    let mut with_feedback = with_gaze.clone();
    let follow = |trial: &&Trial| {
        let (scene, normal) = facing_scene(trial, &objects, most_off_m)?;
        let predictors = [&without_gaze, &with_gaze, &with_feedback].map(Clone::clone);
        let answers = follow(trial, &scene, normal, predictors);
        learn_from(&mut with_feedback, trial, &scene)?;
        answers
    };
    own.iter().map(follow).collect()
}

/// The scene of a reach whose panel faces the head, and the normal of the panel.
fn facing_scene(
    trial: &Trial,
    objects: &BTreeMap<&str, [DVec3; 2]>,
    most_off_m: f64,
) -> anyhow::Result<(Scene, DVec3)> {
    let towards_head = trial.towards_head_m()?.try_normalize();
    let normal = towards_head.context("the head is at the touch")?;
    let across = normal.any_orthonormal_pair().into();
    Ok((scene_of(trial, objects, across, most_off_m)?, normal))
}

/// The filters of hand and gaze, as in a session.
struct Senses(HandFilter, GazeFilter);

impl Senses {
    fn new() -> anyhow::Result<Self> {
        let filters = StreamFilters::default();
        Ok(Self(
            HandFilter::new(filters.hand)?,
            GazeFilter::new(filters.gaze)?,
        ))
    }

    /// Shows a sample to every predictor.
    fn show<'a, P: Predictor + 'a>(
        &mut self,
        frame: &HandFrame,
        scene: &Scene,
        predictors: impl IntoIterator<Item = &'a mut P>,
    ) {
        let tracking = self.0.step(frame);
        let input = PredictorInput {
            frame,
            hand: tracking.state(),
            gaze: self.1.step(frame.t_s, frame.gaze_ray().as_ref()),
        };
        for predictor in predictors {
            predictor.predict(scene, &input);
        }
    }
}

/// Lets a predictor follow a reach to its touch, and learn from that.
fn learn_from(predictor: &mut impl Predictor, trial: &Trial, scene: &Scene) -> anyhow::Result<()> {
    let mut senses = Senses::new()?;
    for frame in &trial.frames {
        senses.show(frame, scene, [&mut *predictor]);
    }
    predictor.touched(trial.reach.contact_m, trial.reach.contact_s);
    // A touch is learnt with the next sample, in the scene in which it happened.
    if let Some(last) = trial.frames.last() {
        senses.show(last, scene, [predictor]);
    }
    Ok(())
}

/// Follows one reach with each predictor of [`ROWS_OF`].
fn follow(
    trial: &Trial,
    scene: &Scene,
    normal: DVec3,
    mut predictors: [FusedPredictor<LearnedEstimator>; 3],
) -> anyhow::Result<Answers> {
    let reach = &trial.reach;
    let judged = |place: &ContactPrediction, first| {
        let off_m = reach.contact_m - place.point_m;
        let squared = place.squared_deviations(reach.contact_m);
        Judged {
            off_m: Some(off_m.reject_from_normalized(normal).length()),
            in_region: squared.map(|squared| squared <= ContactPrediction::region_squared(0.9)),
            first,
        }
    };
    let at_s = SHARES.map(|share| {
        let frame = Moment::Share(share).frame(reach)?;
        Some(reach.frames[frame].t_s)
    });
    let mut senses = Senses::new()?;
    let mut answers = Answers::default();
    for frame in &trial.frames {
        senses.show(frame, scene, &mut predictors);
        for moment in (0..SHARES.len()).filter(|&m| at_s[m] == Some(frame.t_s)) {
            for (predictor, [estimator, belief]) in predictors.iter().zip(ROWS_OF) {
                let ranked = predictor.ranked();
                let first = Some(ranked.first().is_some_and(|best| best.surface == PANEL));
                let named = ranked.iter().find(|place| place.surface == PANEL);
                let unnamed = Judged {
                    first,
                    ..Judged::default()
                };
                answers[belief][moment] = named.map_or(unnamed, |place| judged(place, first));
                let alone = predictor.estimate().map(|estimate| ContactPrediction {
                    covariance_m2: estimate.covariance_m2,
                    ..ContactPrediction::of_place(PANEL, estimate.point_m, normal)
                });
                answers[estimator][moment] =
                    alone.map_or_else(Judged::default, |place| judged(&place, None));
            }
        }
    }
    Ok(answers)
}

/// The scene of a reach: its panel in the plane of two axes, and the boxes of the other objects of the room.
pub(crate) fn scene_of(
    trial: &Trial,
    objects: &BTreeMap<&str, [DVec3; 2]>,
    across: [DVec3; 2],
    most_off_m: f64,
) -> anyhow::Result<Scene> {
    let others = objects.iter().filter(|(name, _)| **name != trial.object);
    let mut meshes = vec![panel(&trial.reach, across, most_off_m)];
    meshes.extend(others.map(|(name, of)| cuboid(name, *of)));
    Ok(Scene::from_meshes(meshes)?.0)
}

/// A square, offset from the touch by an amount derived from the trial's name.
fn panel(reach: &LabelledReach, [u, v]: [DVec3; 2], most_off_m: f64) -> SurfaceMesh {
    let number = reach
        .trial
        .as_deref()
        .and_then(|name| name.parse::<u64>().ok());
    // A multiplicative hash: consecutive numbers give unrelated offsets.
    let hash = number.unwrap_or(7).wrapping_mul(2_654_435_761) % 1_000_003;
    let share = |thousand: u64| (thousand % 1000) as f64 / 500.0 - 1.0;
    let off_m = u * share(hash) + v * share(hash / 1000);
    let centre_m = reach.contact_m + off_m * most_off_m;
    let corner = |a: f64, b: f64| centre_m + (u * a + v * b) * (0.5 * PANEL_M);
    let corners = [
        corner(-1., -1.),
        corner(1., -1.),
        corner(1., 1.),
        corner(-1., 1.),
    ];
    mesh(PANEL_NAME, &[corners])
}

/// A box with faces along the axes.
fn cuboid(name: &str, [centre_m, size_m]: [DVec3; 2]) -> SurfaceMesh {
    let corner = |i: u32| {
        let sign = |bit: u32| if i & bit == 0 { -0.5 } else { 0.5 };
        centre_m + size_m * DVec3::new(sign(1), sign(2), sign(4))
    };
    let faces = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    mesh(name, &faces.map(|face| face.map(corner)))
}

fn mesh(name: &str, faces: &[[DVec3; 4]]) -> SurfaceMesh {
    let halves = |[a, b, c, d]: &[DVec3; 4]| [[*a, *b, *c], [*a, *c, *d]];
    SurfaceMesh {
        surface: Surface {
            name: name.to_owned(),
            ..Surface::default()
        },
        triangles_m: faces.iter().flat_map(halves).collect(),
    }
}
