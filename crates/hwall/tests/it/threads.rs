//! The halves of a session on two threads, and a session with a perception thread.

use crate::common::{Bench, DT_S, Hand, TRACKER_S, session, session_with, wall};
use hwall::contact::{ContactPrediction, Predictor, PredictorInput};
use hwall::glam::DVec3;
use hwall::haptics::ArmCommand;
use hwall::scene::Scene;
use hwall::{EventKind, Session, SessionConfig, SessionState};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::Duration;

const CYCLES: usize = 4_500;

fn hand() -> Hand {
    Hand::reaching_in(1.5, DVec3::new(0.6, 0.1, 0.6))
}

/// Frames that the tracker has sent when a cycle begins.
fn frames_by(cycle: usize) -> usize {
    (0..)
        .take_while(|frame| *frame as f64 * TRACKER_S <= cycle as f64 * DT_S)
        .count()
}

/// In lockstep, two threads do exactly what one thread does.
#[test]
fn two_threads_give_the_commands_of_one() {
    let mut bench = Bench::new(hand());
    let mut whole = session(wall(0.6));
    let alone: Vec<ArmCommand> = (0..CYCLES).map(|_| bench.cycle(&mut whole)).collect();

    let (mut perception, mut planner, mut control) = session(wall(0.6)).split();
    let (begun, sent) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let due: Vec<usize> = (0..CYCLES).map(frames_by).collect();
    let (begun, sent, due) = (&begun, &sent, &due);
    let together = thread::scope(|scope| {
        scope.spawn(move || {
            let hand = hand();
            for frame in 0..due[CYCLES - 1] {
                while due[begun.load(Ordering::Acquire)] <= frame {
                    thread::yield_now();
                }
                perception.frame(&hand.frame(frame as f64 * TRACKER_S));
                sent.store(frame + 1, Ordering::Release);
            }
        });
        let control = scope.spawn(move || {
            let mut bench = Bench::new(hand());
            let mut commands = Vec::new();
            for (cycle, due) in due.iter().enumerate() {
                begun.store(cycle, Ordering::Release);
                while sent.load(Ordering::Acquire) < *due {
                    thread::yield_now();
                }
                let state = bench.state();
                let command = control.step(bench.now_s(), &state);
                planner.plan();
                bench.obey(command);
                commands.push(command);
            }
            commands
        });
        control.join().expect("the control thread ends")
    });
    assert_eq!(together, alone);
    assert_eq!(
        whole.state(),
        SessionState::InPlace,
        "the hand has left, the board waits for it"
    );
}

/// Neither waits for the other: the tracker sends at its own rate, the control loop keeps stepping.
#[test]
fn threads_that_run_freely_both_make_progress() {
    const FRAMES: usize = 200;
    let (mut perception, mut planner, mut control) = session(wall(0.6)).split();
    let (cycles, finished) = (AtomicUsize::new(0), AtomicBool::new(false));
    let (cycles, finished) = (&cycles, &finished);
    thread::scope(|scope| {
        let tracker = scope.spawn(move || {
            let (hand, mut seen, mut frames) = (hand(), 0, 0);
            let mut last_s = f64::NEG_INFINITY;
            while frames < FRAMES {
                let now_s = cycles.load(Ordering::Relaxed) as f64 * DT_S;
                if now_s < last_s + TRACKER_S {
                    thread::yield_now();
                    continue;
                }
                perception.frame(&hand.frame(now_s));
                (last_s, frames) = (now_s, frames + 1);
                while let Some(event) = perception.next_event() {
                    seen += usize::from(matches!(event.kind, EventKind::Frame(_)));
                }
            }
            finished.store(true, Ordering::Release);
            (seen, perception.missed_events())
        });
        let control = scope.spawn(move || {
            let mut bench = Bench::new(hand());
            let mut steps = 0;
            while !finished.load(Ordering::Acquire) {
                let state = bench.state();
                // Checks every command.
                let command = control.step(bench.now_s(), &state);
                planner.plan();
                bench.obey(command);
                steps += 1;
                cycles.store(steps, Ordering::Relaxed);
                // A real loop waits for its cycle.
                thread::sleep(Duration::from_micros(50));
            }
            (steps, control.last_step().copied())
        });
        let (frames, missed) = tracker.join().expect("the tracker's thread ends");
        assert_eq!((frames, missed), (FRAMES, 0));
        let (steps, last) = control.join().expect("the control thread ends");
        assert!(steps as f64 * DT_S >= (FRAMES - 1) as f64 * TRACKER_S);
        assert!(last.is_some());
    });
}

/// Predicts nothing, and blocks until the other side sends a message. On `false` it panics.
struct Waiting {
    word: Receiver<bool>,
}

impl Predictor for Waiting {
    fn predict(&mut self, _: &Scene, _: &PredictorInput<'_>) -> &[ContactPrediction] {
        assert!(self.word.recv().unwrap_or(true), "a fault of the predictor");
        &[]
    }
}

/// A session with perception on its own thread.
fn apart() -> (Session<Waiting>, Sender<bool>) {
    let (say, word) = channel();
    let session = session_with(wall(0.6), Waiting { word }, SessionConfig::default());
    (session.perceive_on_thread().expect("a thread"), say)
}

/// Steps until this holds, however long it takes; frames keep coming.
fn step_until(
    session: &mut Session<Waiting>,
    bench: &mut Bench,
    until: impl Fn(&Session<Waiting>) -> bool,
) {
    while !until(session) {
        bench.cycle(session);
        thread::yield_now();
    }
}

#[test]
fn steps_go_on_while_a_frame_is_perceived() {
    let (mut session, say) = apart();
    let mut bench = Bench::new(hand());
    // Far more frames than can wait: the oldest are dropped.
    let until_s = 200.0 * TRACKER_S;
    while bench.now_s() < until_s {
        bench.cycle(&mut session);
    }
    assert_eq!(session.perceived(), Some(0));
    assert!(session.tracking().is_none());
    // The sender is gone: nothing blocks any more.
    drop(say);
    step_until(&mut session, &mut bench, |session| {
        session.perceived() > Some(1)
    });
    assert!(session.tracking().is_some());
    // The half is returned, with its thread ended.
    let (perception, _, _) = session.split();
    assert!(perception.tracking().is_some());
}

#[test]
fn a_session_whose_perception_ends_by_a_fault_stops() {
    let (mut session, say) = apart();
    let mut bench = Bench::new(hand());
    say.send(false).expect("the thread listens");
    step_until(&mut session, &mut bench, |session| {
        session.control().is_latched()
    });
    let command = session.step(bench.now_s(), &bench.state());
    assert_eq!(command, ArmCommand::Hold);
    assert_eq!(session.perceived(), Some(0));
}
