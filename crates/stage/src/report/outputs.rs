//! All output of the main job: printed tables and files.

use super::{json, plan_figure, run_figures, tables};
use crate::input::file_plan::FilePlan;
use crate::input::output::{remove_outdated, write_file};
use crate::job_options::JobOptions;
use crate::person::responses::Scenery;
use crate::recording;
use crate::run::people::PersonRun;
use crate::run::stage::Stage;
use anyhow::Context;
use hwall::reachability::WallMaps;
use hwall_view::{ViewFrame, ViewScene, film_strip, glb, replay_page};
use std::path::Path;
use std::time::Duration;

const PLAN: &str = "plan.svg";
const TIME: &str = "time.svg";
const TABLE: &str = "table.md";
const TOUCHES: &str = "touches.csv";
/// Stills of the film strip: times after the contact, s.
const STILLS_S: [f64; 6] = [-0.9, -0.6, -0.4, -0.2, 0.0, 0.3];

const REPLAY: &str = "replay.html";
const STRIP: &str = "touch.svg";
const ANIMATION: &str = "hwall.glb";

/// Checks, before minutes of work, that all files can be written and none of them is one of the `inputs`;
/// then creates the folder.
///
/// # Errors
/// As [`FilePlan::check`]; a folder that cannot be made.
pub fn prepare(options: &JobOptions, inputs: FilePlan) -> anyhow::Result<()> {
    let mut names = vec![PLAN, TIME, TABLE, TOUCHES];
    names.extend(view_names(options.glb));
    let plan = inputs
        .write_into("--out", Some(&options.out), &names)
        .write("--json", options.json.as_deref());
    recording::planned(plan, "--mcap", options.mcap.as_deref()).check()?;
    std::fs::create_dir_all(&options.out).with_context(|| options.out.display().to_string())
}

/// Writes plan.svg, time.svg, the replay, the film strip, table.md, touches.csv, and the JSON file if requested;
/// call [`prepare`] first. Figures show the first person, whose hand exists from `span_s.0` to
/// `span_s.1`; returns remarks for the user.
///
/// # Errors
/// Nobody touched anything, or a file that cannot be written.
pub fn write(
    options: &JobOptions,
    table: &str,
    runs: &[PersonRun],
    stage: &Stage<'_>,
    span_s: (f64, f64),
) -> anyhow::Result<String> {
    let (first, scenery) = (first(runs)?, &stage.scenery);
    let run = &first.run;
    let in_folder = |name: &str| options.out.join(name);
    plan_figure::plan(
        &in_folder(PLAN),
        scenery.scene,
        &scenery.walls.maps,
        &run.trace,
    )?;
    run_figures::over_time(&in_folder(TIME), &run.trace, &run.forces, span_s)?;
    let views = write_views(&options.out, scenery, first, options.glb)?;
    tables::touches_csv(&in_folder(TOUCHES), runs)?;
    if let Some(path) = &options.json {
        write_file(path, json::text(runs)?)?;
    }
    write_file(&in_folder(TABLE), table)?;
    let mut said = format!(
        "wrote {PLAN}, {TIME}, {}, {TABLE} and {TOUCHES} to {}",
        views.written.join(", "),
        options.out.display()
    );
    for line in &views.remarks {
        said += &format!("\n{line}");
    }
    Ok(said)
}

/// Names of the files that [`write_views`] may write.
fn view_names(with_glb: bool) -> impl Iterator<Item = &'static str> {
    [REPLAY, STRIP]
        .into_iter()
        .chain(with_glb.then_some(ANIMATION))
}

/// The files written, and remarks.
struct Views {
    /// The names of the files.
    written: Vec<&'static str>,
    /// Why there is no film strip, and which outdated files of an earlier run were removed.
    remarks: Vec<String>,
}

/// Writes `replay.html` of a run to a folder, `touch.svg` if a board was in place for a touch, and `hwall.glb` if requested.
/// Removes those files of an earlier run that this run does not write.
///
/// # Errors
/// A file that cannot be written; a board or a scene that cannot be shown.
fn write_views(
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
        written.push(name);
        write_file(&folder.join(name), content)
    };
    let replay = replay_page(&scene, &view.frames, &view.markers);
    write(REPLAY, replay.as_bytes())?;
    let mut remarks = Vec::new();
    let mut outdated = vec![ANIMATION];
    match stills_of_one_touch(&scene, person) {
        Some((stills, contact_s)) => {
            write(STRIP, film_strip(&scene, &stills, contact_s)?.as_bytes())?;
        }
        None => {
            outdated.push(STRIP);
            remarks.push(format!(
                "no {STRIP}: the board was in place for none of these touches"
            ));
        }
    }
    if with_glb {
        write(ANIMATION, &glb(&scene, &view.frames))?;
        outdated.retain(|name| *name != ANIMATION);
    }
    remarks.extend(remove_outdated(folder, &outdated)?);
    Ok(Views { written, remarks })
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

/// The printed tables; `mapping`: the computing time of the maps.
///
/// # Errors
/// Nobody touched anything.
pub fn text(runs: &[PersonRun], maps: &WallMaps, mapping: Duration) -> anyhow::Result<String> {
    first(runs)?;
    Ok(format!(
        "{}\n{}\n{}{}",
        tables::table(runs, maps, mapping),
        tables::regrets(runs),
        tables::who_was_right(runs),
        tables::textures(runs) + &tables::pushes(runs) + &tables::gestures(runs)
    ))
}

fn first(runs: &[PersonRun]) -> anyhow::Result<&PersonRun> {
    runs.first().context("nobody touches anything")
}
