//! Where the tracker's half runs: with the control loop, or on its own thread.

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

/// The tracker's half, here or on another thread.
pub(super) enum Perceiving<P> {
    Here(Box<Perception<P>>),
    Apart(Box<Apart<P>>),
}

/// Access to the tracker's half.
pub(super) enum Access<H, A> {
    Here(H),
    Apart(A),
}

impl<P, H, A> Deref for Access<H, A>
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

impl<P, H, A> DerefMut for Access<H, A>
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
    pub(super) fn access(&self) -> Access<&Perception<P>, MutexGuard<'_, Desk<P>>> {
        match self {
            Self::Here(perception) => Access::Here(perception),
            Self::Apart(apart) => Access::Apart(apart.shared.desk()),
        }
    }

    pub(super) fn access_mut(&mut self) -> Access<&mut Perception<P>, MutexGuard<'_, Desk<P>>> {
        match self {
            Self::Here(perception) => Access::Here(perception),
            Self::Apart(apart) => Access::Apart(apart.shared.desk()),
        }
    }
}

/// An input of the tracker's half.
// Inputs live in a ring of fixed size; boxing the large ones would allocate in the loops.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, Copy)]
pub(super) enum Input {
    Frame(HandFrame),
    World(WorldPose),
    ClockOffset(f64),
}

/// Most inputs that can wait, about half a second of frames. The oldest frames are dropped: their guidance would be too old.
const CAPACITY: usize = 64;

/// State of both threads, never used at the same time: the worker uses it while `is_asked` is set, the control loop otherwise.
pub(super) struct Desk<P> {
    perception: Perception<P>,
    inputs: VecDeque<Input>,
}

impl<P: Predictor> Desk<P> {
    fn perceive_next(&mut self) -> bool {
        match self.inputs.pop_front() {
            None => return false,
            Some(Input::Frame(frame)) => self.perception.perceive(&frame),
            // A rejected pose is reported as an event.
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

/// The tracker's half, which processes its inputs while the control loop continues.
///
/// Inputs are handed over together with what the control loop knows at that time; results are taken at the start of a step. What a step
/// knows depends only on the order of hand-overs and results. A replay keeps that order without a thread.
pub(super) struct Apart<P> {
    shared: Arc<Shared<P>>,
    /// `None` in a replay.
    worker: Option<Worker<()>>,
    inbox: VecDeque<Input>,
    /// Inputs were handed over, and their results not yet taken.
    is_away: bool,
    tracking: Option<Tracking>,
    contact: Option<ContactPrediction>,
    events: EventQueue,
    /// How many times results were taken.
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
            // World poses and clock offsets stay valid until a newer one comes, so drop a frame.
            let frame = self.inbox.iter().position(|i| matches!(i, Input::Frame(_)));
            self.inbox.remove(frame.unwrap_or(0));
        }
        self.inbox.push_back(input);
        self.give();
    }

    /// Hands over the waiting inputs, unless earlier ones are still being processed.
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

    /// Takes the results if the thread is done. Never waits: the thread has released the desk by then.
    pub(super) fn hear(&mut self) {
        if self.worker.is_some() && !self.shared.is_asked.load(Ordering::Acquire) {
            self.take();
        }
    }

    /// Processes one input that was handed over: for a replay.
    pub(super) fn perceive_next(&self) -> bool {
        self.worker.is_none() && self.shared.desk().perceive_next()
    }

    /// Takes the results, in a replay.
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

    /// `None` in a replay.
    pub(super) const fn taken(&self) -> Option<u64> {
        match self.worker {
            Some(_) => Some(self.taken),
            None => None,
        }
    }

    /// Has the thread panicked?
    pub(super) fn is_lost(&self) -> bool {
        self.worker.as_ref().is_some_and(Worker::is_over)
    }
}

impl<P: Predictor> Apart<P> {
    /// Ends the thread and sends its results.
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
                // A thread that has ended releases its reference.
                Err(held) => shared = held,
            }
        }
    }
}
