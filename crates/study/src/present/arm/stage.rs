//! An arm that presents trials, on its own thread.

use super::desk::{Desk, Job};
use super::ending::{of_safe, of_session};
use super::observed::{ArmTrialConfig, Observed, kind_of};
use super::room::StudyRoom;
use crate::error::StudyError;
use crate::present::presenter::Presenter;
use crate::present::stimulus::{Fault, Rendered, Stimulus};
use crate::protocol::{ArmKind, Protocol};
use hwall::contact::Predictor;
use hwall::hand::HandFrame;
use hwall::haptics::{Arm, ArmState, Board};
use hwall::scene::Scene;
use hwall::texton::{Level, ScanAngle};
use hwall::texture::TextureLevels;
use hwall::{Cycle, Session, SessionError, Surroundings, WorldPose, drive};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Roughness of the surface: arbitrary, because the session presents the condition's level at any roughness.
const ROUGHNESS: f64 = 1.0;
/// The loop counts as stuck after this multiple of a trial's longest duration.
const PATIENCE: f64 = 3.0;

/// Ends the loop of an arm from elsewhere, for instance from a signal handler.
#[derive(Debug, Clone)]
pub struct ArmStop {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    stops: AtomicBool,
    has_ended: AtomicBool,
    /// Why the loop ended, with the state of the session.
    why: Mutex<Option<String>>,
}

impl ArmStop {
    /// Ends the loop after its cycle: the arm brakes and holds; a running trial is spoilt as `interrupted`.
    pub fn stop(&self) {
        self.shared.stops.store(true, Ordering::Relaxed);
    }

    /// Has the loop ended, so that this program no longer moves the arm?
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.shared.has_ended.load(Ordering::Acquire)
    }

    /// Stops the loop and waits at most this long; returns whether it has ended.
    pub fn stop_within(&self, longest: Duration) -> bool {
        self.stop();
        let began = Instant::now();
        while !self.has_ended() && began.elapsed() < longest {
            std::thread::sleep(Duration::from_millis(5));
        }
        self.has_ended()
    }
}

/// A [`Presenter`] on any arm, in real time, for the participant's tracked hand.
///
/// A thread runs one [`Session`] with the arm for the whole study, also while the participant answers. For a trial the
/// session gets the levels of its condition; the participant touches, feels the texture and lets go. Between trials the texture
/// rests. The rendered values are the session's measurements: face from the joints, force from its estimate, finger from the
/// tracker. A trial always ends, with a touch or spoilt for a reason ([`Fault`]); [`Presenter::because`] gives
/// details. A person who [stops](Session::stop) the session spoils the trial; the next one begins after a reset.
///
/// When the loop ends (failure of the arm or its connection, or a stop), or the session latches a fault, a running trial is
/// spoilt, the session is stopped, and every further trial is refused with [`StudyError::ArmEnded`], because a latched fault
/// needs a person. Dropping the stage ends the loop.
#[derive(Debug)]
pub struct ArmStage {
    kind: ArmKind,
    board: Board,
    config: ArmTrialConfig,
    jobs: SyncSender<Job>,
    outcomes: Receiver<Observed>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    because: Option<String>,
    /// Why it cannot present further trials.
    over: Option<String>,
}

impl ArmStage {
    /// Starts the loop. The arm must be ready for commands, the session made for it and its scene; see [`check_surfaces`].
    ///
    /// # Errors
    /// A time outside its range; a thread that cannot be started.
    pub fn start<P, R, S>(
        kind: ArmKind,
        session: Session<P>,
        arm: R,
        room: S,
        config: ArmTrialConfig,
    ) -> Result<Self, StudyError>
    where
        P: Predictor + Send + 'static,
        R: Arm + Send + 'static,
        S: StudyRoom<R> + Send + 'static,
    {
        config.validate()?;
        let board = *session.control().board();
        let (jobs, taken) = sync_channel(1);
        let (told, outcomes) = sync_channel(1);
        let shared = Arc::new(Shared {
            stops: AtomicBool::new(false),
            has_ended: AtomicBool::new(false),
            why: Mutex::new(None),
        });
        let desk = Desk::new(config, taken, told);
        let loops = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("study-arm".to_owned())
            .spawn(move || run(session, arm, room, desk, &loops))
            .map_err(|error| StudyError::ArmEnded {
                why: format!("no thread for it: {error}"),
            })?;
        Ok(Self {
            kind,
            board,
            config,
            jobs,
            outcomes,
            shared,
            thread: Some(thread),
            because: None,
            over: None,
        })
    }

    /// A handle to stop it from elsewhere.
    #[must_use]
    pub fn stop_handle(&self) -> ArmStop {
        ArmStop {
            shared: Arc::clone(&self.shared),
        }
    }

    /// Why the loop has ended, with the final state of the session; `None` while it runs.
    #[must_use]
    pub fn why_ended(&self) -> Option<String> {
        let why = self.shared.why.lock();
        why.unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn levels(
        &self,
        stimulus: &Stimulus,
        speed_mm_per_s: f64,
    ) -> Result<TextureLevels, StudyError> {
        let level = Level {
            scan: ScanAngle::from_deg(stimulus.angle_deg).map_err(SessionError::from)?,
            speed_mm_per_s,
            magnitude: ROUGHNESS,
        };
        Ok(TextureLevels::of_level(level, &self.board)?)
    }

    /// Outcome if the loop has ended or does not answer.
    fn gone(&mut self) -> Observed {
        self.shared.stops.store(true, Ordering::Relaxed);
        let why = self.why_ended();
        let why = why.unwrap_or_else(|| "its loop does not answer".to_owned());
        Observed::nothing(Fault::ArmGone, Some(format!("arm gone: {why}")))
    }
}

impl Presenter for ArmStage {
    /// The seed is not used.
    fn present(&mut self, stimulus: &Stimulus, _seed: u64) -> Result<Rendered, StudyError> {
        if let Some(why) = self.over.clone().or_else(|| self.why_ended()) {
            return Err(StudyError::ArmEnded { why });
        }
        let job = Job {
            stimulus: *stimulus,
            levels: self.levels(stimulus, stimulus.speed_mm_per_s)?,
            resting: self.levels(stimulus, 0.0)?,
        };
        let longest = Duration::from_secs_f64(PATIENCE * self.config.longest_s());
        let observed = match self.jobs.try_send(job) {
            Ok(()) => match self.outcomes.recv_timeout(longest) {
                Ok(observed) => observed,
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => self.gone(),
            },
            Err(_) => self.gone(),
        };
        let Observed {
            rendered,
            because,
            is_last,
        } = observed;
        if is_last || matches!(rendered.fault, Fault::ArmGone | Fault::Interrupted) {
            self.over.clone_from(&because);
        }
        self.because = because;
        Ok(rendered)
    }

    fn because(&mut self) -> Option<String> {
        self.because.take()
    }

    fn arm(&self) -> ArmKind {
        self.kind
    }
}

impl Drop for ArmStage {
    fn drop(&mut self) {
        self.shared.stops.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // Also for a thread that panicked.
            let _ = thread.join();
        }
    }
}

/// Surroundings that can be ended from elsewhere.
struct Stoppable<'a, S> {
    room: S,
    shared: &'a Shared,
}

impl<R: Arm, S: StudyRoom<R>> Surroundings<R> for Stoppable<'_, S> {
    fn next_cycle(&mut self, arm: &mut R) -> Result<Option<f64>, R::Error> {
        if self.shared.stops.load(Ordering::Relaxed) {
            return Ok(None);
        }
        self.room.next_cycle(arm)
    }

    fn next_frame(&mut self, now_s: f64) -> Option<HandFrame> {
        self.room.next_frame(now_s)
    }

    fn next_world(&mut self, now_s: f64) -> Option<WorldPose> {
        self.room.next_world(now_s)
    }

    fn state(&mut self, state: ArmState) -> ArmState {
        self.room.state(state)
    }
}

/// Marks the loop as ended on drop, also after a panic.
struct Ending<'a>(&'a Shared);

impl Drop for Ending<'_> {
    fn drop(&mut self) {
        self.0.has_ended.store(true, Ordering::Release);
    }
}

/// The control loop; runs until it is stopped or the arm fails.
fn run<P: Predictor, R: Arm, S: StudyRoom<R>>(
    mut session: Session<P>,
    mut arm: R,
    room: S,
    mut desk: Desk,
    shared: &Shared,
) {
    let _ending = Ending(shared);
    let mut room = Stoppable { room, shared };
    let mut last: Option<Cycle> = None;
    let ended = drive(
        &mut session,
        &mut arm,
        &mut room,
        |session, arm, Stoppable { room, .. }, cycle| {
            while let Some(event) = session.next_event() {
                desk.event(&event);
                room.event(&event);
            }
            desk.step(session, cycle);
            last = Some(*cycle);
            room.after(session, arm, cycle)
        },
    );
    room.room.ended(&mut arm);
    // One more step determines the session's final state.
    session.stop();
    let state = match last {
        Some(last) => {
            let next_s = last.t_s + 1e-3;
            let state = ArmState {
                t_s: next_s,
                ..last.state
            };
            session.step(next_s, &state);
            of_session(session.state())
        }
        None => of_safe(&session.control().safety()),
    };
    let (fault, why) = match ended {
        Ok(()) => (Fault::Interrupted, format!("it was stopped ({state})")),
        Err(error) => (Fault::ArmGone, format!("{error} ({state})")),
    };
    *shared.why.lock().unwrap_or_else(PoisonError::into_inner) = Some(why.clone());
    desk.ended(fault, &why);
}

/// Checks that a scene has a rough surface of every kind that the protocol's conditions need.
///
/// # Errors
/// [`StudyError::NoSurface`] for the first missing kind; a condition that cannot be presented.
pub fn check_surfaces(scene: &Scene, protocol: &Protocol) -> Result<(), StudyError> {
    for condition in 0..protocol.conditions() {
        let wanted = Stimulus::of(protocol, condition)?.surface;
        let mut rough = scene.surfaces().iter().filter(|s| s.roughness.is_some());
        if !rough.any(|surface| kind_of(&surface.kind) == Some(wanted)) {
            return Err(StudyError::NoSurface {
                surface: wanted.word(),
            });
        }
    }
    Ok(())
}
