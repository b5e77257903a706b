//! Readers of text: scenes, recordings, arms, tables, models.

use super::{Inputs, judged, judged_text, promise};
use glam::DVec3;
use hwall_bip::model_file::ModelFileError;
use hwall_bip::{
    Basis, BipError, Demonstration, Filter, FilterConfig, Group, Model, Observation, TrainingConfig,
};
use hwall_hand::{LabelConfig, PointPair, Pose, Recording, labelled_reaches, read_recordings};
use hwall_kinematics::{Chain, KinematicsError};
use hwall_psychophysics::{AnalysisConfig, Columns, Study, analyse};
use hwall_scene::{Facet, Scene, SurfaceId};
use hwall_testkit::{Sampler, Verdict};
use hwall_texton::Calibration;

const ROOM: (&str, &str) = (
    include_str!("../../../../examples/assets/room.obj"),
    include_str!("../../../../examples/assets/room.toml"),
);
/// Separates the OBJ and the sidecar.
const CUT: &str = "\n=====\n";

/// An arm with every feature of a description.
const ARM: &str = r#"<robot name="r" version="1.0"><!-- two joints --><link name="a"><inertial><origin xyz="0 0 0.1" rpy="0 0 0"/><mass value="2.5"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial></link>
<link name="b"/><link name="c"><inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link><link name="d"/>
<joint name="ab" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.34" rpy="0 1.5708 0"/><axis xyz="0 0 1"/><limit lower="-2.9" upper="2.9" velocity="1.7" effort="176"/></joint>
<joint name="bc" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="0.1 0 0"/><axis xyz="1 0 0"/><limit lower="0" upper="0.5" velocity="0.3" effort="80"/></joint>
<joint name="cd" type="fixed"><parent link="c"/><child link="d"/><origin xyz="0 0 0.05" rpy="0 0 0.7"/></joint></robot>"#;

pub(super) fn scenes() -> Inputs {
    let room = format!("{}{CUT}{}", ROOM.0, ROOM.1);
    let small = format!(
        "v 1 -1 0\nv 1 1 0\nv 1 1 2\nv 1 -1 2\no wall\nusemtl red\nf 1 2 3 4\nf -1 -2 -3{CUT}default_kind = \"static\"\n"
    );
    Ok(vec![room.into_bytes(), small.into_bytes()])
}

pub(super) fn read_scene(bytes: &[u8]) -> Verdict {
    let read = |text: &str| match text.split_once(CUT) {
        Some((obj, sidecar)) => Scene::from_obj_str(obj, Some(sidecar)),
        None => Scene::from_obj_str(text, None),
    };
    judged_text(bytes, read, |(mut scene, _)| {
        for id in (0..scene.surfaces().len()).map(SurfaceId) {
            if let Some(range) = scene.surface(id).kind.range() {
                let _ = scene.set_opening(id, range.max);
            }
        }
        let unit = |normal: DVec3| (normal.length() - 1.0).abs() < 1e-6;
        for p in [DVec3::ZERO, DVec3::new(0.3, 0.1, 0.7), DVec3::splat(-1e3)] {
            for direction in [DVec3::X, DVec3::new(-1.0, 0.3, 0.2)] {
                if let Ok(Some(hit)) = scene.ray_cast(p, direction) {
                    let holds = hit.point_m.is_finite() && unit(hit.normal);
                    promise(holds, "a hit that is none")?;
                }
            }
            if let Ok(Some(closest)) = scene.closest_point(p, f64::INFINITY) {
                let holds = closest.point_m.is_finite() && unit(closest.normal);
                promise(holds, "a closest point that is none")?;
            }
        }
        let facets = scene.vertical_facets();
        let finite = |f: &Facet| f.point_m.is_finite() && f.area_m2.is_finite();
        promise(facets.iter().all(finite), "a facet that is not finite")
    })
}

pub(super) fn hands() -> Inputs {
    Ok([false, true].map(hand_csv).into())
}

fn hand_csv(trials: bool) -> Vec<u8> {
    let mut text = String::from(
        "t,palm_x,palm_y,palm_z,index_x,index_y,index_z,gaze_x,gaze_y,gaze_z,contact,note",
    );
    text += if trials { ",person,trial\n" } else { "\n" };
    for i in 0..80 {
        let t = f64::from(i) / 40.0;
        let x = 0.4 * (0.5 - 0.5 * (std::f64::consts::PI * t).cos());
        let (tip, contact) = (x + 0.08, u8::from(i % 40 == 39));
        text += &format!("{t},{x:.4},0.1,0.9,{tip:.4},0.12,0.93,1,0,0,{contact},n");
        if trials {
            text += &format!(",p{},{}", i % 2, i / 40);
        }
        text += "\n";
    }
    text.into_bytes()
}

pub(super) fn read_hand(bytes: &[u8]) -> Verdict {
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
        let same = samples(&again) == samples(&recordings);
        promise(same, "samples lost on the way")?;
        if let Some(recording) = recordings.first() {
            let _ = recording.resampled(0.01, 0.1);
        }
        Ok(())
    })
}

pub(super) fn arms() -> Inputs {
    Ok(vec![ARM.into()])
}

pub(super) fn read_arm(bytes: &[u8]) -> Verdict {
    let read = |text: &str| Chain::from_urdf_str(text, None, None);
    judged_text(bytes, read, |chain| {
        let q = vec![0.1; chain.joint_count()];
        match chain.forward(&q) {
            Ok(pose) => promise(pose.position_m().is_finite(), "a pose that is not finite"),
            Err(KinematicsError::Argument(_) | KinematicsError::Geometry(_)) => Ok(()),
            Err(error) => Err(format!("no pose: {error}")),
        }
    })
}

pub(super) fn studies() -> Inputs {
    Ok([false, true].map(study_csv).into())
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
                text += &format!("s{subject},{orientation},{velocity},{value:.3}");
                if groups {
                    text += &format!(",g{}", subject % 2);
                }
                text += "\n";
            }
        }
    }
    text.into_bytes()
}

pub(super) fn read_study(bytes: &[u8]) -> Verdict {
    let mut columns = Columns::new("subject", ["orientation", "velocity"], "value");
    let header = bytes.split(|byte| *byte == b'\n').next();
    if header.is_some_and(|header| header.ends_with(b"group")) {
        columns = columns.with_between("group");
    }
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

pub(super) fn calibrations() -> Inputs {
    let mut text = String::from("orientation_deg,velocity_mm_s,value\n");
    for (i, orientation) in [0, 45, 90].into_iter().enumerate() {
        for velocity in [20, 40, 80] {
            let value = 1.0 + i as f64 + 0.01 * f64::from(velocity);
            text += &format!("{orientation},{velocity},{value}\n");
        }
    }
    Ok(vec![text.into_bytes()])
}

pub(super) fn read_calibration(bytes: &[u8]) -> Verdict {
    judged(Calibration::from_csv(bytes), |calibration| {
        for node in calibration.nodes() {
            let found = calibration.magnitude(node.scan, node.speed_mm_per_s);
            let found = found.map_err(|error| format!("a node outside: {error}"))?;
            let off = (found - node.magnitude).abs();
            let on = off <= 1e-6 * (1.0 + node.magnitude.abs());
            promise(on, "a node off its magnitude")?;
            if let Ok(level) = calibration.level_for(node.magnitude) {
                let finite = level.speed_mm_per_s.is_finite();
                promise(finite, "a level that is not finite")?;
            }
        }
        Ok(())
    })
}

pub(super) fn headsets() -> Inputs {
    let corners = [[0.62, -0.1, 0.6], [0.62, 0.1, 0.6], [0.62, 0.1, 0.4]].map(DVec3::from);
    let space = Pose::from_yaw(2.5, DVec3::new(1.4, 0.2, -0.6))? * Pose::Z_UP_FROM_Y_UP;
    let touches = corners.map(|corner_m| PointPair {
        in_a_m: corner_m,
        in_b_m: space.inverse_transform_point(corner_m),
    });
    let good = hwall_bridge::Calibration::from_touches(1, touches)?.to_json();
    Ok(vec![good.into_bytes()])
}

pub(super) fn read_headset(bytes: &[u8]) -> Verdict {
    let read = hwall_bridge::Calibration::from_json;
    judged_text(bytes, read, |calibration| {
        let off_m = calibration.rms_m();
        promise(
            off_m <= hwall_bridge::FIT_BOUND_M,
            "touches that do not fit",
        )?;
        let again = read(&calibration.to_json());
        promise(again.as_ref() == Ok(&calibration), "not its own file")
    })
}

/// Models with two bases, as files.
pub(super) fn models() -> Inputs {
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
    let model = |basis| {
        let groups = vec![
            Group::observed("hand", 1, basis),
            Group::controlled("arm", 1, basis),
        ];
        let model = Model::train(&demonstrations, &TrainingConfig::new(groups))?;
        Ok(model.to_json().into_bytes())
    };
    let bases = [Basis::Legendre { count: 4 }, Basis::gaussian(5)];
    bases.map(model).into_iter().collect()
}

/// Reads a model with a corrected digest: the digest protects only against accidents, so the reader must check everything else.
fn forged<T, E>(
    text: &str,
    read: impl Fn(&str) -> Result<T, E>,
    file_error: impl Fn(&E) -> Option<&ModelFileError>,
) -> Result<T, E> {
    read(text).or_else(|error| match file_error(&error) {
        Some(ModelFileError::Digest { stored, computed }) if !stored.is_empty() => {
            read(&text.replacen(stored.as_str(), computed, 1))
        }
        _ => Err(error),
    })
}

pub(super) fn read_model(bytes: &[u8]) -> Verdict {
    fn file_error(error: &BipError) -> Option<&ModelFileError> {
        match error {
            BipError::File(error) => Some(error),
            _ => None,
        }
    }
    let read = |text: &str| forged(text, Model::from_json, file_error);
    judged_text(bytes, read, |model| {
        let again = Model::from_json(&model.to_json());
        let same = again.is_ok_and(|again| again == model);
        promise(same, "a model that cannot read its own file")?;
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
