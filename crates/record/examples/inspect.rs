//! Prints the contents of a recording: `cargo run -p hwall-record --example inspect -- session.mcap`

use hwall_record::{Input, RecordError, Recording};
use std::path::Path;

fn main() -> Result<(), RecordError> {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("usage: inspect FILE.mcap");
        return Ok(());
    };
    let recording = Recording::open(Path::new(&path))?;
    let setup = recording.setup();
    println!("by {}, arm {}", setup.program, setup.arm.name());
    println!("scene: {} bytes of OBJ", setup.scene_obj.len());
    let (mut frames, mut cycles, mut last_s, mut missing, mut expected) = (0, 0, 0.0, 0, 0);
    for input in recording.inputs() {
        let (sequence, input) = input?;
        missing += sequence.saturating_sub(expected);
        expected = sequence + 1;
        match input {
            Input::Run(run) => println!("run {}: {:?}", run.number, run.options),
            Input::Frame(_) => frames += 1,
            Input::Cycle(cycle) => (cycles, last_s) = (cycles + 1, cycle.t_s),
            Input::Request(request) => println!("{last_s:.3} s: {request:?}"),
            _ => {}
        }
    }
    println!(
        "{frames} frames, {cycles} cycles, the last at {last_s:.3} s; {missing} messages left out"
    );
    println!("ends: {:?}", recording.ending());
    Ok(())
}
