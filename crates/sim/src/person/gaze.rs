//! Gaze of a person as a sequence of fixations.

use super::profile::minimum_jerk;
use glam::{DQuat, DVec3};

/// Duration of a saccade, s; they last 0.02 to 0.1 s, longer for larger angles.
pub(super) const SACCADE_S: f64 = 0.06;

/// A fixation, from a time on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fixation {
    pub(super) from_s: f64,
    pub(super) on: LookAt,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum LookAt {
    /// The gaze direction of a person at rest.
    Ahead,
    /// A point, and the two angles by which the gaze deviates from it, rad.
    Point { at_m: DVec3, off_rad: [f64; 2] },
}

/// Unit gaze direction at a time, for fixations in order of time.
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

/// A unit vector deflected by two angles below 90 degrees about perpendicular axes.
pub(super) fn deflected(direction: DVec3, [a_rad, b_rad]: [f64; 2]) -> DVec3 {
    let (u, v) = direction.any_orthonormal_pair();
    (direction + u * a_rad.tan() + v * b_rad.tan()).normalize()
}
