//! The setting of the main job: scene, hand and touches in the arm's base frame.

use crate::console::note;
use crate::input::arms::BoardArm;
use crate::input::base_flag::BaseFlag;
use crate::input::floor_pose::FloorPose;
use crate::input::numbers::{counted, whole_within};
use crate::input::place::{self, Contacts};
use crate::input::recording_units::RecordingUnits;
use crate::input::scene_file::{SceneFile, SceneFlags, unit_hint};
use crate::input::trial;
use crate::person::gestures::with_gesture;
use crate::person::hand::Hand;
use crate::person::kinds::PersonKind;
use crate::person::participants::{self, Participant};
use crate::person::predictors::TrainingPeople;
use crate::person::touches;
use crate::run::base_by_arrival::base_by_arrival;
use anyhow::{anyhow, bail};
use clap::ValueEnum;
use hwall::LikelyTouches;
use hwall_hand::{FreezeConfig, HandFilterConfig, HandFrame, Pose, Recording};
use hwall_scene::{LoadLimits, LoadReport, Scene, read_text};
use std::path::{Path, PathBuf};

/// The built-in room, compiled in so that the binary runs from anywhere.
const ROOM: (&str, &str) = (
    include_str!("../../../examples/assets/room.obj"),
    include_str!("../../../examples/assets/room.toml"),
);

/// Longest pause and longest recording, s: the loop also steps through pauses.
const LONGEST_PAUSE_S: f64 = 60.0;
const LONGEST_RECORDING_S: f64 = 1800.0;
/// A head that ends earlier than the recording by more than this is reported, s.
const LONGEST_WITHOUT_HEAD_S: f64 = 0.5;

/// Touches in a corridor, by the value of `--base`.
const IN_CORRIDOR: [(&str, &str, &str); 4] = [
    ("base", "fixed", "60"),
    ("base", "redirected", "60"),
    ("base", "drives", "60"),
    ("base", "both", "60"),
];

/// Scene, poses and people, as flags.
#[derive(Debug, Clone, clap::Parser)]
pub struct SettingFlags {
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
    /// auto: place arm and recording at the nearest suitable wall; none: use --base and --hand-origin [default: auto with --hand, else
    /// none]
    #[arg(long, value_enum)]
    pub place: Option<Place>,
    /// The arm's base in the scene: x,y,z in metres, yaw in degrees about z, counter-clockwise from the scene's x axis; with auto placing,
    /// the wall nearest to it is used [default: 0,0,0,0 without auto placing]. Or drives, both, redirected or fixed: a person walks through
    /// a corridor of rooms and touches 60 times, and the four kinds of base are compared; the figure shows the one named
    #[arg(long, value_parser = BaseFlag::parse, allow_hyphen_values = true)]
    pub base: Option<BaseFlag>,
    /// arrival: place the arm's base near the origin of the scene where most touches are in time; takes a minute and a half
    #[arg(long, value_enum, conflicts_with_all = ["base", "hand"])]
    pub base_from: Option<BaseFrom>,
    /// Origin of the recording (z up) in the scene: x,y,z in metres, yaw in degrees [default: 0,0,0,0 without auto placing]
    #[arg(long, value_parser = FloorPose::parse, allow_hyphen_values = true)]
    pub hand_origin: Option<FloorPose>,
    /// The recorded hand is synthetic: a shape that never changes does not mean a frozen tracker
    #[arg(long, requires = "hand")]
    pub rigid_hand: bool,
    /// Kind of simulated people
    #[arg(long, value_enum, default_value_t, conflicts_with = "hand")]
    pub person: PersonKind,
    /// Infers from the hand, before the contact, whether it touches, pushes, grasps or strokes, answers each differently, and prints how early they
    /// were told apart. Simulated people do one of the four, in turn by person
    #[arg(long)]
    pub gestures: bool,
    /// Number of touches of the simulated people; each person makes a dozen
    #[arg(long, default_value_t = 12, default_value_ifs = IN_CORRIDOR, conflicts_with = "hand", value_parser = whole_within::<1, 100_000>, allow_negative_numbers = true)]
    pub touches: u64,
    /// Seed of the simulated people and the sensors' noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u64,
}

impl SettingFlags {
    /// Pose of the base, if given.
    ///
    /// # Errors
    /// A kind of base in a corridor, which has no place in this scene.
    fn base_pose(&self) -> anyhow::Result<Option<FloorPose>> {
        match self.base {
            None => Ok(None),
            Some(BaseFlag::At(pose)) => Ok(Some(pose)),
            Some(BaseFlag::Corridor(kind)) => {
                bail!(
                    "--base {}: only the main job walks through a corridor",
                    kind.name()
                )
            }
        }
    }
}

/// Axes of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Axes {
    /// y up, as headsets have it
    YUp,
    /// z up
    ZUp,
}

/// Who places arm and recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Place {
    /// The program
    Auto,
    /// The flags
    None,
}

/// Criterion for the pose of the base.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BaseFrom {
    /// Number of touches in time
    Arrival,
}

/// Everything the loop needs, in the arm's base frame.
pub struct Setting {
    /// The scene.
    pub scene: Scene,
    /// Participants: one recorded hand, or simulated people, each with a separate run.
    pub participants: Vec<Participant>,
    /// People like the participants, for training a predictor.
    pub training_people: TrainingPeople,
    /// Likely touches of the participants.
    pub likely_touches: LikelyTouches,
    /// For the user: what was chosen or repaired.
    pub remarks: Vec<String>,
    /// The arm's base in the scene as its file has it.
    pub base: FloorPose,
}

impl Setting {
    /// Loads the scene, places arm and recording, plans touches. The tool of `arm` is the face of the board.
    ///
    /// # Errors
    /// A file that is missing or malformed, a recording without a reach, no suitable wall.
    pub fn new(arm: &BoardArm, flags: &SettingFlags) -> anyhow::Result<Self> {
        let (scene, remarks) = load_scene(flags.scene.file())?;
        match &flags.hand {
            Some(path) => Self::recorded(arm, scene, path, flags, remarks),
            None => Self::simulated(arm, scene, flags, remarks),
        }
    }

    fn simulated(
        arm: &BoardArm,
        scene: Scene,
        flags: &SettingFlags,
        mut remarks: Vec<String>,
    ) -> anyhow::Result<Self> {
        if flags.hand_origin.is_some() || flags.place == Some(Place::Auto) {
            bail!("--hand-origin and --place auto place a recording: they need --hand");
        }
        let (kind, touches, seed) = (flags.person, flags.touches as usize, flags.seed);
        let mut training_people = TrainingPeople::default();
        let base = match flags.base_from {
            Some(BaseFrom::Arrival) => {
                // Sample people of this kind, to find likely touches; they stay where they stand.
                let people = participants::simulated(&scene, arm, kind, 1, seed)?;
                let likely = participants::likely_touches(&scene, arm, &people);
                note(
                    "looking for the arm's base by rehearsals, which takes about a minute and a half",
                );
                let base = base_by_arrival(&scene, arm, &likely, kind)?;
                remarks.push(format!(
                    "by arrival the arm's base stands best at {base} (x,y,z,yaw)"
                ));
                // Training people stand where the participants stand.
                training_people = training_people.seen_from(base);
                base
            }
            None => flags.base_pose()?.unwrap_or(FloorPose::ORIGIN),
        };
        let scene = base.scene_seen(&scene)?;
        // With a given base, people stand at the default place in front of it.
        let stood = flags.base_from.map_or(FloorPose::ORIGIN, |_| base);
        let config = |number, person_seed| match flags.gestures {
            true => with_gesture(kind.config(person_seed), seed.wrapping_add(number)),
            false => kind.config(person_seed),
        };
        let participants = participants::simulated_as(config, stood, &scene, arm, touches, seed)?;
        Ok(Self {
            likely_touches: participants::likely_touches(&scene, arm, &participants),
            scene,
            participants,
            training_people,
            remarks,
            base,
        })
    }

    fn recorded(
        arm: &BoardArm,
        scene: Scene,
        path: &Path,
        flags: &SettingFlags,
        mut remarks: Vec<String>,
    ) -> anyhow::Result<Self> {
        let mut recording = trial::read(path, flags.trial.as_deref())?;
        let units = flags.units.apply(&mut recording);
        units.map_err(|error| named(path, error))?;
        remarks.extend(count_from_start(&mut recording));
        remarks.extend(lost_rows(&recording, flags.rigid_hand));
        remarks.extend(heads(&mut recording));
        if flags.axes == Axes::YUp {
            for sample in &mut recording.samples {
                sample.frame = sample.frame.transformed(&Pose::Z_UP_FROM_Y_UP);
            }
        }
        check_times(&recording).map_err(|error| named(path, error))?;
        remarks.extend(unused_columns(&recording));
        let contacts = place::reaches_to_contact(&recording, flags.rigid_hand);
        let (base, hand) = match (flags.place, flags.base_pose()?, flags.hand_origin) {
            // Both are given; a recording without a reach then has no touch to evaluate.
            (_, Some(base), Some(hand)) => (base, hand),
            (None | Some(Place::Auto), base, hand) => {
                let reaches = &contacts
                    .as_ref()
                    .map_err(|error| named(path, error))?
                    .reaches;
                let found = place::before_a_wall(&scene, &recording, reaches, base)?;
                remarks.push(found.remark);
                (found.base, hand.unwrap_or(found.hand))
            }
            (Some(Place::None), base, hand) => (
                base.unwrap_or(FloorPose::ORIGIN),
                hand.unwrap_or(FloorPose::ORIGIN),
            ),
        };
        remarks.push(format!(
            "the arm's base stands at {base}, the recording's origin at {hand} (x,y,z,yaw)"
        ));
        let contacts = contacts.unwrap_or_else(|error| Contacts {
            remark: error.to_string(),
            ..Contacts::default()
        });
        remarks.push(contacts.remark);
        let base_from_hand = base.outer_from_here().inverse() * hand.outer_from_here();
        let scene = base.scene_seen(&scene)?;
        let touches = touches::of_recording(&scene, &recording, base_from_hand, &contacts.reaches)?;
        if touches.is_empty() {
            remarks.push(
                "no recorded movement meets a touchable surface: --hand-origin moves the recording, and without --place none a \
                 place before a wall is looked for"
                    .to_owned(),
            );
        }
        let filter = if flags.rigid_hand {
            HandFilterConfig::simulated()
        } else {
            HandFilterConfig::default().with_value_step(recording.value_step_m())
        };
        let map = Pose::from_affine(&base_from_hand)?;
        let frames: Vec<_> = recording
            .frames()
            .map(|frame| frame.transformed(&map))
            .collect();
        let training_people = TrainingPeople::tracked_as(&frames);
        let participants = vec![Participant {
            hand: Hand::Recorded(frames, filter),
            touches,
            seed: flags.seed,
        }];
        Ok(Self {
            likely_touches: participants::likely_touches(&scene, arm, &participants),
            scene,
            participants,
            training_people,
            remarks,
            base,
        })
    }
}

/// Lists unused columns, so that misspelt ones are noticed.
fn unused_columns(recording: &Recording) -> Option<String> {
    const NAMED: usize = 8;
    let names = &recording.ignored_columns;
    let first: Vec<&str> = names.iter().take(NAMED).map(String::as_str).collect();
    let more = if names.len() > NAMED { ", ..." } else { "" };
    (!first.is_empty()).then(|| {
        format!(
            "columns of the recording that are not used: {}{more}",
            first.join(", ")
        )
    })
}

/// Reports rows in which a recorder wrote values for an unseen hand.
fn lost_rows(recording: &Recording, rigid: bool) -> Vec<String> {
    let freeze = FreezeConfig {
        rigid_after_s: f64::INFINITY,
        value_step_m: recording.value_step_m(),
        ..FreezeConfig::default()
    };
    let frozen = recording.frozen_samples(freeze).into_iter();
    let frozen = frozen.filter(|&is_frozen| is_frozen && !rigid).count();
    let kinds = [(recording.zero_rows, "zeros"), (frozen, "a repeated pose")];
    let found = kinds.into_iter().filter(|(count, _)| *count > 0);
    found
        .map(|(count, of)| {
            let were = if count == 1 { "was" } else { "were" };
            let rows = counted(count, "row", "rows");
            format!("{rows} of {of} {were} taken as lost tracking")
        })
        .collect()
}

/// Interpolates heads between the rows that have one, and reports this and a head that ends before the hand.
fn heads(recording: &mut Recording) -> Vec<String> {
    let filled = recording.fill_slow_channels();
    let rows = counted(filled, "row", "rows");
    let slow = format!("the head of {rows} was interpolated between its neighbours");
    let times = |with: fn(&&HandFrame) -> bool| recording.frames().filter(with).last();
    let last = times(|frame| frame.head_m.is_some()).map_or(f64::INFINITY, |frame| frame.t_s);
    let end = times(|_| true).map_or(0.0, |frame| frame.t_s);
    let ends = format!(
        "the head ends at {last:.2} s, the recording at {end:.2} s: the arm stops when the head ends"
    );
    let said = [
        (filled > 0, slow),
        (end - last > LONGEST_WITHOUT_HEAD_S, ends),
    ];
    let said = said.into_iter().filter(|(is_so, _)| *is_so);
    said.map(|(_, text)| text).collect()
}

/// Makes the times of a recording start at its first sample, and reports a change. Rounded to 1 us: Unix time as a float is
/// hardly finer.
fn count_from_start(recording: &mut Recording) -> Option<String> {
    let began_s = recording.samples.first()?.frame.t_s;
    for sample in &mut recording.samples {
        let t_s = &mut sample.frame.t_s;
        *t_s = (1e6 * (*t_s - began_s)).round() / 1e6;
    }
    (began_s != 0.0).then(|| {
        format!("times count from the first sample of the recording, which is at {began_s} s of its clock")
    })
}

/// Checks that a loop from the first to the last sample ends within minutes.
///
/// # Errors
/// Times that are too far apart: of neighbours, or of the first and the last sample.
fn check_times(recording: &Recording) -> anyhow::Result<()> {
    let times_s: Vec<f64> = recording.frames().map(|frame| frame.t_s).collect();
    for (sample, pair) in (2..).zip(times_s.windows(2)) {
        let pause_s = pair[1] - pair[0];
        if pause_s > LONGEST_PAUSE_S {
            bail!(
                "sample {sample} is at {} s, {pause_s} s after the one before; at most {LONGEST_PAUSE_S} s (seconds?)",
                pair[1]
            );
        }
    }
    let duration_s = recording.duration_s();
    if duration_s > LONGEST_RECORDING_S {
        bail!("a recording of {duration_s} s, at most {LONGEST_RECORDING_S} s are followed");
    }
    Ok(())
}

/// The scene in a file, or the built-in room, and its repairs.
///
/// # Errors
/// A file that is missing or malformed.
pub fn load_scene(file: Option<SceneFile<'_>>) -> anyhow::Result<(Scene, Vec<String>)> {
    let (scene, report) = match file {
        Some(SceneFile { path, frame }) => {
            Scene::from_obj_file_in(path, None, &frame, &LoadLimits::default())
                .map_err(|error| named(path, error))?
        }
        None => Scene::from_obj_str(ROOM.0, Some(ROOM.1))?,
    };
    let mut remarks = repairs(&report);
    remarks.extend(unit_hint(&scene).map(|hint| format!("the scene {hint}")));
    Ok((scene, remarks))
}

/// The texts of a scene and of its sidecar, as [`load_scene`] reads them.
///
/// # Errors
/// A file that cannot be read.
pub(crate) fn scene_texts(path: Option<&Path>) -> anyhow::Result<(String, Option<String>)> {
    let Some(path) = path else {
        return Ok((ROOM.0.to_owned(), Some(ROOM.1.to_owned())));
    };
    let read =
        |path: &Path| read_text(path, &LoadLimits::default()).map_err(|error| named(path, error));
    let sidecar = path.with_extension("toml");
    let sidecar = sidecar.is_file().then(|| read(&sidecar)).transpose()?;
    Ok((read(path)?, sidecar))
}

/// The error as one line with the name of the file in front, unless it contains it already.
fn named(path: &Path, error: impl std::fmt::Display) -> anyhow::Error {
    let (name, text) = (path.display().to_string(), error.to_string());
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    if text.contains(&name) {
        anyhow!(text)
    } else {
        anyhow!("{name}: {text}")
    }
}

/// The first few names in brackets; empty without names.
fn first_of(names: &[String]) -> String {
    const MOST: usize = 3;
    match names.len() {
        0 => String::new(),
        n if n <= MOST => format!(" ({})", names.join(", ")),
        n => format!(" ({} and {} more)", names[..MOST].join(", "), n - MOST),
    }
}

/// Repairs by the loader, one line per kind.
fn repairs(report: &LoadReport) -> Vec<String> {
    if report.is_clean() {
        return Vec::new();
    }
    // Faces have no names, but their surfaces do.
    let LoadReport {
        degenerate_faces: degenerate,
        duplicate_faces: duplicate,
        concave_polygons,
        points_and_lines,
        ignored_lines,
        thinned_surfaces: thinned,
        empty_surfaces: empty,
        missing_material_libraries: libraries,
        missing_materials: materials,
    } = report;
    let told = |n: usize, one: &str, many: &str, names: &[String]| {
        (n > 0).then(|| format!("{}{}", counted(n, one, many), first_of(names)))
    };
    let found = [
        told(*degenerate, "degenerate face", "degenerate faces", thinned),
        told(*duplicate, "duplicate face", "duplicate faces", thinned),
        told(
            *concave_polygons,
            "polygon cut as a fan",
            "polygons cut as fans",
            &[],
        ),
        told(*points_and_lines, "point or line", "points and lines", &[]),
        told(*ignored_lines, "unknown line", "unknown lines", &[]),
        told(empty.len(), "empty surface", "empty surfaces", empty),
        told(
            libraries.len(),
            "missing material library",
            "missing material libraries",
            libraries,
        ),
        told(
            materials.len(),
            "missing material",
            "missing materials",
            materials,
        ),
    ];
    let found: Vec<String> = found.into_iter().flatten().collect();
    vec![format!("scene, left out or mended: {}", found.join(", "))]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(times_s: impl IntoIterator<Item = f64>) -> Option<String> {
        let recording = Recording::from_frames(times_s.into_iter().map(HandFrame::empty)).unwrap();
        check_times(&recording).err().map(|error| error.to_string())
    }

    #[test]
    fn surfaces_that_lost_faces_are_named() {
        let names = |n: usize| (0..n).map(|i| format!("s{i}")).collect::<Vec<_>>();
        let report = |n: usize| LoadReport {
            degenerate_faces: 7,
            thinned_surfaces: names(n),
            ..LoadReport::default()
        };
        for (surfaces, named) in [
            (0, ""),
            (3, " (s0, s1, s2)"),
            (5, " (s0, s1, s2 and 2 more)"),
        ] {
            let line = format!("scene, left out or mended: 7 degenerate faces{named}");
            assert_eq!(repairs(&report(surfaces)), [line]);
        }
        assert!(repairs(&LoadReport::default()).is_empty());
    }

    /// Regression: one late time stamp ran forever (1e4), out of memory (1e7) or into a panic (1e300).
    #[test]
    fn one_late_time_stamp_is_named() {
        for late_s in [1e4, 1e7, 1e300] {
            let text = refused([0.0, 0.01, 0.02, late_s]).unwrap();
            assert!(text.contains("sample 4"), "{text}");
        }
        assert!(refused([-1e308, 1e308]).is_some());
        assert!(refused((0..2000).map(f64::from)).unwrap().contains("1999"));
        // Unix time is accepted.
        assert_eq!(refused([1.7e9, 1.7e9 + 0.01]), None);
    }
}
