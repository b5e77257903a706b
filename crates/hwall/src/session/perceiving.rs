//! Where the tracker's half works: with the control loop, or on a thread of its own.

use super::event::{Event, EventQueue};
use super::perception::Perception;
use super::worker::Worker;
use super::world::WorldPose;
use hwall_contact::{ContactPrediction, Predictor};
use hwall_hand::{HandFrame, Tracking};
use std::collections::VecDeque;
use std::io;
use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The tracker's half where it works.
pub(super) enum Perceiving<P> {
    Here(Box<Perception<P>>),
    Apart(Box<Apart<P>>),
}

/// The tracker's half, to look at or to change.
pub(super) enum Look<H, A> {
    Here(H),
    Apart(A),
}

impl<P, H, A> Deref for Look<H, A>
where
    H: Deref<Target = Perception<P>>,
    A: Deref<Target = Desk<P>>,
{
    type Target = Perception<P>;

    fn deref(&self) -> &Perception<P> {
        match self {
            Self::Here(perception) => perception,
            Self::Apart(desk) => &desk.perception,
        }
    }
}

impl<P, H, A> DerefMut for Look<H, A>
where
    H: DerefMut<Target = Perception<P>>,
    A: DerefMut<Target = Desk<P>>,
{
    fn deref_mut(&mut self) -> &mut Perception<P> {
        match self {
            Self::Here(perception) => perception,
            Self::Apart(desk) => &mut desk.perception,
        }
    }
}

impl<P> Perceiving<P> {
    pub(super) fn look(&self) -> Look<&Perception<P>, MutexGuard<'_, Desk<P>>> {
        match self {
            Self::Here(perception) => Look::Here(perception),
            Self::Apart(apart) => Look::Apart(apart.shared.desk()),
        }
    }

    pub(super) fn look_mut(&mut self) -> Look<&mut Perception<P>, MutexGuard<'_, Desk<P>>> {
        match self {
            Self::Here(perception) => Look::Here(perception),
            Self::Apart(apart) => Look::Apart(apart.shared.desk()),
        }
    }
}

/// What the tracker's half is told.
// Inputs live in a ring of fixed size; boxing the large ones would allocate in the loops.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, Copy)]
pub(super) enum Input {
    Frame(HandFrame),
    World(WorldPose),
    ClockOffset(f64),
}

/// At most this many inputs wait, about half a second of frames. The oldest frames are left out: their guidance would be too old.
const CAPACITY: usize = 64;

/// What both threads work on, never at the same time: the worker while it is asked, the control loop while it is not.
pub(super) struct Desk<P> {
    perception: Perception<P>,
    inputs: VecDeque<Input>,
}

impl<P: Predictor> Desk<P> {
    fn perceive_next(&mut self) -> bool {
        match self.inputs.pop_front() {
            None => return false,
            Some(Input::Frame(frame)) => self.perception.perceive(&frame),
            // What is refused is an event.
            Some(Input::World(pose)) => drop(self.perception.perceive_world(&pose)),
            Some(Input::ClockOffset(s)) => drop(self.perception.set_clock_offset_s(s)),
        }
        true
    }
}

struct Shared<P> {
    desk: Mutex<Desk<P>>,
    is_asked: AtomicBool,
}

impl<P> Shared<P> {
    fn desk(&self) -> MutexGuard<'_, Desk<P>> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The tracker's half, which perceives what it was given while the control loop goes on.
///
/// Inputs are handed over together with what the control loop knows then; findings are taken as a step begins. What a step knows depends only
/// on the order of the two. A replay keeps to that order without a thread.
pub(super) struct Apart<P> {
    shared: Arc<Shared<P>>,
    /// `None`: a replay.
    worker: Option<Worker<()>>,
    inbox: VecDeque<Input>,
    /// Inputs were given, and what was found was not taken yet.
    is_away: bool,
    tracking: Option<Tracking>,
    contact: Option<ContactPrediction>,
    events: EventQueue,
    /// How often findings were taken.
    taken: u64,
}

impl<P: Predictor> Apart<P> {
    pub(super) fn new(perception: Perception<P>) -> Self {
        let (tracking, contact) = (perception.tracking().copied(), perception.contact());
        let inputs = || VecDeque::with_capacity(CAPACITY);
        let desk = Desk {
            perception,
            inputs: inputs(),
        };
        Self {
            shared: Arc::new(Shared {
                desk: Mutex::new(desk),
                is_asked: AtomicBool::new(false),
            }),
            worker: None,
            inbox: inputs(),
            is_away: false,
            tracking,
            contact,
            events: EventQueue::new(),
            taken: 0,
        }
    }

    pub(super) fn spawn(&mut self) -> io::Result<()>
    where
        P: Send + 'static,
    {
        if self.worker.is_some() {
            return Ok(());
        }
        let shared = Arc::clone(&self.shared);
        self.worker = Some(Worker::spawn("perception", (), move |()| {
            if !shared.is_asked.load(Ordering::Acquire) {
                return false;
            }
            let mut desk = shared.desk();
            while desk.perceive_next() {}
            drop(desk);
            shared.is_asked.store(false, Ordering::Release);
            true
        })?);
        Ok(())
    }

    pub(super) fn put(&mut self, input: Input) {
        if self.inbox.len() == CAPACITY {
            // A place of the world, or a difference of the clocks, counts until there is a newer one.
            let frame = self.inbox.iter().position(|i| matches!(i, Input::Frame(_)));
            self.inbox.remove(frame.unwrap_or(0));
        }
        self.inbox.push_back(input);
        self.give();
    }

    /// Gives what waits, unless the last is still out.
    fn give(&mut self) {
        if self.is_away || self.inbox.is_empty() {
            return;
        }
        let mut desk = self.shared.desk();
        desk.perception.listen();
        std::mem::swap(&mut desk.inputs, &mut self.inbox);
        drop(desk);
        self.is_away = true;
        if let Some(worker) = &self.worker {
            self.shared.is_asked.store(true, Ordering::Release);
            worker.wake();
        }
    }

    /// Takes what the thread has found, if it is done. Never waits: the thread has left the desk by then.
    pub(super) fn hear(&mut self) {
        if self.worker.is_some() && !self.shared.is_asked.load(Ordering::Acquire) {
            self.take();
        }
    }

    /// Perceives one input that was given: for a replay.
    pub(super) fn perceive_next(&self) -> bool {
        self.worker.is_none() && self.shared.desk().perceive_next()
    }

    /// Takes what was found, in a replay.
    pub(super) fn take_without_thread(&mut self) {
        if self.worker.is_none() {
            self.take();
        }
    }

    fn take(&mut self) {
        if !self.is_away {
            return;
        }
        let mut desk = self.shared.desk();
        while desk.perceive_next() {}
        let perception = &mut desk.perception;
        perception.tell();
        self.tracking = perception.tracking().copied();
        self.contact = perception.contact();
        while let Some(event) = perception.next_event() {
            self.events.push(event.t_s, event.kind);
        }
        drop(desk);
        self.is_away = false;
        self.taken += 1;
        self.give();
    }

    pub(super) fn next_event(&mut self) -> Option<Event> {
        self.events.pop()
    }

    pub(super) const fn tracking(&self) -> Option<&Tracking> {
        self.tracking.as_ref()
    }

    pub(super) const fn contact(&self) -> Option<ContactPrediction> {
        self.contact
    }

    /// `None`: of a replay.
    pub(super) const fn taken(&self) -> Option<u64> {
        match self.worker {
            Some(_) => Some(self.taken),
            None => None,
        }
    }

    /// Has the thread ended by a fault?
    pub(super) fn is_lost(&self) -> bool {
        self.worker.as_ref().is_some_and(Worker::is_over)
    }
}

impl<P: Predictor> Apart<P> {
    /// Ends the thread, and tells what it has found.
    pub(super) fn end(mut self) -> Perception<P> {
        if let Some(mut worker) = self.worker.take() {
            worker.end();
        }
        let mut shared = self.shared;
        loop {
            match Arc::try_unwrap(shared) {
                Ok(Shared { desk, .. }) => {
                    let desk = desk.into_inner().unwrap_or_else(PoisonError::into_inner);
                    let mut perception = desk.perception;
                    perception.tell();
                    return perception;
                }
                // A thread that has ended lets go of it.
                Err(held) => shared = held,
            }
        }
    }
}
