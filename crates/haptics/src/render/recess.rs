//! The board moves back for a person who is inside the wall.

use crate::board::{Board, BoardTarget};
use glam::DVec3;
use hwall_geometry::Pose;

/// A finger deeper in a wall than this is inside it, m: presses on a board in place are not as deep.
const INSIDE_M: f64 = 0.01;
/// Step size of the retreat, m.
const STEP_M: f64 = 0.01;
/// A point further behind the wall does not obstruct the board, m.
const DEEPEST_M: f64 = 0.25;

/// Moves the target further behind its surface if a person occupies the board's place and the board, whose face is commanded to be at `face`, is not
/// there yet.
pub(super) fn clear_of(
    target: &BoardTarget,
    person_m: &[DVec3],
    board: &Board,
    face: &Pose,
    clearance_m: f64,
) -> Option<BoardTarget> {
    let normal = target.normal.try_normalize()?;
    let reach_m = board.half_width_m.hypot(board.half_height_m);
    // The slack may shift the centre of the face.
    let [slack_u, slack_v] = target.slack_m;
    let reach_m = reach_m + slack_u.max(slack_v).max(0.0);
    let off_m = (face.position_m() - target.point_m).dot(normal);
    let at = face.inverse_transform_point(target.point_m);
    // A board in place stays: the finger presses it.
    let is_there = off_m.abs() <= INSIDE_M
        && at.x.abs() <= board.half_width_m
        && at.y.abs() <= board.half_height_m;
    let deepest_m = person_m
        .iter()
        .filter(|point| point.is_finite())
        .map(|point| *point - target.point_m)
        .filter(|off| off.reject_from_normalized(normal).length() <= reach_m)
        .map(|off| -off.dot(normal))
        .filter(|depth_m| (INSIDE_M..=DEEPEST_M).contains(depth_m))
        .fold(f64::NEG_INFINITY, f64::max);
    if deepest_m < INSIDE_M {
        return None;
    }
    // In steps, so that a jittering finger does not move the board.
    let behind_m = ((deepest_m + clearance_m) / STEP_M).ceil() * STEP_M;
    (!is_there && behind_m > target.behind_m).then_some(BoardTarget {
        behind_m,
        ..*target
    })
}
