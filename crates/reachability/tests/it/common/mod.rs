//! Shared test code.

pub(crate) mod lines;
pub(crate) mod solids;

use glam::DVec3;
use hwall_kinematics::{JointLimit, SrsArm, SrsGeometry, SrsParameters};
use hwall_reachability::{
    BoardPart, Carried, ExactConfig, ExactSolver, Interval, PlacementConfig, PlacementScores,
    Plate, Steps, Target, WallFacet, WallGrid, WallLine, WallPlane, place_base,
};
use hwall_testkit::Sampler;
use std::f64::consts::PI;

pub(crate) const SEED: u64 = 11;

/// Any point of the board of the examples, 200 mm square.
pub(crate) const ANY_PART: BoardPart = BoardPart::Any {
    half_width_m: 0.1,
    half_height_m: 0.1,
};

/// The same board as a body.
pub(crate) const BOARD: Plate = Plate {
    half_width_m: 0.1,
    half_height_m: 0.1,
    thickness_m: 0.02,
};

pub(crate) const fn carried(plate: Plate) -> Carried {
    Carried {
        plate: Some(plate),
        last_link: None,
    }
}

/// The arm with other limits of one joint, degrees.
pub(crate) fn with_limit(arm: &SrsArm, joint: usize, [min, max]: [f64; 2]) -> SrsArm {
    let mut limits = *arm.limits();
    limits[joint] = JointLimit::new(min.to_radians(), max.to_radians());
    arm.with_limits(limits).expect("valid")
}

/// An iiwa, `size` times as large.
pub(crate) fn scaled_iiwa(size: f64) -> SrsArm {
    let iiwa = SrsParameters::iiwa7();
    let g = iiwa.geometry;
    let geometry = SrsGeometry {
        d_bs_m: size * g.d_bs_m,
        d_se_m: size * g.d_se_m,
        d_ew_m: size * g.d_ew_m,
        d_wf_m: size * g.d_wf_m,
    };
    SrsArm::new(SrsParameters { geometry, ..iiwa }).expect("valid")
}

/// All planes and heights of a heading.
pub(crate) const fn grid(heading_rad: f64, distances: Steps, heights: Steps) -> WallGrid {
    WallGrid {
        heading_rad,
        distances,
        heights,
        span_m: None,
    }
}

/// The settings with some changed.
pub(crate) fn exact_config(change: impl FnOnce(&mut ExactConfig)) -> ExactConfig {
    let mut config = ExactConfig::default();
    change(&mut config);
    config
}

pub(crate) fn exact_solver(arm: &SrsArm, change: impl FnOnce(&mut ExactConfig)) -> ExactSolver {
    ExactSolver::new(arm, &exact_config(change)).expect("valid")
}

pub(crate) fn line(heading_deg: f64, distance_m: f64, height_m: f64) -> WallLine {
    let plane = WallPlane::new(heading_deg.to_radians(), distance_m);
    plane.expect("finite").line(height_m)
}

pub(crate) fn steps(first: f64, step: f64, count: usize) -> Steps {
    Steps::new(first, step, count).expect("valid")
}

pub(crate) fn place(arm: &SrsArm, targets: &[Target], config: &PlacementConfig) -> PlacementScores {
    place_base(arm, targets, config).expect("valid")
}

/// Targets at various headings around a table 0.7 m high.
pub(crate) fn scattered_targets(n: usize) -> Vec<Target> {
    let mut sampler = Sampler::new(SEED);
    let mut target = || {
        let heading = sampler.uniform(-PI, PI);
        Target {
            point_m: sampler.point_in_box(DVec3::new(1.2, -0.8, 0.5), DVec3::new(2.4, 0.8, 1.7)),
            normal: 3.0 * DVec3::new(heading.cos(), heading.sin(), 0.0),
        }
    };
    (0..n).map(|_| target()).collect()
}

pub(crate) fn small_config() -> PlacementConfig {
    PlacementConfig {
        headings_rad: vec![0.0, 0.9, 1.9, 3.3, -1.0],
        best: 4,
        ..PlacementConfig::new(steps(1.1, 0.27, 5), steps(-0.6, 0.31, 4), 0.7)
    }
}

/// A wall at a heading and a distance, 3 m wide, from the floor to 1.4 m.
pub(crate) fn wall(heading_rad: f64, distance_m: f64) -> WallFacet {
    let plane = WallPlane::new(heading_rad, distance_m).expect("finite");
    let middle = plane.normal() * distance_m;
    WallFacet {
        point_m: middle + plane.along() * 0.3,
        normal: plane.normal(),
        heights: Interval::new(0.0, 1.4),
        outline_m: vec![
            middle - plane.along() * 1.5,
            middle + plane.along() * 1.5 + DVec3::Z,
        ],
    }
}
