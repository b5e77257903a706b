//! Results do not depend on the unit of length, the side of the scan or the order of measurements.

use crate::common::bumps::{hemiellipsoids, level, radii, scan, sized, staggered};
use glam::dvec2;
use hwall_testkit::Sampler;
use hwall_texton::{
    Calibration, FingerState, MotionLimits, Patch, Tessellation, Texture, TextureMotion,
    roughness_models,
};

const UNITS: [f64; 3] = [0.25, 3.0, 10.0];

fn texture(unit: f64) -> Texture {
    let pitch_mm = [8.0 * unit, 5.0 * unit];
    hemiellipsoids(radii(3.0 * unit, unit), 0.7 * unit, pitch_mm).unwrap()
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(b.abs()).max(1e-12)
}

#[test]
fn lengths_grow_with_the_unit_and_frequencies_stay() {
    let plain = texture(1.0);
    for unit in UNITS {
        let large = texture(unit);
        assert!(close(large.coverage(), plain.coverage()));
        assert!(close(large.gap_mm(), unit * plain.gap_mm()));
        for deg in [0.0, 20.0, 45.0, 63.43, 90.0] {
            let scan = scan(deg);
            if let Some(spacing) = plain.spacing_mm(scan) {
                assert!(close(large.spacing_mm(scan).unwrap(), unit * spacing));
            }
            let met = plain.mean_encounter_mm(scan);
            assert!(close(large.mean_encounter_mm(scan), unit * met));
            let hz = [(&large, unit * 60.0), (&plain, 60.0)];
            let [a, b] = hz.map(|(t, speed)| t.encounter_frequency_hz(scan, speed));
            assert!(close(a, b), "{a} {b}");
        }
    }
}

/// Half a turn of the board and its mirror image give the same grid.
#[test]
fn opposite_and_mirrored_scans_feel_the_same() {
    for texture in [texture(1.0), staggered(8.0, 5.0).unwrap()] {
        for deg in [0.0, 17.0, 45.0, 63.43, 90.0, 120.0] {
            for other in [deg + 180.0, -deg] {
                for model in roughness_models() {
                    let value = |deg: f64| {
                        let found = model.predict(&texture, scan(deg), 60.0).unwrap();
                        found.value().unwrap_or(f64::NEG_INFINITY)
                    };
                    let (a, b) = (value(deg), value(other));
                    let alike = a == b || (a - b).abs() < 1e-6 * a.abs().max(b.abs());
                    assert!(alike, "{}, {deg} and {other}: {a} {b}", model.info().name);
                }
            }
        }
    }
}

#[test]
fn a_mesh_grows_with_the_unit() {
    let solid = |unit: f64| {
        let mut spec = sized([60.0 * unit, 40.0 * unit]);
        spec.plate_mm *= unit;
        spec.margin_mm *= unit;
        let patch = Patch::new(texture(unit), spec).unwrap();
        let ask = Tessellation::with_accuracy_mm(0.02 * unit);
        let mesh = patch.mesh(&ask).unwrap();
        (mesh.triangles().len(), mesh.volume_mm3(), mesh.area_mm2())
    };
    let (triangles, volume, area) = solid(1.0);
    for unit in UNITS {
        let (others, large, wide) = solid(unit);
        assert_eq!(triangles, others, "{unit}");
        assert!(close(large, volume * unit.powi(3)), "{unit}: {large}");
        assert!(close(wide, area * unit.powi(2)), "{unit}: {wide} {area}");
    }
}

#[test]
fn measurements_come_in_any_order() {
    let rows: Vec<_> = [0.0, 30.0, 90.0]
        .into_iter()
        .flat_map(|deg| [0.0, 40.0, 80.0].map(|speed| level(deg, speed, deg / 10.0 + speed / 8.0)))
        .collect();
    let nominal = Calibration::from_rows(rows.clone()).unwrap();
    let mut sampler = Sampler::new(1);
    for _ in 0..20 {
        let mut others = rows.clone();
        for last in (1..others.len()).rev() {
            others.swap(last, sampler.index(last + 1));
        }
        let other = Calibration::from_rows(others).unwrap();
        assert_eq!(nominal.nodes(), other.nodes());
        let wanted = sampler.uniform(1.0, 15.0);
        assert_eq!(nominal.level_for(wanted), other.level_for(wanted));
    }
}

/// Shifted clocks, and half a turn of a square board, give the same motion.
#[test]
fn the_clock_and_half_a_turn_of_the_board_do_not_matter() {
    let run = |clock_s: f64, side: f64| {
        let mut motion = TextureMotion::new(MotionLimits::default()).unwrap();
        let mut steps = Vec::new();
        for k in 0..1500 {
            let t = f64::from(k) * 1e-3;
            let at = dvec2(0.05 * (2.0 * t).sin(), 0.02 * t);
            let velocity = dvec2(0.1 * (2.0 * t).cos(), 0.02);
            let finger = (k < 1300).then_some(FingerState {
                point_m: side * at,
                velocity_m_per_s: side * velocity,
            });
            let step = motion.step(clock_s + t, finger, &level(45.0, 40.0, 1.0));
            let step = step.unwrap();
            steps.push((step.relative_speed_m_per_s, step.displacement_m));
        }
        steps
    };
    let nominal = run(0.0, 1.0);
    for (clock_s, side) in [(50.0, 1.0), (1e4, 1.0), (1.7e9, 1.0), (0.0, -1.0)] {
        for (k, (a, b)) in nominal.iter().zip(&run(clock_s, side)).enumerate() {
            let off = (a.0 - b.0).abs().max((side * a.1).distance(b.1));
            // Unix time is rounded to 0.2 us, a step to a part in 4000.
            assert!(off < 1e-4, "{clock_s} s, {side}, step {k}: {a:?} {b:?}");
        }
    }
}
