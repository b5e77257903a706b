//! A study with people, who answer by keyboard or on a page.

use super::outputs;
use super::settings::ProtocolArgs;
use anyhow::Context;
use hwall_bridge::{Answering, Question, QuestionServer};
use hwall_study::{
    Answer, Ask, Durability, NextStep, Procedure, Respondent, SimulatedStage, Study, StudyError,
    conduct,
};
use std::io::{BufRead, Write};
use std::net::SocketAddr;
use std::path::Path;
use std::time::{Duration, Instant};

/// How long a page waits for an answer before the session ends by itself: longer than any break.
const PATIENCE: Duration = Duration::from_secs(3600);

/// Runs or goes on with the study of a folder. `subjects`: of a new one. `page`: where the page of questions listens; without
/// it questions are asked on the terminal.
///
/// # Errors
/// A protocol that cannot be run; a folder or an address that cannot be used.
pub fn run(
    folder: &Path,
    subjects: usize,
    protocol: &ProtocolArgs,
    page: Option<SocketAddr>,
    out: &mut impl Write,
) -> anyhow::Result<()> {
    let study = open(folder, subjects, protocol)?;
    writeln!(
        out,
        "no arm is connected: touches are presented by the simulated one; {} trials are left",
        study.left()
    )?;
    match page {
        Some(listen) => {
            let server = QuestionServer::start(listen, Vec::new())?;
            writeln!(out, "open {}", server.url())?;
            by_page(folder, study, &server, PATIENCE, out)
        }
        None => {
            let mut keyboard = Keyboard {
                input: std::io::stdin().lock(),
                output: out,
            };
            conduct_and_write(folder, study, &mut keyboard)
                .and_then(|text| Ok(writeln!(keyboard.output, "{text}")?))
        }
    }
}

/// The study of a folder; a new one if it holds none.
///
/// # Errors
/// As [`run`].
pub fn open(folder: &Path, subjects: usize, protocol: &ProtocolArgs) -> anyhow::Result<Study> {
    if Study::log_path(folder).exists() {
        return Study::resume(folder, Durability::Disk)
            .with_context(|| folder.display().to_string());
    }
    Ok(Study::create(
        folder,
        protocol.protocol(subjects)?,
        Durability::Disk,
    )?)
}

/// Asks on a page until the study is done, or nobody answers for so long.
///
/// # Errors
/// As [`run`].
pub fn by_page(
    folder: &Path,
    study: Study,
    server: &QuestionServer,
    patience: Duration,
    out: &mut impl Write,
) -> anyhow::Result<()> {
    let mut page = Page { server, patience };
    let text = conduct_and_write(folder, study, &mut page)?;
    // The page shows its last text before the server goes.
    std::thread::sleep(Duration::from_millis(200));
    Ok(writeln!(out, "{text}")?)
}

fn conduct_and_write(
    folder: &Path,
    mut study: Study,
    respondent: &mut dyn Respondent,
) -> anyhow::Result<String> {
    let mut stage = SimulatedStage::new()?;
    let answered = conduct(&mut study, &mut stage, respondent)?;
    if study.next_step() != NextStep::Done {
        return Ok(format!(
            "{answered} trials answered, {} are left; the same command goes on",
            study.left()
        ));
    }
    outputs::write(folder, study.protocol(), study.trials(), "")?;
    Ok(format!(
        "done: {} has the tables and the report",
        folder.display()
    ))
}

/// Questions on the terminal.
struct Keyboard<R, W> {
    input: R,
    output: W,
}

fn broken(name: &str, error: &std::io::Error) -> StudyError {
    StudyError::File {
        name: name.to_owned(),
        kind: error.kind(),
        message: error.to_string(),
    }
}

impl<R: BufRead, W: Write> Respondent for Keyboard<R, W> {
    fn tell(&mut self, text: &str) -> Result<(), StudyError> {
        writeln!(self.output, "{text}").map_err(|error| broken("terminal", &error))
    }

    fn ask(&mut self, text: &str, ask: Ask) -> Result<Option<Answer>, StudyError> {
        let failed = |error: std::io::Error| broken("terminal", &error);
        let began = Instant::now();
        loop {
            let hint = match ask {
                Ask::GoOn => "Enter",
                Ask::Procedure(procedure) if procedure.is_two_intervals() => "1 or 2",
                Ask::Procedure(_) => "a number",
            };
            write!(self.output, "{text} [{hint}] ").map_err(failed)?;
            self.output.flush().map_err(failed)?;
            let mut line = String::new();
            if self.input.read_line(&mut line).map_err(failed)? == 0 {
                return Ok(None);
            }
            let answered_s = began.elapsed().as_secs_f64();
            let value = match ask {
                Ask::GoOn => Some(1.0),
                Ask::Procedure(procedure) => {
                    let typed = line.trim().replace(',', ".").parse().ok();
                    typed.filter(|v| procedure.check(*v).is_ok())
                }
            };
            if let Some(value) = value {
                return Ok(Some(Answer { value, answered_s }));
            }
            self.tell("Please try again.")?;
        }
    }
}

/// Questions on a page.
struct Page<'a> {
    server: &'a QuestionServer,
    patience: Duration,
}

impl Respondent for Page<'_> {
    fn tell(&mut self, text: &str) -> Result<(), StudyError> {
        self.server.tell(text);
        Ok(())
    }

    fn ask(&mut self, text: &str, ask: Ask) -> Result<Option<Answer>, StudyError> {
        let answering = match ask {
            Ask::GoOn => Answering::Continue,
            Ask::Procedure(Procedure::Likert { points }) => Answering::Scale { points },
            Ask::Procedure(procedure) if procedure.is_two_intervals() => Answering::Two,
            Ask::Procedure(_) => Answering::Number,
        };
        self.server.ask(Question {
            text: text.to_owned(),
            answering,
        });
        let began = Instant::now();
        let value = self.server.wait(self.patience);
        Ok(value.map(|value| Answer {
            value,
            answered_s: began.elapsed().as_secs_f64(),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_study::Protocol;
    use hwall_study::StudyFactor;

    #[test]
    fn a_study_by_keyboard_ends_and_goes_on() {
        let folder = std::env::temp_dir().join(format!("hwall_keyboard_{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        let protocol = Protocol {
            factors: vec![StudyFactor::new("angle", ["0", "90"])],
            subjects: 2,
            practice: 0,
            catch_per_block: 0,
            break_after: 0,
            ..Protocol::default()
        };
        let study = Study::create(&folder, protocol, Durability::System).unwrap();
        let session = |study: Study, typed: &str| {
            let mut output = Vec::new();
            let mut keyboard = Keyboard {
                input: typed.as_bytes(),
                output: &mut output,
            };
            let text = conduct_and_write(&folder, study, &mut keyboard).unwrap();
            (text, String::from_utf8(output).unwrap())
        };
        // The first subject answers once, mistypes, and the line is cut.
        let (text, said) = session(study, "\n5\nrough\n-1\n");
        assert!(text.starts_with("1 trials answered, 3 are left"), "{text}");
        assert!(said.contains("Trial 1: touch the board.") && said.matches("again").count() == 2);
        // Nothing about the condition.
        assert!(!said.contains("angle") && !said.contains("90"), "{said}");
        let study = Study::resume(&folder, Durability::System).unwrap();
        let (text, _) = session(study, "\n7,5\n\n3\n4\n");
        assert!(text.starts_with("done"), "{text}");
        let trials = std::fs::read_to_string(folder.join("trials.csv")).unwrap();
        assert_eq!(trials.lines().count(), 5);
        let mut answers: Vec<&str> = trials
            .lines()
            .skip(1)
            .filter_map(|l| l.split(',').nth(12))
            .collect();
        answers.sort_unstable();
        assert_eq!(answers, ["3", "4", "5", "7.5"]);
        let _ = std::fs::remove_dir_all(&folder);
    }
}
