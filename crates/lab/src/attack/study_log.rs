//! Logs of studies. Checksums are recomputed after a mutation, because they protect only against accidents.

use super::binary::scratch;
use super::{Inputs, judged, promise};
use crc::{CRC_32_ISCSI, Crc};
use hwall_study::{
    Answer, Durability, EventLog, NextStep, Participants, Presentation, Procedure, Protocol,
    Rendered, Study, StudyError, StudyFactor, StudyReport, write_attempts, write_trials,
};
use hwall_testkit::Verdict;
use std::path::Path;

/// Hexadecimal digits of a line's checksum, and a space.
const HEAD: usize = 9;
/// The checksum before the first line.
const START: u32 = 0x4857_0001;
const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

pub(super) fn logs() -> Inputs {
    let magnitude = protocol(Procedure::Magnitude, &["0", "90"]);
    let staircase = protocol(Procedure::Staircase, &["10", "30", "60", "90"]);
    let real = protocol(Procedure::MoreReal { points: 5 }, &["0", "90"]);
    let all = [magnitude, staircase, real].into_iter();
    all.map(whole_log).collect()
}

fn protocol(procedure: Procedure, levels: &[&str]) -> Protocol {
    Protocol {
        procedure,
        factors: vec![StudyFactor::new("angle", levels.iter().copied())],
        subjects: 2,
        repeats: 2,
        practice: 1,
        break_after: 5,
        ..Protocol::default()
    }
}

/// The log of a complete study, including a failed trial.
fn whole_log(protocol: Protocol) -> anyhow::Result<Vec<u8>> {
    let path = scratch("a.log")?;
    let folder = path.with_extension("study");
    let _ = std::fs::remove_dir_all(&folder);
    let two = protocol.procedure.is_two_intervals();
    let people = Participants::People;
    let mut study = Study::create(&folder, protocol, people, Durability::System)?;
    let mut failed = false;
    loop {
        match study.next_step() {
            NextStep::Done => break,
            NextStep::Rest { .. } => study.rested()?,
            NextStep::Present { trial, .. } => {
                let rendered = Rendered {
                    angle_deg: Some(10.0 + 20.0 * trial.condition as f64),
                    speed_mm_per_s: Some(40.0),
                    force_n: Some(7.0),
                    contact_s: 0.7,
                    ..Rendered::default()
                };
                study.presented(&Presentation {
                    rendered,
                    reference: two.then_some(rendered),
                })?;
            }
            NextStep::Answer { .. } if !failed => {
                failed = true;
                study.spoilt("the hand was lost")?;
            }
            NextStep::Answer { trial, .. } => study.answered(Answer {
                value: (1 + trial.number % 2) as f64,
                answered_s: 1.25,
            })?,
        }
    }
    let bytes = std::fs::read(Study::log_path(&folder))?;
    drop(study);
    std::fs::remove_dir_all(&folder)?;
    Ok(bytes)
}

/// Corrects the checksums: each covers the previous one and its own line.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    let mut sealed = Vec::with_capacity(bytes.len());
    let mut sum = START;
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        let (text, feed) = match line.strip_suffix(b"\n") {
            Some(text) => (text, &b"\n"[..]),
            None => (line, &b""[..]),
        };
        let Some((_, json)) = text.split_at_checked(HEAD) else {
            sealed.extend_from_slice(line);
            continue;
        };
        let mut digest = CRC.digest();
        digest.update(&sum.to_le_bytes());
        digest.update(json);
        sum = digest.finalize();
        sealed.extend_from_slice(format!("{sum:08x} ").as_bytes());
        sealed.extend_from_slice(json);
        sealed.extend_from_slice(feed);
    }
    sealed
}

pub(super) fn read(bytes: &[u8]) -> Verdict {
    let record = || -> Result<_, StudyError> {
        let events = EventLog::events_of(&sealed(bytes), Path::new("attack"))?;
        let count = events.len();
        Ok((Study::record_of(&events)?, count))
    };
    judged(record(), |(study, events)| {
        promise(study.trials.len() <= events, "more trials than events")?;
        let numbers = study.trials.iter().filter_map(|trial| trial.answer);
        let finite = numbers.clone().all(f64::is_finite);
        promise(finite, "an answer that is none")?;
        let (protocol, trials) = (&study.protocol, &study.trials);
        write_trials(protocol, trials, std::io::sink())
            .map_err(|error| format!("trials cannot be written: {error}"))?;
        write_attempts(protocol, trials, std::io::sink())
            .map_err(|error| format!("attempts cannot be written: {error}"))?;
        let report = StudyReport::of(&study).map_err(|error| format!("no report: {error}"))?;
        promise(!report.to_markdown(&[]).is_empty(), "an empty report")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_is_as_it_was_once_it_is_sealed_again() {
        for procedure in [Procedure::Magnitude, Procedure::Staircase] {
            let levels = ["10", "30", "60", "90"];
            let bytes = whole_log(protocol(procedure, &levels)).unwrap();
            assert_eq!(sealed(&bytes), bytes);
            assert_eq!(read(&bytes), Verdict::Accepted);
            // A changed answer is accepted with a correct checksum.
            let text = String::from_utf8(bytes).unwrap();
            let changed = text.replace("1.25", "1.75").into_bytes();
            assert!(EventLog::events_of(&changed, Path::new("changed")).is_err());
            assert_eq!(read(&changed), Verdict::Accepted);
        }
    }
}
