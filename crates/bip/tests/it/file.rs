//! Model files: bit-identical round trips, and an error for every damage.

use crate::common::{one_group, reaches, trained};
use hwall_bip::model_file::ModelFileError;
use hwall_bip::{ArgumentError, Basis, BipError, Group, Model, Role, TrainingConfig, Tuning};
use hwall_testkit::{Sampler, Verdict, attack};
use serde_json::Value;

fn bases() -> Vec<Basis> {
    vec![
        Basis::gaussian(6),
        // Dependent up to rounding: fewer orthonormal functions, infinite condition number.
        Basis::Gaussian {
            count: 30,
            variance: 0.5,
        },
        Basis::normalized_gaussian(7),
        Basis::Sigmoid {
            count: 5,
            width: 0.1,
        },
        Basis::Polynomial { count: 6 },
        Basis::Legendre { count: 6 },
        Basis::Chebyshev { count: 6 },
    ]
}

fn model(basis: Basis, change: impl Fn(&mut TrainingConfig)) -> Model {
    let mut config = TrainingConfig::new(vec![
        Group::observed("hand \"π\"\n", 2, basis),
        Group {
            role: Role::Either,
            ..Group::controlled("", 1, Basis::Legendre { count: 4 })
        },
    ]);
    change(&mut config);
    Model::train(&reaches(1, 5, 3), &config).unwrap()
}

fn small() -> Model {
    trained(&reaches(1, 3, 3), Basis::gaussian(3))
}

fn tuned(model: Model) -> Model {
    let tuning = Tuning {
        noise_factor: 16.0,
        acceleration_variance: 0.1 + 0.2,
        spread: 1.25,
        time_spread: 1.5,
        correlation_time: 0.3,
    };
    model.with_tuning(tuning).unwrap()
}

/// The bits of all public numbers of a model, because `==` does not compare NaN or ±0.
fn bits(model: &Model) -> Vec<u64> {
    let prior = model.to_prior();
    let held_out = model.noise_held_out().unwrap_or(&[]);
    [
        &prior.mean,
        &prior.factor,
        model.noise_fit(),
        held_out,
        model.offset(),
    ]
    .into_iter()
    .flatten()
    .chain([&prior.sampling_period, &prior.phase_velocity.mean])
    .chain([&prior.phase_velocity.variance])
    .map(|x| x.to_bits())
    .collect()
}

#[test]
fn every_basis_survives_to_the_last_bit() {
    let mut models: Vec<Model> = bases().into_iter().map(|b| model(b, |_| ())).collect();
    let legendre = Basis::Legendre { count: 6 };
    models.push(model(legendre, |c| c.held_out = 0));
    models.push(model(legendre, |c| c.max_rank = Some(0)));
    models.push(tuned(models[5].clone()));
    models.push(Model::from_prior(&small().to_prior()).unwrap());
    for model in models {
        let text = model.to_json();
        let read = Model::from_json(&text).unwrap();
        assert_eq!(read, model);
        assert_eq!(bits(&read), bits(&model));
        assert_eq!(read.to_json(), text);
        let mut file = Vec::new();
        model.write_json(&mut file).unwrap();
        assert_eq!(Model::read_json(&file[..]).unwrap(), model);
    }
}

#[test]
fn spaces_and_pretty_printing_do_not_matter() {
    let model = small();
    let value: Value = serde_json::from_str(&model.to_json()).unwrap();
    let pretty = serde_json::to_string_pretty(&value).unwrap();
    assert_eq!(Model::from_json(&pretty).unwrap(), model);
}

/// The file with one field replaced.
fn with(path: &[&str], value: Value) -> String {
    let mut file: Value = serde_json::from_str(&small().to_json()).unwrap();
    let mut at = &mut file;
    for key in path {
        at = match key.parse::<usize>() {
            Ok(index) => &mut at[index],
            Err(_) => &mut at[*key],
        };
    }
    assert!(!at.is_null(), "{path:?}");
    *at = value;
    file.to_string()
}

fn error(text: &str) -> BipError {
    Model::from_json(text).unwrap_err()
}

type Field<'a> = (&'a [&'a str], Value);

/// Replacing a field by its value must give the expected error.
fn assert_refused<const N: usize>(is_expected: impl Fn(&BipError) -> bool, fields: [Field<'_>; N]) {
    for (path, value) in fields {
        let error = error(&with(path, value));
        assert!(is_expected(&error), "{path:?}: {error}");
    }
}

#[test]
fn each_damage_has_its_error() {
    use ModelFileError as F;
    let file = |e: &BipError, is: fn(&F) -> bool| matches!(e, BipError::File(e) if is(e));
    let contents = |e: &BipError| file(e, |e| matches!(e, F::Contents { .. }));
    let syntax = |e: &BipError| file(e, |e| matches!(e, F::Syntax { .. }));
    let out_of_range =
        |e: &BipError| matches!(e, BipError::Argument(ArgumentError::OutOfRange { .. }));
    let text = small().to_json();
    assert!(file(&error(""), |e| matches!(e, F::Truncated { .. })));
    assert!(syntax(&error("model")) && syntax(&error(&format!("{text}{text}"))));
    assert!(contents(&error("[]")) && contents(&error("{}")));
    let expected = "hwall-bip model";
    let found = "wall".to_owned();
    let foreign = error(r#"{"format": "wall", "version": 1}"#);
    assert_eq!(foreign, BipError::File(F::Format { expected, found }));
    // A newer version may differ in every other field.
    let newer = r#"{"format": "hwall-bip model", "version": 9, "weights": "elsewhere"}"#;
    for (text, found) in [(newer.to_owned(), 9), (with(&["version"], 0.into()), 0)] {
        let unknown = F::Version { newest: 2, found };
        assert_eq!(error(&text), BipError::File(unknown));
    }
    assert_refused(
        |e| matches!(e, BipError::WrongLength { .. }),
        [
            (&["rank"], 1.into()),
            (&["rank"], usize::MAX.into()),
            (&["groups", "0", "dofs"], 2.into()),
            (&["groups", "0", "dofs"], usize::MAX.into()),
            (&["groups", "0", "size"], 2.into()),
            (&["groups", "0", "size"], usize::MAX.into()),
            (&["mean"], Vec::<f64>::new().into()),
            (&["factor"], vec![0.0; 9].into()),
            (&["offset"], vec![0.0; 2].into()),
            (&["noise_fit"], vec![1.0; 4].into()),
            (&["noise_held_out"], vec![1.0; 4].into()),
            (&["groups", "0", "transform"], vec![1.0; 8].into()),
            (&["groups", "0", "inverse"], vec![1.0; 10].into()),
            (&["groups", "0", "basis", "count"], 4.into()),
        ],
    );
    assert_refused(
        out_of_range,
        [
            (&["groups", "0", "basis", "count"], 0.into()),
            (&["groups", "0", "basis", "count"], usize::MAX.into()),
            (&["groups", "0", "basis", "variance"], 0.0.into()),
            (&["groups", "0", "condition"], 0.5.into()),
            (&["noise_fit", "1"], 0.0.into()),
            (&["noise_fit", "1"], (-1.0).into()),
            (&["noise_held_out", "2"], (-1.0).into()),
            (&["phase_velocity_variance"], 0.0.into()),
            // The duration is the inverse. This is checked before the digest, so a forged digest does not help.
            (&["phase_velocity_mean"], (-1.0).into()),
            (&["phase_velocity_mean"], 0.0.into()),
            (&["sampling_period"], 0.0.into()),
            (&["shrinkage"], 1.5.into()),
        ],
    );
    // Another basis than that of the stored functions.
    assert_refused(
        |e| matches!(e, BipError::FileBasis { .. }),
        [
            (&["groups", "0", "basis", "variance"], 0.3.into()),
            (&["groups", "0", "transform", "4"], 7.0.into()),
            (&["groups", "0", "inverse", "4"], 7.0.into()),
        ],
    );
    assert_refused(
        |e| file(e, |e| matches!(e, F::Digest { .. })),
        [
            (&["mean", "3"], 0.25.into()),
            (&["noise_fit", "0"], 1.0.into()),
            (&["demonstrations"], 4.into()),
            (&["groups", "0", "name"], "arm".into()),
            (&["groups", "0", "role"], "controlled".into()),
            (&["digest"], "0".into()),
        ],
    );
    assert_refused(
        contents,
        [
            (&["mean", "3"], Value::Null),
            (&["mean", "3"], "NaN".into()),
            (&["rank"], (-1).into()),
            (&["rank"], 2.5.into()),
            (&["groups", "0", "role"], "seen".into()),
            (&["groups", "0", "basis", "kind"], "wavelet".into()),
            (&["factor"], Value::Null),
        ],
    );
    let replaced = |text: &str, from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        error(&text.replacen(from, to, 1))
    };
    let text_tuned = tuned(small()).to_json();
    for (from, to) in [("16.0", "-16.0"), ("1.25", "0.0")] {
        assert!(out_of_range(&replaced(&text_tuned, from, to)), "{from}");
    }
    for (from, to) in [
        ("\"rank\":", "\"range\":"),
        ("\"count\":3,", "\"count\":3,\"width\":1.0,"),
        ("\"rank\":2,", "\"rank\":2,\"rank\":2,"),
    ] {
        assert!(contents(&replaced(&text, from, to)), "{from}");
    }
    for (from, to) in [
        ("\"rank\":2", "\"rank\":NaN"),
        ("\"offset\":[", "\"offset\":[1e999,"),
    ] {
        assert!(syntax(&replaced(&text, from, to)), "{from}");
    }
    let deep = "[".repeat(1_000_000);
    let inside = format!(r#"{{"format":"hwall-bip model","version":1,"x":{deep}"#);
    assert!(Model::from_json(&deep).is_err() && Model::from_json(&inside).is_err());
}

#[test]
fn readers_and_writers_that_fail() {
    struct Broken;
    impl std::io::Read for Broken {
        fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
            Err(std::io::ErrorKind::ConnectionReset.into())
        }
    }
    let kind = |result: Result<(), BipError>| match result {
        Err(BipError::File(ModelFileError::Io { kind, message })) if !message.is_empty() => kind,
        other => panic!("{other:?}"),
    };
    let read = |result: Result<Model, BipError>| kind(result.map(drop));
    let reset = read(Model::read_json(Broken));
    assert_eq!(reset, std::io::ErrorKind::ConnectionReset);
    let not_text = read(Model::read_json(&[0xff, 0xfe][..]));
    assert_eq!(not_text, std::io::ErrorKind::InvalidData);
    let mut full = [0_u8; 10];
    let cut_off = kind(small().write_json(&mut full[..]));
    assert_eq!(cut_off, std::io::ErrorKind::WriteZero);
}

/// A damaged file gives the written model or an error.
#[test]
fn no_damage_passes_unnoticed() {
    let model = small();
    let text = model.to_json().into_bytes();
    let unchanged = |bytes: &[u8]| match Model::read_json(bytes) {
        Ok(read) => assert_eq!(read, model),
        Err(error) => assert!(!error.to_string().is_empty()),
    };
    for end in 0..text.len() {
        assert!(Model::read_json(&text[..end]).is_err(), "cut off at {end}");
    }
    let report = attack("bip model", &[text], 20_000, 2, |bytes| {
        unchanged(bytes);
        Verdict::Refused
    });
    assert_eq!(report.findings, 0, "{report:?}");
}

/// Regression test: 7 of 2,400 models trained on plain data could not read their own files ("0.000153 from orthonormal").
#[test]
fn every_basis_reads_its_own_file() {
    let mut sampler = Sampler::new(7);
    let mut bases = vec![Basis::Gaussian {
        count: 30,
        variance: 0.0912,
    }];
    for _ in 0..60 {
        let count = 10 + sampler.index(31);
        let size = 10_f64.powf(sampler.uniform(-3.0, 0.5));
        let (variance, width) = (size, size);
        bases.extend([
            Basis::Gaussian { count, variance },
            Basis::NormalizedGaussian { count, variance },
            Basis::Sigmoid { count, width },
            Basis::Polynomial { count },
        ]);
    }
    for basis in bases {
        let Ok(model) = Model::train(&reaches(1, 6, 3), &one_group(3, basis)) else {
            continue;
        };
        let read = Model::from_json(&model.to_json());
        assert!(read.is_ok_and(|read| read == model), "{basis:?}");
    }
}
