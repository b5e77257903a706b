//! One run: a fault in a phase, or a hand that hits the board in place at 2 m/s, and its outcome.

use super::bench::{Bench, DT_S, Setup};
use super::fault::{Fault, Other, Phase};
use super::spoiled::SpoiledPredictor;
use anyhow::ensure;
use glam::DVec3;
use hwall::haptics::safety::Channel;
use hwall::haptics::{ContactLimits, HoldReason, SafeReason, SafeState};
use hwall::{EventKind, Session, SessionState};
use hwall_sim::{HandBody, HandBodyConfig};
use hwall_stage::named;
use hwall_stage::run::simulated_arm::ArmLevel;

named! {
    /// The safest state reached.
    pub enum Reached {
        /// The session went on.
        WentOn = "went on",
        /// Slower, or with less torque.
        Slowed = "slowed",
        /// The arm stands still.
        Holding = "holding",
        /// The board withdraws.
        Retreating = "retreating",
        /// The arm is compliant.
        Compliant = "compliant",
        /// The arm stands still until the fault is gone, possibly until a reset.
        Stopped = "stopped",
    }
}

named! {
    /// What happened after the fault.
    pub enum After {
        /// The session continued by itself.
        Recovered = "recovered",
        /// The fault stayed latched, and the session continued after a reset.
        Latched = "latched, reset",
        /// The session did not continue.
        Stuck = "stuck",
    }
}

/// One combination.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The fault.
    pub fault: Fault,
    /// The phase in which it began.
    pub phase: Phase,
    /// How much of the arm was simulated.
    pub level: ArmLevel,
    /// The safest state while it lasted.
    pub reached: Reached,
    /// The name of the first safe state and its reason.
    pub reason: String,
    /// Time from the fault to the first safe state, s.
    pub after_s: Option<f64>,
    /// Largest force on the hand since the fault, N.
    pub most_n: f64,
    /// Longest duration of a force above the quasi-static limit, s.
    pub pressed_s: f64,
    /// Largest approach speed of hand and face at contact since the fault, m/s.
    pub meets_m_per_s: f64,
    /// Largest displacement of the face during the fault, m.
    pub moved_m: f64,
    /// Displacement towards the hand, m.
    pub outward_m: f64,
    /// What happened afterwards.
    pub after: After,
}

/// Limits for evaluating the matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Time limit for a safe state, s: every missing input is outdated by then.
    pub safe_s: f64,
    /// Force of an impact, N.
    pub impact_n: f64,
    /// Longest duration of a force that counts as an impact, s.
    pub impact_s: f64,
    /// Energy of an impact, J.
    pub energy_j: f64,
    /// Mass of hand and board in an impact, kg.
    pub reduced_mass_kg: f64,
}

impl Outcome {
    /// Energy of the hardest contact of hand and face, J: `μ v² / 2`.
    pub fn energy_j(&self, bounds: &Bounds) -> f64 {
        0.5 * bounds.reduced_mass_kg * self.meets_m_per_s * self.meets_m_per_s
    }

    /// The exceeded limit and the excess; the time to a safe state first.
    pub fn exceeds(&self, bounds: &Bounds) -> Option<String> {
        let energy_j = self.energy_j(bounds);
        if self.is_unsafe(bounds) {
            Some(match self.after_s {
                Some(after_s) => format!("late by {:.0} ms", 1e3 * (after_s - bounds.safe_s)),
                None => "no safe state".to_owned(),
            })
        } else if self.most_n > bounds.impact_n {
            Some(format!("force by {:.0} N", self.most_n - bounds.impact_n))
        } else if self.pressed_s > bounds.impact_s {
            let longer_s = self.pressed_s - bounds.impact_s;
            Some(format!("lasting force by {longer_s:.2} s"))
        } else if energy_j > bounds.energy_j {
            Some(format!("energy by {:.2} J", energy_j - bounds.energy_j))
        } else {
            None
        }
    }

    /// Was a required safe state not reached in time?
    pub fn is_unsafe(&self, bounds: &Bounds) -> bool {
        let asked = self.fault.unheeded(self.phase).is_none();
        asked && self.after_s.is_none_or(|after_s| after_s > bounds.safe_s)
    }

    /// Did the session fail to continue even after a reset?
    pub fn is_stuck(&self) -> bool {
        self.after == After::Stuck
    }

    /// Combines two runs of the same combination, taking the worse of every number.
    pub fn worse_of(self, other: Self) -> Self {
        let later = match (self.after_s, other.after_s) {
            (Some(a), Some(b)) => Some(a.max(b)),
            _ => None,
        };
        let reason = match self.reason.is_empty() {
            true => other.reason,
            false => self.reason,
        };
        Self {
            reached: self.reached.min(other.reached),
            reason,
            after_s: later,
            most_n: self.most_n.max(other.most_n),
            pressed_s: self.pressed_s.max(other.pressed_s),
            meets_m_per_s: self.meets_m_per_s.max(other.meets_m_per_s),
            moved_m: self.moved_m.max(other.moved_m),
            outward_m: self.outward_m.max(other.outward_m),
            after: match (self.after, other.after) {
                (After::Stuck, _) | (_, After::Stuck) => After::Stuck,
                (After::Latched, _) | (_, After::Latched) => After::Latched,
                _ => After::Recovered,
            },
            ..self
        }
    }
}

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

/// Speed of the hand, m/s.
pub const SPEED_M_PER_S: f64 = 2.0;
/// Masses of the hand, kg: a finger, hands and fingers of ISO/TS 15066, a stiff forearm.
pub const MASSES_KG: [f64; 3] = [0.1, 0.6, 2.0];
/// Stiffnesses of the finger, N/m: from soft to that of a hand in ISO/TS 15066.
pub const STIFFNESSES_N_PER_M: [f64; 4] = [1e3, 5e3, 2e4, 7.5e4];

/// One hand on one arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Impact {
    /// How much of the arm was simulated.
    pub level: ArmLevel,
    /// Mass of the hand, kg.
    pub mass_kg: f64,
    /// Stiffness of the finger, N/m.
    pub stiffness_n_per_m: f64,
    /// Largest force, N.
    pub peak_n: f64,
    /// Kinetic energy of the hand, J.
    pub energy_j: f64,
    /// Largest displacement of the board, m.
    pub moved_m: f64,
    /// The safest state reached.
    pub reached: Reached,
    /// Its reason.
    pub reason: String,
}

impl Impact {
    /// Force above the limit of an impact, N.
    pub fn exceeds_n(&self, bounds: &Bounds) -> f64 {
        (self.peak_n - bounds.impact_n).max(0.0)
    }

    /// Force on a rigid board, N: `v √(k m)`, [ISO/TS 15066], annex A.
    pub fn rigid_n(&self) -> f64 {
        SPEED_M_PER_S * (self.stiffness_n_per_m * self.mass_kg).sqrt()
    }
}

pub(super) fn hit(
    setup: &Setup,
    (level, mass_kg, stiffness_n_per_m): (ArmLevel, f64, f64),
    seed: u64,
) -> anyhow::Result<Impact> {
    let mut bench = Bench::new(setup, Phase::InPlace, Some(level), seed)?;
    // Wait until the board is at rest in place, before the script's hand arrives.
    while bench.t_s < 2.1 {
        bench.cycle(None, None)?;
    }
    let face = bench.arm.pose();
    let outward: DVec3 = face.rotation().z_axis;
    let config = HandBodyConfig {
        mass_kg,
        finger_stiffness_n_per_m: stiffness_n_per_m,
        arm_damping_n_s_per_m: 0.0,
        ..HandBodyConfig::default()
    };
    let start_m = face.position_m() + outward * 0.02;
    bench.hand = HandBody::new(config, start_m, outward * -SPEED_M_PER_S)?;
    bench.script_is_over = true;
    let mut impact = Impact {
        level,
        mass_kg,
        stiffness_n_per_m,
        peak_n: 0.0,
        energy_j: 0.5 * mass_kg * SPEED_M_PER_S * SPEED_M_PER_S,
        moved_m: 0.0,
        reached: Reached::WentOn,
        reason: String::new(),
    };
    for _ in 0..(0.3 / DT_S) as usize {
        bench.cycle(None, None)?;
        let force_n = bench.hand_wrench.force_n.length();
        impact.peak_n = impact.peak_n.max(force_n);
        let way = bench.arm.pose().position_m() - face.position_m();
        impact.moved_m = impact.moved_m.max(way.length());
        let (reached, name) = safe_state(&bench.session, false);
        impact.reached = impact.reached.max(reached);
        if let (Some(name), true) = (name, impact.reason.is_empty()) {
            impact.reason = name;
        }
    }
    Ok(impact)
}
