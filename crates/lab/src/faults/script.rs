//! What the hand does in a run: it looks, reaches, presses and leaves.

use super::fault::Phase;
use glam::DVec3;
use hwall_sim::{HandDrive, minimum_jerk};

/// Where the hand touches if nobody says otherwise, base frame, m.
pub(super) const TARGET_M: DVec3 = DVec3::new(0.6, 0.02, 0.6);
/// Where the hand rests, m, from there.
pub(super) const REST_M: DVec3 = DVec3::new(0.4, 0.1, 0.1);

/// When the hand does what, s.
#[derive(Clone, Copy)]
pub(super) struct Script {
    /// Where it touches, base frame, m.
    pub(super) target_m: DVec3,
    pub(super) look_s: f64,
    pub(super) reach_s: f64,
    pub(super) press_s: f64,
    pub(super) leave_s: f64,
    pub(super) end_s: f64,
    /// How its aim goes on while it presses, m/s.
    pub(super) pressing_m_per_s: DVec3,
}

impl Script {
    pub(super) const fn of(phase: Phase) -> Self {
        let waits = matches!(phase, Phase::Waiting);
        let pressing_m_per_s = match phase {
            Phase::TouchedDoor => DVec3::new(-0.08, 0.0, 0.0),
            Phase::Sliding => DVec3::new(0.0, 0.04, 0.0),
            _ => DVec3::ZERO,
        };
        let later_s = if waits { 3.0 } else { 0.0 };
        Self {
            target_m: TARGET_M,
            look_s: 0.8 + later_s,
            reach_s: 2.2 + later_s,
            press_s: 3.2 + later_s,
            leave_s: 5.8 + later_s,
            end_s: 6.4 + later_s,
            pressing_m_per_s,
        }
    }

    /// The same of a hand that sets off `waits_s` after the look and is there `takes_s` later, whether a board is or not, `beside_m`
    /// the usual place.
    pub(super) fn hurried(self, waits_s: f64, takes_s: f64, beside_m: DVec3) -> Self {
        let reach_s = self.look_s + waits_s;
        let press_s = reach_s + takes_s;
        let sooner_s = self.press_s - press_s;
        Self {
            target_m: self.target_m + beside_m,
            reach_s,
            press_s,
            leave_s: self.leave_s - sooner_s,
            end_s: self.end_s - sooner_s,
            ..self
        }
    }

    /// Where the muscles aim, m.
    pub(super) fn aim_m(&self, t_s: f64) -> DVec3 {
        let share = |from_s: f64, to_s: f64| minimum_jerk((t_s - from_s) / (to_s - from_s));
        let out = share(self.reach_s, self.press_s) - share(self.leave_s, self.end_s);
        let pressed_s = t_s.clamp(self.press_s, self.leave_s) - self.press_s;
        let inside_m = self.target_m - DVec3::X * 0.03 + self.pressing_m_per_s * pressed_s;
        (TARGET_M + REST_M).lerp(inside_m, out)
    }

    pub(super) fn drive(&self, t_s: f64) -> HandDrive {
        HandDrive::Aim {
            position_m: self.aim_m(t_s),
            velocity_m_per_s: (self.aim_m(t_s + 1e-4) - self.aim_m(t_s - 1e-4)) / 2e-4,
        }
    }
}
