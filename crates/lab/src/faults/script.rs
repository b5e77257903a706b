//! The hand's script in a run: look, reach, press and leave.

use super::fault::Phase;
use glam::DVec3;
use hwall_sim::{HandDrive, minimum_jerk};

/// Default point of touch, base frame, m.
pub const TARGET_M: DVec3 = DVec3::new(0.6, 0.02, 0.6);
/// Rest position relative to the target, m.
pub(super) const REST_M: DVec3 = DVec3::new(0.4, 0.1, 0.1);

/// Times of the hand's actions, s.
#[derive(Clone, Copy)]
pub(super) struct Script {
    /// Point of touch, base frame, m.
    pub(super) target_m: DVec3,
    pub(super) look_s: f64,
    pub(super) reach_s: f64,
    pub(super) press_s: f64,
    pub(super) leave_s: f64,
    pub(super) end_s: f64,
    /// Velocity of its aim while it presses, m/s.
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

    /// The script of a hurried hand: starts `waits_s` after the look, arrives `takes_s` later whether or not the board is there, at
    /// `beside_m` from the default place.
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

    /// The aim of the muscles, m.
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
