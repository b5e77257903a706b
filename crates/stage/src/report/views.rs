//! Views of the main job: a replay, a film strip and, on request, an animation.

use crate::input::output::remove_outdated;
use crate::person::responses::Scenery;
use crate::run::people::PersonRun;
use anyhow::Context;
use hwall_view::{ViewFrame, ViewScene, film_strip, glb, replay_page};
use std::path::Path;

/// Stills of the film strip: times after the contact, s.
const STILLS_S: [f64; 6] = [-0.9, -0.6, -0.4, -0.2, 0.0, 0.3];

const REPLAY: &str = "replay.html";
const STRIP: &str = "touch.svg";
const ANIMATION: &str = "hwall.glb";

/// Names of the files that [`write`] may write.
pub(super) fn names(with_glb: bool) -> impl Iterator<Item = &'static str> {
    [REPLAY, STRIP]
        .into_iter()
        .chain(with_glb.then_some(ANIMATION))
}

/// The files written, and remarks.
pub struct Views {
    /// The names of the files.
    pub written: Vec<&'static str>,
    /// Why there is no film strip, if so.
    pub missing: Option<String>,
    /// A line about outdated files of an earlier run that were removed.
    pub removed: Option<String>,
}

/// Writes `replay.html` of a run to a folder, `touch.svg` if a board was in place for a touch, and `hwall.glb` if requested.
/// Removes those files of an earlier run that this run does not write.
///
/// # Errors
/// A file that cannot be written; a board or a scene that cannot be shown.
pub fn write(
    folder: &Path,
    scenery: &Scenery<'_>,
    person: &PersonRun,
    with_glb: bool,
) -> anyhow::Result<Views> {
    let (scene, arm) = (scenery.scene, scenery.arm);
    let title = "H-Wall: the main job";
    let scene = ViewScene::new(title, scene, &**arm.kinematics(), arm.board())?;
    let view = &person.run.view;
    let mut written = Vec::new();
    let mut write = |name: &'static str, content: &[u8]| {
        let path = folder.join(name);
        written.push(name);
        hwall_files::write(&path, content).with_context(|| path.display().to_string())
    };
    let replay = replay_page(&scene, &view.frames, &view.markers);
    write(REPLAY, replay.as_bytes())?;
    let mut missing = None;
    let mut outdated = vec![ANIMATION];
    match stills_of_one_touch(&scene, person) {
        Some((stills, contact_s)) => {
            write(STRIP, film_strip(&scene, &stills, contact_s)?.as_bytes())?;
        }
        None => {
            outdated.push(STRIP);
            missing = Some(format!(
                "no {STRIP}: the board was in place for none of these touches"
            ));
        }
    }
    if with_glb {
        write(ANIMATION, &glb(&scene, &view.frames))?;
        outdated.retain(|name| *name != ANIMATION);
    }
    Ok(Views {
        written,
        missing,
        removed: remove_outdated(folder, &outdated)?,
    })
}

/// Frames and contact time, s, of the touch with the longest board motion among those with the board in place.
fn stills_of_one_touch(scene: &ViewScene, person: &PersonRun) -> Option<(Vec<ViewFrame>, f64)> {
    let frames = &person.run.view.frames;
    let at = |t_s: f64| {
        let near = |frame: &&ViewFrame| (frame.t_s - t_s).abs();
        frames.iter().min_by(|a, b| near(a).total_cmp(&near(b)))
    };
    let middle_m = |frame: &ViewFrame| {
        let poses = scene.arm.poses(&frame.q);
        poses.last().map(|pose| pose.position_m())
    };
    let way_m = |contact_s: f64| {
        let [from, to] = [STILLS_S[0], 0.0].map(|s| at(contact_s + s).and_then(middle_m));
        from.zip(to).map_or(0.0, |(from, to)| from.distance(to))
    };
    let in_place = person.touches.iter().filter(|t| t.outcome.in_place());
    let contact_s = in_place
        .map(|touch| touch.outcome.touch.contact_s)
        .max_by(|a, b| way_m(*a).total_cmp(&way_m(*b)))?;
    let stills = STILLS_S.iter().map(|s| at(contact_s + s).copied());
    Some((stills.collect::<Option<Vec<_>>>()?, contact_s))
}
