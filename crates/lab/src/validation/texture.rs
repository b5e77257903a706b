//! The section of textures: the models that predict the study's order, and the time until a moving texture has its speed.

use crate::report::template;
use crate::texture::trial;
use crate::validation::perception::json;
use hwall_testkit::{MarkdownTable, cells, or_none, titled};
use hwall_texton::{OrderScore, StudyOrder, Tally, Texture, roughness_models, score_order};
use serde_json::Value;
use std::path::Path;

/// The finger's own speed in the study, mm/s: an assumption.
const FINGER_MM_PER_S: f64 = 100.0;

/// Touches of every row of the motion table.
const TOUCHES: usize = 100;

/// Markdown, from a second-level heading on.
///
/// # Errors
/// A reference file that is missing or malformed.
pub fn section(folder: &Path, seed: u64) -> anyhow::Result<String> {
    let sweep = json(&folder.join("touchsim_sweep.json"))?;
    let mut models = titled("model | number | source | range | misfit");
    for model in roughness_models() {
        let info = model.info();
        models.row([
            info.name,
            info.quantity,
            info.source,
            info.range,
            info.misfit,
        ]);
    }
    template(include_str!("textures.md")).fill(&[
        ("finger", &FINGER_MM_PER_S),
        ("released", &order(Texture::released())?),
        ("text", &order(Texture::spaced_3_mm())?),
        ("afferents", &afferents(&sweep)),
        ("models", &models),
        ("motion", &trial::table(seed, TOUCHES)?),
    ])
}

/// Which model puts the dissertation's conditions on a texture in their order of roughness.
///
/// # Errors
/// A texture that a model refuses.
pub fn order(texture: Texture) -> anyhow::Result<MarkdownTable> {
    let mut table = titled(
        "model | orientation | spread | speed | within its range | order reproduced | at 0 / 45 / 63 / 72 / 90 degrees, \
         share of the largest",
    );
    for model in roughness_models() {
        let study = StudyOrder::dissertation(FINGER_MM_PER_S);
        table.row(row(&score_order(&*model, &texture, &study)?));
    }
    Ok(table)
}

fn row(score: &OrderScore) -> Vec<String> {
    let of = |tally: Tally| format!("{} of {}", tally.hits, tally.of);
    let which = match (score.reproduces_orientation(), score.reproduces_speed()) {
        (true, true) => "yes",
        (true, false) => "orientation only",
        (false, true) => "speed only",
        (false, false) => "no",
    };
    let values = &score.over_orientation;
    let largest = values.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
    let share = |value: &Option<f64>| or_none(value.map(|value| value / largest), 2);
    let plateau = Some(score.plateau).filter(|plateau| plateau.is_finite());
    vec![
        score.model.to_owned(),
        of(score.orientation),
        or_none(plateau, 2),
        of(score.speed),
        of(score.within),
        which.to_owned(),
        values.iter().map(share).collect::<Vec<_>>().join(" / "),
    ]
}

/// Rates of simulated afferents on the same texture, means over the speeds of the sweep.
fn afferents(sweep: &Value) -> MarkdownTable {
    let rows = sweep.as_array().into_iter().flatten();
    let of_patch = |row: &&Value| row["geom"].as_str() == Some("script_6.2x2.2");
    let rows: Vec<&Value> = rows.filter(of_patch).collect();
    let mut table = titled("TouchSim, mean over speeds | 0 | 45 | 63.43 | 71.57 | 90 deg");
    for (name, key) in [
        ("PC rate, Hz", "PC_mean_rate"),
        ("RA rate, Hz", "RA_mean_rate"),
        ("SA1 variation over 2 mm, Hz", "SA1_spatial_variation_2mm"),
    ] {
        let means = [0.0, 45.0, 63.43, 71.57, 90.0].map(|angle| {
            let at = rows.iter().filter(|r| r["theta"].as_f64() == Some(angle));
            let values: Vec<f64> = at.filter_map(|r| r[key].as_f64()).collect();
            let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
            format!("{mean:.0}")
        });
        table.row(cells([name], means));
    }
    table
}
