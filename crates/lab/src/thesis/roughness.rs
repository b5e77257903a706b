//! Chapter V: bumps by scanning angle, three studies of roughness, levels from pictures.

use super::job::Job;
use crate::dissertation::{Row, SPEED_AFTER_S};
use crate::psychophysics::figures;
use crate::report::template;
use crate::texture::{assign, patch_figures, trial};
use crate::touch_study::outputs::normalised;
use crate::touch_study::thesis::{Magnitudes, redone, rows};
use crate::validation::texture::order;
use anyhow::Context;
use hwall_psychophysics::Study;
use hwall_study::{Patch as StudyPatch, ReadyProtocol, StudyRecord, StudyReport};
use hwall_testkit::MarkdownTable;
use hwall_texton::{MaterialPicture, MaterialScale, Patch, PatchSpec, PictureKind, Texture};
use std::path::Path;

/// Random touches of each row of the table of speeds.
const TOUCHES: usize = 25;
/// Side of a patch whose heights are a picture, and of its pixels, mm.
const SIDE_MM: f64 = 50.0;
const PIXEL_MM: f64 = 0.1;

pub(super) fn section(job: &Job<'_>) -> anyhow::Result<String> {
    let released = Texture::released();
    let (path, plan) = job.figure("patch.svg", "The released patch, from above and cut")?;
    patch_figures::plan(&path, &Patch::new(released, PatchSpec::released())?)?;
    let (path, spacing) = job.figure("spacing.svg", "Width and spacing by scanning angle")?;
    patch_figures::spacing(&path, &released)?;
    let [preliminary, main, cones] = [
        ReadyProtocol::Preliminary,
        ReadyProtocol::Roughness,
        ReadyProtocol::Cones,
    ]
    .map(|ready| redone(ready, ready.protocol().subjects, job.seed));
    let (preliminary, main, cones) = (preliminary?, main?, cones?);
    let (path, by_patch) = job.figure("preliminary.svg", "Estimates of four patches by angle")?;
    means(&path, &preliminary)?;
    let (path, by_level) = job.figure("roughness.svg", "Estimates by angle and by speed")?;
    figures::boxes(&path, &answers(&main)?)?;
    let (path, by_shape) = job.figure(
        "cones.svg",
        "Estimates of hemiellipsoids and cones by angle",
    )?;
    means(&path, &cones)?;
    let scale = MaterialScale::calibrated()?;
    let off = |kind| format!("{:.1}", scale.error(kind).ln_sd().exp());
    template(include_str!("roughness.md")).fill(&[
        ("heights_off", &off(PictureKind::Height)),
        ("colour_off", &off(PictureKind::Albedo)),
        ("plan", &plan),
        ("encounters", &patch_figures::encounters(&released)?),
        ("spacing", &spacing),
        ("preliminary", &Row::table(&rows(&preliminary)?)),
        ("by_patch", &by_patch),
        ("main", &Row::table(&rows(&main)?)),
        ("table_v", &Magnitudes::of(&main)?.table_v()),
        ("by_level", &by_level),
        ("order", &order(released)?),
        ("cones", &Row::table(&rows(&cones)?)),
        ("by_shape", &by_shape),
        ("levels", &levels(&scale)?),
        ("after", &SPEED_AFTER_S),
        ("touches", &TOUCHES),
        ("speeds", &trial::table(job.seed, TOUCHES)?),
    ])
}

/// The answers of a study, magnitudes normalised.
fn answers(study: &StudyRecord) -> anyhow::Result<Study> {
    normalised(study, &StudyReport::of(study)?)?.context("too few answers")
}

/// Draws the mean answers of a study.
pub(super) fn means(path: &Path, study: &StudyRecord) -> anyhow::Result<()> {
    figures::means(path, &answers(study)?, 0.95)
}

/// Levels proposed for surfaces with available height maps: the patches of the studies.
fn levels(scale: &MaterialScale) -> anyhow::Result<MarkdownTable> {
    let spec = PatchSpec {
        size_mm: [SIDE_MM; 2],
        ..PatchSpec::default()
    };
    let proposals = StudyPatch::ALL.map(|patch| -> anyhow::Result<_> {
        let heights = Patch::new(patch.texture(), spec.clone())?.height_field(PIXEL_MM)?;
        let picture = MaterialPicture::from_heights(&heights)?;
        let name = patch.word().to_owned();
        Ok((name, "heights".into(), scale.propose(&picture)?))
    });
    let proposals = proposals.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    Ok(assign::table(&assign::assigned(proposals)?))
}
