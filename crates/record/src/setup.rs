//! The setup of a session: everything that is needed to create it again.

use hwall::haptics::Board;

/// Source of the arm.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ArmSource {
    /// A preset, by name.
    Named(String),
    /// A custom description: its source and its text.
    Urdf {
        /// Name of the file.
        name: String,
        /// The URDF.
        text: String,
    },
}

impl ArmSource {
    /// The name of the preset or of the file.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Named(name) | Self::Urdf { name, .. } => name,
        }
    }
}

/// The setup of a session. It contains the texts of the files, so a recording does not need the files.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// Recording program and version. Only the same build gives bit-identical results.
    pub program: String,
    /// The OBJ text of the scene, in the frame of its file.
    pub scene_obj: String,
    /// The text of its sidecar, if it has one.
    pub scene_sidecar: Option<String>,
    /// The arm.
    pub arm: ArmSource,
    /// The board.
    pub board: Board,
    /// Further settings of the program that creates the session, as text. Numbers written with `{:?}` are read back bit by bit.
    pub options: Vec<(String, String)>,
}

impl Setup {
    /// The first option of this name.
    #[must_use]
    pub fn option(&self, name: &str) -> Option<&str> {
        find(&self.options, name)
    }
}

/// One session of a recording. Each session starts anew, as with another person.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Run {
    /// Its number, from 0.
    pub number: u32,
    /// Settings that differ from run to run, as text.
    pub options: Vec<(String, String)>,
}

impl Run {
    /// The first option of this name.
    #[must_use]
    pub fn option(&self, name: &str) -> Option<&str> {
        find(&self.options, name)
    }
}

fn find<'a>(options: &'a [(String, String)], name: &str) -> Option<&'a str> {
    let found = options.iter().find(|(key, _)| key == name)?;
    Some(&found.1)
}
