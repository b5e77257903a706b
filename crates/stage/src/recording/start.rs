//! `--mcap FILE`.

use super::setup::SessionSource;
use crate::input::arms::NamedArm;
use crate::input::file_plan::FilePlan;
use crate::input::output::write_file;
use crate::input::scene_file::SceneFile;
use crate::person::responses::Scenery;
use crate::run::stage::Stage;
use crate::setting::Setting;
use anyhow::ensure;
use hwall_files::same_file;
use hwall_record::{Recorder, RecorderConfig, Skeleton};
use std::path::{Path, PathBuf};

/// Path of the arm's capsules: `session.urdf` for `session.mcap`.
#[must_use]
pub fn urdf_beside(path: &Path) -> PathBuf {
    path.with_extension("urdf")
}

/// Adds a recording, if there is one, and its URDF to the files of a program.
#[must_use]
pub fn planned(plan: FilePlan, flag: &'static str, path: Option<&Path>) -> FilePlan {
    let urdf = path.map(urdf_beside);
    let beside = match flag {
        "--record" => "the arm's description beside --record",
        _ => "the arm's description beside --mcap",
    };
    plan.write(flag, path).write(beside, urdf.as_deref())
}

/// Begins a recording and writes the arm's capsules [beside](urdf_beside) it. The recording has its final name from the start, so it
/// can be opened after a crash.
///
/// # Errors
/// A file that cannot be read or written, or that is the arm's own description; an arm with unknown links.
pub fn start(
    path: &Path,
    source: &SessionSource<'_>,
    config: &RecorderConfig,
) -> anyhow::Result<Recorder> {
    let Scenery { arm, scene, .. } = source.scenery;
    let skeleton = Skeleton::new(&arm.links()?, &**arm.kinematics(), arm.board())?;
    let urdf = urdf_beside(path);
    ensure!(
        urdf != path && !same_file(&urdf, &source.arm.name),
        "{}: the arm's capsules would be written over it; record under another name",
        urdf.display()
    );
    let setup = source.to_setup()?;
    let name = Path::new(&source.arm.name).file_stem().unwrap_or_default();
    let text = skeleton.to_urdf(&name.to_string_lossy());
    // Create the recorder first: if another program records to the file, the URDF belongs to that program too.
    let recorder = Recorder::create(path, &setup, skeleton, scene, config)?;
    write_file(&urdf, text)?;
    Ok(recorder)
}

/// As [`start`], for the runs of the main job; drops no messages.
///
/// # Errors
/// As for [`start`].
pub fn of_stage(
    path: &Path,
    stage: &Stage<'_>,
    setting: &Setting,
    scene: Option<SceneFile<'_>>,
    arm: &NamedArm,
) -> anyhow::Result<Recorder> {
    let source = SessionSource {
        scene,
        arm,
        room: None,
        base: setting.base,
        scenery: stage.scenery,
        level: stage.level,
        predictor: stage.predictors.leader(),
        adapts: stage.predictors.adapts(),
        likely_touches: &setting.likely_touches,
    };
    start(path, &source, &RecorderConfig::simulated())
}

/// Ends a recording. Returns a line for the user.
///
/// # Errors
/// The first error of writing.
pub fn finish(recorder: Recorder, path: &Path) -> anyhow::Result<String> {
    let summary = recorder.finish()?;
    let mut line = format!(
        "wrote {} ({:.1} MB, {} messages of the session) and {}",
        path.display(),
        1e-6 * summary.bytes as f64,
        summary.messages,
        urdf_beside(path).display()
    );
    if summary.dropped > 0 {
        line += &format!("; {} messages were left out", summary.dropped);
    }
    Ok(line)
}
