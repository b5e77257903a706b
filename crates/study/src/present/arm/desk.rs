//! The control loop's interface to the study: takes trials, returns their outcomes.

use super::ending::{is_stopped_by_person, of_safe};
use super::observed::{ArmTrialConfig, Observed, ObservedTouch, is_touched};
use crate::present::stimulus::{Fault, Stimulus};
use hwall::contact::Predictor;
use hwall::texture::TextureLevels;
use hwall::{Cycle, Event, Session};
use std::sync::mpsc::{Receiver, SyncSender};

/// A trial begins after the board was free for this long, s.
const FREE_S: f64 = 0.2;

/// A trial to be presented.
pub(super) struct Job {
    pub(super) stimulus: Stimulus,
    pub(super) levels: TextureLevels,
    /// The levels at rest, presented until the next trial.
    pub(super) resting: TextureLevels,
}

enum Phase {
    Idle,
    /// Waiting for the hand to let go, or for a person to reset the arm.
    Clearing {
        job: Box<Job>,
        since_s: f64,
    },
    Touch {
        touch: Box<ObservedTouch>,
        resting: Box<TextureLevels>,
    },
}

/// The control loop's end. Never blocks; changes levels only while nobody touches.
pub(super) struct Desk {
    config: ArmTrialConfig,
    jobs: Receiver<Job>,
    outcomes: SyncSender<Observed>,
    phase: Phase,
    /// Levels at rest that wait for the hand to let go.
    resting: Option<Box<TextureLevels>>,
    touched_s: f64,
}

impl Desk {
    pub(super) const fn new(
        config: ArmTrialConfig,
        jobs: Receiver<Job>,
        outcomes: SyncSender<Observed>,
    ) -> Self {
        Self {
            config,
            jobs,
            outcomes,
            phase: Phase::Idle,
            resting: None,
            touched_s: f64::NEG_INFINITY,
        }
    }

    pub(super) fn event(&mut self, event: &Event) {
        if let Phase::Touch { touch, .. } = &mut self.phase {
            touch.event(event);
        }
    }

    /// To be called at the end of a cycle, after its events.
    pub(super) fn step<P: Predictor>(&mut self, session: &mut Session<P>, cycle: &Cycle) {
        let now_s = cycle.t_s;
        if is_touched(session) {
            self.touched_s = now_s;
        }
        let is_free = now_s - self.touched_s > FREE_S;
        if is_free && let Some(resting) = self.resting.take() {
            session.set_texture_levels(*resting);
        }
        let is_stopped = is_stopped_by_person(session.control());
        self.phase = match std::mem::replace(&mut self.phase, Phase::Idle) {
            Phase::Idle => match self.jobs.try_recv() {
                Ok(job) => Phase::Clearing {
                    job: Box::new(job),
                    since_s: now_s,
                },
                Err(_) => Phase::Idle,
            },
            Phase::Clearing { since_s, .. }
                if is_stopped && now_s - since_s > self.config.touch_within_s =>
            {
                let because = Some(of_safe(&session.control().safety()));
                self.tell(Observed::nothing(Fault::Stopped, because));
                Phase::Idle
            }
            Phase::Clearing { job, .. } if is_free && !is_stopped => {
                session.set_texture_levels(job.levels);
                Phase::Touch {
                    touch: Box::new(ObservedTouch::new(job.stimulus, self.config, now_s)),
                    resting: Box::new(job.resting),
                }
            }
            Phase::Clearing { since_s, .. }
                if !is_stopped && now_s - since_s > self.config.release_within_s =>
            {
                let because = "not released: the board was pressed before the trial began";
                let because = Some(because.to_owned());
                self.tell(Observed::nothing(Fault::NotReleased, because));
                Phase::Idle
            }
            Phase::Touch { mut touch, resting } => match touch.step(session, cycle) {
                Some(observed) => {
                    self.tell(observed);
                    self.resting = Some(resting);
                    Phase::Idle
                }
                None => Phase::Touch { touch, resting },
            },
            waits => waits,
        };
    }

    /// The loop has ended: ends a running trial.
    pub(super) fn ended(&mut self, fault: Fault, why: &str) {
        match std::mem::replace(&mut self.phase, Phase::Idle) {
            Phase::Idle => {}
            Phase::Clearing { .. } => {
                let word = fault.word().unwrap_or_default();
                self.tell(Observed::nothing(fault, Some(format!("{word}: {why}"))));
            }
            Phase::Touch { touch, .. } => self.tell(touch.spoilt(fault, why)),
        }
    }

    fn tell(&self, observed: Observed) {
        // The channel has room for one, and only one is requested at a time. Ignore a receiver that is gone.
        let _ = self.outcomes.try_send(observed);
    }
}
