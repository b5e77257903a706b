//! An arm at torque level that does not follow commands: detected, named, held, and released without a jump.

use crate::common::{Bench, DT_S, GazeSession, Hand, home, iiwa, session, wall};
use hwall::glam::DVec3;
use hwall::haptics::safety::{SafeReason, SafeState};
use hwall::haptics::{ArmCommand, ArmState};
use hwall::kinematics::{Chain, ChainDynamics, JointPositions};
use hwall::{EventKind, SessionState};
use hwall_sim::{TorqueArm, TorqueConfig};
use std::sync::Arc;

/// What happens to a command before it reaches the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    Through,
    /// The arm ignores commands and stands still, as with brakes on.
    Stuck,
    /// It ignores commands and drifts at this speed, rad/s, about its first joint.
    Drifting(f64),
}

struct Run {
    session: GazeSession,
    bench: Bench<TorqueArm>,
    drifted_rad: f64,
    stuck_at: Option<JointPositions>,
    /// The last command, and what the arm measured.
    command: ArmCommand,
    state: ArmState,
}

impl Run {
    fn new() -> Self {
        let dynamics = ChainDynamics::new(&Chain::iiwa7()).unwrap();
        let config = TorqueConfig::default();
        let arm = TorqueArm::new(Arc::new(iiwa()), dynamics, home(), config).unwrap();
        let hand = Hand::reaching_in(3.0, DVec3::new(0.6, -0.25, 0.7));
        let mut bench = Bench::of(arm, hand);
        Self {
            session: session(wall(0.6)),
            drifted_rad: 0.0,
            stuck_at: None,
            command: ArmCommand::Hold,
            state: bench.state(),
            bench,
        }
    }

    fn now_s(&self) -> f64 {
        self.bench.now_s()
    }

    fn cycle(&mut self, way: Way) -> SessionState {
        self.bench.show_frames(&mut self.session);
        let mut state = self.bench.state();
        // Encoders have noise: an arm at rest is not frozen.
        let noise = 1e-9 * ((self.now_s() / DT_S).round() % 7.0);
        state.q[6] += noise;
        state.qd[6] += noise;
        let command = self.session.step(self.now_s(), &state);
        self.session.plan();
        let held = *self.stuck_at.get_or_insert(self.bench.arm.q());
        let sent = match way {
            Way::Through => {
                (self.stuck_at, self.drifted_rad) = (None, 0.0);
                command
            }
            Way::Stuck => ArmCommand::Position(held),
            Way::Drifting(rad_per_s) => {
                self.drifted_rad += rad_per_s * DT_S;
                let mut q = held;
                q[0] += self.drifted_rad;
                ArmCommand::Position(q)
            }
        };
        self.bench.send(sent);
        (self.command, self.state) = (command, state);
        self.session.state()
    }

    /// Largest joint speed relative to its limit.
    fn speed_share(&self) -> f64 {
        let (qd, model) = (self.bench.arm.qd(), iiwa());
        let most = model.max_velocity_rad_per_s();
        (0..7).fold(0.0, |share: f64, i| share.max(qd[i].abs() / most[i]))
    }

    /// After it obeys again and the session was reset: no jump, and the board continues.
    fn is_released_without_a_leap(&mut self) {
        for _ in 0..500 {
            self.cycle(Way::Through);
        }
        assert!(self.session.control().is_latched());
        self.session.reset();
        let mut last: Option<JointPositions> = None;
        let (mut served, mut fastest) = (false, 0.0_f64);
        for _ in 0..3000 {
            let state = self.cycle(Way::Through);
            served |= matches!(state, SessionState::InPlace | SessionState::Touched);
            if let ArmCommand::Position(q) = self.command {
                let from = last.unwrap_or(self.state.q);
                let most_rad = if last.is_some() { 3.2 * DT_S } else { 0.05 };
                let leap_rad = q.max_abs_difference(&from);
                assert!(leap_rad <= most_rad, "{leap_rad} rad at {}", self.now_s());
                last = Some(q);
                fastest = fastest.max(self.speed_share());
            } else {
                last = None;
            }
        }
        assert!(served, "{:?}", self.session.state());
        assert!(fastest < 1.05, "{fastest} of the largest speeds");
    }
}

fn is_not_obeyed(state: SessionState) -> bool {
    let SessionState::Safe(state) = state else {
        return false;
    };
    state.reason() == Some(SafeReason::NotObeyed)
}

#[test]
fn an_arm_that_stands_whatever_it_is_told_is_held_and_goes_on_after_a_reset() {
    let mut run = Run::new();
    while !matches!(run.session.state(), SessionState::Approaching) {
        run.cycle(Way::Through);
        assert!(run.now_s() < 4.0);
    }
    let stuck_s = run.now_s();
    let mut named = 0;
    let mut apart_rad = 0.0_f64;
    while !is_not_obeyed(run.session.state()) {
        run.cycle(Way::Stuck);
        if let ArmCommand::Position(q) = run.command {
            apart_rad = apart_rad.max(q.max_abs_difference(&run.bench.arm.q()));
        }
        while let Some(event) = run.session.next_event() {
            named += usize::from(matches!(event.kind, EventKind::Safe(safe)
                if safe.reason() == Some(SafeReason::NotObeyed)));
        }
        assert!(run.now_s() < stuck_s + 1.5, "{apart_rad} rad apart");
    }
    println!(
        "stuck: noticed after {:.3} s, {apart_rad:.3} rad apart",
        run.now_s() - stuck_s
    );
    assert!(named == 1 && run.session.control().is_latched());
    assert!(matches!(
        run.session.control().safety(),
        SafeState::Holding { .. }
    ));
    // It was 3.3 rad.
    assert!(apart_rad < 0.8, "{apart_rad}");
    // Held for as long as the fault lasts, 3 s here.
    for _ in 0..3000 {
        run.cycle(Way::Stuck);
        assert_eq!(run.command, ArmCommand::Hold);
    }
    run.is_released_without_a_leap();
}

#[test]
fn an_arm_that_drifts_although_it_was_told_to_hold_is_named() {
    let mut run = Run::new();
    for _ in 0..500 {
        run.cycle(Way::Through);
    }
    run.session.stop();
    let began_s = run.now_s();
    while !is_not_obeyed(run.session.state()) {
        run.cycle(Way::Drifting(0.15));
        assert!(run.now_s() < began_s + 1.5);
    }
    println!(
        "drift: noticed after {:.3} s, {:.3} rad",
        run.now_s() - began_s,
        run.drifted_rad
    );
    assert!(run.session.control().is_latched());
    run.is_released_without_a_leap();
}
