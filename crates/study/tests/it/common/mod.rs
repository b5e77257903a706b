//! Shared by the tests.

use hwall_study::{
    Answer, Ask, Durability, ParticipantConfig, Participants, Presentation, Presenter, Protocol,
    Rendered, Respondent, SimulatedStage, Simulation, Stimulus, Study, StudyError, simulate,
};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// Shared by all tests, because its maps take a second.
pub(crate) static STAGE: LazyLock<SimulatedStage> =
    LazyLock::new(|| SimulatedStage::new().unwrap());

/// Each condition once.
pub(crate) const ONCE: Participants = Participants::Simulated {
    once_per_condition: true,
};

/// A simulation with these participants, each condition presented once.
pub(crate) fn once_by(participants: ParticipantConfig) -> Simulation {
    Simulation {
        participants,
        once_per_condition: true,
        ..Simulation::default()
    }
}

/// A whole study with simulated participants.
pub(crate) fn simulated(folder: &Path, protocol: Protocol, simulation: &Simulation) -> Study {
    let mut study = Study::create(folder, protocol, ONCE, Durability::System).unwrap();
    simulate(&mut study, &STAGE, simulation).unwrap();
    study
}

/// A folder for one test, not created yet.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("study-{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    folder
}

/// A whole touch of a texture at 40 mm/s, without a reference.
pub(crate) fn shown(angle_deg: f64) -> Presentation {
    Presentation {
        rendered: Rendered {
            angle_deg: Some(angle_deg),
            speed_mm_per_s: Some(40.0),
            force_n: Some(7.0),
            contact_s: 0.7,
            ..Rendered::default()
        },
        reference: None,
    }
}

/// A scripted person: gives an answer a given number of times, and keeps the texts that were shown.
pub(crate) struct Script {
    answer: f64,
    pub(crate) left: usize,
    pub(crate) said: Vec<String>,
    pub(crate) asked: Vec<String>,
}

impl Script {
    pub(crate) const fn new(answer: f64, left: usize) -> Self {
        Self {
            answer,
            left,
            said: Vec::new(),
            asked: Vec::new(),
        }
    }

    /// The questions with these words.
    pub(crate) fn asked_with<'a>(&'a self, words: &'a str) -> impl Iterator<Item = &'a String> {
        self.asked.iter().filter(move |text| text.contains(words))
    }
}

impl Respondent for Script {
    fn tell(&mut self, text: &str) -> Result<(), StudyError> {
        self.said.push(text.to_owned());
        Ok(())
    }

    fn ask(&mut self, text: &str, ask: Ask) -> Result<Option<Answer>, StudyError> {
        self.asked.push(text.to_owned());
        let value = match ask {
            Ask::GoOn => 1.0,
            Ask::Procedure(_) if self.left == 0 => return Ok(None),
            Ask::Procedure(_) => {
                self.left -= 1;
                self.answer
            }
        };
        Ok(Some(Answer {
            value,
            answered_s: 1.0,
        }))
    }
}

/// An arm that keeps its touches.
#[derive(Default)]
pub(crate) struct Counting(pub(crate) Vec<Stimulus>);

impl Presenter for Counting {
    fn present(&mut self, stimulus: &Stimulus, _: u64) -> Result<Rendered, StudyError> {
        self.0.push(*stimulus);
        Ok(Rendered {
            force_n: Some(7.0),
            contact_s: 0.7,
            patch: stimulus.patch,
            ..Rendered::default()
        })
    }
}
