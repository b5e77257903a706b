//! The session that is measured: without maps, led by the ray of the gaze, for a simulated hand.

use hwall::contact::{DeterministicConfig, DeterministicPredictor};
use hwall::hand::HandFilterConfig;
use hwall::haptics::Board;
use hwall::{Session, SessionConfig, Walls};
use hwall_scene::Scene;
use hwall_stage::input::arms::BoardArm;

/// It waits where the arm starts.
///
/// # Errors
/// As for [`Session::new`].
pub(super) fn ray_led(
    arm: &BoardArm,
    board: &Board,
    scene: Scene,
) -> anyhow::Result<Session<DeterministicPredictor>> {
    let walls = Walls {
        waiting: Some(arm.start()),
        ..Walls::default()
    };
    let predictor = DeterministicPredictor::new(DeterministicConfig::ray_led())?;
    let config = SessionConfig {
        hand: HandFilterConfig::simulated(),
        ..SessionConfig::default()
    };
    let kinematics = &**arm.kinematics();
    Ok(Session::new(
        kinematics, board, scene, walls, predictor, config,
    )?)
}
