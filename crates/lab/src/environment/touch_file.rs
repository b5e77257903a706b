//! Every touch of the study as a row of a file.

use crate::environment::outcome::Outcome;
use crate::environment::study::Results;
use std::path::Path;

const HEADER: &str = "person,number,surface,orientation,hand,outcome,reason,x_m,y_m,z_m,normal_deg,residual_deg,\
                      turned_deg,budget_s,travel_s,shift_mm";

/// Writes touches.csv: places in the arm's base frame; empty where there is no such number.
pub(super) fn write(path: &Path, results: &Results) -> anyhow::Result<()> {
    let mut file = hwall_stage::numbers::writer(Some(path))?;
    file.write_record(HEADER.split(','))?;
    for row in &results.rows {
        for (number, (touch, encounter)) in row
            .touches
            .iter()
            .zip(&results.ways[row.way].encounters)
            .enumerate()
        {
            let (outcome, reason) = match touch.outcome {
                Outcome::InTime => ("in_time", ""),
                Outcome::Late => ("late", ""),
                Outcome::OutOfReach(reason) => ("out_of_reach", reason.name()),
            };
            let angle = |rad: f64| format!("{:.3}", rad.to_degrees());
            let optional = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.4}"));
            let [x, y, z] = touch.point_m.to_array().map(|v| format!("{v:.4}"));
            file.write_record([
                row.person.name().to_owned(),
                (number + 1).to_string(),
                results.scene.surface(encounter.surface).name.clone(),
                row.mode.name().to_owned(),
                if row.shifted { "shifted" } else { "as it is" }.to_owned(),
                outcome.to_owned(),
                reason.to_owned(),
                x,
                y,
                z,
                angle(touch.normal.truncate().to_angle()),
                angle(touch.residual_rad),
                angle(touch.turned_rad),
                format!("{:.4}", touch.budget_s),
                optional(touch.travel_s),
                optional(touch.used.map(|used| 1e3 * used.offset_m)),
            ])?;
        }
    }
    file.flush()
}
