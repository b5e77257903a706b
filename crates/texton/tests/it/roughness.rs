//! Models of roughness: their ranges, their hard cases, and the order of the published study.

use crate::common::bumps::{cone, hemiellipsoids, radii, roughness, scan};
use crate::common::refusals::refused;
use glam::{DVec2, dvec2};
use hwall_testkit::Sampler;
use hwall_texton::{
    AfferentPairs, GrooveRidge, InvertedU, Layout, MonotoneSpacing, OrderScore, Prediction,
    Quantity, RoughnessModel, ScanAngle, SpatialVariation, StudyOrder, Tally, TemporalFrequency,
    Texture, Vibration, roughness_models, score_order,
};

const ORIENTATIONS_DEG: [f64; 5] = [0.0, 45.0, 63.43, 71.57, 90.0];

fn scores(texture: &Texture) -> Vec<OrderScore> {
    let study = StudyOrder::dissertation(100.0);
    let models = roughness_models();
    let scores = models
        .iter()
        .map(|m| score_order(&**m, texture, &study).unwrap());
    scores.collect()
}

#[test]
fn the_order_of_the_study_is_that_of_vibration_and_of_temporal_frequency() {
    let both = |texture: &Texture| -> Vec<&'static str> {
        scores(texture)
            .iter()
            .filter(|s| s.reproduces_orientation() && s.reproduces_speed())
            .map(|s| s.model)
            .collect()
    };
    for texture in [Texture::released(), Texture::spaced_3_mm()] {
        assert_eq!(both(&texture), ["temporal frequency", "PC vibration"]);
    }
}

#[test]
fn an_inverted_u_on_spacing_fails_on_the_released_grid_and_fits_the_one_of_the_text() {
    let orientation = |texture: &Texture| -> Vec<(&'static str, bool)> {
        scores(texture)
            .iter()
            .map(|s| (s.model, s.reproduces_orientation()))
            .collect()
    };
    assert_eq!(
        orientation(&Texture::released()),
        [
            ("groove and ridge", false),
            ("inverted U in spacing", false),
            ("rising with spacing", false),
            ("SA1 spatial variation", false),
            ("SA1 variation along the scan", false),
            ("SA1 variation across the scan", true),
            ("temporal frequency", true),
            ("PC vibration", true),
        ]
    );
    let text = orientation(&Texture::spaced_3_mm());
    assert!(text.contains(&("inverted U in spacing", true)));
    assert!(text.contains(&("SA1 variation across the scan", false)));
}

/// Mean rates (spikes/s) over orientation at 60, 100, 140 and 180 mm/s, released grid, of TouchSim (Saal and
/// others 2017), one phase, no shear.
const PC_RATE: [[f64; 5]; 4] = [
    [14.857, 38.171, 48.0, 53.829, 54.4],
    [21.943, 51.2, 71.886, 79.886, 88.914],
    [24.343, 53.829, 81.029, 97.029, 103.086],
    [30.743, 64.457, 99.086, 109.714, 115.657],
];

/// Spatial variation of SA1 afferents 2 mm apart over orientation, mean of the same runs.
const SA1_VARIATION: [f64; 5] = [14.8, 26.3, 27.7, 25.7, 22.0];

#[test]
fn vibration_follows_simulated_pc_afferents() {
    let texture = Texture::released();
    let model = Vibration::default();
    let mut pairs = Vec::new();
    for (rates, speed) in PC_RATE.iter().zip([60.0, 100.0, 140.0, 180.0]) {
        let of = |deg| roughness(&model, &texture, scan(deg), speed);
        for (deg, rate) in ORIENTATIONS_DEG.iter().zip(rates) {
            // Relative to 90 degrees: what orientation does, apart from speed.
            let relative = of(*deg) / of(90.0);
            let off = relative - rate / rates[4];
            assert!(off.abs() < 0.16, "{deg} {speed}: {relative}");
            pairs.push((of(*deg).ln(), rate.ln()));
        }
    }
    let r = correlation(&pairs);
    assert!(r > 0.75, "{r}");
}

#[test]
fn variation_across_the_scan_follows_simulated_sa1_afferents() {
    let texture = Texture::released();
    let across = SpatialVariation::default();
    let along = SpatialVariation {
        pairs: AfferentPairs::Along,
        ..across
    };
    let r = |model: SpatialVariation| {
        let of = |deg| roughness(&model, &texture, scan(deg), 100.0);
        let pairs = ORIENTATIONS_DEG.iter().zip(SA1_VARIATION);
        correlation(&pairs.map(|(deg, v)| (of(*deg), v)).collect::<Vec<_>>())
    };
    assert!(r(across) > 0.9, "{}", r(across));
    assert!(r(along) < 0.5, "{}", r(along));
}

fn correlation(pairs: &[(f64, f64)]) -> f64 {
    let n = pairs.len() as f64;
    let (ma, mb) = pairs
        .iter()
        .fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let sum =
        |f: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|p| f(p.0 - ma, p.1 - mb)).sum::<f64>();
    sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt()
}

#[test]
fn the_published_formula_and_its_range() {
    // Bumps 1 mm long along the scan, grooves of 1 mm: inside.
    let texture = hemiellipsoids(radii(0.5, 0.5), 0.3, [2.0, 2.0]).unwrap();
    let inside = GrooveRidge.predict(&texture, ScanAngle::ACROSS, 0.0);
    let published = Prediction::Within(0.2 + 1.6 - 0.5 - 0.25);
    assert_eq!(inside, Ok(published));
    // The released bumps are 6 mm long along the long axis: beyond the ridges that were measured.
    let beyond = GrooveRidge.predict(&Texture::released(), ScanAngle::ALONG, 0.0);
    assert!(matches!(
        beyond.unwrap(),
        Prediction::Beyond {
            what: Quantity::RidgeMm,
            at: 6.0,
            range: [0.0, 1.0],
            ..
        }
    ));
    let peak = InvertedU { peak_mm: 2.2 };
    let roughest = peak.predict(&Texture::released(), ScanAngle::ACROSS, 50.0);
    assert_eq!(roughest.unwrap(), Prediction::Within(1.0));
}

#[test]
fn scans_past_the_ends_of_bumps_and_fingers_at_rest_have_no_answer_from_models_that_need_one() {
    let texture = Texture::released();
    let past = scan(0.5 * texture.least_spaced_rad().to_degrees());
    let spacing: [&dyn RoughnessModel; 4] = [
        &GrooveRidge,
        &InvertedU::default(),
        &MonotoneSpacing,
        &TemporalFrequency,
    ];
    for model in spacing {
        let prediction = model.predict(&texture, past, 80.0).unwrap();
        assert_eq!(prediction, Prediction::Undefined(Quantity::SpacingMm));
        assert_eq!(prediction.value(), None);
    }
    let rest = TemporalFrequency.predict(&texture, ScanAngle::ACROSS, 0.0);
    assert_eq!(rest, Ok(Prediction::Undefined(Quantity::FrequencyHz)));
    let rest = Vibration::default().predict(&texture, ScanAngle::ACROSS, 0.0);
    assert_eq!(rest, Ok(Prediction::Within(0.0)));
    // Of two speeds, one without an answer, none is right.
    let study = StudyOrder {
        speeds_mm_per_s: vec![0.0, 10.0],
        ..StudyOrder::dissertation(0.0)
    };
    let score = score_order(&TemporalFrequency, &texture, &study).unwrap();
    assert_eq!(score.speed, Tally { hits: 0, of: 5 });
    assert!(!score.reproduces_orientation());
}

#[test]
fn bad_speeds_and_settings_are_named() {
    let texture = Texture::released();
    for model in roughness_models() {
        for bad in [-1.0, f64::NAN, f64::INFINITY] {
            let prediction = model.predict(&texture, ScanAngle::ALONG, bad);
            assert_eq!(refused(prediction), "speed_mm_per_s");
        }
    }
    let models = |blur_mm: f64| -> [Box<dyn RoughnessModel>; 2] {
        let vibration = Vibration {
            blur_mm,
            ..Vibration::default()
        };
        let variation = SpatialVariation {
            blur_mm,
            ..SpatialVariation::default()
        };
        [Box::new(vibration), Box::new(variation)]
    };
    for blur_mm in [0.0, -1.0, 1e-6, 0.0499, f64::NAN, f64::INFINITY] {
        for model in models(blur_mm) {
            let prediction = model.predict(&texture, ScanAngle::ALONG, 1.0);
            assert_eq!(refused(prediction), "blur_mm", "{blur_mm}");
        }
    }
    for model in models(0.05) {
        assert!(model.predict(&texture, ScanAngle::ALONG, 1.0).is_ok());
    }
    let study = StudyOrder {
        ranks: vec![0],
        ..StudyOrder::dissertation(100.0)
    };
    assert!(score_order(&GrooveRidge, &texture, &study).is_err());
}

#[test]
fn waves_add_up_to_the_bumps() {
    let layout = Layout::Staggered {
        long_mm: 6.2,
        short_mm: 2.2,
    };
    for texture in [Texture::released(), Texture::new(cone(), layout).unwrap()] {
        let texton = texture.texton();
        let waves: Vec<_> = texture.harmonics(60.0).collect();
        let mean = texton.volume_mm3() / texture.layout().cell_area_mm2();
        let height = |at: DVec2| {
            waves.iter().fold(mean, |z, w| {
                z + w.amplitude_mm * w.wave_rad_per_mm.dot(at).cos()
            })
        };
        // The middle of a bump, that of another one, and the plate between four.
        let top = texton.height_mm();
        let other = texture.layout().offset_mm(1, 1);
        let beside = dvec2(1.0, 0.0);
        for (at, z) in [(DVec2::ZERO, top), (other, top), (beside, height(beside))] {
            assert!((height(at) - z).abs() < 0.02, "{at:?}: {} {z}", height(at));
        }
        let mut s = Sampler::new(5);
        let free = |_| height(dvec2(3.1 + 0.02 * s.uniform(-1.0, 1.0), 1.1));
        if texton.top_radii() == radii(0.0, 0.0) {
            assert!((0..20).map(free).all(|z| z.abs() < 0.02));
        }
    }
}

#[test]
fn spectra_meet_the_volume() {
    for texton in [*Texture::released().texton(), cone()] {
        let volume = texton.volume_mm3();
        // At zero, and beside the change of formula.
        let [zero, below, above] =
            [0.0, 0.0099, 0.0101].map(|wave| texton.spectrum_mm3(dvec2(wave, 0.0)));
        assert!((zero / volume - 1.0).abs() < 1e-3);
        assert!((below - above).abs() < 1e-3 * volume);
    }
}

/// `harmonics(inf)` did not end, and vibration at 1e160 mm/s was NaN.
#[test]
fn unbounded_waves_and_speeds_end_in_numbers() {
    let texture = Texture::released();
    for most in [f64::INFINITY, 1e300, f64::NAN, -1.0] {
        assert!(texture.harmonics(most).take(5_000_000).count() < 5_000_000);
    }
    for speed in [0.0, 1e77, 1e160, 1e308] {
        let found = Vibration::default().predict(&texture, scan(45.0), speed);
        let is_finite = matches!(found, Ok(Prediction::Within(v)) if v.is_finite());
        assert!(is_finite, "{speed}");
    }
}
