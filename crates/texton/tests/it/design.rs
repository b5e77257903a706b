//! From wanted roughnesses to textures and levels, and back.

use crate::common::bumps::{roughness, scan};
use hwall_testkit::refused;
use hwall_texton::{
    Calibration, Compression, DesignCandidate, DesignLevel, DesignRequest, DeviceLimits, GivenUp,
    GrooveRidge, LevelPath, MagnitudeScale, PrintProcess, RoughnessModel, RoughnessSource,
    ScanAngle, SpatialVariation, TemporalFrequency, TextonError, Texture, Vibration, Wanted,
    design,
};

const PROCESSES: [PrintProcess; 3] = [PrintProcess::Fdm, PrintProcess::Sla, PrintProcess::PolyJet];

/// Predicts every level again; returns the largest relative error of a ratio.
fn round_trip(candidate: &DesignCandidate, model: &dyn RoughnessModel) -> f64 {
    let ratio = |level: &DesignLevel| {
        roughness(model, &candidate.texture, level.scan, level.speed_mm_per_s) / level.wanted
    };
    let first = ratio(&candidate.levels[0]);
    let off = candidate
        .levels
        .iter()
        .map(|l| (ratio(l) / first - 1.0).abs());
    off.fold(0.0, f64::max)
}

#[test]
fn what_is_designed_is_predicted() {
    let models: [&dyn RoughnessModel; 3] = [
        &Vibration::default(),
        &TemporalFrequency,
        &SpatialVariation::default(),
    ];
    for model in models {
        for process in PROCESSES {
            let ratios = match model.info().depends_on_speed {
                true => vec![1.0, 2.0, 4.0],
                false => vec![1.0, 1.1, 1.15],
            };
            let request = DesignRequest::of_ratios(ratios, model, process);
            let candidates = design(&request).unwrap();
            assert!((1..=5).contains(&candidates.len()));
            for candidate in &candidates {
                let error = round_trip(candidate, model);
                assert!(error < 4e-9, "{}: {error:e}", model.info().name);
                let limits = process.limits();
                assert!(candidate.texture.gap_mm() >= limits.least_gap_mm - 1e-9);
                let radii = candidate.texture.texton().radii();
                assert!(radii.short_mm >= limits.least_radius_mm);
                for level in &candidate.levels {
                    assert!((10.0..=80.0).contains(&level.speed_mm_per_s));
                    assert!(level.error_jnd.is_finite() && level.jnd > 0.0);
                }
            }
        }
    }
}

#[test]
fn levels_keep_the_path_and_the_order_given() {
    let model = Vibration::default();
    let request = DesignRequest {
        most_candidates: 1000,
        ..DesignRequest::of_ratios(vec![4.0, 1.0, 2.0], &model, PrintProcess::Sla)
    };
    let candidates = design(&request).unwrap();
    let mut paths = [false; 3];
    for c in &candidates {
        let [a, b, d] = [0, 1, 2].map(|i| (c.levels[i].scan.deg(), c.levels[i].speed_mm_per_s));
        match c.path {
            LevelPath::Speed => assert!(a.0 == b.0 && b.0 == d.0),
            LevelPath::Angle => assert!(a.1 == b.1 && b.1 == d.1),
            LevelPath::Both => {}
        }
        paths[c.path as usize] = true;
        assert!((c.levels[0].magnitude / c.levels[1].magnitude - 4.0).abs() < 1e-7);
        assert!((c.least_step_jnd.unwrap() - 2_f64.ln() / 1.1_f64.ln()).abs() < 1e-7);
    }
    assert_eq!(paths, [true; 3]);
    // Vibration has no range, so only errors rank.
    let errors = candidates.iter().map(|c| c.worst_error_jnd);
    assert!(errors.is_sorted_by(|a, b| *a <= b + 0.1));
}

#[test]
fn what_is_out_of_reach_names_the_nearest() {
    let model = TemporalFrequency;
    let mut request = DesignRequest::of_ratios(vec![1.0, 1000.0], &model, PrintProcess::PolyJet);
    let Err(TextonError::RatioTooWide { wanted, nearest }) = design(&request) else {
        panic!("a ratio of 1000 is refused");
    };
    assert_eq!(wanted, 1000.0);
    assert!(nearest > 8.0 && nearest < 1000.0, "{nearest}");
    // The reported nearest ratio is possible, and a slightly larger one is not.
    request.wanted = Wanted::Ratios(vec![1.0, nearest]);
    assert!(!design(&request).unwrap().is_empty());
    request.wanted = Wanted::Ratios(vec![1.0, nearest * 1.0001]);
    assert!(design(&request).is_err());
    // Narrowed by one power, and reported.
    request.wanted = Wanted::Ratios(vec![1.0, 10.0, 1000.0]);
    request.compression = Compression::Allow;
    let best = &design(&request).unwrap()[0];
    let ratio = best.levels[2].magnitude / best.levels[0].magnitude;
    assert!((ratio / nearest - 1.0).abs() < 1e-6);
    let third = (best.levels[1].magnitude / best.levels[0].magnitude).ln() / ratio.ln();
    assert!((third - 1.0 / 3.0).abs() < 1e-6);
    let mut given_up = best.given_up.iter();
    assert!(given_up.any(|g| matches!(g, GivenUp::Ratio { .. })));
}

const STUDY: &str = "orientation_deg,velocity_mm_s,value\n0,0,1\n0,80,1.4\n90,0,3.2\n90,80,4\n";

#[test]
fn a_table_is_for_its_own_patch() {
    let calibration = Calibration::from_csv(STUDY.as_bytes()).unwrap();
    let table = |texture: Texture| RoughnessSource::Table {
        calibration: &calibration,
        texture,
    };
    let model = Vibration::default();
    let mut request = DesignRequest {
        wanted: Wanted::Magnitudes(vec![1.2, 2.5, 3.9]),
        source: table(Texture::spaced_3_mm()),
        ..DesignRequest::of_ratios(Vec::new(), &model, PrintProcess::Sla)
    };
    let best = &design(&request).unwrap()[0];
    for level in &best.levels {
        let told = calibration
            .magnitude(level.scan, level.speed_mm_per_s)
            .unwrap();
        assert!((told / level.wanted - 1.0).abs() < 1e-8);
    }
    request.wanted = Wanted::Magnitudes(vec![1.2, 9.0]);
    let Err(TextonError::MagnitudeOutOfReach { wanted, nearest }) = design(&request) else {
        panic!("the table ends at 4");
    };
    assert_eq!((wanted, nearest), (9.0, 4.0));
    request.source = table(Texture::released());
    let refused = design(&request).unwrap_err();
    let is_named = matches!(refused, TextonError::NotPrintable { what: "gap", .. });
    assert!(is_named, "{refused}");
}

#[test]
fn a_scale_is_fitted_to_a_study() {
    let model = Vibration::default();
    let texture = Texture::released();
    // A study whose magnitudes are 3 times the prediction to the power 0.4.
    let mut rows = "orientation_deg,velocity_mm_s,value\n".to_owned();
    for deg in [0.0, 45.0, 90.0] {
        for speed in [20.0, 50.0, 80.0] {
            let value = roughness(&model, &texture, scan(deg), speed);
            rows += &format!("{deg},{speed},{}\n", 3.0 * value.powf(0.4));
        }
    }
    let calibration = Calibration::from_csv(rows.as_bytes()).unwrap();
    let scale = MagnitudeScale::from_calibration(&model, &texture, &calibration, 0.0).unwrap();
    assert!((scale.gain - 3.0).abs() < 1e-9 && (scale.exponent - 0.4).abs() < 1e-9);
    assert!(scale.ln_sd.unwrap() < 1e-9);
    let request = DesignRequest {
        wanted: Wanted::Magnitudes(vec![0.2, 0.3]),
        source: RoughnessSource::Model {
            model: &model,
            scale,
        },
        ..DesignRequest::of_ratios(Vec::new(), &model, PrintProcess::Sla)
    };
    let best = &design(&request).unwrap()[0];
    for level in &best.levels {
        let again = roughness(&model, &best.texture, level.scan, level.speed_mm_per_s);
        let again = 3.0 * again.powf(0.4);
        assert!((again / level.wanted - 1.0).abs() < 1e-8);
    }
}

#[test]
fn hostile_numbers_are_refused_by_name() {
    let model = GrooveRidge;
    let good = DesignRequest::of_ratios(vec![1.0, 1.2], &model, PrintProcess::Fdm);
    let wrong = [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300, 5e-324];
    for value in wrong {
        for wanted in [
            Wanted::Ratios(vec![1.0, value]),
            Wanted::Magnitudes(vec![value]),
        ] {
            let request = DesignRequest {
                wanted,
                ..good.clone()
            };
            let refused = design(&request);
            assert!(matches!(refused, Err(TextonError::Argument(_))), "{value}");
        }
    }
    refused!(good, |request| design(&request), {
        printer.least_gap_mm = 0.0, f64::NAN;
        printer.least_gap_mm = 1e300 => "the largest pitch";
        weber_fraction = 0.0, 1e300, f64::NAN;
        wanted = Wanted::Ratios(Vec::new()), Wanted::Ratios(vec![1.0; 65]) => "number of wanted levels";
        device.angle_deg = [f64::NAN, 90.0], [50.0, 40.0], [-1.0, 90.0], [0.0, 91.0];
    });
    // A single angle and speed present one level, and no ratio.
    let device = DeviceLimits {
        angle_deg: [45.0; 2],
        speed_mm_per_s: [40.0; 2],
        ..DeviceLimits::default()
    };
    let vibration = Vibration::default();
    let one = DesignRequest {
        device,
        ..DesignRequest::of_ratios(vec![3.0], &vibration, PrintProcess::Sla)
    };
    let best = &design(&one).unwrap()[0];
    assert_eq!(best.levels[0].speed_mm_per_s, 40.0);
    assert_eq!(best.least_step_jnd, None);
    let two = DesignRequest {
        wanted: Wanted::Ratios(vec![1.0, 2.0]),
        ..one
    };
    assert!(matches!(
        design(&two),
        Err(TextonError::RatioTooWide { nearest: 1.0, .. })
    ));
}

/// Temporal frequency at a modified speed and angle, or no prediction.
struct Warped(fn(f64, f64) -> Option<(f64, f64)>);

impl RoughnessModel for Warped {
    fn info(&self) -> &'static hwall_texton::ModelInfo {
        TemporalFrequency.info()
    }

    fn predict(
        &self,
        texture: &Texture,
        scan: ScanAngle,
        speed_mm_per_s: f64,
    ) -> Result<hwall_texton::Prediction, TextonError> {
        match (self.0)(scan.deg(), speed_mm_per_s) {
            Some((deg, speed)) => {
                TemporalFrequency.predict(texture, ScanAngle::from_deg(deg)?, speed)
            }
            None => GrooveRidge.predict(texture, scan, f64::NAN),
        }
    }
}

#[test]
fn a_bracket_with_a_gap_is_not_the_end() {
    // In part of the speed range, one jumps and the other has no prediction.
    let jump = Warped(|deg, speed| {
        let far = deg < 44.0 && speed > 31.0;
        Some((deg, if far { speed + 40.0 } else { speed }))
    });
    let silent = Warped(|deg, speed| {
        let silent = deg < 44.0 && (30.5..31.5).contains(&speed);
        (!silent).then_some((deg, speed))
    });
    for model in [jump, silent] {
        let request = DesignRequest::of_ratios(vec![1.0, 2.0, 4.0], &model, PrintProcess::Sla);
        let candidates = design(&request).unwrap();
        assert!(!candidates.is_empty());
        for c in &candidates {
            assert!(round_trip(c, &model) < 4e-9);
        }
    }
}

#[test]
fn the_best_of_every_path_is_kept_where_there_is_room() {
    let model = Vibration::default();
    let of = |most_candidates| {
        let request = DesignRequest {
            most_candidates,
            ..DesignRequest::of_ratios(vec![1.0, 1.5], &model, PrintProcess::Fdm)
        };
        design(&request).unwrap()
    };
    let all = of(1000);
    let first = |path| all.iter().find(|c| c.path == path).unwrap();
    for most in 1..20 {
        let kept = of(most);
        assert_eq!(kept.len(), most.min(all.len()));
        assert_eq!(kept[0], all[0], "the best of all is among {most}");
        if most >= 3 {
            for path in [LevelPath::Speed, LevelPath::Angle, LevelPath::Both] {
                assert!(kept.contains(first(path)), "{path:?} among {most}");
            }
        }
    }
}

#[test]
fn ratios_are_never_widened() {
    // Two distant islands: the ratio is reached, but not the levels between.
    let islands = Warped(|_, speed| Some((0.0, if speed < 40.0 { 1.0 } else { 1000.0 })));
    let mut request = DesignRequest::of_ratios(vec![1.0, 2.0, 3.0], &islands, PrintProcess::Sla);
    for compression in [Compression::Refuse, Compression::Allow] {
        request.compression = compression;
        let no_such = Some(TextonError::NoSuchLevels { asked: 3 });
        assert_eq!(design(&request).err(), no_such, "{compression:?}");
    }
}

#[test]
fn an_error_that_is_not_known_is_not_zero() {
    // Gaps of 0.2 mm and a tolerance of 0.6 mm: thicker bumps may overlap, thinner ones still have a prediction.
    let model = Vibration::default();
    let mut request = DesignRequest::of_ratios(vec![1.0, 2.0], &model, PrintProcess::PolyJet);
    request.printer.least_gap_mm = 0.2;
    request.printer.tolerance_mm = 0.6;
    for c in design(&request).unwrap() {
        assert!(c.worst_error_jnd > 0.0 && c.worst_error_jnd.is_finite());
    }
}
