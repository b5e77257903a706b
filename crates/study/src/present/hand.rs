//! The hand of a simulated trial.

use hwall::glam::DVec3;
use hwall::hand::HandFrame;
use hwall::sim::minimum_jerk;

/// A hand that rests, reaches for a surface facing +x, presses while it slides along it, and returns. Without tremor
/// or noise. The gaze is slightly ahead of the target.
#[derive(Debug, Clone, Copy)]
pub(super) struct StudyHand {
    pub(super) target_m: DVec3,
    /// Aim of the finger beyond the face, m.
    pub(super) depth_m: f64,
    /// Velocity along the surface while it presses, m/s.
    pub(super) slide_m_per_s: DVec3,
    /// Additional acceleration that drags the touched object along, m/s².
    pub(super) takes_m_per_s2: DVec3,
}

/// Times at which the hand starts to move, presses, lets go and is back, s.
pub(super) const START_S: f64 = 0.2;
pub(super) const PRESS_S: f64 = 1.8;
pub(super) const LEAVE_S: f64 = 2.5;
pub(super) const END_S: f64 = 2.8;

/// Rest position relative to the target, m.
const REST_M: DVec3 = DVec3::new(0.4, 0.1, 0.1);

/// Gaze ahead of the start of the scan, m: the board then arrives with more of its face ahead.
const LOOKS_AHEAD_M: f64 = 0.03;

impl StudyHand {
    /// Position of the index fingertip without contact, m.
    pub(super) fn tip_m(&self, t_s: f64) -> DVec3 {
        let share = |from_s: f64, to_s: f64| minimum_jerk((t_s - from_s) / (to_s - from_s));
        let out = share(START_S, PRESS_S) - share(LEAVE_S, END_S);
        let slid_s = t_s.clamp(PRESS_S, LEAVE_S) - PRESS_S;
        let slid_m = self.slide_m_per_s * slid_s + self.takes_m_per_s2 * (0.5 * slid_s * slid_s);
        let inside_m = self.target_m - DVec3::X * self.depth_m + slid_m;
        // Approach straight to an object that is dragged along: friction during the approach would move it.
        let way = self.takes_m_per_s2.normalize_or_zero();
        let rest_m = REST_M - way * way.dot(REST_M);
        (self.target_m + rest_m).lerp(inside_m, out)
    }

    /// Its velocity, m/s.
    pub(super) fn velocity_m_per_s(&self, t_s: f64) -> DVec3 {
        (self.tip_m(t_s + 1e-5) - self.tip_m(t_s - 1e-5)) / 2e-5
    }

    /// The tracker's frame.
    pub(super) fn frame(&self, t_s: f64) -> HandFrame {
        let tip_m = self.tip_m(t_s);
        let head_m = self.target_m + REST_M + DVec3::new(0.3, -0.2, 0.3);
        let looked_at_m = self.target_m + self.slide_m_per_s.normalize_or_zero() * LOOKS_AHEAD_M;
        HandFrame {
            palm_m: Some(tip_m + DVec3::X * 0.15),
            tips_m: [None, Some(tip_m), None, None, None],
            head_m: Some(head_m),
            gaze: (looked_at_m - head_m).try_normalize(),
            ..HandFrame::empty(t_s)
        }
    }
}
