//! Messages between follower and planner. The follower never waits: what it cannot pass or fetch now is passed or fetched in its next step.

use super::planner::{Answer, Asked};
use std::sync::{Arc, Mutex};

/// A value on its way. Both sides only try the lock, and hold it for a copy: the one that moves goes on without what it could not get,
/// and gets it in its next step.
#[derive(Debug)]
struct Slot<T>(Mutex<(bool, T)>);

impl<T: Default> Default for Slot<T> {
    fn default() -> Self {
        Self(Mutex::new((false, T::default())))
    }
}

impl<T> Slot<T> {
    /// Exchanges a value with what is in the slot, if `when` agrees to whether that was not taken yet.
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
    /// The newest question replaces one that was not taken.
    pub(super) fn ask(&self, asked: &Asked) {
        if let Ok(mut held) = self.0.asked.0.try_lock() {
            *held = (true, *asked);
        }
    }

    /// Takes the newest question. While an answer waits there is none.
    pub(super) fn take_asked(&self, asked: &mut Asked) -> bool {
        !self.0.answer.is_full() && self.0.asked.swap(asked, true)
    }

    /// The number of the newest question that was not taken.
    pub(super) fn newest(&self) -> Option<u64> {
        let held = self.0.asked.0.try_lock().ok()?;
        held.0.then_some(held.1.number)
    }

    /// Leaves an answer; what it is exchanged for has been read.
    pub(super) fn answer(&self, answer: &mut Answer) {
        while !self.0.answer.swap(answer, false) {
            std::thread::yield_now();
        }
    }

    /// Takes an answer; what it is exchanged for is the planner's to drop.
    pub(super) fn take_answer(&self, answer: &mut Answer) -> bool {
        self.0.answer.swap(answer, true)
    }
}
