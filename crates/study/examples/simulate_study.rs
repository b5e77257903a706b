//! What would a study find? Uses simulated participants, before anybody is invited.
//!
//! `cargo run --release -p hwall-study --example simulate_study`

use hwall_study::{
    Durability, Participants, Protocol, SimulatedStage, Simulation, Study, StudyError, StudyFactor,
    StudyReport, simulate,
};
use std::time::Instant;

fn main() -> Result<(), StudyError> {
    let protocol = Protocol {
        factors: vec![
            StudyFactor::new("angle", ["0", "45", "90"]),
            StudyFactor::new("speed", ["20", "60"]),
        ],
        subjects: 4,
        ..Protocol::default()
    };
    let folder = std::env::temp_dir().join(format!("hwall-study-{}", std::process::id()));
    let participants = Participants::Simulated {
        once_per_condition: false,
    };
    let mut study = Study::create(&folder, protocol, participants, Durability::System)?;
    let began = Instant::now();
    let stage = SimulatedStage::new()?;
    let ready_s = began.elapsed().as_secs_f64();
    let trials = simulate(&mut study, &stage, &Simulation::default())?;
    let took_s = began.elapsed().as_secs_f64() - ready_s;
    println!("stage {ready_s:.2} s, {trials} trials {took_s:.2} s");
    let report = StudyReport::of(&study.record())?;
    println!("{}", report.to_markdown(&[]));
    let _ = std::fs::remove_dir_all(&folder);
    Ok(())
}
