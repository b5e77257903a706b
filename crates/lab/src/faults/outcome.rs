//! The outcome of a fault.

use super::fault::{Fault, Phase};
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
