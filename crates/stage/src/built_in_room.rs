//! The built-in room, for studies and tests with simulated people.

use crate::input::arms::BoardArm;
use crate::person::kinds::PersonKind;
use crate::person::participants::{self, Participant};
use crate::person::predictors::TrainingPeople;
use crate::person::responses::Scenery;
use crate::setting::{load_scene, scene_texts};
use hwall::Walls;
use hwall::haptics::Board;
use hwall_scene::Scene;
use std::fmt::Write as _;

/// The built-in room with an iiwa 7 and the default board.
pub struct BuiltInRoom {
    /// The arm, with the face of its board as its tool.
    pub arm: BoardArm,
    /// The room, in the arm's base frame.
    pub scene: Scene,
}

impl BuiltInRoom {
    /// The default of the main job.
    ///
    /// # Errors
    /// As for [`BoardArm::named`] and [`load_scene`].
    pub fn new() -> anyhow::Result<Self> {
        Ok(Self {
            arm: BoardArm::named("iiwa7", &Board::default())?,
            scene: load_scene(None)?.0,
        })
    }

    /// The same room with 3 cm boxes on its front wall, up to this many upright surface patches.
    ///
    /// # Errors
    /// As for [`Scene::from_obj_str`].
    pub fn crowded(pieces: usize) -> anyhow::Result<Self> {
        const LEFT_M: f64 = 0.18;
        const TOP_M: f64 = 1.78;
        const WALL_M: f64 = 0.62;
        const ROW: usize = 28;
        const SIZE_M: f64 = 0.03;
        let room = Self::new()?;
        let boxes = pieces.saturating_sub(room.scene.vertical_facets().len()) / 4;
        let (mut obj, sidecar) = scene_texts(None)?;
        let corners = obj.lines().filter(|line| line.starts_with("v ")).count();
        for number in 0..boxes {
            let (row, column) = (number / ROW, number % ROW);
            let y = LEFT_M - 1.6 * SIZE_M * column as f64;
            // Above and below the points that people touch.
            let row = if row % 2 == 0 { row / 2 } else { 38 - row / 2 };
            let z = TOP_M - 2.0 * SIZE_M * row as f64;
            writeln!(obj, "o box{number}")?;
            for (x, y) in [
                (WALL_M, y),
                (WALL_M + SIZE_M, y),
                (WALL_M + SIZE_M, y - SIZE_M),
                (WALL_M, y - SIZE_M),
            ] {
                writeln!(obj, "v {x} {y} {z}\nv {x} {y} {}", z - SIZE_M)?;
            }
            let at = |corner: usize| corners + 8 * number + corner % 8 + 1;
            for side in [0, 2, 4, 6] {
                let [a, b, c, d] = [side, side + 1, side + 3, side + 2].map(at);
                writeln!(obj, "f {d} {c} {b} {a}")?;
            }
        }
        let (scene, _) = Scene::from_obj_str(&obj, sidecar.as_deref())?;
        Ok(Self { scene, ..room })
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

    /// Precomputed maps of the walls where such people touch them. `textured`: the board presents roughness.
    ///
    /// # Errors
    /// As for [`BoardArm::walls_of`].
    pub fn walls(&self, people: &[Participant], textured: bool) -> anyhow::Result<Walls> {
        let likely = participants::likely_touches(&self.scene, &self.arm, people);
        self.arm.walls_of(&self.scene, likely, textured)
    }

    /// The scenery for demonstrations and runs.
    #[must_use]
    pub const fn scenery<'a>(
        &'a self,
        walls: &'a Walls,
        people: &'a TrainingPeople,
        textured: bool,
    ) -> Scenery<'a> {
        Scenery::of(&self.scene, &self.arm, walls, people).textured(textured)
    }
}
