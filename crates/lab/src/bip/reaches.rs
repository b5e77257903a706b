//! Synthetic reaches: a hand moves to a point on a wall, and a board meets it there.
//!
//! 25 degrees of freedom: palm and five fingertips (m), then the board's middle (m), its normal
//! and its roll (rad). Synthetic, but with the difficulties of real data: varied targets, durations,
//! path curvature and noise.

use crate::bip::trajectories::{TrainTest, Trajectory, TrajectorySet};
use glam::DVec3;
use hwall_testkit::Sampler;

/// Columns that a tracker would see.
pub const OBSERVED: &str = "0-17";

/// Period of the tracker, s.
const PERIOD_S: f64 = 1.0 / 90.0;
/// Standard deviation of the tracker's noise, m.
const HAND_NOISE_M: f64 = 1.5e-3;
/// Standard deviation of the noise of the board's position and direction, m and rad.
const BOARD_NOISE: f64 = 0.5e-3;
/// Corners of the targets, arm's base frame, m.
const TARGETS_M: [DVec3; 2] = [DVec3::new(0.45, -0.30, 0.30), DVec3::new(0.65, 0.30, 0.70)];
/// The hand at rest, m.
const HAND_M: DVec3 = DVec3::new(1.05, 0.05, 0.25);
/// The board at rest, m.
const BOARD_M: DVec3 = DVec3::new(0.45, 0.0, 0.45);
/// Palm to fingertips, thumb to little, hand at rest, m: the index fingertip leads.
const TIPS_M: [DVec3; 5] = [
    DVec3::new(-0.05, -0.06, -0.01),
    DVec3::new(-0.08, -0.03, 0.0),
    DVec3::new(-0.08, 0.0, 0.0),
    DVec3::new(-0.07, 0.03, 0.0),
    DVec3::new(-0.05, 0.05, 0.0),
];

/// Training and test motions; the same seed gives the same motions.
pub fn sets(seed: u64, train: usize, test: usize) -> TrainTest {
    let mut sampler = Sampler::new(seed);
    let mut set = |part: &str, count: usize| TrajectorySet {
        columns: columns(),
        trajectories: (0..count)
            .map(|i| reach(&mut sampler, format!("synthetic {part} {i}"), i as u64))
            .collect(),
    };
    // Order matters: test motions use the random numbers after the training motions.
    TrainTest {
        train: set("train", train),
        test: set("test", test),
    }
}

fn columns() -> Vec<String> {
    let points = [
        "palm", "thumb", "index", "middle", "ring", "little", "board", "normal",
    ];
    let coordinates = points
        .iter()
        .flat_map(|p| ["x", "y", "z"].map(|c| format!("{p}_{c}")));
    coordinates.chain(["roll".to_owned()]).collect()
}

fn reach(sampler: &mut Sampler, name: String, id: u64) -> Trajectory {
    let target = sampler.point_in_box(TARGETS_M[0], TARGETS_M[1]);
    let around = |sampler: &mut Sampler, middle: DVec3, sd: f64| {
        middle + sd * DVec3::from_array([(); 3].map(|()| sampler.normal()))
    };
    let start = around(sampler, HAND_M, 0.03);
    let bow = around(sampler, DVec3::new(0.0, 0.0, 0.06), 0.03);
    let spread = 1.0 + 0.08 * sampler.normal();
    let duration_s = sampler.uniform(0.8, 1.7);
    let samples = (duration_s / PERIOD_S) as usize + 1;
    // The hand turns to the wall's direction, which depends on the point of touch.
    let heading = 1.2 * target.y;
    let normal_end = DVec3::new(heading.cos(), heading.sin(), 0.0);
    let roll_end = 0.8 * (target.z - BOARD_M.z) + 0.3 * target.y;
    let mut rows = Vec::with_capacity(samples);
    for k in 0..samples {
        let t = k as f64 / (samples - 1) as f64;
        let gone = t * t * t * (10.0 - 15.0 * t + 6.0 * t * t); // minimum jerk
        let turn = glam::DQuat::from_rotation_z(gone * heading);
        let bump = 16.0 * (t * (1.0 - t)).powi(2);
        // The index fingertip arrives, not the palm.
        let palm_end = target - spread * (glam::DQuat::from_rotation_z(heading) * TIPS_M[1]);
        let palm = start.lerp(palm_end, gone) + bump * bow;
        let open = spread * (1.0 + 0.15 * bump);
        let hand = [palm]
            .into_iter()
            .chain(TIPS_M.map(|tip| palm + open * (turn * tip)));
        let mut row: Vec<f64> = Vec::with_capacity(25);
        for point in hand {
            row.extend(
                point
                    .to_array()
                    .map(|x| x + HAND_NOISE_M * sampler.normal()),
            );
        }
        let normal = DVec3::X.lerp(normal_end, gone).normalize();
        for point in [BOARD_M.lerp(target, gone), normal] {
            row.extend(point.to_array().map(|x| x + BOARD_NOISE * sampler.normal()));
        }
        row.push(gone * roll_end + BOARD_NOISE * sampler.normal());
        rows.push(row.into_iter().map(Some).collect());
    }
    Trajectory {
        name,
        id,
        kind: None,
        times_s: Some((0..samples).map(|k| k as f64 * PERIOD_S).collect()),
        rows,
    }
}
