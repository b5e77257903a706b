//! A whole study with simulated participants.

use super::outputs;
use super::settings::{ProtocolArgs, resumed};
use anyhow::ensure;
use hwall_stage::numbers::counted;
use hwall_study::{
    Durability, NextStep, Participants, Procedure, Protocol, SimulatedStage, Simulation, Study,
    planted_for, promised_power, simulate_and_tell,
};
use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Number of simulated studies for the predicted power.
const STUDIES: usize = 1000;

/// Settings of the simulation.
pub struct Request<'a> {
    /// Subjects.
    pub subjects: usize,
    /// The study.
    pub protocol: &'a ProtocolArgs,
    /// Folder for the study; `None`: nothing is kept.
    pub out: Option<&'a Path>,
    /// Resume the study of that folder?
    pub resume: bool,
    /// Stop after this many trials, as if killed.
    pub kill_after: Option<usize>,
    /// Present each condition once only.
    pub once: bool,
    /// Ends the study after the current trial when it becomes true.
    pub stop: &'a AtomicBool,
}

/// Runs the study, writes its files and prints the report; returns whether it finished or stopped as requested.
///
/// # Errors
/// A protocol that cannot be run; a folder that holds another study or cannot be written.
pub fn run(request: &Request<'_>, out: &mut impl Write) -> anyhow::Result<bool> {
    if let Some(folder) = request.out {
        return run_in(folder, request, out);
    }
    let passing = std::env::temp_dir().join(format!("hwall_study_{}", std::process::id()));
    // Left by a killed program with the same process id.
    let _ = std::fs::remove_dir_all(&passing);
    let result = run_in(&passing, request, out);
    let _ = std::fs::remove_dir_all(&passing);
    result
}

fn run_in(folder: &Path, request: &Request<'_>, out: &mut impl Write) -> anyhow::Result<bool> {
    let participants = Participants::Simulated {
        once_per_condition: request.once,
    };
    ensure!(
        request.out.is_some() || !request.resume,
        "--resume needs --out, the folder of the study"
    );
    let (subjects, system) = (request.subjects, Durability::System);
    let there = match request.resume {
        true => resumed(
            folder,
            participants,
            None,
            Some(subjects),
            request.protocol,
            system,
        )?,
        false => None,
    };
    if let Some(study) = &there {
        let done = counted(study.trials().len(), "trial is", "trials are");
        writeln!(out, "resumed: {done} done")?;
    } else if request.resume {
        writeln!(out, "nothing was recorded there; the study begins anew")?;
    }
    let create = || -> anyhow::Result<Study> {
        let protocol = request.protocol.protocol(Some(subjects))?;
        Ok(Study::create(folder, protocol, participants, system)?)
    };
    let mut study = there.map_or_else(create, Ok)?;
    let simulation = Simulation {
        participants: planted_for(study.protocol()),
        once_per_condition: request.once,
        kill_after: request.kill_after,
    };
    let stage = SimulatedStage::new()?;
    let mut tell = |_: &Study| match request.stop.load(Ordering::Relaxed) {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    };
    let presented = simulate_and_tell(&mut study, &stage, &simulation, &mut tell)?;
    if study.next_step() != NextStep::Done {
        outputs::tables(folder, &study.record())?;
        let how = request.out.map_or("", |_| "; --resume goes on");
        let done = counted(presented, "trial", "trials");
        let left = counted(study.left(), "is", "are");
        writeln!(out, "stopped after {done}, {left} left{how}")?;
        return Ok(request.kill_after == Some(presented));
    }
    let remarks = remarks(study.protocol(), &simulation)?;
    let text = outputs::write(folder, &study.record(), &remarks)?;
    match request.out {
        Some(_) => writeln!(out, "{text}\nwrote {}", folder.display())?,
        None => writeln!(
            out,
            "{}\n--out DIR keeps the table of trials, this report and its figures",
            outputs::without_files(&text)
        )?,
    }
    Ok(true)
}

/// The report's text about the simulation.
fn remarks(protocol: &Protocol, simulation: &Simulation) -> anyhow::Result<String> {
    let how = match simulation.once_per_condition {
        true => {
            "Each condition was presented once by the session on the simulated arm, and its rendering used for all its trials."
        }
        false => "Each trial was presented by the session on the simulated arm.",
    };
    let mut remarks = format!("\n## Simulated participants\n\nNobody was asked. {how}");
    let planted = &simulation.participants;
    if !planted.ratings.is_empty() {
        remarks += " The published means were planted as the means of ratings before they are rounded to a point of the scale.";
    } else if let Procedure::MoreReal { .. } = protocol.procedure {
        remarks += " Planted: no wall feels more real than the other.";
    } else if !protocol.procedure.is_two_intervals() {
        remarks += &format!(
            " Power of this protocol for what was planted ({STUDIES} studies, by the logarithms of the answers):\n"
        );
        for effect in promised_power(protocol, &simulation.participants, STUDIES)? {
            let (low, high) = (effect.ci_low, effect.ci_high);
            remarks += &format!(
                "\n- {}: {:.3} ({low:.3} to {high:.3})",
                effect.name, effect.power
            );
        }
    }
    Ok(remarks + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    static NEVER: AtomicBool = AtomicBool::new(false);

    fn args() -> ProtocolArgs {
        ProtocolArgs {
            factors: vec!["angle".to_owned(), "speed".to_owned()],
            levels: vec!["0,90".to_owned(), "20,80".to_owned()],
            practice: Some(0),
            catch_per_block: Some(0),
            break_after: Some(0),
            seed: Some(3),
            ..ProtocolArgs::default()
        }
    }

    /// Each condition presented once, in a folder.
    fn request<'a>(protocol: &'a ProtocolArgs, subjects: usize, folder: &'a Path) -> Request<'a> {
        Request {
            subjects,
            protocol,
            out: Some(folder),
            resume: false,
            kill_after: None,
            once: true,
            stop: &NEVER,
        }
    }

    #[test]
    fn a_killed_study_ends_as_a_whole_one() {
        let args = args();
        let root = std::env::temp_dir().join(format!("hwall_study_lab_{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&root);
        let run_to = |name: &str, resume, kill_after| {
            let folder = root.join(name);
            let mut text = Vec::new();
            let request = Request {
                resume,
                kill_after,
                ..request(&args, 3, &folder)
            };
            assert!(run(&request, &mut text).unwrap());
            (folder, String::from_utf8(text).unwrap())
        };
        let (whole, text) = run_to("whole", false, None);
        assert!(text.contains("12 of 12 trials"), "{text}");
        assert!(text.contains("angle"), "{text}");
        run_to("killed", false, Some(7));
        let (killed, _) = run_to("killed", true, None);
        let read = |folder: &Path| std::fs::read_to_string(folder.join("trials.csv")).unwrap();
        assert_eq!(read(&whole), read(&killed));
        for figure in ["means.svg", "boxes.svg", "rendered.svg", "report.md"] {
            assert!(whole.join(figure).exists(), "{figure}");
        }
        let _ = std::fs::remove_dir_all(&root);
    }

    /// Regression: practice and catch trials were drawn too.
    #[test]
    fn what_is_drawn_as_rendered_are_the_trials_that_count() {
        let args = ProtocolArgs {
            practice: Some(3),
            catch_per_block: Some(1),
            ..args()
        };
        let root = std::env::temp_dir().join(format!("hwall_study_drawn_{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&root);
        assert!(run(&request(&args, 2, &root), &mut Vec::new()).unwrap());
        let count = |file: &str, of: &str| {
            let text = std::fs::read_to_string(root.join(file)).unwrap();
            text.matches(of).count()
        };
        // Header and rows; a dot in each panel for each row.
        let rows = count("trials.csv", "\n") - 1;
        assert_eq!(count("rendered.svg", "<circle"), 2 * rows);
        assert!(count("attempts.csv", "\n") - 1 > rows);
        let _ = std::fs::remove_dir_all(&root);
    }
}
