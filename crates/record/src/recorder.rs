//! The recorder: takes what happens in a loop and hands it to a thread that writes.

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

/// What came of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Summary {
    /// Messages of the session, those left out included.
    pub messages: u64,
    /// Messages of the session that were left out: the recording cannot run again beyond the first.
    pub dropped: u64,
    /// Views and log lines that were left out.
    pub views_dropped: u64,
    /// Size of the file.
    pub bytes: u64,
}

/// Writes a session to an MCAP file, from a thread of its own.
///
/// Every call copies a value of fixed size into a queue: nothing is allocated, no lock is waited for, no system call is
/// made. Only with [`Overflow::Wait`] and a full queue does a call wait.
///
/// Inputs and answers must be recorded in the order in which the session got them: [`Recorded`](crate::Recorded) does so.
#[derive(Debug)]
pub struct Recorder {
    /// `None` once finished.
    sender: Option<SyncSender<Item>>,
    thread: Option<JoinHandle<Result<u64, RecordError>>>,
    overflow: Overflow,
    sequence: u64,
    dropped: Arc<AtomicU64>,
    views_dropped: u64,
    /// The writing thread met an error.
    failed: Arc<AtomicBool>,
    view_period_s: f64,
    /// When the last view was taken, s.
    viewed_s: f64,
    /// Was the hand tracked in the newest frame?
    tracked: Option<bool>,
}

impl Recorder {
    /// Makes the file, or empties it, and writes the setup. As long as the recorder lives, no other one can have the file. `scene` is drawn where it stands now: it is that of `setup`,
    /// seen from the arm's base, its moving surfaces at opening zero.
    ///
    /// # Errors
    /// A file that cannot be written or that somebody else records to, a setting outside its range, a scene that makes no sense.
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

    /// A new session begins, its clock at zero. Comes before everything else.
    pub fn begin(&mut self, run: Run) {
        self.viewed_s = f64::NEG_INFINITY;
        self.tracked = None;
        self.input(Input::Run(run));
    }

    /// A frame of the tracker, as the session gets it.
    pub fn frame(&mut self, frame: &HandFrame) {
        self.input(Input::Frame(*frame));
    }

    /// A place of the virtual world, as the session gets it.
    pub fn world(&mut self, world: &WorldPose) {
        self.input(Input::World(*world));
    }

    /// Something else that the session was told.
    pub fn request(&mut self, request: Request) {
        self.input(Input::Request(request));
    }

    /// A cycle: time and state that the session got, command that it answered.
    pub fn cycle(&mut self, cycle: &Cycle) {
        self.input(Input::Cycle(*cycle));
    }

    /// Something that happened. Frames and predictions come too often for a log: of those only the loss of the hand and
    /// its return are kept.
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

    /// What is to be seen of a session after a cycle; taken once in every period of the settings, otherwise nothing is done.
    pub fn view<P: Predictor>(&mut self, session: &Session<P>, cycle: &Cycle) {
        // Half a microsecond of rounding would skip every other view.
        let due = cycle.t_s - self.viewed_s >= self.view_period_s - 5e-7;
        let backwards = cycle.t_s < self.viewed_s;
        if due || backwards {
            self.viewed_s = cycle.t_s;
            let sent = self.send(Item::View(View::of(session, cycle.t_s, &cycle.state)));
            self.views_dropped += u64::from(!sent);
        }
    }

    /// Messages of the session that were left out so far.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Did writing fail? Nothing more is recorded then; [`finish`](Self::finish) says why.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    fn input(&mut self, input: Input) {
        let sent = self.send(Item::Input(self.sequence, input));
        self.sequence += 1;
        self.dropped.fetch_add(u64::from(!sent), Ordering::Relaxed);
    }

    /// Was there space for it?
    fn send(&self, item: Item) -> bool {
        let Some(sender) = &self.sender else {
            return false;
        };
        match self.overflow {
            Overflow::Wait => sender.send(item).is_ok(),
            Overflow::Drop => sender.try_send(item).is_ok(),
        }
    }

    /// Writes what still waits, and ends the file. A recorder that is dropped does the same and keeps silent.
    ///
    /// # Errors
    /// The first error of the thread that writes.
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
