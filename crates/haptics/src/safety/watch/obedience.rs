//! Does the arm follow its commands?

use crate::error::HapticsError;
use crate::safety::cycle::Sent;
use hwall_kinematics::{JointPositions, MOST_JOINTS};
use hwall_numeric::check::{non_negative, positive};

/// When an arm counts as disobeying its commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObedienceConfig {
    /// Longest time until a commanded position is reached, s; default 0.15: an iiwa reacts in 0.022 s, and its servo smooths the motion.
    pub delay_s: f64,
    /// A joint may be this far outside all positions commanded within that time, rad; default 0.3: a push bends an arm, and an arm that has to stop
    /// at once from full speed overruns by 0.1 to 0.2 rad.
    pub tolerance_rad: f64,
    /// Longest time that a joint may be further out, s; default 0.1.
    pub lasting_s: f64,
    /// A joint that does not move for `delay_s` although all positions commanded in that time are this far away is stuck, rad; default 0.1.
    pub stuck_rad: f64,
    /// Time in which an arm that is commanded to hold comes to rest, s; default 0.4.
    pub rest_s: f64,
    /// Afterwards no joint may drift further than this, rad; default 0.05.
    pub drift_rad: f64,
}

impl Default for ObedienceConfig {
    fn default() -> Self {
        Self {
            delay_s: 0.15,
            tolerance_rad: 0.3,
            lasting_s: 0.1,
            stuck_rad: 0.1,
            rest_s: 0.4,
            drift_rad: 0.05,
        }
    }
}

impl ObedienceConfig {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("delay_s", self.delay_s)?;
        positive("tolerance_rad", self.tolerance_rad)?;
        non_negative("lasting_s", self.lasting_s)?;
        positive("stuck_rad", self.stuck_rad)?;
        non_negative("rest_s", self.rest_s)?;
        positive("drift_rad", self.drift_rad)?;
        Ok(())
    }
}

/// A joint that turned less than this has not moved, rad.
const STANDS_RAD: f64 = 2e-3;

/// Number of time slots within the delay.
const PIECES: usize = 16;

/// Smallest and largest angle of each joint in a time slot.
#[derive(Debug, Clone, Copy)]
struct Span {
    began_s: f64,
    least: [f64; MOST_JOINTS],
    most: [f64; MOST_JOINTS],
}

impl Span {
    const EMPTY: Self = Self {
        began_s: f64::NEG_INFINITY,
        least: [f64::INFINITY; MOST_JOINTS],
        most: [f64::NEG_INFINITY; MOST_JOINTS],
    };

    fn include(&mut self, other: &Self) {
        for joint in 0..MOST_JOINTS {
            self.least[joint] = self.least[joint].min(other.least[joint]);
            self.most[joint] = self.most[joint].max(other.most[joint]);
        }
    }

    fn widen(&mut self, q: &JointPositions) {
        for joint in 0..MOST_JOINTS {
            self.least[joint] = self.least[joint].min(q[joint]);
            self.most[joint] = self.most[joint].max(q[joint]);
        }
    }
}

/// The kind of the last command.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Told {
    /// Torques, or nothing so far: the arm may be anywhere.
    Anything,
    Positions,
    /// Hold: since when, and where the arm came to rest.
    Hold {
        since_s: f64,
        rested: Option<JointPositions>,
    },
}

/// Compares the arm's position with its commands. An arm under torques goes where it is pushed; it is not checked.
#[derive(Debug, Clone)]
pub(in crate::safety) struct Obedience {
    config: ObedienceConfig,
    told: Told,
    spans: [Span; PIECES],
    /// Measured angles in the same time slots.
    measured: [Span; PIECES],
    newest: usize,
    /// Since when the arm has been elsewhere, s.
    astray_since_s: Option<f64>,
}

impl Obedience {
    pub(in crate::safety) const fn new(config: ObedienceConfig) -> Self {
        Self {
            config,
            told: Told::Anything,
            spans: [Span::EMPTY; PIECES],
            measured: [Span::EMPTY; PIECES],
            newest: 0,
            astray_since_s: None,
        }
    }

    /// Is the arm where it was commanded to be? `q` is measured and finite; times are of sound clocks.
    pub(in crate::safety) fn holds(
        &mut self,
        q: &JointPositions,
        joints: usize,
        now_s: f64,
    ) -> bool {
        let c = self.config;
        match &mut self.told {
            Told::Anything => true,
            Told::Hold { since_s, rested } => {
                if now_s - *since_s < c.rest_s {
                    return true;
                }
                let at = *rested.get_or_insert(*q);
                let drifts = (0..joints).any(|i| (q[i] - at[i]).abs() > c.drift_rad);
                if drifts {
                    // Report once, then restart from here.
                    *rested = Some(*q);
                }
                !drifts
            }
            Told::Positions => {
                let oldest_s = now_s - c.delay_s * (1.0 + 1.0 / PIECES as f64);
                let (newest, spans) = (self.newest, &self.spans);
                let live = |k: &usize| *k == newest || spans[*k].began_s >= oldest_s;
                let (mut told, mut moved) = (Span::EMPTY, Span::EMPTY);
                for k in (0..PIECES).filter(live) {
                    told.include(&spans[k]);
                    moved.include(&self.measured[k]);
                }
                let off = |i: usize| (told.least[i] - q[i]).max(q[i] - told.most[i]);
                let stands =
                    |i: usize| moved.most[i].max(q[i]) - moved.least[i].min(q[i]) < STANDS_RAD;
                if (0..joints).any(|i| off(i) > c.stuck_rad && stands(i)) {
                    return false;
                }
                let astray = (0..joints).any(|i| off(i) > c.tolerance_rad);
                if !astray {
                    self.astray_since_s = None;
                    return true;
                }
                let since_s = *self.astray_since_s.get_or_insert(now_s);
                now_s - since_s < c.lasting_s
            }
        }
    }

    /// Stores the command of this cycle; `q` is the measured configuration.
    pub(in crate::safety) fn remember(
        &mut self,
        sent: Sent,
        held: bool,
        q: &JointPositions,
        now_s: f64,
    ) {
        let is_finite = q.0.iter().all(|angle| angle.is_finite());
        match (sent, self.told) {
            (Sent::Position(to), told) => {
                if told != Told::Positions {
                    self.spans = [Span::EMPTY; PIECES];
                    self.measured = [Span::EMPTY; PIECES];
                    self.spans[self.newest].began_s = now_s;
                    // The motion starts from the measured configuration.
                    if is_finite {
                        self.spans[self.newest].widen(q);
                    }
                    (self.told, self.astray_since_s) = (Told::Positions, None);
                }
                let piece_s = self.config.delay_s / PIECES as f64;
                if now_s - self.spans[self.newest].began_s >= piece_s {
                    self.newest = (self.newest + 1) % PIECES;
                    self.spans[self.newest] = Span {
                        began_s: now_s,
                        ..Span::EMPTY
                    };
                    self.measured[self.newest] = Span::EMPTY;
                }
                self.spans[self.newest].widen(&to);
                if is_finite {
                    self.measured[self.newest].widen(q);
                }
            }
            (_, Told::Hold { .. }) if held => {}
            _ if held => {
                self.told = Told::Hold {
                    since_s: now_s,
                    rested: None,
                };
            }
            _ => self.told = Told::Anything,
        }
    }
}
