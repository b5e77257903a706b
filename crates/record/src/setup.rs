//! How a session was set up: all that is needed to set it up again.

use hwall::haptics::Board;

/// Where the arm comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ArmSource {
    /// A preset, by name.
    Named(String),
    /// A description of its own: where it was read from, and its text.
    Urdf {
        /// Name of the file.
        name: String,
        /// The URDF.
        text: String,
    },
}

impl ArmSource {
    /// The preset's name, or that of the file.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Named(name) | Self::Urdf { name, .. } => name,
        }
    }
}

/// What a session was made of. The texts are those of the files, so a recording needs none of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// Who recorded, with its version. Bit by bit only the same build answers alike.
    pub program: String,
    /// The OBJ text of the scene, in the frame of its file.
    pub scene_obj: String,
    /// The text of its sidecar, if it has one.
    pub scene_sidecar: Option<String>,
    /// The arm.
    pub arm: ArmSource,
    /// The board.
    pub board: Board,
    /// Whatever else whoever makes the session needs, in words of its own. Numbers written with `{:?}` come back
    /// bit by bit.
    pub options: Vec<(String, String)>,
}

impl Setup {
    /// The first option of this name.
    #[must_use]
    pub fn option(&self, name: &str) -> Option<&str> {
        find(&self.options, name)
    }
}

/// One session of a recording: each begins anew, as with another person.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Run {
    /// Its number, from 0.
    pub number: u32,
    /// What differs from run to run, in words of whoever makes the sessions.
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
