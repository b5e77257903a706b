//! Where a person looks: one fixation after the other.

use super::profile::minimum_jerk;
use glam::{DQuat, DVec3};

/// Duration of a saccade, s; they last 0.02 to 0.1 s, longer for larger angles.
pub(super) const SACCADE_S: f64 = 0.06;

/// From a time on, the gaze rests on one thing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fixation {
    pub(super) from_s: f64,
    pub(super) on: LookAt,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum LookAt {
    /// Where a person at rest looks.
    Ahead,
    /// A point, and the two angles by which the gaze misses it, rad.
    Point { at_m: DVec3, off_rad: [f64; 2] },
}

/// Unit direction at a time, after these fixations in order of time.
pub(super) fn direction(fixations: &[Fixation], t_s: f64, ahead: DVec3, head_m: DVec3) -> DVec3 {
    let mut gaze = ahead;
    for fixation in fixations.iter().take_while(|f| f.from_s <= t_s) {
        let next = match fixation.on {
            LookAt::Ahead => ahead,
            LookAt::Point { at_m, off_rad } => {
                deflected((at_m - head_m).normalize_or(ahead), off_rad)
            }
        };
        let there = minimum_jerk((t_s - fixation.from_s) / SACCADE_S);
        gaze = if there < 1.0 {
            let turn = DQuat::from_rotation_arc(gaze, next);
            (DQuat::IDENTITY.slerp(turn, there) * gaze).normalize()
        } else {
            next
        };
    }
    gaze
}

/// A unit vector turned by angles below a right one about two axes across it.
pub(super) fn deflected(direction: DVec3, [a_rad, b_rad]: [f64; 2]) -> DVec3 {
    let (u, v) = direction.any_orthonormal_pair();
    (direction + u * a_rad.tan() + v * b_rad.tan()).normalize()
}
