//! The built-in room, where studies and tests meet simulated people.

use crate::input::arms::BoardArm;
use crate::person::kinds::PersonKind;
use crate::person::participants::{self, Participant};
use crate::person::predictors::TrainingPeople;
use crate::person::responses::Scenery;
use crate::setting::load_scene;
use hwall::Walls;
use hwall::haptics::Board;
use hwall_scene::Scene;

/// The built-in room with an iiwa 7 and the default board.
pub struct BuiltInRoom {
    /// The board.
    pub board: Board,
    /// The arm, with the face of the board as its tool.
    pub arm: BoardArm,
    /// The room, in the arm's base frame.
    pub scene: Scene,
}

impl BuiltInRoom {
    /// As the main job has it without flags.
    ///
    /// # Errors
    /// As for [`BoardArm::named`] and [`load_scene`].
    pub fn new() -> anyhow::Result<Self> {
        let board = Board::default();
        Ok(Self {
            arm: BoardArm::named("iiwa7", &board)?,
            scene: load_scene(None)?.0,
            board,
        })
    }

    /// Simulated people of a kind.
    ///
    /// # Errors
    /// As for [`participants::simulated`].
    pub fn people(
        &self,
        kind: PersonKind,
        touches: usize,
        seed: u64,
    ) -> anyhow::Result<Vec<Participant>> {
        participants::simulated(&self.scene, &self.arm, kind, touches, seed)
    }

    /// What is known of the walls beforehand, where such people touch them. `textured`: the board presents roughness.
    ///
    /// # Errors
    /// As for [`BoardArm::walls_of`].
    pub fn walls(&self, people: &[Participant], textured: bool) -> anyhow::Result<Walls> {
        let likely = participants::likely_touches(&self.scene, &self.arm, people);
        self.arm
            .walls_of(&self.scene, &self.board, likely, textured)
    }

    /// All of it for demonstrations and runs.
    #[must_use]
    pub const fn scenery<'a>(
        &'a self,
        walls: &'a Walls,
        people: &'a TrainingPeople,
        textured: bool,
    ) -> Scenery<'a> {
        Scenery {
            scene: &self.scene,
            arm: &self.arm,
            board: &self.board,
            walls,
            people,
            textured,
        }
    }
}
