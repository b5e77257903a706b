//! The settings of sessions, stored as options of a recording.
//!
//! Numbers are written with `{:?}`, which restores them bit by bit.

use super::words::{flag_of, name_of, named, numbers, numbers_of, wanted};
use crate::input::arms::NamedArm;
use crate::input::floor_pose::FloorPose;
use crate::input::real_room::RealRoom;
use crate::input::scene_file::SceneFile;
use crate::person::predictors::{PredictorKind, TrainingPeople};
use crate::person::responses::Scenery;
use crate::person::touches::Standing;
use crate::run::simulated_arm::ArmLevel;
use crate::setting;
use anyhow::{Context, bail};
use glam::DVec3;
use hwall::LikelyTouches;
use hwall::arrival::WeightedTarget;
use hwall::reachability::Target;
use hwall_hand::HandPoint;
use hwall_record::{ArmSource, Setup};
use hwall_scene::{FileFrame, LoadLimits, read_text};
use std::path::Path;

/// The origin of a session: everything needed to rebuild it, including its training.
#[derive(Clone, Copy)]
pub struct SessionSource<'a> {
    /// OBJ file; `None`: the built-in room.
    pub scene: Option<SceneFile<'a>>,
    /// The arm.
    pub arm: &'a NamedArm,
    /// The text of the real room around the arm; `None`: a floor.
    pub room: Option<&'a str>,
    /// The arm's base in the scene.
    pub base: FloorPose,
    /// Derived from the above: board, texture and training people, who follow from a built-in seed.
    pub scenery: Scenery<'a>,
    /// How objects are rendered.
    pub level: ArmLevel,
    /// Who leads the board.
    pub predictor: PredictorKind,
    /// Do predictors learn from felt touches?
    pub adapts: bool,
    /// Touches the arm waits for.
    pub likely_touches: &'a LikelyTouches,
}

impl SessionSource<'_> {
    /// As stored in a recording, with the texts of the files.
    ///
    /// # Errors
    /// A file that cannot be read; likely touches that are neither points nor the default range.
    pub fn to_setup(&self) -> anyhow::Result<Setup> {
        let (scene_obj, scene_sidecar) = setting::scene_texts(self.scene.map(|file| file.path))?;
        let NamedArm { name, root, tip } = self.arm;
        let arm = if self.arm.is_file() {
            ArmSource::Urdf {
                name: name.clone(),
                text: read_text(Path::new(name), &LoadLimits::default())?,
            }
        } else {
            ArmSource::Named(name.clone())
        };
        let people = self.scenery.people;
        let points: Vec<&str> = people.points.iter().map(|point| point.name()).collect();
        let FloorPose { origin_m, yaw_rad } = self.base;
        let nominal = TrainingPeople::default();
        let people_stay = people.person == nominal.clone().seen_from(self.base).person;
        // Training people for a recorded hand stand where it is first seen.
        let (head_m, hand_m) = (people.person.head_m, people.person.hand_rest_m);
        let standing = nominal.clone().standing(&Standing { head_m, hand_m });
        if standing.person != people.person && !people_stay {
            bail!("people who are not the usual ones cannot be recorded");
        }
        let [head, hand] = [head_m, hand_m].map(|m| m.to_array());
        let stand = (people.person != nominal.person && !people_stay)
            .then(|| ("training_stand", numbers(&[head, hand].concat())));
        let options = [
            (
                "base",
                numbers(&[origin_m.x, origin_m.y, origin_m.z, yaw_rad]),
            ),
            ("textured", self.scenery.textured.to_string()),
            ("level", name_of(self.level)),
            ("predictor", name_of(self.predictor)),
            ("adapts", self.adapts.to_string()),
            ("training_points", points.join(" ")),
            ("training_head", people.head.to_string()),
            ("training_gaze", people.gaze.to_string()),
            ("training_people_stay", people_stay.to_string()),
            ("likely_touches", touches_text(self.likely_touches)?),
        ];
        let room = self.room.map(|text| ("room", text.to_owned()));
        let ends = [("arm_root", root), ("arm_tip", tip)];
        let ends = ends
            .into_iter()
            .filter_map(|(key, link)| Some((key, link.clone()?)));
        let frame = self.scene.map(|file| file.frame).unwrap_or_default();
        let frame = [
            ("scene_scale", numbers(&[frame.metres_per_unit])),
            ("scene_y_up", frame.y_up.to_string()),
        ];
        let options = options.into_iter().chain(frame);
        let options = options.chain(room).chain(ends).chain(stand);
        Ok(Setup {
            program: concat!("hwall ", env!("CARGO_PKG_VERSION")).to_owned(),
            scene_obj,
            scene_sidecar,
            arm,
            board: *self.scenery.arm.board(),
            options: options
                .map(|(key, value)| (key.to_owned(), value))
                .collect(),
        })
    }
}

/// The options of a setup, read back.
pub(super) struct Options {
    /// Unit and axes of the scene's text.
    pub(super) frame: FileFrame,
    pub(super) base: FloorPose,
    pub(super) textured: bool,
    pub(super) level: ArmLevel,
    pub(super) predictor: PredictorKind,
    pub(super) adapts: bool,
    pub(super) training_people: TrainingPeople,
    pub(super) likely_touches: LikelyTouches,
    pub(super) room: Option<RealRoom>,
    /// First and last link of an arm from a description, if given.
    pub(super) ends: [Option<String>; 2],
}

impl Options {
    pub(super) fn of(setup: &Setup) -> anyhow::Result<Self> {
        let text = |key: &'static str| wanted(setup.option(key), key);
        let flag = |key: &'static str| flag_of(key, text(key)?);
        let [x, y, z, yaw_rad] = numbers_of("base", text("base")?)?;
        let points = text("training_points")?.split_whitespace().map(|name| {
            let point = HandPoint::ALL.into_iter().find(|p| p.name() == name);
            point.with_context(|| format!("training_points: {name:?} is no point of a hand"))
        });
        let base = FloorPose {
            origin_m: DVec3::new(x, y, z),
            yaw_rad,
        };
        // Standing place of the training people: in front of the arm, or unmoved while the base was moved.
        let nominal = TrainingPeople::default();
        let people = match setup.option("training_people_stay") {
            Some(_) if flag("training_people_stay")? => nominal.seen_from(base),
            _ => match setup.option("training_stand") {
                Some(text) => {
                    let [hx, hy, hz, x, y, z] = numbers_of("training_stand", text)?;
                    nominal.standing(&Standing {
                        head_m: DVec3::new(hx, hy, hz),
                        hand_m: DVec3::new(x, y, z),
                    })
                }
                None => nominal,
            },
        };
        // Older recordings are all in metres, z up.
        let scale = setup.option("scene_scale").unwrap_or("1");
        let [metres_per_unit] = numbers_of("scene_scale", scale)?;
        Ok(Self {
            frame: FileFrame {
                metres_per_unit,
                y_up: setup.option("scene_y_up").is_some() && flag("scene_y_up")?,
            },
            base,
            textured: flag("textured")?,
            level: named("level", text("level")?)?,
            predictor: named("predictor", text("predictor")?)?,
            // Older recordings lack this option: their predictors got no feedback.
            adapts: setup.option("adapts").is_some() && flag("adapts")?,
            training_people: TrainingPeople {
                points: points.collect::<anyhow::Result<_>>()?,
                head: flag("training_head")?,
                gaze: flag("training_gaze")?,
                ..people
            },
            likely_touches: touches_of(text("likely_touches")?)?,
            ends: ["arm_root", "arm_tip"].map(|key| setup.option(key).map(str::to_owned)),
            room: (setup.option("room"))
                .map(|text| RealRoom::parse(text.to_owned()).context("room"))
                .transpose()?,
        })
    }
}

/// Word for likely touches without points.
const DEFAULT_RANGE: &str = "usual range";
/// Word for a free roll.
const ANY_ROLL: &str = "any";

fn touches_text(touches: &LikelyTouches) -> anyhow::Result<String> {
    let places = match touches {
        LikelyTouches::Such(places) => places,
        range if *range == LikelyTouches::default() => return Ok(DEFAULT_RANGE.to_owned()),
        LikelyTouches::InRange(_) => {
            bail!("a range of likely touches of its own cannot be recorded")
        }
    };
    let place = |place: &WeightedTarget| {
        let (at, normal) = (place.target.point_m, place.target.normal);
        let all = [at.x, at.y, at.z, normal.x, normal.y, normal.z, place.weight];
        let roll = place.roll_rad.map(|roll_rad| format!("{roll_rad:?}"));
        format!("{} {}", numbers(&all), roll.as_deref().unwrap_or(ANY_ROLL))
    };
    Ok(places.iter().map(place).collect::<Vec<_>>().join("; "))
}

fn touches_of(text: &str) -> anyhow::Result<LikelyTouches> {
    if text == DEFAULT_RANGE {
        return Ok(LikelyTouches::default());
    }
    let places = text.split(';').filter(|place| !place.trim().is_empty());
    let place = |text: &str| -> anyhow::Result<WeightedTarget> {
        let (rest, roll) = text.trim().rsplit_once(' ').unwrap_or(("", text));
        let [x, y, z, nx, ny, nz, weight] = numbers_of("likely_touches", rest)?;
        let roll_rad = match roll {
            ANY_ROLL => None,
            angle => Some(numbers_of::<1>("likely_touches", angle)?[0]),
        };
        let target = Target {
            point_m: DVec3::new(x, y, z),
            normal: DVec3::new(nx, ny, nz),
        };
        Ok(WeightedTarget {
            target,
            weight,
            roll_rad,
        })
    };
    let places = places.map(place).collect::<anyhow::Result<_>>()?;
    Ok(LikelyTouches::Such(places))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in_room::BuiltInRoom;
    use crate::recording::runs::{run_of, set_from};
    use crate::run::stage::SessionSettings;
    use hwall::Walls;
    use hwall::haptics::Board;
    use hwall_hand::HandFilterConfig;
    use hwall_record::Run;

    const ROOM: &str = "[[plane]]\npoint_m = [0, 0, -0.1]\nnormal = [0, 0, 1]\n";

    #[test]
    fn options_come_back_bit_by_bit() {
        let (built_in, walls) = (BuiltInRoom::new().unwrap(), Walls::default());
        let place = |x: f64, roll_rad| WeightedTarget {
            target: Target {
                point_m: DVec3::new(x, -0.1 - x, 1.0 / 3.0),
                normal: DVec3::new(x.cos(), x.sin(), -0.0),
            },
            weight: 1e-300,
            roll_rad,
        };
        let people = TrainingPeople {
            points: vec![HandPoint::Palm, HandPoint::Index],
            head: true,
            gaze: false,
            ..TrainingPeople::default()
        };
        let source = SessionSource {
            scene: None,
            arm: &"iiwa14".into(),
            room: Some(ROOM),
            base: FloorPose {
                origin_m: DVec3::new(0.1, -2.0 / 7.0, 5e-324),
                yaw_rad: std::f64::consts::PI / 7.0,
            },
            scenery: built_in.scenery(&walls, &people, false),
            level: ArmLevel::Torque,
            predictor: PredictorKind::RayLed,
            adapts: true,
            likely_touches: &LikelyTouches::Such(vec![place(0.3, None), place(0.7, Some(0.1))]),
        };
        let options = Options::of(&source.to_setup().unwrap()).unwrap();
        assert_eq!(options.base.origin_m, source.base.origin_m);
        let bits = [options.base, source.base].map(|base| base.yaw_rad.to_bits());
        assert_eq!(bits[0], bits[1]);
        assert_eq!(options.training_people, people);
        assert_eq!(&options.likely_touches, source.likely_touches);
        assert_eq!((options.textured, options.level), (false, ArmLevel::Torque));
        assert_eq!(options.predictor, PredictorKind::RayLed);
        assert_eq!(options.room.map(|room| room.text).as_deref(), Some(ROOM));
        // People who stayed while the base was moved, and unknown people.
        let stayed = people.clone().seen_from(source.base);
        let of = |people| {
            let scenery = built_in.scenery(&walls, people, false);
            SessionSource { scenery, ..source }.to_setup()
        };
        let options = Options::of(&of(&stayed).unwrap()).unwrap();
        assert_eq!(options.training_people, stayed);
        // Other people stand where a recorded hand is first seen.
        let mut elsewhere = people.clone();
        elsewhere.person.head_m += DVec3::new(0.1, 1.0 / 3.0, -0.2);
        let options = Options::of(&of(&elsewhere).unwrap()).unwrap();
        assert_eq!(options.training_people, elsewhere);
        let mut others = elsewhere.clone();
        others.person.reach_scatter += 0.1;
        assert!(of(&others).is_err());
        let settings = SessionSettings {
            level: source.level,
            filter: HandFilterConfig::default(),
            sees_head: false,
            watches_head: true,
            link_s: 0.2,
            arm_minus_tracker_s: -0.1,
            ..SessionSettings::of(source.scenery)
        };
        // Regression: a hand with values of two decimals could not be recorded.
        for value_step_m in [0.0, 0.01, 0.1 + 0.2] {
            let filter = settings.filter.with_value_step(value_step_m);
            let run = run_of(3, &SessionSettings { filter, ..settings }).unwrap();
            let mut read = SessionSettings::of(source.scenery);
            set_from(&run, &mut read).unwrap();
            assert_eq!(read.filter, filter);
            assert_eq!((read.sees_head, read.watches_head), (false, true));
            assert_eq!((read.link_s, read.arm_minus_tracker_s), (0.2, -0.1));
        }
        let mut others = settings;
        others.filter.max_gap_s += 0.1;
        assert!(run_of(3, &others).is_err());
        let mut run = run_of(3, &settings).unwrap();
        // Recordings of earlier programs.
        run.options
            .retain(|(key, _)| !["hand_value_step_m", "watches_head"].contains(&key.as_str()));
        let mut read = SessionSettings::of(source.scenery);
        set_from(&run, &mut read).unwrap();
        assert_eq!((read.filter, read.watches_head), (settings.filter, false));
    }

    /// Regression: a scene and an arm in Latin-1 could be loaded but not recorded.
    #[test]
    fn texts_in_latin_1_are_recorded() {
        let folder = std::env::temp_dir().join(format!("hwall-latin-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = |name: &str, bytes: &[u8]| {
            let path = folder.join(name);
            std::fs::write(&path, bytes).unwrap();
            path
        };
        let triangle = b"# M\xfcller\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let obj = file("room.obj", triangle);
        file("room.toml", b"\xef\xbb\xbf# M\xc3\xbcller\n");
        let urdf = file("arm.urdf", b"<!-- M\xfcller --><robot/>");
        let built_in = BuiltInRoom::new().unwrap();
        let (walls, people) = (Walls::default(), TrainingPeople::default());
        let frame = FileFrame {
            metres_per_unit: 0.1 + 0.2,
            y_up: true,
        };
        let source = SessionSource {
            scene: Some(SceneFile { path: &obj, frame }),
            arm: &urdf.to_str().unwrap().into(),
            room: None,
            base: FloorPose::ORIGIN,
            scenery: built_in.scenery(&walls, &people, true),
            level: ArmLevel::Servo,
            predictor: PredictorKind::RayLed,
            adapts: true,
            likely_touches: &LikelyTouches::default(),
        };
        let setup = source.to_setup();
        std::fs::remove_dir_all(&folder).unwrap();
        let setup = setup.unwrap();
        assert_eq!(Options::of(&setup).unwrap().frame, frame);
        assert!(setup.scene_obj.starts_with("# M\u{fc}ller\n"));
        assert_eq!(setup.scene_sidecar.as_deref(), Some("# M\u{fc}ller\n"));
        let ArmSource::Urdf { text, .. } = setup.arm else {
            panic!("a description");
        };
        assert_eq!(text, "<!-- M\u{fc}ller --><robot/>");
    }

    #[test]
    fn a_setup_that_lacks_something_is_refused_by_name() {
        let setup = Setup {
            program: String::new(),
            scene_obj: String::new(),
            scene_sidecar: None,
            arm: ArmSource::Named("iiwa7".to_owned()),
            board: Board::default(),
            options: vec![("base".to_owned(), "0 0 NaN 0".to_owned())],
        };
        let error = Options::of(&setup).err().unwrap().to_string();
        assert!(error.contains("base"), "{error}");
        let (built_in, people) = (BuiltInRoom::new().unwrap(), TrainingPeople::default());
        let walls = Walls::default();
        let mut settings = SessionSettings::of(built_in.scenery(&walls, &people, true));
        let error = set_from(&Run::default(), &mut settings).unwrap_err();
        assert!(error.to_string().contains("hand_filter"), "{error}");
    }
}
