//! All that a run of the main job leaves: what is printed, and the files.

use super::{json, plan_figure, run_figures, tables, views};
use crate::run::people::{PersonRun, Stage};
use anyhow::{Context, ensure};
use hwall::reachability::WallMaps;
use std::path::Path;
use std::time::Duration;

/// Where it goes.
#[derive(Debug, Clone, Copy)]
pub struct Outputs<'a> {
    /// For figures and tables; made if it does not exist.
    pub folder: &'a Path,
    /// For the touches and their summary as JSON.
    pub json: Option<&'a Path>,
    /// Is the animation written as glTF, too?
    pub glb: bool,
}

impl Outputs<'_> {
    /// Says before minutes of work, not after them, that a file cannot be written.
    ///
    /// # Errors
    /// The folder of the JSON file does not exist.
    pub fn check(&self) -> anyhow::Result<()> {
        let folder = self.json.and_then(Path::parent);
        ensure!(
            folder.is_none_or(|f| f.as_os_str().is_empty() || f.is_dir()),
            "--json: no folder for that file"
        );
        Ok(())
    }

    /// Writes plan.svg, time.svg, the replay, the film strip, table.md and touches.csv, and the JSON file if there is to be one. Figures are of the first person,
    /// whose hand is there from `span_s.0` to `span_s.1`; returns what to say about it.
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
        let (first, scene) = (first(runs)?, stage.scene);
        let run = &first.run;
        let in_folder = |name: &str| self.folder.join(name);
        std::fs::create_dir_all(self.folder).with_context(|| self.folder.display().to_string())?;
        plan_figure::plan(&in_folder("plan.svg"), scene, &stage.walls.maps, &run.trace)?;
        run_figures::over_time(&in_folder("time.svg"), &run.trace, &run.forces, span_s)?;
        let arm = &**stage.arm.kinematics();
        let views = views::write(self.folder, scene, arm, stage.board, first, self.glb)?;
        tables::touches_csv(&in_folder("touches.csv"), runs)?;
        if let Some(path) = self.json {
            json::write(path, runs)?;
        }
        std::fs::write(in_folder("table.md"), table)?;
        Ok(format!(
            "wrote plan.svg, time.svg, {}, table.md and touches.csv to {}",
            views.join(", "),
            self.folder.display()
        ))
    }
}

/// The tables that are printed; `mapping` is the time that the maps took.
///
/// # Errors
/// Nobody touched anything.
pub fn text(runs: &[PersonRun], maps: &WallMaps, mapping: Duration) -> anyhow::Result<String> {
    let run = &first(runs)?.run;
    Ok(format!(
        "{}\n{}\n{}{}",
        tables::table(runs, maps, mapping),
        tables::regrets(runs),
        tables::who_was_right(runs),
        tables::textures(run) + &tables::pushes(run)
    ))
}

fn first(runs: &[PersonRun]) -> anyhow::Result<&PersonRun> {
    runs.first().context("nobody touches anything")
}
