//! The section of textures: geometry against independent numbers, which model predicts the study's order, and
//! how soon a moved texture has its speed.

use crate::report::titled;
use crate::texture::trial;
use anyhow::Context;
use hwall_testkit::MarkdownTable;
use hwall_texton::{
    OrderScore, ScanAngle, StudyOrder, Tally, Texture, roughness_models, score_order,
};
use serde_json::Value;
use std::fmt::Write as _;
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
    let read = |name: &str| -> anyhow::Result<Value> {
        let path = folder.join(name);
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        serde_json::from_str(&text).with_context(|| path.display().to_string())
    };
    let Geometry { count, off_mm } = geometry(&read("texture_truth.json")?)?;
    let sweep = read("touchsim_sweep.json")?;
    let mut text = format!(
        "## Textures\n\n### Geometry\n\nWidths, spacings, mean encounters and first bumps met, {count} numbers of six textures, against \
         independent computation: largest deviation {off_mm:.1e} mm.\n\n### Which model puts the study's conditions in order?\n\nThe study: roughness rises with orientation, 0 < 45 < \
         63.43 ~ 71.57 ~ 90 degrees, and with the board's speed, 0 to 80 mm/s (finger: {FINGER_MM_PER_S} mm/s, an \
         assumption). Pairs in order, of all pairs of different rank; \"spread\" is the largest difference \
         within 63.43 ~ 71.57 ~ 90 over the smallest between ranks (below 1: a plateau).\n"
    );
    for (name, texture) in [
        ("released patch (6.2 x 2.2 mm)", Texture::released()),
        ("patch of the text (7 x 3 mm)", Texture::spaced_3_mm()),
    ] {
        let mut table = titled(
            "model | orientation | spread | speed | within its range | order reproduced | at 0 / 45 / 63 / 72 / 90 degrees, \
             share of the largest",
        );
        for model in roughness_models() {
            let study = StudyOrder::dissertation(FINGER_MM_PER_S);
            let score = score_order(&*model, &texture, &study)?;
            table.row(row(&score));
        }
        let _ = write!(text, "\n{name}:\n\n{table}");
    }
    let _ = write!(text, "\n{}", afferents(&sweep));
    text.push_str("\nWhat is known about each model:\n\n");
    let mut table = MarkdownTable::new(["model", "number", "source", "range", "misfit"]);
    for model in roughness_models() {
        let info = model.info();
        table.row([
            info.name,
            info.quantity,
            info.source,
            info.range,
            info.misfit,
        ]);
    }
    let motion = trial::table(seed, TOUCHES)?;
    let _ = write!(
        text,
        "{table}\n### How soon the texture has its speed\n\nSimulated iiwa 7 with a reaction delay of 22 ms, touches of 8 N at random places \
         (walls, ramps and tables in front of the arm, any scan). Error: velocity of the board less the wanted one, \
         over the wanted speed, after the touch was felt; \"off\": from the direction in which the scan was expected. Joints are able where their accelerations (10 rad/s²) allow \
         the wanted speed within 25 ms, and 1 m/s² at least. In the released code of the dissertation the commanded \
         velocity is nominal after 1.5 s.\n\n{motion}"
    );
    Ok(text)
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
    let share = |value: &Option<f64>| match value {
        Some(value) => format!("{:.2}", value / largest),
        None => "none".to_owned(),
    };
    let spread = if score.plateau.is_finite() {
        format!("{:.2}", score.plateau)
    } else {
        "none".to_owned()
    };
    vec![
        score.model.to_owned(),
        of(score.orientation),
        spread,
        of(score.speed),
        of(score.within),
        which.to_owned(),
        values.iter().map(share).collect::<Vec<_>>().join(" / "),
    ]
}

/// How many numbers were compared, and the largest deviation.
struct Geometry {
    count: usize,
    off_mm: f64,
}

fn geometry(truth: &Value) -> anyhow::Result<Geometry> {
    let textures = [
        ("script_large_patch_6.2x2.2", Texture::released()),
        ("script_prelim_r3_6.5x2.1667", Texture::study_3()),
        ("text_3mm_min_7.0x3.0", Texture::spaced_3_mm()),
        ("prelim_r1.5_3.5x3.5", Texture::study_1_5()),
        ("prelim_r2_4.5x2.25", Texture::study_2()),
        ("prelim_r2.5_5.5x2.75", Texture::study_2_5()),
    ];
    let (mut count, mut off_mm) = (0, 0.0_f64);
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
                let difference_mm = match (row[key].as_f64(), ours) {
                    (Some(expected), Some(ours)) => (ours - expected).abs(),
                    (None, None) => 0.0,
                    _ => f64::INFINITY,
                };
                off_mm = off_mm.max(difference_mm);
            }
        }
    }
    Ok(Geometry { count, off_mm })
}

/// Rates of simulated afferents on the same texture, means over the speeds of the sweep.
fn afferents(sweep: &Value) -> String {
    let rows: Vec<&Value> = sweep.as_array().into_iter().flatten().collect();
    let angles = [0.0, 45.0, 63.43, 71.57, 90.0];
    let mut table = titled("TouchSim, mean over speeds | 0 | 45 | 63.43 | 71.57 | 90 deg");
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
        "A simulation of afferents (TouchSim, Saal 2017; one phase, no shear: an indication) shows the same two trends: the rates of vibration-sensitive afferents (PC) rise \
         and flatten as people's estimates do, and the spatial variation of slowly adapting ones peaks in between.\n\n{table}"
    )
}
