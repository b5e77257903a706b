//! Fusion of an estimate with gaze and surfaces: time of a prediction against its error.

use crate::contact::moments::Moment;
use crate::rooms::people::{self as contact_rooms, Condition, Room};
use crate::rooms::scores::{self as rooms_scores, Told};
use crate::speed::contact::{AT, SHARES};
use crate::speed::multiples::{Axis, Line, Panel, Point};
use crate::speed::tables::{Figure, Section, summary};
use hwall_contact::{
    Combination, ContactPrediction, FusedConfig, FusedPredictor, GazeModel, LearnedConfig,
    LearnedEstimator, LearnedModel, Predictor, PredictorInput,
};
use hwall_scene::{Scene, SurfaceId};
use hwall_stage::training::{self, Stream};
use hwall_testkit::{MarkdownTable, Timing, format_ns};

/// A surface that is not among the answers counts as this probable.
const LEAST: f64 = 1e-3;

/// A fused predictor that may be kept from the gaze, and what it said of the surfaces.
struct Listener {
    predictor: FusedPredictor<LearnedEstimator>,
    gaze: bool,
    /// Time, s, surface and its probability.
    said: Vec<(f64, SurfaceId, f64)>,
}

impl Predictor for Listener {
    fn predict(&mut self, scene: &Scene, seen: &PredictorInput<'_>) -> &[ContactPrediction] {
        let seen = PredictorInput {
            gaze: seen.gaze.filter(|_| self.gaze),
            ..*seen
        };
        let answers = self.predictor.predict(scene, &seen);
        let one = |a: &ContactPrediction| (seen.frame.t_s, a.surface, a.probability);
        self.said.extend(answers.iter().map(one));
        answers
    }
}

/// What was said of all touches, and how surprising the touched surfaces were.
struct Heard {
    told: Vec<Told>,
    /// Mean of `-ln p` over the shares.
    log_score: f64,
    /// Mean number of answers.
    answers: f64,
}

fn hear(
    predictor: &FusedPredictor<LearnedEstimator>,
    gaze: bool,
    room: &Room,
    people: &[Stream],
    condition: &Condition,
) -> anyhow::Result<Heard> {
    let mut all = Vec::new();
    let (mut scores, mut answers) = (Vec::new(), 0);
    for person in people {
        let mut listener = Listener {
            predictor: predictor.clone(),
            gaze,
            said: Vec::with_capacity(1 << 16),
        };
        let person = std::slice::from_ref(person);
        let told = contact_rooms::listen(&mut listener, room, person, condition)?;
        let said = &listener.said;
        for touch in told.iter().map(|t| &t.touch) {
            for share in SHARES {
                let t_s = touch.start_s + share * (touch.contact_s - touch.start_s);
                let until = said.partition_point(|s| s.0 <= t_s);
                let last = said[..until].last().map_or(t_s, |s| s.0);
                let now = said[..until].iter().rev().take_while(|s| s.0 == last);
                answers += now.clone().count();
                let right = now.filter(|s| s.1 == touch.surface).map(|s| s.2);
                scores.push(-right.fold(0.0, f64::max).max(LEAST).ln());
            }
        }
        all.extend(told);
    }
    let count = scores.len().max(1) as f64;
    Ok(Heard {
        told: all,
        // Not "-0.000" where nothing else was possible.
        log_score: scores.iter().sum::<f64>() / count + 0.0,
        answers: answers as f64 / count,
    })
}

/// Fusion with gaze and surfaces: by the number of rays of a hypothesis, and of hypotheses.
///
/// # Errors
/// None in practice: rooms and people are made here.
pub fn fusion(seed: u64) -> anyhow::Result<Section> {
    let condition = Condition::usual();
    let cast = contact_rooms::Cast {
        people: [12, 16],
        seed,
        ..contact_rooms::Cast::default()
    };
    let mut table = MarkdownTable::new([
        "touchable surfaces",
        "hypotheses, at most",
        "rays of each",
        "median",
        "p99",
        "right surface at 50 / 70 / 90 %, %",
        "log score",
        AT,
        "answers",
    ]);
    let mut quoted = Vec::new();
    let (mut points, mut surprises) = (Vec::new(), Vec::new());
    for count in [1, 6, 12] {
        let room = Room::new(count)?;
        let [train, test] = contact_rooms::streams(&room, &condition, &cast)?;
        let reaches = training::reaches(&train, condition.person.gaze_noise_rad)?;
        let estimator = LearnedModel::train(
            &reaches,
            &LearnedConfig {
                combination: Combination::Both,
                ..LearnedConfig::default()
            },
        )?
        .estimator();
        let gaze = GazeModel::default().fit(&reaches)?;
        let mut line = [Vec::new(), Vec::new()];
        let hypotheses = [(1, 19), (2, 19)].into_iter();
        let rays = [3, 7, 19, 37, 75].map(|rays| (3, rays));
        for (hypotheses, rays) in hypotheses.chain(rays) {
            let mut config = FusedConfig {
                gaze,
                rays,
                ..FusedConfig::default()
            };
            if hypotheses == 2 {
                // The fixation before is forgotten at once.
                config.gaze.memory_s = 1e-6;
            }
            let sees = hypotheses > 1;
            let predictor = FusedPredictor::new(estimator.clone(), config)?;
            let heard = hear(&predictor, sees, &room, &test, &condition)?;
            let times = heard.told.iter().flat_map(|t| &t.heard);
            let timing = Timing::from_samples_ns(times.map(|h| 1e3 * h.took_us).collect());
            let at = SHARES.map(|share| rooms_scores::summary(&heard.told, Moment::Share(share)));
            table.row([
                count.to_string(),
                hypotheses.to_string(),
                rays.to_string(),
                format_ns(timing.median_ns),
                format_ns(timing.p99_ns),
                at.map(|s| format!("{:.1}", 100.0 * s.right)).join(" / "),
                format!("{:.3}", heard.log_score),
                at.map(|s| format!("{:.1}", 1e3 * s.median_m)).join(" / "),
                format!("{:.1}", heard.answers),
            ]);
            if hypotheses == 3 {
                let point = |y: f64| Point {
                    at: (timing.median_ns, y),
                    label: rays.to_string(),
                    ..Point::default()
                };
                line[0].push(point(1e3 * at[1].median_m));
                line[1].push(point(heard.log_score));
            }
            if hypotheses == 3 && rays == FusedConfig::default().rays && count == 6 {
                quoted = vec![summary(
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
        // A single surface is no surprise.
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
    Ok(Section {
        text: format!(
            "### Fusion with gaze and surfaces\n\nSimulated people touch rooms of 1, 6 and 12 touchable surfaces: 12 people to \
             learn from, 16 others to be judged by, {} touches of each, seed {seed}. Times are of a prediction, the \
             estimator included. Log score: mean of -ln p of the touched surface at 50, 70 and 90 % of the time, p at \
             least {LEAST}; 0 is perfect. One hypothesis: no gaze; two: the present line of sight too; three: also the fixation before.\n\n{table}",
            cast.touches
        ),
        figure: Some(Figure::panels(
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
        )),
        summary: quoted,
    })
}
