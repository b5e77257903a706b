//! Fusion of an estimate with gaze and surfaces: time of a prediction against its error.

use crate::rooms::people::{self, Condition, StudyPeople, StudySize};
use crate::rooms::room::Room;
use crate::rooms::scores::{self, TouchPredictions};
use crate::speed::contact::estimators::{AT, SHARES};
use crate::speed::page::multiples::{Axis, Line, Panel, Point};
use crate::speed::page::section::{Figure, Section, SummaryRow};
use hwall_contact::score::Moment;
use hwall_contact::{
    Combination, ContactPrediction, FusedConfig, FusedPredictor, LearnedConfig, LearnedEstimator,
    LearnedModel, Predictor, PredictorInput,
};
use hwall_scene::{Scene, SurfaceId};
use hwall_stage::training::{self, Stream};
use hwall_testkit::{MarkdownTable, Timing, format_ns};

/// The probability of a surface that is not among the predictions.
const LEAST: f64 = 1e-3;

/// The probability of a surface at a time.
struct SurfaceProbability {
    t_s: f64,
    surface: SurfaceId,
    probability: f64,
}

/// A fused predictor that keeps the probabilities of all surfaces.
struct RecordingPredictor {
    predictor: FusedPredictor<LearnedEstimator>,
    recorded: Vec<SurfaceProbability>,
}

impl Predictor for RecordingPredictor {
    fn predict(&mut self, scene: &Scene, seen: &PredictorInput<'_>) -> &[ContactPrediction] {
        let predictions = self.predictor.predict(scene, seen);
        let probability = |p: &ContactPrediction| SurfaceProbability {
            t_s: seen.frame.t_s,
            surface: p.surface,
            probability: p.probability,
        };
        self.recorded.extend(predictions.iter().map(probability));
        predictions
    }
}

/// The predictions for all touches.
struct Run {
    touches: Vec<TouchPredictions>,
    /// Mean of `-ln p` of the touched surface, at the shares of the time.
    log_score: f64,
    /// Mean number of predictions.
    predictions: f64,
}

fn run(
    predictor: &FusedPredictor<LearnedEstimator>,
    room: &Room,
    people: &[Stream],
) -> anyhow::Result<Run> {
    let mut all = Vec::new();
    let (mut scores, mut predictions) = (Vec::new(), 0);
    for person in people {
        let mut recording = RecordingPredictor {
            predictor: predictor.clone(),
            recorded: Vec::with_capacity(1 << 16),
        };
        let person = std::slice::from_ref(person);
        let touches = people::predictions(&mut recording, room, person)?;
        let recorded = &recording.recorded;
        for touch in touches.iter().map(|t| &t.touch) {
            for share in SHARES {
                let t_s = touch.start_s + share * (touch.contact_s - touch.start_s);
                let until = recorded.partition_point(|r| r.t_s <= t_s);
                let last_s = recorded[..until].last().map_or(t_s, |r| r.t_s);
                let now = recorded[..until].iter().rev();
                let now = now.take_while(|r| r.t_s == last_s);
                predictions += now.clone().count();
                let right = now
                    .filter(|r| r.surface == touch.surface)
                    .map(|r| r.probability);
                scores.push(-right.fold(0.0, f64::max).max(LEAST).ln());
            }
        }
        all.extend(touches);
    }
    let count = scores.len().max(1) as f64;
    Ok(Run {
        touches: all,
        // Not "-0.000" where nothing else was possible.
        log_score: scores.iter().sum::<f64>() / count + 0.0,
        predictions: predictions as f64 / count,
    })
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
    let mut table = MarkdownTable::new([
        "touchable surfaces",
        "rays of each",
        "median",
        "p99",
        "right surface at 50 / 70 / 90 %, %",
        "log score",
        AT,
        "predictions",
    ]);
    let mut quoted = Vec::new();
    let (mut points, mut surprises) = (Vec::new(), Vec::new());
    for count in [1, 6, 12] {
        let room = Room::new(count)?;
        let StudyPeople {
            training: train,
            participants,
        } = people::people(&room, &condition, &size)?;
        let reaches = training::reaches(&train)?;
        let estimator = LearnedModel::train(
            &reaches,
            &LearnedConfig {
                combination: Combination::Both,
                ..LearnedConfig::default()
            },
        )?
        .estimator();
        let gaze = training::gaze_model(&train, |_| estimator.clone())?;
        let mut line = [Vec::new(), Vec::new()];
        for rays in [3, 7, 19, 37, 75] {
            let config = FusedConfig {
                gaze,
                rays,
                ..FusedConfig::default()
            };
            let predictor = FusedPredictor::new(estimator.clone(), config)?;
            let run = run(&predictor, &room, &participants)?;
            let samples = run.touches.iter().flat_map(|t| &t.samples);
            let timing = Timing::from_samples_ns(samples.map(|s| 1e3 * s.took_us).collect());
            let at = SHARES.map(|share| scores::summary(&run.touches, Moment::Share(share)));
            table.row([
                count.to_string(),
                rays.to_string(),
                format_ns(timing.median_ns),
                format_ns(timing.p99_ns),
                at.map(|s| format!("{:.1}", 100.0 * s.right)).join(" / "),
                format!("{:.3}", run.log_score),
                at.map(|s| format!("{:.1}", 1e3 * s.median_m)).join(" / "),
                format!("{:.1}", run.predictions),
            ]);
            let point = |y: f64| Point {
                at: (timing.median_ns, y),
                // On a single surface rays decide nothing.
                label: match count {
                    1 => String::new(),
                    _ => rays.to_string(),
                },
                ..Point::default()
            };
            line[0].push(point(1e3 * at[1].median_m));
            line[1].push(point(run.log_score));
            if rays == FusedConfig::default().rays && count == 6 {
                quoted = vec![SummaryRow::new(
                    "contact",
                    "ranked surfaces and points, 6 surfaces",
                    &timing,
                    format!(
                        "{:.0} mm (median), {:.0} % the right surface at 70 % of a reach",
                        1e3 * at[1].median_m,
                        100.0 * at[1].right
                    ),
                )];
            }
        }
        let name = match count {
            1 => "1 surface".to_owned(),
            _ => format!("{count} surfaces"),
        };
        let [point, surprise] = line;
        points.push(Line {
            name: name.clone(),
            points: point,
        });
        // With a single surface there is nothing to rank.
        if count > 1 {
            surprises.push(Line {
                name,
                points: surprise,
            });
        }
    }
    let title =
        "Fused prediction: error by the time of a prediction; numbers are rays of a hypothesis";
    let time = Axis::Time("median time of a prediction");
    Ok(Section::of(format!(
            "### Fusion with gaze and surfaces\n\nSimulated people touch rooms of 1, 6 and 12 touchable surfaces: 12 people to \
             learn from, 16 others to be judged by, {} touches of each, seed {seed}. Times are of a prediction, the \
             estimator included. Log score: mean of -ln p of the touched surface at 50, 70 and 90 % of the time, p at \
             least {LEAST}; 0 is perfect. Hypotheses are six at most: where the motion leads, the present look, the look before, and whatever else. Without gaze (two) the right surface was named at 50 % of the time in 96 % of the touches of 6 surfaces instead of 99.5 %, without the look before (four) as often.\n\n{table}",
            size.touches
        ), quoted).drawn(Figure::panels(
            "contact_fusion.svg",
            title,
            2,
            vec![
                Panel {
                    title: "point, at 70 % of the time".to_owned(),
                    axes: [time, Axis::Number("median error, mm")],
                    lines: points,
                },
                Panel {
                    title: "surface, at 50, 70 and 90 % of the time".to_owned(),
                    axes: [time, Axis::Number("log score")],
                    lines: surprises,
                },
            ],
        )))
}
