//! Cost of recording for a loop, and size of a recording: `cargo bench -p hwall-record`
//!
//! A minute of cycles at 1 kHz, frames at 90 Hz and views at 100 Hz, as fast as they come.

#[path = "../tests/it/common/mod.rs"]
mod common;

use common::{file, hand, recorder, session_of};
use hwall::Cycle;
use hwall::haptics::ArmState;
use hwall::kinematics::JointPositions;
use hwall_record::{RecordError, RecorderConfig, Recording, Run, replay};
use hwall_testkit::{Machine, Sampler, Timing, format_ns};
use std::time::Instant;

const SECONDS: u32 = 60;

fn main() {
    println!("{}\n", Machine::detect(1));
    let path = file("bench.mcap");
    let mut to = recorder(&path, &RecorderConfig::simulated());
    let mut session = session_of(&common::setup());
    let mut noise = Sampler::new(1);
    to.begin(Run::default());
    let (mut cycles, mut frames, mut views) = (Vec::new(), Vec::new(), Vec::new());
    let start = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
    let timed = |samples: &mut Vec<f64>, f: &mut dyn FnMut()| {
        let began = Instant::now();
        f();
        samples.push(began.elapsed().as_secs_f64() * 1e9);
    };
    let began = Instant::now();
    let mut q = start;
    for i in 0..1000 * SECONDS {
        let t_s = 1e-3 * f64::from(i);
        if i % 11 == 0 {
            // A reach every four seconds; the tracker's clock continues.
            let mut frame = hand(t_s % 4.0);
            frame.t_s = t_s;
            timed(&mut frames, &mut || to.frame(&frame));
            session.frame(&frame);
        }
        let mut state = ArmState {
            t_s,
            q,
            qd: Default::default(),
            external_torque: Some(Default::default()),
        };
        state
            .q
            .0
            .iter_mut()
            .for_each(|q| *q += 1e-6 * noise.normal());
        let command = session.step(t_s, &state);
        session.plan();
        if let hwall::haptics::ArmCommand::Position(told) = command {
            q = told;
        }
        let cycle = Cycle {
            t_s,
            state,
            command,
        };
        timed(&mut cycles, &mut || to.cycle(&cycle));
        if i % 10 == 0 {
            timed(&mut views, &mut || to.view(&session, &cycle));
        }
        while let Some(event) = session.next_event() {
            to.event(&event);
        }
    }
    let simulated_s = began.elapsed().as_secs_f64();
    let summary = to.finish().expect("a file");
    let written_s = began.elapsed().as_secs_f64();
    println!("| call | calls | median | p99 | max |");
    println!("| --- | --- | --- | --- | --- |");
    for (name, samples) in [("cycle", cycles), ("frame", frames), ("view", views)] {
        let count = samples.len();
        let timing = Timing::from_samples_ns(samples);
        let [median, p99, max] = [timing.median_ns, timing.p99_ns, timing.max_ns].map(format_ns);
        println!("| {name} | {count} | {median} | {p99} | {max} |");
    }
    println!(
        "\n{SECONDS} s of session: {simulated_s:.2} s with the session's own work, {written_s:.2} s until the file was \
         finished, {:.1} MB, {} messages left out",
        1e-6 * summary.bytes as f64,
        summary.dropped
    );
    let began = Instant::now();
    let recording = Recording::open(&path).expect("a recording");
    let inputs = recording.inputs().filter(Result::is_ok).count();
    println!(
        "read back: {inputs} messages in {:.2} s",
        began.elapsed().as_secs_f64()
    );
    let began = Instant::now();
    let same = replay(&recording, |setup, _| {
        Ok::<_, RecordError>(session_of(setup))
    });
    let same = same.expect("a replay");
    println!(
        "replayed: {} cycles in {:.2} s, difference: {:?}",
        same.cycles,
        began.elapsed().as_secs_f64(),
        same.difference
    );
    let _ = std::fs::remove_file(&path);
}
