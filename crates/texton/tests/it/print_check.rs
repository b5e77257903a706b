//! What a printer cannot make is found before it tries.

use crate::common::bumps::{cone, hemiellipsoids, on_released_grid, radii, staggered};
use glam::dvec2;
use hwall_texton::{Finding, Patch, PatchSpec, Printer, Texton, Texture};

#[test]
fn the_released_patch_prints_in_its_tiles_and_not_in_one_piece() {
    let patch = Patch::released();
    let findings = patch.print_check(&Printer::default());
    assert!(!findings.iter().any(Finding::is_fault), "{findings:?}");
    let whole = PatchSpec {
        tile_mm: None,
        ..PatchSpec::released()
    };
    let whole = Patch::new(Texture::released(), whole).unwrap();
    let findings = whole.print_check(&Printer::default());
    let size_mm = [200.0, 200.0];
    let is_too_large =
        |f: &Finding| matches!(f, Finding::Tile { size_mm: of, .. } if *of == size_mm);
    assert!(findings.iter().any(is_too_large), "{findings:?}");
}

#[test]
fn gaps_heights_plates_and_sides_are_looked_at() {
    let touching = hemiellipsoids(radii(3.0, 1.0), 0.04, [6.0, 2.0]).unwrap();
    let spec = PatchSpec {
        plate_mm: 0.3,
        ..PatchSpec::default()
    };
    let printer = Printer {
        steepest_rad: Some(1.0),
        ..Printer::default()
    };
    let findings = Patch::new(touching, spec).unwrap().print_check(&printer);
    let faults: Vec<&Finding> = findings.iter().filter(|f| f.is_fault()).collect();
    assert!(matches!(
        faults[..],
        [
            Finding::Gap { gap_mm: 0.0, .. },
            Finding::Height {
                height_mm: 0.04,
                ..
            },
            Finding::Steepness { .. },
            Finding::Plate { plate_mm: 0.3, .. },
        ]
    ));
    let ridge = Texton::truncated_cone(radii(3.0, 0.71), 0.7).unwrap();
    let patch = Patch::new(on_released_grid(ridge), PatchSpec::default()).unwrap();
    let findings = patch.print_check(&Printer::default());
    assert!(matches!(
        findings[..],
        [Finding::Breadth { .. }, Finding::LeftOut { .. }]
    ));
}

#[test]
fn gaps_are_those_of_the_closest_points() {
    // Halfway between two bumps that stand askew, by a search over both outlines.
    let texture = staggered(6.6, 1.8).unwrap();
    let points: Vec<[f64; 2]> = (0..2_000)
        .map(|i| f64::from(i) * std::f64::consts::TAU / 2_000.0)
        .map(|t| [3.0 * t.cos(), t.sin()])
        .collect();
    let mut least = f64::INFINITY;
    for p in &points {
        for q in &points {
            least = least.min((p[0] - q[0] - 3.3).hypot(p[1] - q[1] - 1.8));
        }
    }
    let gap_mm = texture.gap_mm();
    assert!((gap_mm - least).abs() < 1e-4, "{gap_mm} {least}");
    assert!((Texture::released().gap_mm() - 0.2).abs() < 1e-12);
}

#[test]
fn a_cone_is_steepest_beside_its_axes() {
    let cone = cone();
    let [c, d] = cone.top_radii().to_array();
    // By central differences just below the top, and at the foot.
    let slope = |inset_mm: f64, t: f64| {
        let at = [
            (c + 0.7 - inset_mm) * t.cos(),
            (d + 0.7 - inset_mm) * t.sin(),
        ];
        let step = 1e-5;
        let height = |dx: f64, dy: f64| cone.height_at_mm(dvec2(at[0] + dx, at[1] + dy));
        let x = height(step, 0.0) - height(-step, 0.0);
        let y = height(0.0, step) - height(0.0, -step);
        (x.hypot(y) / (2.0 * step)).atan()
    };
    let steepest = |inset_mm: f64| {
        let around = (0..4_000).map(|i| f64::from(i) * std::f64::consts::TAU / 4_000.0);
        around
            .map(|t| slope(inset_mm, t))
            .fold(0.0_f64, f64::max)
            .to_degrees()
    };
    let stated = cone.steepest_rad().to_degrees();
    assert!((stated - 57.4).abs() < 0.05, "{stated}");
    assert!((steepest(0.6999) - stated).abs() < 0.02);
    assert!((steepest(1e-4) - 49.1).abs() < 0.05);
    let round = Texton::truncated_cone(radii(1.0, 1.0), 0.7).unwrap();
    assert!((round.steepest_rad().to_degrees() - 45.0).abs() < 1e-9);
    let patch = Patch::new(on_released_grid(cone), PatchSpec::default()).unwrap();
    let refused = |most_deg: f64| {
        let printer = Printer {
            steepest_rad: Some(most_deg.to_radians()),
            ..Printer::default()
        };
        let findings = patch.print_check(&printer);
        findings
            .iter()
            .any(|f| matches!(f, Finding::Steepness { .. }))
    };
    assert!(refused(50.0) && !refused(58.0));
}
