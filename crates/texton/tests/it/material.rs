//! Roughness from pictures: known reliefs, invariances, the calibration, pictures that are refused.

use crate::common::refusals::refused;
use hwall_texton::{
    Caveat, HeightField, MaterialPicture, MaterialScale, MaterialSeries, PictureKind, Relief,
    TextonError,
};
use std::f64::consts::TAU;

const SIDE: usize = 256;
const PITCH_MM: f64 = 0.02;

fn picture(kind: PictureKind, value: impl Fn(f64, f64) -> f64) -> MaterialPicture {
    let at = |k: usize| [k % SIDE, k / SIDE].map(|i| i as f64 * PITCH_MM);
    let values = (0..SIDE * SIDE).map(|k| {
        let [x, y] = at(k);
        value(x, y) as f32
    });
    MaterialPicture::new(kind, SIDE, PITCH_MM, values.collect(), 0.0).unwrap()
}

fn heights(value: impl Fn(f64, f64) -> f64) -> MaterialPicture {
    picture(PictureKind::Height, value)
}

/// Waves of several periods, in several directions, mm.
fn bumpy(x: f64, y: f64) -> f64 {
    let waves = [(0.2, 0.3), (0.35, 1.4), (0.6, 2.2), (0.9, 4.0)];
    let wave = |(period, turn): (f64, f64)| {
        let along = x * turn.cos() + y * turn.sin();
        0.02 * period * (TAU * along / period + turn).sin()
    };
    waves.into_iter().map(wave).sum()
}

#[test]
fn a_sine_has_its_height_and_its_period() {
    for period_mm in [0.25, 0.33, 0.4, 0.55, 0.7] {
        for turn in [0.0, 0.6, 1.2_f64] {
            let along = |x: f64, y: f64| x * turn.cos() + y * turn.sin();
            let sine = heights(|x, y| 0.05 * (TAU * along(x, y) / period_mm).sin());
            let relief = Relief::of(&sine).unwrap();
            let height = relief.height_mm / (0.05 / 2_f64.sqrt());
            let what = format!("{period_mm} {turn}: {relief:?}");
            assert!((0.94..1.06).contains(&height), "{what}");
            let period = relief.period_mm() / period_mm;
            assert!((0.9..1.15).contains(&period), "{what}");
        }
    }
}

#[test]
fn level_tilt_mirror_and_brightness_change_nothing_and_units_scale() {
    let near = |a: &Relief, height: f64, slope: f64, b: &Relief| {
        let height = a.height_mm / (height * b.height_mm) - 1.0;
        let slope = a.slope / (slope * b.slope) - 1.0;
        assert!(height.abs() < 1e-3, "{height}");
        assert!(slope.abs() < 1e-3, "{slope}");
    };
    let of = |picture: &MaterialPicture| Relief::of(picture).unwrap();
    let plain = of(&heights(bumpy));
    near(&of(&heights(|x, y| bumpy(x, y) + 300.0)), 1.0, 1.0, &plain);
    let end = (SIDE - 1) as f64 * PITCH_MM;
    near(&of(&heights(|x, y| bumpy(end - y, x))), 1.0, 1.0, &plain);
    near(&of(&heights(|x, y| 3.0 * bumpy(x, y))), 3.0, 3.0, &plain);
    let colour = |gain: f64| picture(PictureKind::Albedo, move |x, y| gain * (0.5 + bumpy(x, y)));
    near(&of(&colour(200.0)), 1.0, 1.0, &of(&colour(1.0)));
    // The same pixels, twice as far apart.
    let values: Vec<f32> = (0..SIDE * SIDE)
        .map(|k| bumpy((k % SIDE) as f64 * PITCH_MM, (k / SIDE) as f64 * PITCH_MM) as f32)
        .collect();
    let larger = HeightField::new(SIDE, 2.0 * PITCH_MM, values).unwrap();
    let larger = of(&MaterialPicture::from_heights(&larger).unwrap());
    near(&larger, 1.0, 0.5, &plain);
}

#[test]
fn the_calibration_keeps_the_order_of_each_series_and_states_its_error() {
    let scale = MaterialScale::calibrated().unwrap();
    let [p, q] = scale.exponents();
    assert!(p > 0.0 && q > 0.0, "{p} {q}");
    let papers = scale
        .samples()
        .iter()
        .filter(|s| s.series == MaterialSeries::Sandpaper);
    let papers: Vec<_> = papers.collect();
    assert_eq!(papers.len(), 15);
    for pair in papers.windows(2) {
        assert!(pair[0].left_out[0][0] > pair[1].left_out[0][0], "{pair:?}");
    }
    let heights = scale.error(PictureKind::Height);
    let colours = scale.error(PictureKind::Albedo);
    // Factors of 1.4 and 1.8 for heights, and more for shading under an unknown light.
    assert!((0.2..0.45).contains(&heights.material_ln), "{heights:?}");
    assert!((0.4..0.8).contains(&heights.study_ln), "{heights:?}");
    let least_ln = 1.5 * heights.material_ln;
    assert!(colours.material_ln > least_ln, "{colours:?}");
    assert!(colours.ln_sd() < 2.0, "{colours:?}");
    assert_eq!(scale, MaterialScale::calibrated().unwrap());
}

#[test]
fn more_relief_is_rougher_and_the_rest_is_told() {
    let scale = MaterialScale::calibrated().unwrap();
    let smooth = scale.propose(&heights(|x, y| 2.2 * bumpy(x, y))).unwrap();
    let rough = scale.propose(&heights(|x, y| 5.0 * bumpy(x, y))).unwrap();
    assert!(rough.roughness > 4.0 * smooth.roughness);
    let [low, high] = rough.interval().unwrap();
    assert!(low < rough.roughness && rough.roughness < high);
    assert!((smooth.order_certainty(&smooth).unwrap() - 0.5).abs() < 1e-12);
    let certain = smooth.order_certainty(&rough).unwrap();
    assert!(certain > 0.95 && certain <= 1.0);
    assert_eq!(rough.order_certainty(&smooth), Some(certain));
    assert!(rough.caveats.contains(&Caveat::NotGeometry));
    assert!(!rough.caveats.contains(&Caveat::Print));
    let colour = picture(PictureKind::Albedo, |x, y| 0.5 + bumpy(x, y));
    let colour = scale.propose(&colour).unwrap();
    assert!(colour.caveats.contains(&Caveat::Print));
    let fine = |pitch_mm: f64| {
        let values = (0..SIDE * SIDE)
            .map(|k| ((k * k) % 7) as f32 * 1e-2)
            .collect();
        let picture = MaterialPicture::new(PictureKind::Height, SIDE, pitch_mm, values, 0.0);
        let caveats = scale.propose(&picture.unwrap()).unwrap().caveats;
        let mut caveats = caveats.iter();
        caveats.any(|c| matches!(c, Caveat::FineUnseen { .. }))
    };
    assert!(fine(0.1) && !fine(0.01));
}

/// Regression: a checkerboard of black and white squares of 16 pixels was rougher than anything with probability 1.00.
#[test]
fn outside_the_calibration_its_edge_counts_and_nothing_is_certain() {
    let scale = MaterialScale::calibrated().unwrap();
    let rough = scale.propose(&heights(|x, y| 5.0 * bumpy(x, y))).unwrap();
    let square = |x: f64| (x / (16.0 * PITCH_MM)) as usize;
    let board = |x, y| ((square(x) + square(y)) % 2) as f64;
    let board = scale.propose(&picture(PictureKind::Albedo, board)).unwrap();
    let flat = scale.propose(&heights(|x, y| 1e-3 * bumpy(x, y))).unwrap();
    for beyond in [&board, &flat] {
        assert!(!beyond.is_calibrated() && beyond.interval().is_none());
        assert!(beyond.order_certainty(&rough).is_none());
        assert!(rough.order_certainty(beyond).is_none());
    }
    assert!(rough.is_calibrated());
    // No extrapolation: more of the same is no rougher, and less no smoother.
    let steeper = scale.propose(&heights(|x, y| 1e3 * bumpy(x, y))).unwrap();
    let steepest = scale.propose(&heights(|x, y| 1e5 * bumpy(x, y))).unwrap();
    assert_eq!(steeper.roughness, steepest.roughness);
    let flatter = scale.propose(&heights(|x, y| 1e-5 * bumpy(x, y))).unwrap();
    assert_eq!(flatter.roughness, flat.roughness);
    assert!(flat.roughness < rough.roughness && rough.roughness < steepest.roughness);
    assert!(board.roughness < 40.0, "{}", board.roughness);
}

#[test]
fn pictures_without_information_are_refused() {
    let uniform = |kind| Relief::of(&picture(kind, |_, _| 0.7));
    for kind in [PictureKind::Height, PictureKind::Albedo] {
        assert!(matches!(uniform(kind), Err(TextonError::Uniform { .. })));
    }
    let black = Relief::of(&picture(PictureKind::Albedo, |_, _| 0.0));
    assert!(matches!(black, Err(TextonError::Uniform { .. })));
    let new = |kind, columns, pitch_mm, value: f32, step| {
        MaterialPicture::new(kind, columns, pitch_mm, vec![value; 64 * 64], step)
    };
    let height = PictureKind::Height;
    for (columns, pitch_mm, step, what) in [
        (32, 0.1, 0.0, "pixels along a side"),
        (64, 0.0, 0.0, "pixel pitch, mm"),
        (64, -1.0, 0.0, "pixel pitch, mm"),
        (64, f64::NAN, 0.0, "pixel pitch, mm"),
        (64, f64::INFINITY, 0.0, "pixel pitch, mm"),
        (64, 0.1, f64::NAN, "step of the values"),
    ] {
        let picture = new(height, columns, pitch_mm, 0.0, step);
        assert_eq!(refused(picture), what, "{columns} {pitch_mm} {step}");
    }
    for columns in [0, 63] {
        let odd = new(height, columns, 0.1, 0.0, 0.0);
        assert!(matches!(odd, Err(TextonError::MapSize { .. })), "{odd:?}");
    }
    for (kind, value) in [(height, f32::NAN), (PictureKind::Albedo, -1.0)] {
        let bad = new(kind, 64, 0.1, value, 0.0);
        assert!(matches!(bad, Err(TextonError::Pixel { .. })), "{bad:?}");
    }
    // Noise within its own steps, and pixels of two millimetres.
    let grainy: Vec<f32> = (0..64 * 64).map(|k| (k % 3) as f32 * 1e-3).collect();
    let of = |pitch_mm, step| {
        let picture = MaterialPicture::new(height, 64, pitch_mm, grainy.clone(), step);
        Relief::of(&picture.unwrap())
    };
    assert!(of(0.1, 1e-5).is_ok());
    assert!(matches!(of(0.1, 0.01), Err(TextonError::Uniform { .. })));
    assert!(matches!(of(2.0, 0.0), Err(TextonError::NotTactile { .. })));
}
