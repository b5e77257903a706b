//! A study with people, who answer by keyboard or on a page.

use super::arm::{ArmArgs, WaitingArm};
use super::outputs;
use super::settings::{ProtocolArgs, resumed};
use hwall_bridge::{Answering, Question, QuestionServer};
use hwall_stage::numbers::counted;
use hwall_study::{
    Answer, ArmKind, ArmStop, Ask, Durability, NextStep, Participants, Presenter, Protocol,
    Respondent, SimulatedStage, Study, StudyError, conduct,
};
use std::io::{BufRead, ErrorKind, Write};
use std::net::SocketAddr;
use std::path::Path;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Time after which a page without an answer ends the session: longer than any break.
const PATIENCE: Duration = Duration::from_secs(3600);

/// Time limit for a controller to accept commands.
const CONTROLLER_WITHIN: Duration = Duration::from_secs(600);

/// The arm, and the place of the questions.
pub struct Setup<'a> {
    /// Address of the page of questions; `None`: the terminal.
    pub page: Option<SocketAddr>,
    /// Flags of an arm behind FRI.
    pub arm: &'a ArmArgs,
    /// Set to the stop handle of that arm once it moves.
    pub stop: &'a OnceLock<ArmStop>,
}

/// Runs or resumes the study of a folder; returns whether it is done. `subjects`: of a new study, by default the number in its protocol.
///
/// # Errors
/// A protocol that cannot be run; flags or a kind of arm that differ from the study's; a folder or an address that cannot be
/// used; an arm that does not connect, or disconnects: earlier answers are in the log and the tables.
pub fn run(
    folder: &Path,
    subjects: Option<usize>,
    protocol: &ProtocolArgs,
    setup: Setup<'_>,
    out: &mut impl Write,
) -> anyhow::Result<bool> {
    // Do what may fail first, so that no folder is left behind.
    let protocol_of = planned(folder, subjects, protocol)?;
    let page = setup
        .page
        .map(|listen| QuestionServer::start(listen, Vec::new()));
    let page = page.transpose()?;
    let begins = !Study::log_path(folder).exists();
    if !setup.arm.is_given() {
        let mut stage = SimulatedStage::new()?;
        let study = open(ArmKind::Simulated, folder, subjects, protocol)?;
        announce(folder, &study, begins, out)?;
        writeln!(
            out,
            "no arm is connected: touches are presented by the simulated one"
        )?;
        return ask_with(folder, study, &mut stage, page, out);
    }
    let waiting = WaitingArm::prepare(setup.arm, &protocol_of)?;
    let study = open(ArmKind::Fri, folder, subjects, protocol)?;
    announce(folder, &study, begins, out)?;
    for remark in &waiting.remarks {
        writeln!(out, "{remark}")?;
    }
    writeln!(
        out,
        "hands: {}\nwaiting for an FRI controller at {}",
        waiting.server.invitation(),
        waiting.fri_address()?
    )?;
    if setup.arm.has_enabling_switch() {
        writeln!(
            out,
            "the arm moves only while somebody holds the switch on that page, opened with #switch behind its address"
        )?;
    }
    let mut arm = waiting.connect(CONTROLLER_WITHIN)?;
    // Never set before.
    let _ = setup.stop.set(arm.stage.stop_handle());
    ask_with(folder, study, &mut arm.stage, page, out)
}

/// Reports whether a study is new or resumed, so that a mistyped name is noticed before the first answer.
fn announce(
    folder: &Path,
    study: &Study,
    begins: bool,
    out: &mut impl Write,
) -> anyhow::Result<()> {
    let what = match begins {
        true => "a new study begins",
        false => "the study goes on",
    };
    let left = counted(study.left(), "trial is", "trials are");
    let subjects = counted(study.protocol().subjects, "subject", "subjects");
    Ok(writeln!(
        out,
        "{}: {what}, of {subjects}; {left} left",
        folder.display()
    )?)
}

/// The protocol of the existing or new study.
fn planned(
    folder: &Path,
    subjects: Option<usize>,
    protocol: &ProtocolArgs,
) -> anyhow::Result<Protocol> {
    match Study::read(folder) {
        Ok(record) => Ok(record.protocol),
        // Errors of the log are reported when it is opened.
        Err(_) => protocol.protocol(subjects),
    }
}

/// Asks on a page or on the terminal.
fn ask_with(
    folder: &Path,
    study: Study,
    presenter: &mut dyn Presenter,
    page: Option<QuestionServer>,
    out: &mut impl Write,
) -> anyhow::Result<bool> {
    match page {
        Some(server) => {
            writeln!(out, "open {}", server.url())?;
            by_page(folder, study, presenter, &server, PATIENCE, out)
        }
        None => {
            let mut keyboard = Keyboard {
                folder,
                input: std::io::stdin().lock(),
                output: out,
            };
            let (text, done) = conduct_and_write(folder, study, presenter, &mut keyboard)?;
            writeln!(keyboard.output, "{text}")?;
            Ok(done)
        }
    }
}

/// The study of a folder on this kind of arm; a new one if there is none, or if the log was truncated before its first event.
///
/// # Errors
/// As [`run`].
pub fn open(
    arm: ArmKind,
    folder: &Path,
    subjects: Option<usize>,
    protocol: &ProtocolArgs,
) -> anyhow::Result<Study> {
    let (people, disk) = (Participants::People, Durability::Disk);
    if Study::log_path(folder).exists()
        && let Some(study) = resumed(folder, people, Some(arm), subjects, protocol, disk)?
    {
        return Ok(study);
    }
    let protocol = protocol.protocol(subjects)?;
    Ok(Study::create_on(arm, folder, protocol, people, disk)?)
}

/// Asks on a page until the study is done or an answer takes too long; returns whether it is done.
///
/// # Errors
/// As [`run`].
pub fn by_page(
    folder: &Path,
    study: Study,
    presenter: &mut dyn Presenter,
    server: &QuestionServer,
    patience: Duration,
    out: &mut impl Write,
) -> anyhow::Result<bool> {
    let mut page = Page {
        folder,
        server,
        patience,
    };
    let (text, done) = conduct_and_write(folder, study, presenter, &mut page)?;
    // Let the page show its last text before the server stops.
    std::thread::sleep(Duration::from_millis(200));
    writeln!(out, "{text}")?;
    Ok(done)
}

/// Runs the session; writes tables and a report even if it ends early.
fn conduct_and_write(
    folder: &Path,
    mut study: Study,
    presenter: &mut dyn Presenter,
    respondent: &mut dyn Respondent,
) -> anyhow::Result<(String, bool)> {
    let conducted = conduct(&mut study, presenter, respondent);
    outputs::write(folder, &study.record(), "")?;
    let answered = conducted?;
    if study.next_step() != NextStep::Done {
        let text = format!(
            "answered now: {answered}; left: {}; {folder} has the tables and a report so far, and --run {folder} goes on",
            study.left(),
            folder = folder.display()
        );
        return Ok((text, false));
    }
    let text = format!("done: {} has the tables and the report", folder.display());
    Ok((text, true))
}

/// Updates the tables, for observers of a running study and in case the session is killed.
fn keep_tables(folder: &Path, study: &Study) -> Result<(), StudyError> {
    let written = outputs::tables(folder, &study.record());
    let name = folder.display().to_string();
    written.map_err(|error| broken(name, ErrorKind::Other, format!("{error:#}")))
}

fn broken(name: impl Into<String>, kind: ErrorKind, message: String) -> StudyError {
    let name = name.into();
    StudyError::File {
        name,
        kind,
        message,
    }
}

fn of_terminal(error: std::io::Error) -> StudyError {
    broken("terminal", error.kind(), error.to_string())
}

/// Questions on the terminal.
struct Keyboard<'a, R, W> {
    folder: &'a Path,
    input: R,
    output: W,
}

impl<R: BufRead, W: Write> Respondent for Keyboard<'_, R, W> {
    fn recorded(&mut self, study: &Study) -> Result<(), StudyError> {
        keep_tables(self.folder, study)
    }

    fn tell(&mut self, text: &str) -> Result<(), StudyError> {
        writeln!(self.output, "{text}").map_err(of_terminal)
    }

    fn ask(&mut self, text: &str, ask: Ask) -> Result<Option<Answer>, StudyError> {
        let began = Instant::now();
        loop {
            let hint = match ask {
                Ask::GoOn => "Enter",
                Ask::Procedure(procedure) => match procedure.points() {
                    Some(points) => &format!("1 to {points}"),
                    None if procedure.is_two_intervals() => "1 or 2",
                    None => "a number",
                },
            };
            write!(self.output, "{text} [{hint}] ").map_err(of_terminal)?;
            self.output.flush().map_err(of_terminal)?;
            let mut line = String::new();
            if self.input.read_line(&mut line).map_err(of_terminal)? == 0 {
                writeln!(self.output).map_err(of_terminal)?;
                return Ok(None);
            }
            let answered_s = began.elapsed().as_secs_f64();
            let typed = line.trim();
            let checked = match (ask, typed.replace(',', ".").parse()) {
                (Ask::GoOn, _) => Ok(1.0),
                (_, Err(_)) if typed.is_empty() => Err("nothing was typed".to_owned()),
                (_, Err(_)) => Err(format!("{typed:?} is not a number")),
                (Ask::Procedure(procedure), Ok(value)) => {
                    procedure.check(value).map_err(|error| error.to_string())
                }
            };
            let why = match checked {
                Ok(value) => return Ok(Some(Answer { value, answered_s })),
                Err(why) => why,
            };
            self.tell(&format!("Please try again: {why}."))?;
        }
    }
}

/// Questions on a page.
struct Page<'a> {
    folder: &'a Path,
    server: &'a QuestionServer,
    patience: Duration,
}

impl Respondent for Page<'_> {
    fn recorded(&mut self, study: &Study) -> Result<(), StudyError> {
        keep_tables(self.folder, study)
    }

    fn tell(&mut self, text: &str) -> Result<(), StudyError> {
        self.server.tell(text);
        Ok(())
    }

    fn ask(&mut self, text: &str, ask: Ask) -> Result<Option<Answer>, StudyError> {
        let answering = match ask {
            Ask::GoOn => Answering::Continue,
            Ask::Procedure(procedure) => match procedure.points() {
                Some(points) => Answering::Scale { points },
                None if procedure.is_two_intervals() => Answering::Two,
                None => Answering::Number,
            },
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
        let people = Participants::People;
        let study = Study::create(&folder, protocol, people, Durability::System).unwrap();
        let session = |study: Study, typed: &str| {
            let mut output = Vec::new();
            let mut keyboard = Keyboard {
                folder: &folder,
                input: typed.as_bytes(),
                output: &mut output,
            };
            let mut stage = SimulatedStage::new().unwrap();
            let (text, done) =
                conduct_and_write(&folder, study, &mut stage, &mut keyboard).unwrap();
            assert_eq!(done, text.starts_with("done"));
            (text, String::from_utf8(output).unwrap())
        };
        // The first subject answers once, mistypes, and the input ends.
        let (text, said) = session(study, "\n5\nrough\n-1\n");
        assert!(text.starts_with("answered now: 1; left: 3"), "{text}");
        assert!(said.contains("Trial 1: touch the board.") && said.matches("again").count() == 2);
        for wrong in [
            "\"rough\" is not a number",
            "the answer -1 is not a number above zero",
        ] {
            assert!(said.contains(wrong), "{said}");
        }
        // The tables already contain the answers so far.
        let trials = std::fs::read_to_string(folder.join("trials.csv")).unwrap();
        assert_eq!(trials.lines().count(), 2);
        assert!(folder.join("report.md").exists());
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
