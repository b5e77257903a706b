//! Files of region models: bit-identical regions, and an error for every damage.

use crate::common::damaged;
use hwall_contact::hwall_bip::model_file::ModelFileError;
use hwall_contact::{ContactError, RegionModel};
use hwall_testkit::Sampler;
use serde_json::{Value, json};

/// A file as a trained model writes it, without the digest.
fn unsigned() -> Value {
    let logarithms: Vec<[f64; 3]> = (0..7)
        .map(|knot| [0.1, 0.7, 1.5].map(|l| l + 0.1 * f64::from(knot)))
        .collect();
    json!({
        "format": "hwall-contact regions",
        "version": 1,
        "digest": "?",
        "touches": 144,
        "logarithms": logarithms,
    })
}

/// The file with a forged digest.
fn signed(mut file: Value) -> String {
    file["digest"] = "?".into();
    match RegionModel::from_json(&file.to_string()) {
        Err(ContactError::File(ModelFileError::Digest { computed, .. })) => {
            file["digest"] = computed.into();
        }
        other => assert!(other.is_err()),
    }
    file.to_string()
}

#[test]
fn a_model_read_says_the_same_to_the_last_bit() {
    let model = RegionModel::from_json(&signed(unsigned())).expect("good");
    assert_eq!(model.touches(), 144);
    let mut file = Vec::new();
    model.write_json(&mut file).expect("memory");
    let read = RegionModel::read_json(&file[..]).expect("as written");
    assert_eq!(read, model);
    for way_m in [0.0, 0.013, 0.2, 3.0] {
        assert_eq!(read.at(way_m), model.at(way_m));
    }
    let pretty: Value = serde_json::from_slice(&file).expect("JSON");
    let pretty = serde_json::to_string_pretty(&pretty).expect("JSON");
    assert_eq!(RegionModel::from_json(&pretty).expect("the same"), model);
}

#[test]
fn each_damage_has_its_error() {
    use ContactError::File;
    use ModelFileError as F;
    let error = |text: &str| RegionModel::from_json(text).expect_err("damaged");
    assert!(matches!(error(""), File(F::Truncated { .. })));
    assert!(matches!(error("{}"), File(F::Contents { .. })));
    let other = error(r#"{"format": "hwall-contact learned model", "version": 1}"#);
    assert!(matches!(other, File(F::Format { .. })));
    let (newest, found) = (1, 2);
    let new = error(r#"{"format": "hwall-contact regions", "version": 2, "new": 0}"#);
    assert_eq!(new, File(F::Version { newest, found }));
    for (field, value) in [
        ("logarithms", json!([[0.0, 1.0, 2.0]])),
        ("logarithms", Value::Null),
        ("touches", json!(-1)),
        ("more", json!(1)),
    ] {
        let mut file = unsigned();
        file[field] = value;
        let error = error(&signed(file));
        assert!(matches!(error, File(F::Contents { .. })), "{field}");
    }
    let good = signed(unsigned());
    let changed = good.replacen("144", "145", 1);
    assert!(matches!(error(&changed), File(F::Digest { .. })));
}

/// A digest only protects against accidents.
#[test]
fn forged_numbers_are_refused() {
    for (touches, logarithm) in [(3, 0.1), (0, 0.1), (144, 20.5), (144, -1e300), (144, 1e300)] {
        let mut file = unsigned();
        file["touches"] = touches.into();
        file["logarithms"][3][1] = logarithm.into();
        let error = RegionModel::from_json(&signed(file)).expect_err("forged");
        assert!(matches!(error, ContactError::Argument(_)), "{error}");
    }
    // Within bounds only the sizes change, and they still rise.
    let mut file = unsigned();
    file["logarithms"][3] = json!([19.0, -19.0, 0.0]);
    let model = RegionModel::from_json(&signed(file)).expect("within bounds");
    let [a, b, c] = model.at(0.06).squared();
    assert!(a > 0.0 && a <= b && b <= c && c.is_finite());
}

/// A damaged file gives the written model or an error.
#[test]
fn no_damage_passes_unnoticed() {
    let text = signed(unsigned());
    let model = RegionModel::from_json(&text).expect("good");
    let mut sampler = Sampler::new(5);
    for end in 0..text.len() {
        assert!(RegionModel::from_json(&text[..end]).is_err(), "{end}");
    }
    for _ in 0..5_000 {
        match RegionModel::read_json(&damaged(&mut sampler, text.as_bytes())[..]) {
            Ok(read) => assert_eq!(read, model),
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
}
