//! What docs/VALIDATION.md says about textures: which model predicts the study's order, and how soon a
//! moved texture has its speed.

use crate::texture_touch;
use hwall_testkit::MarkdownTable;
use hwall_texton::{OrderScore, StudyOrder, Texture, roughness_models, score_order};
use std::fmt::Write as _;

/// The finger's own speed in the study, mm/s: an assumption.
const FINGER_MM_PER_S: f64 = 100.0;

/// Places of the motion table.
const TOUCHES: usize = 100;

/// Markdown, from a second-level heading on.
///
/// # Errors
/// None in practice: textures, study and arm are constants.
pub fn section(seed: u64) -> anyhow::Result<String> {
    let mut text = format!(
        "## Textures\n\n### Which model puts the study's conditions in order?\n\nThe study: roughness rises with orientation, 0 < 45 < \
         63.43 ~ 71.57 ~ 90 degrees, and with the board's speed, 0 to 80 mm/s (finger: {FINGER_MM_PER_S} mm/s, an \
         assumption). Pairs in order, of all pairs of different rank; \"spread\" is the largest difference \
         within 63.43 ~ 71.57 ~ 90 over the smallest between ranks (below 1: a plateau).\n"
    );
    for (name, texture) in [
        ("released patch (6.2 x 2.2 mm)", Texture::released()),
        ("patch of the text (7 x 3 mm)", Texture::spaced_3_mm()),
    ] {
        let mut table = MarkdownTable::new([
            "model",
            "orientation",
            "spread",
            "speed",
            "within its range",
            "order reproduced",
            "at 0 / 45 / 63 / 72 / 90 degrees, share of the largest",
        ]);
        for model in roughness_models() {
            let study = StudyOrder::dissertation(FINGER_MM_PER_S);
            let score = score_order(&*model, &texture, &study)?;
            table.row(row(&score));
        }
        let _ = write!(text, "\n{name}:\n\n{table}");
    }
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
    let motion = texture_touch::table(seed, TOUCHES)?;
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
    let of = |[right, all]: [usize; 2]| format!("{right} of {all}");
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
