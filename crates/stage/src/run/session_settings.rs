//! What a session of the main job is made of.

use crate::input::arms::BoardArm;
use crate::run::simulated_arm::ArmLevel;
use hwall::haptics::body::Room;
use hwall::haptics::safety::PersonPart;
use hwall::haptics::{Board, RendererConfig};
use hwall::{Session, SessionConfig, Walls, session_supervisor};
use hwall_contact::Predictor;
use hwall_hand::HandFilterConfig;
use hwall_scene::Scene;

/// What a session of the main job is made of, besides the predictor. The same settings, predictor and inputs give the
/// same commands bit by bit.
#[derive(Clone, Copy)]
pub struct SessionSettings<'a> {
    /// The arm, with the face of the board as its tool.
    pub arm: &'a BoardArm,
    /// The board.
    pub board: &'a Board,
    /// What really stands around the arm; `None`: a floor.
    pub room: Option<&'a Room>,
    /// What is touched, in the arm's base frame.
    pub scene: &'a Scene,
    /// What is known of its walls: where the arm can present them, and where it waits.
    pub walls: &'a Walls,
    /// Does the board present the roughness of surfaces?
    pub textured: bool,
    /// How much of the arm is simulated: says how objects are rendered.
    pub level: ArmLevel,
    /// How frames of the hand are filtered.
    pub filter: HandFilterConfig,
    /// Is the head tracked? Otherwise the arm does not wait for it, and nothing keeps it away from one.
    pub sees_head: bool,
    /// What is added to the time of the tracker to get that of the arm, s.
    pub arm_minus_tracker_s: f64,
}

impl SessionSettings<'_> {
    /// A session that has seen nobody.
    ///
    /// # Errors
    /// A configuration that a crate refuses.
    pub fn session<P: Predictor>(&self, predictor: P) -> anyhow::Result<Session<P>> {
        let mut supervisor = session_supervisor();
        supervisor.room = self.room.cloned();
        let required = &mut supervisor.required;
        required.retain(|part| self.sees_head || *part != PersonPart::Head);
        let config = SessionConfig {
            supervisor: Some(supervisor),
            renderer: RendererConfig::default(),
            hand: self.filter,
            arm_minus_tracker_s: self.arm_minus_tracker_s,
            texture: self.textured,
            object_command: self.level.object_command(self.arm, self.board)?,
            ..SessionConfig::default()
        };
        Ok(Session::new(
            &**self.arm.kinematics(),
            self.board,
            self.scene.clone(),
            self.walls.clone(),
            predictor,
            config,
        )?)
    }
}
