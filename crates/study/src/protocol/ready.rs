//! The studies of the dissertation as ready protocols.

use super::StudyFactor;
use super::settings::{Procedure, Protocol};
use crate::error::StudyError;

/// A study of the dissertation.
///
/// Factors, scales and numbers of subjects are the dissertation's. Some of its settings are unknown and were chosen here: the wording of
/// the questions, practice, rounds, the number of subjects of the preliminary study, and the patch compared with the cones. All can be
/// changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReadyProtocol {
    /// Experiment 1: which felt more real, a whiteboard or H-Wall; eight subjects, five answers.
    Experiment1,
    /// Experiment 2: three questions about H-Wall, 1 to 5; eight subjects.
    Experiment2,
    /// The preliminary study of roughness (V-5, V-8): four patches by scanning angle.
    Preliminary,
    /// The study of roughness (V-10, V-11, table V): five orientations by five speeds, 25 subjects.
    Roughness,
    /// Hemiellipsoids against truncated cones (V-12, V-13): two patches by scanning angle, eight subjects.
    Cones,
}

/// Scanning angles of the study of roughness, degrees.
const ANGLES: [&str; 5] = ["0", "45", "63.43", "71.57", "90"];

impl ReadyProtocol {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Experiment1,
        Self::Experiment2,
        Self::Preliminary,
        Self::Roughness,
        Self::Cones,
    ];

    /// Name and title.
    const fn words(self) -> [&'static str; 2] {
        match self {
            Self::Experiment1 => ["thesis:experiment-1", "dissertation, experiment 1"],
            Self::Experiment2 => ["thesis:experiment-2", "dissertation, experiment 2"],
            Self::Preliminary => ["thesis:preliminary", "dissertation, four patches"],
            Self::Roughness => ["thesis:roughness", "dissertation, roughness"],
            Self::Cones => ["thesis:cones", "dissertation, bumps and cones"],
        }
    }

    /// Its name for the flag `--protocol` of `study`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.words()[0]
    }

    /// The protocol of this name.
    ///
    /// # Errors
    /// [`StudyError::UnknownProtocol`], which lists the known ones.
    pub fn named(name: &str) -> Result<Self, StudyError> {
        let mut all = Self::ALL.into_iter();
        all.find(|p| p.name() == name)
            .ok_or_else(|| StudyError::UnknownProtocol {
                name: name.to_owned(),
                known: Self::ALL.map(Self::name).join(", "),
            })
    }

    /// The study that a protocol comes from, by its title.
    #[must_use]
    pub fn of(protocol: &Protocol) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|p| p.words()[1] == protocol.title)
    }

    /// Does a protocol have the same factors, levels and answers, so that its results can be compared with the published ones?
    #[must_use]
    pub fn is_comparable(self, protocol: &Protocol) -> bool {
        let own = self.protocol();
        own.factors == protocol.factors && own.procedure == protocol.procedure
    }

    /// The protocol. Only the studies of roughness have catch trials and practice.
    #[must_use]
    pub fn protocol(self) -> Protocol {
        let nominal = Protocol {
            title: self.words()[1].to_owned(),
            subjects: 8,
            ..Protocol::default()
        };
        let asked_once = Protocol {
            practice: 0,
            catch_per_block: 0,
            break_after: 0,
            ..nominal.clone()
        };
        // The board rests.
        let at_rest = StudyFactor::new("speed", ["0"]);
        let by_angle = |patches: &[&str]| Protocol {
            factors: vec![
                StudyFactor::new("angle", ANGLES),
                StudyFactor::new("patch", patches.iter().copied()),
                at_rest.clone(),
            ],
            ..nominal.clone()
        };
        match self {
            Self::Experiment1 => Protocol {
                factors: vec![StudyFactor::new("surface", ["wall"]), at_rest],
                procedure: Procedure::MoreReal { points: 5 },
                ..asked_once
            },
            Self::Experiment2 => Protocol {
                factors: vec![StudyFactor::new("question", ["1", "2", "3"]), at_rest],
                procedure: Procedure::Likert { points: 5 },
                questions: [
                    "Did the wall that you touched feel like a real wall",
                    "Was the wall felt where and when you saw it",
                    "Did touching the wall make the room more convincing",
                ]
                .map(|asked| format!("{asked}, from 1 (not at all) to 5 (fully)?"))
                .to_vec(),
                ..asked_once
            },
            Self::Preliminary => by_angle(&["study-1.5", "study-2", "study-2.5", "study-3"]),
            Self::Roughness => Protocol {
                subjects: 25,
                ..nominal
            },
            Self::Cones => by_angle(&["study-3", "cones-3"]),
        }
    }
}
