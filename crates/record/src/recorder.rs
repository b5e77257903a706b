//! The recorder: queues what happens in a loop for a writing thread.

use crate::error::RecordError;
use crate::file::{GrowingFile, create_alone};
use crate::input::{Input, Request};
use crate::recorder_config::{Overflow, RecorderConfig};
use crate::setup::{Run, Setup};
use crate::skeleton::Skeleton;
use crate::view::View;
use crate::writer::{Item, Stage, Writer};
use hwall::contact::Predictor;
use hwall::hand::{HandFrame, Tracking};
use hwall::scene::Scene;
use hwall::{Cycle, Event, EventKind, Session, WorldPose};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

/// Result of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Summary {
    /// Messages of the session, including dropped ones.
    pub messages: u64,
    /// Messages of the session that were dropped: a replay is possible only up to the first of them.
    pub dropped: u64,
    /// Views and log lines that were dropped.
    pub views_dropped: u64,
    /// Size of the file.
    pub bytes: u64,
}

/// Writes a session to an MCAP file, on its own thread.
///
/// Every call copies a value of fixed size into a queue, without allocation, lock or system call. Only with [`Overflow::Wait`] and a full
/// queue does a call block.
///
/// Inputs and outputs must be recorded in the order in which the session got them, as [`Recorded`](crate::Recorded) does.
#[derive(Debug)]
pub struct Recorder {
    /// `None` once finished.
    sender: Option<SyncSender<Item>>,
    thread: Option<JoinHandle<Result<u64, RecordError>>>,
    overflow: Overflow,
    sequence: u64,
    dropped: Arc<AtomicU64>,
    views_dropped: u64,
    /// The writing thread had an error.
    failed: Arc<AtomicBool>,
    view_period_s: f64,
    /// When the last view was taken, s.
    viewed_s: f64,
    /// Was the hand tracked in the newest frame?
    tracked: Option<bool>,
}

impl Recorder {
    /// Creates or empties the file, and writes the setup. While the recorder exists, no other one can open the file. `scene` is drawn at
    /// its current pose; it must be the scene of `setup` in the arm's base frame, with its moving surfaces at opening zero.
    ///
    /// # Errors
    /// A file that cannot be written or that another program records to, a setting outside its range, an invalid scene.
    pub fn create(
        path: &Path,
        setup: &Setup,
        skeleton: Skeleton,
        scene: &Scene,
        config: &RecorderConfig,
    ) -> Result<Self, RecordError> {
        config.validate()?;
        let is_last = Arc::new(AtomicBool::new(false));
        let file = GrowingFile::new(create_alone(path)?, Arc::clone(&is_last));
        let stage = Stage::new(skeleton, scene)?;
        let dropped = Arc::new(AtomicU64::new(0));
        let failed = Arc::new(AtomicBool::new(false));
        let mut writer = Writer::new(file, is_last, stage, config, Arc::clone(&dropped))?;
        writer.setup(setup)?;
        let (sender, receiver) = sync_channel(config.capacity);
        let has_failed = Arc::clone(&failed);
        let thread = std::thread::Builder::new()
            .name("recorder".to_owned())
            .spawn(move || {
                let result = writer.run(&receiver);
                has_failed.store(result.is_err(), Ordering::Relaxed);
                result
            })
            .map_err(|_| RecordError::Thread("could not be started"))?;
        Ok(Self {
            sender: Some(sender),
            thread: Some(thread),
            overflow: config.overflow,
            sequence: 0,
            dropped,
            views_dropped: 0,
            failed,
            view_period_s: config.view_period_s,
            viewed_s: f64::NEG_INFINITY,
            tracked: None,
        })
    }

    /// Records the start of a new session, its clock at zero. Call it before anything else.
    pub fn begin(&mut self, run: Run) {
        self.viewed_s = f64::NEG_INFINITY;
        self.tracked = None;
        self.input(Input::Run(run));
    }

    /// Records a frame of the tracker, as the session gets it.
    pub fn frame(&mut self, frame: &HandFrame) {
        self.input(Input::Frame(*frame));
    }

    /// Records a pose of the virtual world, as the session gets it.
    pub fn world(&mut self, world: &WorldPose) {
        self.input(Input::World(*world));
    }

    /// Records another request to the session.
    pub fn request(&mut self, request: Request) {
        self.input(Input::Request(request));
    }

    /// Records a cycle: the time and state that the session got, and its command.
    pub fn cycle(&mut self, cycle: &Cycle) {
        self.input(Input::Cycle(*cycle));
    }

    /// Records an event. Frames and predictions are too frequent for a log, so only the loss and the return of the hand are recorded from
    /// them.
    pub fn event(&mut self, event: &Event) {
        match event.kind {
            EventKind::Predicted(_) => return,
            EventKind::Frame(tracking) => {
                let tracked = matches!(tracking, Tracking::Tracked(_));
                if self.tracked.replace(tracked) == Some(tracked) {
                    return;
                }
            }
            _ => {}
        }
        let sent = self.send(Item::Event(*event));
        self.views_dropped += u64::from(!sent);
    }

    /// Records a view of a session after a cycle, once in every view period; otherwise does nothing.
    pub fn view<P: Predictor>(&mut self, session: &Session<P>, cycle: &Cycle) {
        // Without this tolerance, rounding would skip every other view.
        let due = cycle.t_s - self.viewed_s >= self.view_period_s - 5e-7;
        let backwards = cycle.t_s < self.viewed_s;
        if due || backwards {
            self.viewed_s = cycle.t_s;
            let sent = self.send(Item::View(View::of(session, cycle.t_s, &cycle.state)));
            self.views_dropped += u64::from(!sent);
        }
    }

    /// Messages of the session that were dropped so far.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Did writing fail? Then nothing more is recorded; [`finish`](Self::finish) returns the error.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    fn input(&mut self, input: Input) {
        let sent = self.send(Item::Input(self.sequence, input));
        self.sequence += 1;
        self.dropped.fetch_add(u64::from(!sent), Ordering::Relaxed);
    }

    /// Returns whether there was space in the queue.
    fn send(&self, item: Item) -> bool {
        let Some(sender) = &self.sender else {
            return false;
        };
        match self.overflow {
            Overflow::Wait => sender.send(item).is_ok(),
            Overflow::Drop => sender.try_send(item).is_ok(),
        }
    }

    /// Writes the queued messages and ends the file. Dropping a recorder does the same, but ignores errors.
    ///
    /// # Errors
    /// The first error of the writing thread.
    pub fn finish(mut self) -> Result<Summary, RecordError> {
        let bytes = self.close()?;
        Ok(Summary {
            messages: self.sequence,
            dropped: self.dropped(),
            views_dropped: self.views_dropped,
            bytes,
        })
    }

    fn close(&mut self) -> Result<u64, RecordError> {
        self.sender = None;
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(result)) => result,
            Some(Err(_)) => Err(RecordError::Thread("ended in a panic")),
            None => Err(RecordError::Thread("has ended already")),
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if self.thread.is_some() {
            let _ = self.close();
        }
    }
}
