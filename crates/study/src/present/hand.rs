//! The hand of a simulated trial.

use hwall::glam::DVec3;
use hwall::hand::HandFrame;
use hwall::sim::minimum_jerk;

/// A hand that rests, reaches for a surface facing +x, presses while it slides along it, and goes back. It has neither tremor
/// nor noise. The person looks a little ahead of the target.
#[derive(Debug, Clone, Copy)]
pub(super) struct StudyHand {
    pub(super) target_m: DVec3,
    /// How far beyond the face the finger aims, m.
    pub(super) depth_m: f64,
    /// Velocity along the surface while it presses, m/s.
    pub(super) slide_m_per_s: DVec3,
    /// How it speeds up beside that to take what it touches along, m/s².
    pub(super) takes_m_per_s2: DVec3,
}

/// When the hand leaves its rest, presses, lets go and is back, s.
pub(super) const START_S: f64 = 0.2;
pub(super) const PRESS_S: f64 = 1.8;
pub(super) const LEAVE_S: f64 = 2.5;
pub(super) const END_S: f64 = 2.8;

/// Where the hand rests, seen from the target, m.
const REST_M: DVec3 = DVec3::new(0.4, 0.1, 0.1);

/// The person looks so far ahead of where the scan begins, m: the board comes with more of its face ahead.
const LOOKS_AHEAD_M: f64 = 0.03;

impl StudyHand {
    /// Where the tip of the index finger would be if nothing stopped it, m.
    pub(super) fn tip_m(&self, t_s: f64) -> DVec3 {
        let share = |from_s: f64, to_s: f64| minimum_jerk((t_s - from_s) / (to_s - from_s));
        let out = share(START_S, PRESS_S) - share(LEAVE_S, END_S);
        let slid_s = t_s.clamp(PRESS_S, LEAVE_S) - PRESS_S;
        let slid_m = self.slide_m_per_s * slid_s + self.takes_m_per_s2 * (0.5 * slid_s * slid_s);
        let inside_m = self.target_m - DVec3::X * self.depth_m + slid_m;
        // It comes straight to what it takes along: friction on the way would set that in motion.
        let way = self.takes_m_per_s2.normalize_or_zero();
        let rest_m = REST_M - way * way.dot(REST_M);
        (self.target_m + rest_m).lerp(inside_m, out)
    }

    /// Its velocity, m/s.
    pub(super) fn velocity_m_per_s(&self, t_s: f64) -> DVec3 {
        (self.tip_m(t_s + 1e-5) - self.tip_m(t_s - 1e-5)) / 2e-5
    }

    /// What the tracker sees.
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
