//! The search for the posture: starts made from the targets, improved by steps of single joints and pairs.

use super::problem::Problem;
use crate::presentation::Holding;
use glam::{DMat3, DVec3};
use hwall_geometry::Pose;
use hwall_kinematics::{ArmKinematics, ArmScratch, JointPositions, MOST_JOINTS, NearestConfig};
use std::f64::consts::FRAC_PI_4;

/// Distances by which starts are pulled back from a target, m.
const DRAWN_BACK_M: [f64; 2] = [0.12, 0.2];

/// Arm angle step of the presenter for starts: coarse.
pub(super) const START_ANGLE_STEP_RAD: f64 = FRAC_PI_4;

/// Number of targets from which starts are made.
const START_PLACES: usize = 12;

/// Number of starts left after each comparison: by own deficits, then by times alone; the loss decides at the end.
const LEFT: [usize; 2] = [1500, 80];

/// Starts that differ by less than this in every joint count as one, rad.
const ALIKE_RAD: f64 = 0.5;

/// Pairs of joints that are turned together, besides each alone: joints that compensate each other in the arm's poses.
const PAIRS: [[usize; 2]; 4] = [[0, 2], [2, 4], [4, 6], [1, 3]];

/// The most promising starts, best first: configurations that hold the board behind a target.
pub(super) fn starts(
    problem: &Problem,
    holding: &Holding<'_>,
    count: usize,
) -> Vec<JointPositions> {
    let places = problem.places();
    let mut found = problem.config.start_from.clone();
    let near = JointPositions(problem.passage.arm.limits().map(|l| l.middle_rad()));
    let mut ways = Vec::new();
    let tried = START_PLACES.min(places.len());
    for i in 0..tried {
        let place = &places[(2 * i + 1) * places.len() / (2 * tried)];
        for back_m in DRAWN_BACK_M {
            let point_m = place.point_m - place.plane.normal() * back_m;
            holding.present(&place.plane, point_m, &near, &mut ways);
        }
    }
    if ways.is_empty() {
        for place in places.iter().take(START_PLACES) {
            holding.present(&place.plane, place.point_m, &near, &mut ways);
        }
    }
    found.extend(ways.iter().map(|way| way.q));
    let found = best_of(found, LEFT[0], |q| problem.lack_s(q));
    let found = best_of(found, LEFT[1], |q| {
        problem.lack_s(q) + problem.unblocked_s(q)
    });
    let found = best_of(found, LEFT[1], |q| problem.loss_s(q));
    let mut best: Vec<JointPositions> = Vec::with_capacity(count);
    for q in found {
        if best.iter().all(|b| b.max_abs_difference(&q) > ALIKE_RAD) {
            best.push(q);
        }
        if best.len() == count {
            break;
        }
    }
    best
}

/// The configurations of least price, sorted; stable for equal prices.
fn best_of(
    found: Vec<JointPositions>,
    count: usize,
    price: impl Fn(&JointPositions) -> f64,
) -> Vec<JointPositions> {
    let mut order: Vec<(f64, JointPositions)> = found.into_iter().map(|q| (price(&q), q)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    order.truncate(count);
    order.into_iter().map(|(_, q)| q).collect()
}

/// A range of step lengths of a descent, rad.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepRange {
    pub(super) first_rad: f64,
    pub(super) last_rad: f64,
}

/// The best posture reached by steps of single joints, joint pairs and the board, and its loss.
pub(super) fn descend(
    problem: &Problem,
    from: JointPositions,
    steps: StepRange,
) -> (JointPositions, f64) {
    /// Most rounds at one step length; a descent that has not converged by then continues with shorter steps.
    const MOST_ROUNDS: usize = 12;
    let mut best = from;
    let mut least = f64::INFINITY;
    let mut step_rad = steps.first_rad;
    let arm = problem.passage.arm;
    let mut scratch = arm.scratch();
    while step_rad >= steps.last_rad {
        // Only configurations that can matter within a few steps.
        let near = problem.near(&best, 0.15 + 1.5 * step_rad);
        least = near.loss_s(&best);
        for _ in 0..MOST_ROUNDS {
            let before = least;
            for direction in directions() {
                for sign in [1.0, -1.0] {
                    let mut length_rad = sign * step_rad;
                    // Double the step while it helps.
                    loop {
                        let moved = along(&best, &direction, length_rad);
                        let loss = near.loss_s(&moved);
                        if loss >= least {
                            break;
                        }
                        (best, least) = (moved, loss);
                        length_rad *= 2.0;
                    }
                }
            }
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                for length in [step_rad, -step_rad] {
                    for moved in [
                        shifted(arm, &best, axis * (0.5 * length), &mut scratch),
                        turned(arm, &best, axis * length, &mut scratch),
                    ]
                    .into_iter()
                    .flatten()
                    {
                        let loss = near.loss_s(&moved);
                        if loss < least {
                            (best, least) = (moved, loss);
                        }
                    }
                }
            }
            if before - least < 1e-6 {
                break;
            }
        }
        step_rad *= 0.5;
    }
    (best, least)
}

/// The nearest configuration with the board shifted: single joints cannot move it along a surface without coming nearer to it.
fn shifted(
    arm: &dyn ArmKinematics,
    q: &JointPositions,
    by_m: DVec3,
    scratch: &mut ArmScratch,
) -> Option<JointPositions> {
    let pose = arm.forward(q);
    moved_to(arm, q, &pose.at(pose.position_m() + by_m), scratch)
}

fn turned(
    arm: &dyn ArmKinematics,
    q: &JointPositions,
    by_rad: DVec3,
    scratch: &mut ArmScratch,
) -> Option<JointPositions> {
    let pose = arm.forward(q);
    let turn = DMat3::from_axis_angle(by_rad.normalize_or_zero(), by_rad.length());
    let pose = Pose::new(turn * pose.rotation(), pose.position_m()).ok()?;
    moved_to(arm, q, &pose, scratch)
}

fn moved_to(
    arm: &dyn ArmKinematics,
    q: &JointPositions,
    pose: &Pose,
    scratch: &mut ArmScratch,
) -> Option<JointPositions> {
    let found = arm.nearest(pose, q, &NearestConfig::default(), scratch);
    found.ok().map(|solution| solution.q)
}

fn directions() -> impl Iterator<Item = [f64; MOST_JOINTS]> {
    let along = |joints: &[(usize, f64)]| {
        let mut direction = [0.0; MOST_JOINTS];
        for (joint, share) in joints {
            direction[*joint] = *share;
        }
        direction
    };
    let alone = (0..MOST_JOINTS).map(move |joint| along(&[(joint, 1.0)]));
    let signs = |[a, b]: [usize; 2]| [1.0, -1.0].map(|sign| [(a, 1.0), (b, sign)]);
    let pairs = PAIRS.into_iter().flat_map(signs);
    alone.chain(pairs.map(move |pair| along(&pair)))
}

fn along(q: &JointPositions, direction: &[f64; MOST_JOINTS], length_rad: f64) -> JointPositions {
    let mut moved = *q;
    for joint in 0..MOST_JOINTS {
        moved[joint] += length_rad * direction[joint];
    }
    moved
}
