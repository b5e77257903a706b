//! The main job to look at: a replay, a film strip and, on request, an animation.

use crate::run::people::PersonRun;
use anyhow::Context;
use hwall::haptics::Board;
use hwall_kinematics::ArmKinematics;
use hwall_scene::Scene;
use hwall_view::{ViewScene, replay_page};
use std::path::Path;

/// Writes `replay.html` of a run to a folder.
///
/// # Errors
/// A file that cannot be written; a board or a scene that cannot be shown.
pub fn write(
    folder: &Path,
    scene: &Scene,
    arm: &dyn ArmKinematics,
    board: &Board,
    person: &PersonRun,
) -> anyhow::Result<()> {
    let scene = ViewScene::new("H-Wall: the main job", scene, arm, board)?;
    let view = &person.run.view;
    let replay = replay_page(&scene, &view.frames, &view.markers);
    let path = folder.join("replay.html");
    std::fs::write(&path, replay).with_context(|| path.display().to_string())?;
    Ok(())
}
