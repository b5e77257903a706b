//! All output of the main job: printed tables and files.

use super::{json, plan_figure, run_figures, tables, views};
use crate::input::file_plan::FilePlan;
use crate::recording;
use crate::run::people::PersonRun;
use crate::run::stage::Stage;
use anyhow::Context;
use hwall::reachability::WallMaps;
use std::path::Path;
use std::time::Duration;

const PLAN: &str = "plan.svg";
const TIME: &str = "time.svg";
const TABLE: &str = "table.md";
const TOUCHES: &str = "touches.csv";

/// Destinations of the output.
#[derive(Debug, Clone, Copy)]
pub struct Outputs<'a> {
    /// For figures and tables; created if missing.
    pub folder: &'a Path,
    /// For the touches and their summary as JSON.
    pub json: Option<&'a Path>,
    /// Also write the animation as glTF?
    pub glb: bool,
    /// For the recording of all runs; [`recording`] writes it, with the arm's URDF.
    pub mcap: Option<&'a Path>,
}

impl Outputs<'_> {
    /// Checks, before minutes of work, that all files can be written and none of them is one of the `inputs`;
    /// then creates the folder.
    ///
    /// # Errors
    /// As [`FilePlan::check`]; a folder that cannot be made.
    pub fn prepare(&self, inputs: FilePlan) -> anyhow::Result<()> {
        let mut names = vec![PLAN, TIME, TABLE, TOUCHES];
        names.extend(views::names(self.glb));
        let plan = inputs
            .write_into("--out", Some(self.folder), &names)
            .write("--json", self.json);
        recording::planned(plan, "--mcap", self.mcap).check()?;
        std::fs::create_dir_all(self.folder).with_context(|| self.folder.display().to_string())
    }

    /// Writes plan.svg, time.svg, the replay, the film strip, table.md, touches.csv, and the JSON file if requested;
    /// call [`prepare`](Self::prepare) first. Figures show the first person, whose hand exists from `span_s.0` to
    /// `span_s.1`; returns remarks for the user.
    ///
    /// # Errors
    /// Nobody touched anything, or a file that cannot be written.
    pub fn write(
        &self,
        table: &str,
        runs: &[PersonRun],
        stage: &Stage<'_>,
        span_s: (f64, f64),
    ) -> anyhow::Result<String> {
        let (first, scenery) = (first(runs)?, &stage.scenery);
        let run = &first.run;
        let in_folder = |name: &str| self.folder.join(name);
        plan_figure::plan(
            &in_folder(PLAN),
            scenery.scene,
            &scenery.walls.maps,
            &run.trace,
        )?;
        run_figures::over_time(&in_folder(TIME), &run.trace, &run.forces, span_s)?;
        let views = views::write(self.folder, scenery, first, self.glb)?;
        tables::touches_csv(&in_folder(TOUCHES), runs)?;
        if let Some(path) = self.json {
            json::write(path, runs)?;
        }
        let path = in_folder(TABLE);
        hwall_files::write(&path, table).with_context(|| path.display().to_string())?;
        let mut said = format!(
            "wrote {PLAN}, {TIME}, {}, {TABLE} and {TOUCHES} to {}",
            views.written.join(", "),
            self.folder.display()
        );
        for line in views.missing.iter().chain(&views.removed) {
            said += &format!("\n{line}");
        }
        Ok(said)
    }
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
