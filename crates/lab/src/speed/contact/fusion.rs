//! Fusion of an estimate with gaze and surfaces: time of a prediction against its error.

use crate::report::{Gap, titled};
use crate::rooms::people::{self, Condition, StudyPeople, StudySize, Telling};
use crate::rooms::room::Room;
use crate::rooms::scores::{TouchPredictions, summary};
use crate::rooms::setting::counted_surfaces;
use crate::speed::contact::estimators::{AT, SHARES};
use crate::speed::page::multiples::{Axis, Line, Panel, Point};
use crate::speed::page::section::{Figure, Section, median_and_p99, quoted};
use hwall_contact::score::Moment;
use hwall_contact::{Combination, FusedConfig, FusedPredictor, LearnedConfig, LearnedModel};
use hwall_stage::training;
use hwall_testkit::Timing;

/// The probability of a surface that is not among the predictions.
const LEAST: f64 = 1e-3;

/// Mean of `-ln p` of the touched surface, and mean number of predictions, at the shares of the time.
fn surprise(touches: &[TouchPredictions]) -> [f64; 2] {
    let (mut score, mut predictions) = (0.0, 0);
    for (t, share) in touches.iter().flat_map(|t| SHARES.map(|share| (t, share))) {
        let t_s = t.touch.start_s + share * (t.touch.contact_s - t.touch.start_s);
        let by_then = t.early.iter().chain(&t.samples);
        let by_then = by_then.take_while(|s| s.t_s <= t_s);
        let last = by_then.filter(|s| s.count > 0).last();
        predictions += last.map_or(0, |s| s.count);
        score -= last.map_or(0.0, |s| s.of_touched).max(LEAST).ln();
    }
    let count = (touches.len() * SHARES.len()).max(1) as f64;
    // Not "-0.000" where nothing else was possible.
    [score / count + 0.0, predictions as f64 / count]
}

/// Fusion with gaze and surfaces, by the number of rays of a hypothesis.
///
/// # Errors
/// Whatever training and prediction refuse.
pub fn fusion(seed: u64) -> anyhow::Result<Section> {
    let condition = Condition::usual();
    let size = StudySize {
        participants: 16,
        seed,
        ..StudySize::default()
    };
    let mut table = titled(&format!(
        "touchable surfaces | rays of each | median | p99 | right surface at 50 / 70 / 90 %, % | log score | {AT} | predictions"
    ));
    let mut summary_rows = Vec::new();
    let (mut points, mut surprises) = (Vec::new(), Vec::new());
    for count in [1, 6, 12] {
        let room = Room::new(count)?;
        let StudyPeople {
            training: train,
            participants,
        } = people::people(&room, &condition, &size)?;
        let config = LearnedConfig {
            combination: Combination::Both,
            ..LearnedConfig::default()
        };
        let estimator = LearnedModel::train(&training::reaches(&train)?, &config)?.estimator();
        let evidence = training::evidence_model(&train, |_| estimator.clone())?;
        let (mut point, mut of_surface) = (Vec::new(), Vec::new());
        for rays in [3, 7, 19, 37, 75] {
            let config = FusedConfig {
                evidence,
                rays,
                ..FusedConfig::default()
            };
            let mut predictor = FusedPredictor::new(estimator.clone(), config)?;
            let touches =
                people::predictions(&mut predictor, &room, &participants, Telling::Nothing)?;
            let [log_score, predictions] = surprise(&touches);
            let samples = touches.iter().flat_map(|t| &t.samples);
            let timing = Timing::from_samples_ns(samples.map(|s| 1e3 * s.took_us).collect());
            let at = SHARES.map(|share| summary(&touches, Moment::Share(share)));
            let right = at.map(|s| 100.0 * s.right);
            let median_mm = at.map(|s| 1e3 * s.points.median_m);
            let listed = |values: [f64; 3]| values.map(|v| format!("{v:.1}")).join(" / ");
            let [median, p99] = median_and_p99(&timing);
            table.row([
                count.to_string(),
                rays.to_string(),
                median,
                p99,
                listed(right),
                format!("{log_score:.3}"),
                listed(median_mm),
                format!("{predictions:.1}"),
            ]);
            // On a single surface rays decide nothing.
            let label = match count {
                1 => String::new(),
                _ => rays.to_string(),
            };
            let at = |y: f64| Point {
                label: label.clone(),
                ..Point::at(timing.median_ns, y)
            };
            point.push(at(median_mm[1]));
            of_surface.push(at(log_score));
            if rays == FusedConfig::default().rays && count == 6 {
                let error = format!(
                    "{:.0} mm (median), {:.0} % the right surface at 70 % of a reach",
                    median_mm[1], right[1]
                );
                let what = "ranked surfaces and points, 6 surfaces";
                summary_rows = vec![quoted("contact", what, &timing, error)];
            }
        }
        points.push(Line::new(counted_surfaces(count), point));
        // With a single surface there is nothing to rank.
        if count > 1 {
            surprises.push(Line::new(counted_surfaces(count), of_surface));
        }
    }
    let time = Axis::time("median time of a prediction");
    let panels = vec![
        Panel {
            title: "point, at 70 % of the time",
            axes: [time.clone(), Axis::number("median error, mm")],
            lines: points,
        },
        Panel {
            title: "surface, at 50, 70 and 90 % of the time",
            axes: [time, Axis::number("log score")],
            lines: surprises,
        },
    ];
    let title =
        "Fused prediction: error by the time of a prediction; numbers are rays of a hypothesis";
    let gaps: [Gap<'_>; 4] = [
        ("touches", &size.touches),
        ("seed", &seed),
        ("least", &LEAST),
        ("table", &table),
    ];
    Ok(Section {
        figure: Some(Figure {
            name: "contact_fusion.svg",
            title,
            panels,
        }),
        ..Section::of(include_str!("../text/fusion.md"), &gaps, summary_rows)?
    })
}
