//! Leave-one-out error of the predicted end of recorded reaches: the filters beside simple means.

use crate::bip::held_out::{GROUPS, ablation, leave_one_out};
use crate::bip::recordings::{Reaches, read};
use hwall_bip::{EndPrediction, Evaluation};
use hwall_testkit::{MarkdownTable, quantile};
use std::fmt::Write as _;
use std::path::Path;

/// Shares of the samples after which the end is predicted.
pub const FRACTIONS: [f64; 7] = [0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 1.0];
/// Fewer reaches than this are an illustration, not a result.
const FEW: usize = 10;
/// One predictor over all held-out reaches.
#[derive(Debug, Clone)]
pub struct Row {
    /// Name for tables and legends.
    pub name: String,
    /// Its predictions. Those of a predictor without uncertainty have a deviation of 0.
    pub evaluation: Evaluation,
}

impl Row {
    /// Median distance of the predicted from the true end after a share of the motion, mm.
    #[must_use]
    pub fn median_mm(&self, fraction: f64) -> f64 {
        let distance = |p: &EndPrediction| 1e3 * p.distance(&[0, 1, 2]);
        let mut errors: Vec<f64> = self.evaluation.at(fraction).map(distance).collect();
        errors.sort_by(f64::total_cmp);
        quantile(&errors, 0.5)
    }

    /// Shares of 50 % and 90 % intervals, per axis, that hold the truth, and mean CRPS per axis,
    /// mm; after 10 to 90 % of the motion. `None` without uncertainty.
    #[must_use]
    pub fn calibration(&self) -> Option<[f64; 3]> {
        let under_way = |p: &&EndPrediction| p.fraction < 0.95;
        let predictions = self.evaluation.predictions.iter().filter(under_way);
        let part = Evaluation {
            predictions: predictions.cloned().collect(),
        };
        let uncertain = part
            .predictions
            .iter()
            .all(|p| p.sd.iter().all(|s| *s > 0.0));
        let axes = [0, 1, 2];
        let values = [
            part.coverage(&axes, 0.5),
            part.coverage(&axes, 0.9),
            1e3 * part.crps(&axes),
        ];
        (uncertain && !part.predictions.is_empty()).then_some(values)
    }
}

/// All predictors on one source of reaches.
#[derive(Debug, Clone)]
pub struct Study {
    /// The source.
    pub reaches: Reaches,
    /// Every reach held out by itself.
    pub rows: Vec<Row>,
    /// Variations of the filter; every fifth reach held out together. Empty for few reaches.
    pub ablation: Vec<Row>,
}

/// Everything that the recordings say.
#[derive(Debug, Clone)]
pub struct Report {
    /// Markdown, from a third-level heading a source.
    pub text: String,
    /// What the text and the figures are made of.
    pub studies: Vec<Study>,
}

/// Studies every source of recordings under a folder.
///
/// # Errors
/// No recordings there, or a file that is none.
pub fn recordings_report(dir: &Path) -> anyhow::Result<Report> {
    let mut studies = Vec::new();
    let mut text = String::from(
        "Median distance of the predicted from the measured end, mm, over reaches that were held out \
         one at a time (training, tuning and regression saw only the others), after shares of the samples. \
         Intervals are per axis; they and the CRPS are averages over 10 to 90 % of the motion.\n",
    );
    for reaches in read(dir)? {
        let few = reaches.demonstrations.len() < FEW;
        let study = Study {
            rows: leave_one_out(&reaches)?,
            ablation: if few { Vec::new() } else { ablation(&reaches)? },
            reaches,
        };
        write!(text, "\n{}", markdown(&study))?;
        studies.push(study);
    }
    Ok(Report { text, studies })
}

fn markdown(study: &Study) -> String {
    let set = &study.reaches;
    let (length_m, duration_s) = set.size();
    let n = set.demonstrations.len();
    let mut text = format!(
        "### {}: {n} reaches of {length_m:.2} m and {duration_s:.2} s (medians)\n\n{}.",
        set.name, set.source
    );
    if n < FEW {
        text += " Too few for conclusions: an illustration.";
    }
    if !set.left_out.is_empty() {
        text += &format!(" Left out: {}.", set.left_out.join("; "));
    }
    text += &format!("\n\n{}", table(&study.rows));
    if !study.ablation.is_empty() {
        text += &format!(
            "\nVariations of the tuned filter; here {GROUPS} groups, each held out as a whole.\n\n{}",
            table(&study.ablation)
        );
    }
    text
}

fn table(rows: &[Row]) -> MarkdownTable {
    let shares = FRACTIONS.map(|f| format!("{:.0} %", 100.0 * f));
    let columns = ["predictor".to_owned()].into_iter().chain(shares);
    let calibration = ["in 50 %", "in 90 %", "CRPS"].map(str::to_owned);
    let mut table = MarkdownTable::new(columns.chain(calibration));
    for row in rows {
        let mut cells = vec![row.name.clone()];
        cells.extend(FRACTIONS.map(|f| format!("{:.1}", row.median_mm(f))));
        cells.extend(match row.calibration() {
            Some([half, most, crps]) => [
                format!("{half:.2}"),
                format!("{most:.2}"),
                format!("{crps:.1}"),
            ],
            None => ["", "", ""].map(str::to_owned),
        });
        table.row(cells);
    }
    table
}
