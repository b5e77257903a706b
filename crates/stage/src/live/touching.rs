//! The fingertip of a tracked hand on the board of a simulated arm.

use crate::run::simulated_arm::{ArmError, Finger, SimulatedArm};
use glam::DVec3;
use hwall::hand::{HandFrame, Tracking};
use hwall::haptics::Board;
use hwall_geometry::Wrench;

/// Longest extrapolation of the fingertip between samples, s: 1.5 periods of a headset.
const AHEAD_S: f64 = 0.02;

/// Largest step of the arm's simulation, s. After a longer pause of the loop the rest is skipped: the arm does not catch up, and
/// touches during the pause have no effect.
const LONGEST_S: f64 = 0.1;

/// Presses the board of a simulated arm with a tracked fingertip.
pub(super) struct Touching {
    finger: Finger,
    until_s: f64,
    skipped_s: f64,
}

impl Touching {
    pub(super) fn new(board: &Board) -> Self {
        Self {
            finger: Finger::new(board),
            until_s: 0.0,
            skipped_s: 0.0,
        }
    }

    /// Lag of the arm's clock behind that of the loop, s: the skipped time.
    pub(super) const fn skipped_s(&self) -> f64 {
        self.skipped_s
    }

    /// Advances the arm to `until_s`, by 0.1 s at most, and lets the fingertip press the board; returns the force, base axes, N.
    /// A lost hand presses nothing.
    pub(super) fn advance(
        &mut self,
        arm: &mut SimulatedArm,
        until_s: f64,
        frame: Option<&HandFrame>,
        tracking: Option<&Tracking>,
    ) -> Result<DVec3, ArmError> {
        let left_s = until_s - self.until_s;
        if left_s > 0.0 {
            let dt_s = left_s.min(LONGEST_S);
            if dt_s < left_s {
                self.skipped_s += left_s - dt_s;
                arm.apply_wrench(Wrench::default())?;
            }
            arm.advance(dt_s)?;
            self.until_s = until_s;
        }
        let state = tracking.and_then(Tracking::state);
        let tip = state.zip(frame).and_then(|(state, frame)| {
            let ahead_s = (until_s - frame.t_s).clamp(0.0, AHEAD_S);
            let tip_m = frame.contact_point()?.position_m;
            Some((
                tip_m + ahead_s * state.velocity_m_per_s,
                state.velocity_m_per_s,
            ))
        });
        self.finger.press(arm, tip)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::arms::BoardArm;
    use hwall::haptics::{Arm, ArmCommand};
    use std::sync::Arc;

    #[test]
    fn a_loop_that_slept_finds_the_arm_as_it_stood() {
        let board = Board::default();
        let named = BoardArm::named("iiwa7", &board).expect("an arm");
        let model = Arc::clone(named.kinematics());
        let mut arm = SimulatedArm::servo(model, named.start(), 1).expect("an arm");
        let mut goal = named.start();
        goal.0[0] += 1.0;
        arm.command(ArmCommand::Position(goal)).expect("taken");
        let mut touching = Touching::new(&board);
        for ms in 1..=20 {
            let step = touching.advance(&mut arm, 1e-3 * f64::from(ms), None, None);
            step.expect("a step");
        }
        assert_eq!(touching.skipped_s(), 0.0);
        let push = Wrench {
            force_n: 100.0 * DVec3::X,
            ..Wrench::default()
        };
        arm.apply_wrench(push).expect("finite");
        let step = touching.advance(&mut arm, 30_000.0, None, None);
        step.expect("a step");
        let state = arm.state().expect("a state");
        assert!((state.t_s - 0.12).abs() < 1e-9, "{} s", state.t_s);
        assert!((state.t_s + touching.skipped_s() - 30_000.0).abs() < 1e-9);
        assert!(arm.q()[0] < goal[0] - 0.5, "it is still on its way");
        let torques = state.external_torque.expect("sensors");
        assert!(torques.0.iter().all(|torque| torque.abs() < 5.0));
    }
}
