//! Files of learned models: bit-identical answers, and an error for every damage.

use crate::reaches::reaches;
use hwall_contact::hwall_bip::model_file::ModelFileError;
use hwall_contact::{
    Combination, ContactError, ContactEstimate, ContactEstimator, LearnedConfig, LearnedModel,
};
use hwall_hand::{HandFrame, HandPoint, LabelledReach};
use hwall_testkit::{Verdict, attack};
use serde_json::Value;
use std::sync::LazyLock;

fn trained(change: impl Fn(&mut LearnedConfig, &mut Vec<LabelledReach>)) -> LearnedModel {
    let (mut config, mut known) = (LearnedConfig::default(), reaches(1, 3, 12));
    change(&mut config, &mut known);
    LearnedModel::train(&known, &config).expect("good reaches")
}

/// A small model, so that tests with many kinds of damage are fast.
static SMALL: LazyLock<String> = LazyLock::new(|| {
    trained(|config, known| {
        config.regions = Some(2);
        config.samples_per_reach = 5;
        config.lags = 1;
        config.rank = 3;
        for reach in known {
            reach.normal = None;
            reach.frames.iter_mut().for_each(|f| {
                f.head_m = None;
                f.tips_m = [None, f.tips_m[1], None, None, None];
                f.palm_m = None;
            });
        }
    })
    .to_json()
});

/// Answers to fully visible hands, and to hands with only the touching point.
fn answers(model: &LearnedModel) -> Vec<ContactEstimate> {
    let mut estimator = model.estimator();
    let mut all = Vec::new();
    for reach in reaches(2, 2, 4) {
        estimator.begin();
        all.extend(reach.frames.iter().filter_map(|f| estimator.step(f)));
        estimator.begin();
        for frame in &reach.frames {
            let mut only = HandFrame::empty(frame.t_s);
            only.set_point(HandPoint::Index, frame.point(HandPoint::Index));
            all.extend(estimator.step(&only));
        }
    }
    assert!(!all.is_empty());
    all
}

/// Bits of all numbers in an answer, as `==` does not distinguish ±0.
fn bits(answers: &[ContactEstimate]) -> Vec<u64> {
    let numbers = |e: &ContactEstimate| {
        let time = e.time_to_contact_s.expect("learnt");
        let mut all = vec![e.t_s, time.mean_s, time.sd_s.expect("learnt")];
        all.extend(e.point_m.to_array());
        all.extend(e.covariance_m2.expect("learnt").to_cols_array());
        all.extend(e.normal.map(|n| n.to_array()).into_iter().flatten());
        all
    };
    answers.iter().flat_map(numbers).map(f64::to_bits).collect()
}

#[test]
fn a_model_read_foresees_the_same_to_the_last_bit() {
    let of = |combination| move |c: &mut LearnedConfig, _: &mut Vec<_>| c.combination = combination;
    let models = [
        trained(of(Combination::Regression)),
        trained(of(Combination::Primitive)),
        trained(of(Combination::Both)),
        trained(|config, known| {
            (config.lags, config.rank, config.regions) = (0, 5, Some(1));
            known.iter_mut().for_each(|r| r.normal = None);
        }),
        LearnedModel::from_json(&SMALL).expect("as written"),
    ];
    for model in models {
        let text = model.to_json();
        let read = LearnedModel::from_json(&text).expect("as written");
        assert_eq!(read.to_json(), text);
        assert_eq!(bits(&answers(&read)), bits(&answers(&model)));
        let mut file = Vec::new();
        model.write_json(&mut file).expect("memory");
        let value: Value = serde_json::from_slice(&file).expect("JSON");
        let pretty = serde_json::to_vec_pretty(&value).expect("JSON");
        for file in [file, pretty] {
            let read = LearnedModel::read_json(&file[..]).expect("as written");
            assert_eq!(read.to_json(), text);
        }
    }
}

#[test]
fn a_model_says_what_it_was_learnt_from() {
    let model = trained(|_, _| ());
    assert_eq!((model.reaches(), model.people()), (12, 3));
    assert_eq!(model.touching_point(), HandPoint::Index);
    assert_eq!(model.combination(), Combination::Both);
    let mut durations: Vec<f64> = reaches(1, 3, 12).iter().map(|r| r.duration_s()).collect();
    durations.sort_by(f64::total_cmp);
    assert!((durations[5]..=durations[6]).contains(&model.median_duration_s()));
    let nobody = trained(|_, known| known.iter_mut().for_each(|r| r.person = None));
    assert_eq!(nobody.people(), 0);
}

/// Replaces the field at a path; an empty path is the file itself.
fn replace(file: &mut Value, path: &str, value: Value) {
    let keys = path.split('.').filter(|key| !key.is_empty());
    let at = keys.fold(file, |at, key| match key.parse::<usize>() {
        Ok(index) => &mut at[index],
        Err(_) => &mut at[key],
    });
    assert_ne!(*at, value, "{path}");
    *at = value;
}

/// The error of the small file with one field replaced.
fn error_with(path: &str, value: Value) -> ContactError {
    let mut file: Value = serde_json::from_str(&SMALL).expect("JSON");
    replace(&mut file, path, value);
    error(&file.to_string())
}

fn error(text: &str) -> ContactError {
    LearnedModel::from_json(text).expect_err("damaged")
}

#[test]
fn each_damage_has_its_error() {
    use ContactError as E;
    use ModelFileError as F;
    assert!(matches!(error(""), E::File(F::Truncated { .. })));
    assert!(matches!(error("model"), E::File(F::Syntax { .. })));
    assert!(matches!(error("{}"), E::File(F::Contents { .. })));
    let twice = format!("{0}{0}", *SMALL);
    assert!(matches!(error(&twice), E::File(F::Syntax { .. })));
    let expected = "hwall-contact learned model";
    let found = "hwall-bip model".to_owned();
    let other = error(r#"{"format": "hwall-bip model", "version": 1}"#);
    assert_eq!(other, E::File(F::Format { expected, found }));
    // A newer version may differ in every other field.
    let (newest, found) = (9, 10);
    let new = format!(r#"{{"format": "{expected}", "version": 10, "x": 1}}"#);
    assert_eq!(error(&new), E::File(F::Version { newest, found }));
    for (path, value) in [
        ("blend.regions", Value::Array(Vec::new())),
        ("ridges.0.scale", vec![1.0; 3].into()),
        ("ridges.0.coefficients", vec![1.0; 7].into()),
        ("inputs.offsets_m", Vec::<f64>::new().into()),
        ("inputs.head", true.into()),
        ("relied_on", vec![true].into()),
        ("primitive", Value::Null),
        ("combination", "regression".into()),
    ] {
        let error = error_with(path, value);
        assert!(matches!(error, E::FileLength { .. }), "{path}: {error}");
    }
    for (path, value) in [
        ("inputs.point", 6.into()),
        ("inputs.others", vec![2].into()),
        ("inputs.others", vec![0, 0].into()),
        ("inputs.lags", 9.into()),
        ("inputs.lags", 3.into()),
        ("gates.centres", Value::Array(Vec::new())),
        ("gates.width", 0.0.into()),
        ("ridges.0.outputs", 0.into()),
        ("ridges.0.outputs", usize::MAX.into()),
        ("blend.personal.sources.0.0", 1.0.into()),
        ("blend.personal.time.5", (-0.1).into()),
        ("blend.personal.habits.2.slope", (-0.1).into()),
        ("blend.personal.habits.3.offset", (-0.1).into()),
        ("blend.personal.habits.0.scatter_m", 0.0.into()),
        // A digest only protects against accidents: durations and variances are checked before it.
        ("median_duration_s", (-1e-3).into()),
        ("blend.regions.0.moments.0.0", (-1e-3).into()),
        ("blend.regions.1.shape.8", (-1e-3).into()),
        ("blend.regions.0.time_s2", (-1e-3).into()),
        ("blend.regions.0.spread", (-1e-3).into()),
        ("blend.regions.1.size_m2", (-1e-3).into()),
        ("ridges.0.scale.0", (-1e-3).into()),
        ("ridges.1.scale.0", (-1e-3).into()),
        ("gates.scale.0", (-1e-3).into()),
    ] {
        let error = error_with(path, value);
        assert!(matches!(error, E::Argument(_)), "{path}: {error}");
    }
    for (path, value) in [
        ("reaches", 13.into()),
        ("median_duration_s", 0.5.into()),
        ("combination", "primitive".into()),
        ("gates.centres.0.1", 0.25.into()),
        ("ridges.0.coefficients.2", 0.25.into()),
        ("blend.axes", "nowhere".into()),
        ("blend.regions.1.share", 0.25.into()),
        ("primitive.label_offset_m.0", 0.25.into()),
        ("primitive.model.mean.0", 0.25.into()),
        ("primitive.model", Value::Null),
        ("digest", "0".into()),
    ] {
        let error = error_with(path, value);
        let named = matches!(error, E::File(F::Digest { .. } | F::Contents { .. }));
        assert!(named, "{path}: {error}");
    }
    for (path, value) in [
        ("ridges.0.coefficients.2", Value::Null),
        ("gates.scale", vec![1.0; 3].into()),
        ("blend.personal", Value::Null),
        ("blend.personal.habits", Value::Null),
        ("people", (-1).into()),
        ("more", 1.into()),
    ] {
        let error = error_with(path, value);
        let named = matches!(error, E::File(F::Contents { .. }));
        assert!(named, "{path}: {error}");
    }
}

/// The model of the touching point alone is part of the file, and equally protected.
#[test]
fn the_model_for_hands_of_which_little_is_seen_is_guarded_too() {
    let model = trained(|config, _| {
        config.regions = Some(2);
        config.samples_per_reach = 5;
    });
    let file: Value = serde_json::from_str(&model.to_json()).expect("JSON");
    assert!(file["alone"].is_object());
    for (path, value) in [
        ("ridges.0.coefficients.2", 0.25.into()),
        ("ridges.0.scale.0", (-1.0).into()),
        ("blend.regions.0.size_m2", (-1e-3).into()),
        ("gates.centres", Value::Array(Vec::new())),
        ("inputs.lags", 9.into()),
        ("primitive", Value::Null),
        ("more", 1.into()),
        ("", 1.into()),
    ] {
        let mut other = file.clone();
        replace(&mut other["alone"], path, value);
        let read = LearnedModel::from_json(&other.to_string());
        assert!(read.is_err(), "{path}");
    }
    // The digest of the file covers it.
    let mut without = file;
    without.as_object_mut().expect("an object").remove("alone");
    let refused = error(&without.to_string());
    let named = matches!(refused, ContactError::File(ModelFileError::Digest { .. }));
    assert!(named, "{refused}");
}

/// A damaged file gives the written model or an error.
#[test]
fn no_damage_passes_unnoticed() {
    let text = SMALL.as_bytes();
    for end in (0..text.len()).step_by(7) {
        let read = LearnedModel::read_json(&text[..end]);
        assert!(read.is_err(), "cut off at {end}");
    }
    let report = attack("learned model", &[text.to_vec()], 2_000, 2, |bytes| {
        match LearnedModel::read_json(bytes) {
            Ok(read) => assert_eq!(read.to_json(), *SMALL),
            Err(error) => assert!(!error.to_string().is_empty()),
        }
        Verdict::Refused
    });
    assert_eq!(report.findings, 0, "{report:?}");
}
