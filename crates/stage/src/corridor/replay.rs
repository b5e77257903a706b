//! A walk in the browser: the rooms, and frames in which the base drives.

use super::hall::{Hall, Room};
use super::run::Walked;
use crate::input::arms::BoardArm;
use crate::run::logs::view_log::ViewLog;
use hwall_view::{ViewScene, replay_page};

/// The page of a walk, with the rooms in which it touched something.
pub(super) fn page(
    hall: &Hall,
    arm: &BoardArm,
    walk: &Walked,
    view: &ViewLog,
) -> anyhow::Result<String> {
    let title = format!("H-Wall: a base in a corridor: {}", walk.kind.name());
    let of = |room: &Room| ViewScene::new(&title, &room.scene, &**arm.kinematics(), arm.board());
    let mut scene = of(&hall.rooms[0])?;
    for room in &hall.rooms[1..walk.rooms()] {
        scene.surfaces.extend(of(room)?.surfaces);
    }
    Ok(replay_page(&scene, &view.frames, &view.markers))
}
