//! Readers of text: scenes, recordings, arms, tables, models.

use super::{Target, judged, promise};
use glam::DVec3;
use hwall_bip::model_file::ModelFileError;
use hwall_bip::{
    Basis, BipError, Demonstration, Filter, FilterConfig, Group, Model, Observation, TrainingConfig,
};
use hwall_contact::{
    ContactError, ContactEstimate, ContactEstimator, FusedConfig, FusedPredictor, LabelledStream,
    RegionModel, StreamContact, StreamFilters,
};
use hwall_hand::{
    HandFilterConfig, HandFrame, HandPoint, LabelConfig, Recording, labelled_reaches,
    read_recordings,
};
use hwall_kinematics::{Chain, KinematicsError};
use hwall_psychophysics::{AnalysisConfig, Columns, Study, analyse};
use hwall_scene::Scene;
use hwall_testkit::{Sampler, Verdict};
use hwall_texton::Calibration;

const ROOM: (&str, &str) = (
    include_str!("../../../../examples/assets/room.obj"),
    include_str!("../../../../examples/assets/room.toml"),
);
/// Ends the OBJ and begins the sidecar.
const CUT: &str = "\n=====\n";

/// An arm with all that a description may hold.
const ARM: &str = r#"<robot name="r" version="1.0"><!-- two joints --><link name="a"><inertial><origin xyz="0 0 0.1" rpy="0 0 0"/><mass value="2.5"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial></link>
<link name="b"/><link name="c"><inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link><link name="d"/>
<joint name="ab" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.34" rpy="0 1.5708 0"/><axis xyz="0 0 1"/><limit lower="-2.9" upper="2.9" velocity="1.7" effort="176"/></joint>
<joint name="bc" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="0.1 0 0"/><axis xyz="1 0 0"/><limit lower="0" upper="0.5" velocity="0.3" effort="80"/></joint>
<joint name="cd" type="fixed"><parent link="c"/><child link="d"/><origin xyz="0 0 0.05" rpy="0 0 0.7"/></joint></robot>"#;

pub(super) fn scene() -> Target {
    let room = format!("{}{CUT}{}", ROOM.0, ROOM.1);
    let small = format!(
        "v 1 -1 0\nv 1 1 0\nv 1 1 2\nv 1 -1 2\no wall\nusemtl red\nf 1 2 3 4\nf -1 -2 -3{CUT}default_kind = \"static\"\n"
    );
    let good = vec![room.into_bytes(), small.into_bytes()];
    Target::new("scene", good, read_scene)
}

pub(super) fn hand() -> Target {
    Target::new("hand", vec![hand_csv(false), hand_csv(true)], read_hand)
}

pub(super) fn urdf() -> Target {
    Target::new("urdf", vec![ARM.as_bytes().to_vec()], read_urdf)
}

pub(super) fn study() -> Target {
    Target::new("study", vec![study_csv(false), study_csv(true)], read_study)
}

pub(super) fn calibration() -> Target {
    Target::new("calibration", vec![calibration_csv()], read_calibration)
}

pub(super) fn model() -> Target {
    Target::new("model", models(), read_model)
}

pub(super) fn regions() -> anyhow::Result<Target> {
    Ok(Target::new(
        "regions",
        vec![learnt_regions()?],
        read_regions,
    ))
}

fn read_scene(bytes: &[u8]) -> Verdict {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return Verdict::Refused;
    };
    let (obj, sidecar) = match text.split_once(CUT) {
        Some((obj, sidecar)) => (obj, Some(sidecar)),
        None => (text, None),
    };
    judged(Scene::from_obj_str(obj, sidecar), |(mut scene, _)| {
        let opened: Vec<_> = scene.surfaces().iter().map(|s| s.name.clone()).collect();
        let ids: Vec<_> = opened.iter().filter_map(|name| scene.find(name)).collect();
        for id in ids {
            if let Some(range) = scene.surface(id).kind.range() {
                let _ = scene.set_opening(id, range.max);
            }
        }
        for p in [DVec3::ZERO, DVec3::new(0.3, 0.1, 0.7), DVec3::splat(-1e3)] {
            for direction in [DVec3::X, DVec3::new(-1.0, 0.3, 0.2)] {
                if let Ok(Some(hit)) = scene.ray_cast(p, direction) {
                    let unit = (hit.normal.length() - 1.0).abs() < 1e-6;
                    promise(hit.point_m.is_finite() && unit, "a hit that is none")?;
                }
            }
            if let Ok(Some(closest)) = scene.closest_point(p, f64::INFINITY) {
                let unit = (closest.normal.length() - 1.0).abs() < 1e-6;
                promise(
                    closest.point_m.is_finite() && unit,
                    "a closest point that is none",
                )?;
            }
        }
        let facets = scene.vertical_facets();
        let finite = |f: &hwall_scene::Facet| f.point_m.is_finite() && f.area_m2.is_finite();
        promise(facets.iter().all(finite), "a facet that is not finite")
    })
}

fn hand_csv(trials: bool) -> Vec<u8> {
    let mut text = String::from(
        "t,palm_x,palm_y,palm_z,index_x,index_y,index_z,gaze_x,gaze_y,gaze_z,contact,note",
    );
    text += if trials { ",person,trial\n" } else { "\n" };
    for i in 0..80 {
        let t = f64::from(i) / 40.0;
        let x = 0.4 * (0.5 - 0.5 * (std::f64::consts::PI * t).cos());
        let trial = if trials {
            format!(",p{},{}", i % 2, i / 40)
        } else {
            String::new()
        };
        let contact = u8::from(i % 40 == 39);
        text += &format!(
            "{t},{x:.4},0.1,0.9,{:.4},0.12,0.93,1,0,0,{contact},n{trial}\n",
            x + 0.08
        );
    }
    text.into_bytes()
}

fn read_hand(bytes: &[u8]) -> Verdict {
    judged(read_recordings(bytes), |recordings| {
        let valid = recordings.iter().all(|r| r.validate().is_ok());
        promise(valid, "a recording that is not valid")?;
        let labelled = labelled_reaches(&recordings, &LabelConfig::default());
        let labelled = labelled.map_err(|error| format!("no labels: {error}"))?;
        let valid = labelled.reaches.iter().all(|r| r.validate().is_ok());
        promise(valid, "a reach that is not valid")?;
        let mut written = Vec::new();
        hwall_hand::write_recordings(&mut written, &recordings)
            .map_err(|error| format!("cannot be written: {error}"))?;
        let again =
            read_recordings(&written[..]).map_err(|error| format!("not read again: {error}"))?;
        let samples = |all: &[Recording]| all.iter().map(|r| r.samples.len()).sum::<usize>();
        promise(
            samples(&again) == samples(&recordings),
            "samples lost on the way",
        )?;
        if let Some(recording) = recordings.first() {
            let _ = recording.resampled(0.01, 0.1);
        }
        Ok(())
    })
}

fn read_urdf(bytes: &[u8]) -> Verdict {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return Verdict::Refused;
    };
    judged(Chain::from_urdf_str(text, None, None), |chain| {
        let q = vec![0.1; chain.joint_count()];
        match chain.forward(&q) {
            Ok(pose) => promise(pose.position_m().is_finite(), "a pose that is not finite"),
            Err(KinematicsError::Argument(_) | KinematicsError::Geometry(_)) => Ok(()),
            Err(error) => Err(format!("no pose: {error}")),
        }
    })
}

fn study_csv(groups: bool) -> Vec<u8> {
    let mut sampler = Sampler::new(5);
    let mut text = String::from("subject,orientation,velocity,value");
    text += if groups { ",group\n" } else { "\n" };
    for subject in 0..8 {
        for orientation in [0, 45, 90] {
            for velocity in [20, 40] {
                let value =
                    f64::from(orientation) / 45.0 + 0.1 * f64::from(velocity) + sampler.normal();
                let group = if groups {
                    format!(",g{}", subject % 2)
                } else {
                    String::new()
                };
                text += &format!("s{subject},{orientation},{velocity},{value:.3}{group}\n");
            }
        }
    }
    text.into_bytes()
}

fn read_study(bytes: &[u8]) -> Verdict {
    let plain = Columns::new("subject", ["orientation", "velocity"], "value");
    let grouped = bytes
        .split(|byte| *byte == b'\n')
        .next()
        .is_some_and(|header| header.ends_with(b"group"));
    let columns = if grouped {
        plain.with_between("group")
    } else {
        plain
    };
    judged(Study::read_csv(bytes, &columns), |study| {
        let config = AnalysisConfig {
            art: true,
            posthoc: Some(hwall_psychophysics::Adjustment::Holm),
            ..AnalysisConfig::default()
        };
        let Ok(analysis) = analyse(&study, &config) else {
            return Ok(());
        };
        let mut p = analysis.effects.iter().filter_map(|effect| effect.p);
        let possible = |p: f64| p.is_nan() || (0.0..=1.0 + 1e-9).contains(&p);
        promise(p.all(possible), "a probability that is none")?;
        promise(!analysis.to_text().is_empty(), "no report")
    })
}

fn calibration_csv() -> Vec<u8> {
    let mut text = String::from("orientation_deg,velocity_mm_s,value\n");
    for (i, orientation) in [0, 45, 90].into_iter().enumerate() {
        for velocity in [20, 40, 80] {
            let value = 1.0 + i as f64 + 0.01 * f64::from(velocity);
            text += &format!("{orientation},{velocity},{value}\n");
        }
    }
    text.into_bytes()
}

fn read_calibration(bytes: &[u8]) -> Verdict {
    judged(Calibration::from_csv(bytes), |calibration| {
        for node in calibration.nodes() {
            let found = calibration.magnitude(node.scan, node.speed_mm_per_s);
            let found = found.map_err(|error| format!("a node outside: {error}"))?;
            let off = (found - node.magnitude).abs();
            promise(
                off <= 1e-6 * (1.0 + node.magnitude.abs()),
                "a node off its magnitude",
            )?;
            if let Ok(level) = calibration.level_for(node.magnitude) {
                promise(
                    level.speed_mm_per_s.is_finite(),
                    "a level that is not finite",
                )?;
            }
        }
        Ok(())
    })
}

/// Models of two bases, as files.
fn models() -> Vec<Vec<u8>> {
    let mut sampler = Sampler::new(1);
    let demonstrations: Vec<Demonstration> = (0..6)
        .filter_map(|_| {
            let goal = sampler.uniform(0.2, 0.6);
            let values = (0..30).flat_map(|k| {
                let t = f64::from(k) / 29.0;
                let gone = t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
                [goal * gone + 1e-3 * (7.0 * t).sin(), 0.5 * goal * gone]
            });
            Demonstration::from_samples(0.02, 2, values.collect()).ok()
        })
        .collect();
    [Basis::Legendre { count: 4 }, Basis::gaussian(5)]
        .into_iter()
        .filter_map(|basis| {
            let groups = vec![
                Group::observed("hand", 1, basis),
                Group::controlled("arm", 1, basis),
            ];
            let model = Model::train(&demonstrations, &TrainingConfig::new(groups)).ok()?;
            Some(model.to_json().into_bytes())
        })
        .collect()
}

fn read_model(bytes: &[u8]) -> Verdict {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return Verdict::Refused;
    };
    let mut read = Model::from_json(text);
    // A forged digest: it is against accidents only, so everything else must be checked as well.
    if let Err(BipError::File(ModelFileError::Digest { stored, computed })) = &read
        && !stored.is_empty()
    {
        read = Model::from_json(&text.replacen(stored.as_str(), computed, 1));
    }
    judged(read, |model| {
        let again = Model::from_json(&model.to_json());
        promise(
            again.is_ok_and(|again| again == model),
            "a model that cannot read its own file",
        )?;
        let Ok(mut filter) = Filter::new(&model, &FilterConfig::default()) else {
            return Ok(());
        };
        for value in [0.01, 0.05, 0.1] {
            let _ = filter.predict(0.02);
            let _ = filter.observe(&Observation::new(&[0], &[value]));
        }
        promise(filter.phase().is_finite(), "a phase that is not finite")
    })
}

/// The hand touches where it is.
struct Here;

impl ContactEstimator for Here {
    fn begin(&mut self) {}

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        let point_m = frame.point(HandPoint::Index)?;
        Some(ContactEstimate::of_point(frame.t_s, point_m))
    }
}

/// Regions learnt from a hand that goes to a wall and back, as a file.
fn learnt_regions() -> anyhow::Result<Vec<u8>> {
    let wall = "o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 2\nv 0.6 -1 2\nf 1 2 3 4\n";
    let (scene, _) = Scene::from_obj_str(wall, None)?;
    let home_m = DVec3::new(0.1, 0.0, 1.0);
    let (mut frames, mut contacts) = (Vec::new(), Vec::new());
    for touch in 0..6_u8 {
        let point_m = DVec3::new(0.6, 0.1 * f64::from(touch) - 0.3, 1.1);
        for k in 0..150_u8 {
            let t_s = 1.5 * f64::from(touch) + 0.01 * f64::from(k);
            let gone = |from_s: f64| (f64::from(k).mul_add(0.01, -from_s) / 0.5).clamp(0.0, 1.0);
            let way = |x: f64| x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
            let mut frame = HandFrame::empty(t_s);
            let at_m = home_m.lerp(point_m, way(gone(0.2)) - way(gone(0.8)));
            frame.set_point(HandPoint::Index, Some(at_m));
            frames.push(frame);
        }
        let contact_s = 1.5 * f64::from(touch) + 0.7;
        contacts.push(StreamContact { point_m, contact_s });
    }
    let stream = LabelledStream {
        frames: &frames,
        contacts: &contacts,
    };
    let filters = StreamFilters {
        hand: HandFilterConfig::simulated(),
        ..StreamFilters::default()
    };
    let predictor = |_| FusedPredictor::new(Here, FusedConfig::default());
    let model = RegionModel::fit_streams(&scene, &[stream], predictor, &filters)?;
    Ok(model.to_json().into_bytes())
}

fn read_regions(bytes: &[u8]) -> Verdict {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return Verdict::Refused;
    };
    let mut read = RegionModel::from_json(text);
    // A forged digest: it is against accidents only, so everything else must be checked as well.
    if let Err(ContactError::File(ModelFileError::Digest { stored, computed })) = &read
        && !stored.is_empty()
    {
        read = RegionModel::from_json(&text.replacen(stored.as_str(), computed, 1));
    }
    judged(read, |model| {
        let again = RegionModel::from_json(&model.to_json());
        promise(
            again.is_ok_and(|again| again == model),
            "regions that cannot read their own file",
        )?;
        for way_m in [0.0, 0.02, 0.3, 9.0] {
            let [a, b, c] = model.at(way_m).squared();
            promise(
                a > 0.0 && a <= b && b <= c && c.is_finite(),
                "a size that is none",
            )?;
        }
        Ok(())
    })
}
