//! One combination: a fault in a phase, and its outcome.

use super::bench::{Bench, DT_S, Setup};
use super::fault::{Fault, Other, Phase};
use super::outcome::{After, Outcome, Reached};
use super::predictor::SpoiledPredictor;
use anyhow::ensure;
use glam::DVec3;
use hwall::haptics::safety::Channel;
use hwall::haptics::{ContactLimits, HoldReason, SafeReason, SafeState};
use hwall::{EventKind, Session, SessionState};
use hwall_stage::run::simulated_arm::ArmLevel;

/// Duration of the fault, s: long enough for the board to withdraw.
const FAULT_S: f64 = 1.0;
/// Time allowed for the session to continue by itself, s after the fault.
const RECOVERED_S: f64 = 1.0;
/// Time allowed to continue after a reset, s.
const RESET_S: f64 = 0.6;
/// Time limit for a phase to begin, s.
const LATEST_S: f64 = 9.0;

/// The safe state in force, and its name.
pub(super) fn safe_state(
    session: &Session<SpoiledPredictor>,
    heads: bool,
) -> (Reached, Option<String>) {
    let safety = session.control().safety();
    let reached = |state: SafeState| match state {
        SafeState::Holding { .. } => Reached::Holding,
        SafeState::Retreating { .. } => Reached::Retreating,
        SafeState::Compliant { .. } => Reached::Compliant,
        SafeState::Stopped { .. } => Reached::Stopped,
        SafeState::Slowed { .. } => Reached::Slowed,
        _ => Reached::WentOn,
    };
    match (session.state(), safety) {
        (SessionState::Safe(state), _) => (reached(state), state.reason().map(reason_name)),
        (SessionState::Holding(reason), safety) if reason != HoldReason::NoTarget => {
            let state = reached(safety).max(Reached::Holding);
            (state, Some(reason.name().to_owned()))
        }
        (_, SafeState::Slowed { reason }) => {
            let name = match reason {
                SafeReason::PersonNear {
                    part: Channel::Head,
                    ..
                } if heads => Some(reason_name(reason)),
                _ => None,
            };
            (Reached::Slowed, name)
        }
        _ => (Reached::WentOn, None),
    }
}

fn reason_name(reason: SafeReason) -> String {
    match reason.channel() {
        Some(channel) => format!("{} {}", reason.name(), channel.name()),
        None => reason.name().to_owned(),
    }
}

/// One combination.
pub(super) fn run(
    setup: &Setup,
    (fault, phase, level): (Fault, Phase, ArmLevel),
    seed: u64,
) -> anyhow::Result<Outcome> {
    let behind_fri = matches!(fault, Fault::Link(_));
    let mut bench = Bench::new(setup, phase, (!behind_fri).then_some(level), seed)?;
    let heads = fault == Fault::Other(Other::PersonInTheWay);
    if heads {
        // From further away the head would arrive after the board.
        bench.head_m = DVec3::new(1.05, -0.15, 0.95);
    }
    let (mut last, mut since_s, mut released_s) = (bench.session.state(), 0.0, None);
    loop {
        let released = released_s.is_some_and(|at| bench.t_s - at > 0.05);
        if bench.is_in(phase, bench.t_s - since_s, released) {
            break;
        }
        bench.cycle(None, None)?;
        if bench.session.state() != last {
            (last, since_s) = (bench.session.state(), bench.t_s);
        }
        while let Some(event) = bench.session.next_event() {
            if matches!(event.kind, EventKind::Released) {
                released_s = Some(bench.t_s);
            }
        }
        ensure!(
            bench.t_s <= LATEST_S,
            "{} never comes ({level:?})",
            phase.name()
        );
    }
    let began_s = bench.t_s;
    let face = bench.arm.pose();
    let limits = ContactLimits::default();
    let mut outcome = Outcome {
        fault,
        phase,
        level,
        reached: Reached::WentOn,
        reason: String::new(),
        after_s: None,
        most_n: 0.0,
        pressed_s: 0.0,
        meets_m_per_s: 0.0,
        moved_m: 0.0,
        outward_m: 0.0,
        after: After::Stuck,
    };
    if matches!(fault, Fault::Other(Other::Stop | Other::NotObeyed)) {
        bench.session.stop();
    }
    let mut pressed_s = 0.0;
    let mut latched = false;
    while bench.t_s - began_s < FAULT_S + RECOVERED_S + RESET_S {
        let since_s = bench.t_s - began_s;
        let lasts = since_s < FAULT_S;
        let before = bench.hand.is_touching();
        let outward = bench.arm.pose().rotation().z_axis;
        let closing =
            (bench.arm.twist().linear_m_per_s - bench.hand.velocity_m_per_s()).dot(outward);
        bench.cycle(lasts.then_some((fault, since_s)), None)?;
        if bench.hand.is_touching() && !before {
            outcome.meets_m_per_s = outcome.meets_m_per_s.max(closing);
        }
        let force_n = bench.hand_wrench.force_n.length();
        outcome.most_n = outcome.most_n.max(force_n);
        pressed_s = match force_n > limits.lasting_force_n() {
            true => pressed_s + DT_S,
            false => 0.0,
        };
        outcome.pressed_s = outcome.pressed_s.max(pressed_s);
        if lasts {
            let way = bench.arm.pose().position_m() - face.position_m();
            outcome.moved_m = outcome.moved_m.max(way.length());
            outcome.outward_m = outcome.outward_m.max(way.dot(face.rotation().z_axis));
            let (reached, name) = safe_state(&bench.session, heads);
            outcome.reached = outcome.reached.max(reached);
            if let (Some(name), None) = (name, outcome.after_s) {
                (outcome.after_s, outcome.reason) = (Some(since_s), name);
            }
        } else if since_s >= FAULT_S + RECOVERED_S && !latched {
            latched = bench.session.control().is_latched();
            if latched {
                bench.session.reset();
            }
        }
        while bench.session.next_event().is_some() {}
    }
    let goes_on = safe_state(&bench.session, false).0 <= Reached::Slowed;
    if !goes_on {
        let state = bench.session.state();
        outcome.reason = format!("at the end {state:?}");
    }
    outcome.after = match (goes_on, latched) {
        (true, false) => After::Recovered,
        (true, true) => After::Latched,
        (false, _) => After::Stuck,
    };
    Ok(outcome)
}
