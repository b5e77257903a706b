//! Messages between follower and planner. The follower never waits: what it cannot send or fetch now, it sends or fetches in its next step.

use super::barrier::links::LinkInFront;
use crate::board::BoardTarget;
use crate::body::PersonBody;
use hwall_kinematics::{JointPositions, Unreachable};
use hwall_motion::{MotionPlan, UnderWay};
use std::sync::{Arc, Mutex};

/// The follower's destination.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) enum Aim {
    #[default]
    Nowhere,
    Target(BoardTarget),
    /// A posture, and a configuration to pre-position towards as far as the board stays behind the surfaces.
    Posture {
        q: JointPositions,
        prepositions_to: Option<JointPositions>,
    },
}

/// How often the motion was replaced by another.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Counts {
    /// Restarts from a measured state; goals and places are forgotten.
    pub(super) forgets: u64,
    /// Braking; the search is given up.
    pub(super) stops: u64,
    /// Slides that have ended.
    pub(super) slides: u64,
}

/// The follower's question after a step. It counts instead of setting flags, so a question that replaces an unread one loses nothing.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Asked {
    /// The number of the step.
    pub(super) number: u64,
    pub(super) aim: Aim,
    /// At the last known positions.
    pub(super) person: PersonBody,
    /// Where the arm is known to be free.
    pub(super) began: Option<JointPositions>,
    pub(super) counts: Counts,
    /// The sum of all steps, s, and the last step, s.
    pub(super) clock_s: f64,
    pub(super) dt_s: f64,
    /// Is the arm moving to the aim? It may brake or slide instead.
    pub(super) goes: bool,
    pub(super) under_way: UnderWay,
    /// The newest plan that was begun or refused.
    pub(super) answered: u64,
}

/// The planner's current result.
#[derive(Debug, Clone)]
pub(super) struct Answer {
    /// The step that the question came from, and its counts.
    pub(super) to: u64,
    pub(super) counts: Counts,
    /// The target that was planned for, and why it is unreachable.
    pub(super) target: Option<BoardTarget>,
    pub(super) unreachable: Option<Unreachable>,
    pub(super) destination: Option<JointPositions>,
    pub(super) is_blocked: bool,
    pub(super) is_detour: bool,
    pub(super) is_searching_anew: bool,
    pub(super) knows_surfaces: bool,
    /// The number of the surfaces used.
    pub(super) surfaces: u64,
    pub(super) protrusion_m: Option<f64>,
    pub(super) link_in_front: Option<LinkInFront>,
    pub(super) samples: usize,
    pub(super) tests: usize,
    /// Does a new motion begin?
    pub(super) moves: bool,
    pub(super) motion: MotionPlan,
}

impl Default for Answer {
    fn default() -> Self {
        Self {
            to: 0,
            counts: Counts::default(),
            target: None,
            unreachable: None,
            destination: None,
            is_blocked: false,
            is_detour: false,
            is_searching_anew: false,
            knows_surfaces: true,
            surfaces: 0,
            protrusion_m: None,
            link_in_front: None,
            samples: 0,
            tests: 0,
            moves: false,
            motion: MotionPlan::reserved(),
        }
    }
}

/// A value in transit. Both sides only try the lock, and hold it for one copy: the follower continues without a value that it could not get, and gets
/// it in its next step.
#[derive(Debug)]
struct Slot<T>(Mutex<(bool, T)>);

impl<T: Default> Default for Slot<T> {
    fn default() -> Self {
        Self(Mutex::new((false, T::default())))
    }
}

impl<T> Slot<T> {
    /// Exchanges a value with the slot, if the slot's "not taken yet" flag equals `when`.
    fn swap(&self, value: &mut T, when: bool) -> bool {
        let Ok(mut held) = self.0.try_lock() else {
            return false;
        };
        if held.0 != when {
            return false;
        }
        std::mem::swap(&mut held.1, value);
        held.0 = !when;
        true
    }

    fn is_full(&self) -> bool {
        self.0.try_lock().is_ok_and(|held| held.0)
    }
}

#[derive(Debug, Clone, Default)]
pub(super) struct Link(Arc<Slots>);

#[derive(Debug, Default)]
struct Slots {
    asked: Slot<Asked>,
    answer: Slot<Answer>,
}

impl Link {
    /// The newest question replaces an unread one.
    pub(super) fn ask(&self, asked: &Asked) {
        if let Ok(mut held) = self.0.asked.0.try_lock() {
            *held = (true, *asked);
        }
    }

    /// Takes the newest question; none while an answer waits.
    pub(super) fn take_asked(&self, asked: &mut Asked) -> bool {
        !self.0.answer.is_full() && self.0.asked.swap(asked, true)
    }

    /// The number of the newest unread question.
    pub(super) fn newest(&self) -> Option<u64> {
        let held = self.0.asked.0.try_lock().ok()?;
        held.0.then_some(held.1.number)
    }

    /// Leaves an answer in exchange for one that was read.
    pub(super) fn answer(&self, answer: &mut Answer) {
        while !self.0.answer.swap(answer, false) {
            std::thread::yield_now();
        }
    }

    /// Takes an answer; the planner drops the value it is exchanged for.
    pub(super) fn take_answer(&self, answer: &mut Answer) -> bool {
        self.0.answer.swap(answer, true)
    }
}
