//! What docs/VALIDATION.md says of hwall-texton: geometry against independent numbers, and which model of
//! roughness puts the conditions of the published study in the order in which people put them.

use anyhow::Context;
use hwall_testkit::MarkdownTable;
use hwall_texton::{ScanAngle, StudyOrder, Texture, roughness_models, score_order};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;

/// The finger's own speed in the study, mm/s: an assumption.
const FINGER_MM_PER_S: f64 = 100.0;

/// The section, from a second-level heading on.
///
/// # Errors
/// A reference file that is missing or malformed.
pub fn section(folder: &Path) -> anyhow::Result<String> {
    let read = |name: &str| -> anyhow::Result<Value> {
        let path = folder.join(name);
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        serde_json::from_str(&text).with_context(|| path.display().to_string())
    };
    let truth = read("texture_truth.json")?;
    let sweep = read("touchsim_sweep.json")?;
    let (count, off_mm) = geometry(&truth)?;
    let mut out = format!(
        "## Textures\n\n### Geometry\n\nWidths, spacings, mean encounters and first bumps met, {count} numbers of six textures, against independent computation: \
         largest deviation {off_mm:.1e} mm.\n\n### Which model gives the study's order of roughness\n\nThe study found that roughness rises with the angle between scan and long axis \
         (0 < 45 < 63.43 ~ 71.57 ~ 90 degrees) and with the speed of the board (0 to 80 mm/s; here beside a finger of {FINGER_MM_PER_S:.0} mm/s, an \
         assumption). On the released texture:\n\n"
    );
    let texture = Texture::released();
    let study = StudyOrder::dissertation(FINGER_MM_PER_S);
    let mut table = MarkdownTable::new([
        "model",
        "what it predicts",
        "over 0 / 45 / 63.43 / 71.57 / 90 deg",
        "pairs of angles right",
        "upper three together",
        "pairs of speeds right",
        "known misfit",
    ]);
    let share = |[right, all]: [usize; 2]| format!("{right} of {all}");
    for model in roughness_models() {
        let (info, score) = (model.info(), score_order(model.as_ref(), &texture, &study)?);
        let cells = score.over_orientation.iter().map(|value| match value {
            Some(value) => format!("{value:.3}"),
            None => "none".to_owned(),
        });
        table.row([
            info.name.to_owned(),
            info.quantity.to_owned(),
            cells.collect::<Vec<_>>().join(" / "),
            share(score.orientation),
            if score.plateau < 1.0 { "yes" } else { "no" }.to_owned(),
            share(score.speed),
            info.misfit.to_owned(),
        ]);
    }
    let whole: Vec<&str> = roughness_models()
        .iter()
        .filter_map(|model| {
            let score = score_order(model.as_ref(), &texture, &study).ok()?;
            let whole = score.reproduces_orientation() && score.reproduces_speed();
            whole.then_some(score.model)
        })
        .collect();
    let _ = write!(
        out,
        "{table}\nThe whole order is reproduced by: {}. No models are blended: each says what it says.\n\n{}",
        if whole.is_empty() {
            "none".to_owned()
        } else {
            whole.join(", ")
        },
        afferents(&sweep)
    );
    Ok(out)
}

/// How many numbers were compared, and the largest deviation, mm.
fn geometry(truth: &Value) -> anyhow::Result<(usize, f64)> {
    let textures = [
        ("script_large_patch_6.2x2.2", Texture::released()),
        ("script_prelim_r3_6.5x2.1667", Texture::study_3()),
        ("text_3mm_min_7.0x3.0", Texture::spaced_3_mm()),
        ("prelim_r1.5_3.5x3.5", Texture::study_1_5()),
        ("prelim_r2_4.5x2.25", Texture::study_2()),
        ("prelim_r2.5_5.5x2.75", Texture::study_2_5()),
    ];
    let (mut count, mut worst_mm) = (0, 0.0_f64);
    for (name, texture) in textures {
        let rows = truth["geometries"][name].as_array();
        for row in rows.with_context(|| format!("texture_truth.json has no {name}"))? {
            let deg = row["theta_deg"].as_f64().context("theta_deg is missing")?;
            let scan = ScanAngle::from_deg(deg)?;
            let met = texture.encounter(scan);
            for (key, ours) in [
                ("w_theta_mm", Some(texture.texton().width_mm(scan))),
                (
                    "width_across_scan_mm",
                    Some(texture.texton().breadth_mm(scan)),
                ),
                ("d_ridge_mm", texture.spacing_mm(scan)),
                ("d_mean_encounter_mm", Some(texture.mean_encounter_mm(scan))),
                ("t_entry", met.map(|m| m.enters_mm)),
                ("t_chord_mid", met.map(|m| m.middle_mm)),
                ("t_own_exit", met.map(|m| m.leaves_mm)),
                ("base_gap", met.map(|m| m.gap_mm())),
            ] {
                count += 1;
                let off_mm = match (row[key].as_f64(), ours) {
                    (Some(expected), Some(ours)) => (ours - expected).abs(),
                    (None, None) => 0.0,
                    _ => f64::INFINITY,
                };
                worst_mm = worst_mm.max(off_mm);
            }
        }
    }
    Ok((count, worst_mm))
}

/// What simulated afferents say of the same texture: means over the speeds of the sweep.
fn afferents(sweep: &Value) -> String {
    let rows: Vec<&Value> = sweep.as_array().into_iter().flatten().collect();
    let angles = [0.0, 45.0, 63.43, 71.57, 90.0];
    let mut table = MarkdownTable::new([
        "TouchSim, mean over speeds",
        "0",
        "45",
        "63.43",
        "71.57",
        "90 deg",
    ]);
    for (name, key) in [
        ("PC rate, Hz", "PC_mean_rate"),
        ("RA rate, Hz", "RA_mean_rate"),
        ("SA1 variation over 2 mm, Hz", "SA1_spatial_variation_2mm"),
    ] {
        let mut cells = vec![name.to_owned()];
        for angle in angles {
            let at = |row: &&&Value| {
                row["geom"].as_str() == Some("script_6.2x2.2")
                    && row["theta"].as_f64() == Some(angle)
            };
            let values: Vec<f64> = rows
                .iter()
                .filter(at)
                .filter_map(|r| r[key].as_f64())
                .collect();
            let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
            cells.push(format!("{mean:.0}"));
        }
        table.row(cells);
    }
    format!(
        "A simulation of afferents (TouchSim, Saal 2017; one phase, no shear: a trend) has the same two kinds of answer: vibration-sensitive (PC) rates rise and \
         flatten as people's estimates do, the spatial variation of slowly adapting ones peaks in between.\n\n{table}"
    )
}
