//! A tracker that stands elsewhere than is believed, and what touches tell of that.

use crate::contact::tables::range_of;
use crate::report::{fill, titled};
use crate::rooms::contenders::SharedTraining;
use crate::rooms::people::{Telling, predictions};
use crate::rooms::room::Room;
use crate::rooms::scores::{Summary, TouchPredictions, summary};
use crate::rooms::tables::regions;
use glam::{DMat3, DQuat, DVec3};
use hwall_contact::score::Moment;
use hwall_contact::{FusedConfig, MeasuredTouch, RegistrationConfig, RegistrationEstimator};
use hwall_hand::Pose;
use hwall_stage::training::Stream;
use hwall_testkit::Sampler;
use std::ops::Range;

/// Touches made before, from the first number up to the second.
const TOUCHES: [(usize, usize); 5] = [(0, 1), (1, 3), (3, 6), (6, 9), (9, usize::MAX)];
/// Errors of registration that each person is seen with.
const DRAWS: usize = 3;
/// Late enough that the error of the registration is not small beside that of the prediction.
const MOMENT: Moment = Moment::Share(0.9);

/// People as a tracker sees them that is displaced from the scene, and by what.
pub struct Displaced {
    /// Samples as seen; touches where they are.
    pub streams: Vec<Stream>,
    /// What the tracker is off by, person by person.
    pub seen_from_true: Vec<Pose>,
}

impl Displaced {
    /// Every participant under `draws` errors as large as the settings say.
    pub fn draw(
        participants: &[Stream],
        config: &RegistrationConfig,
        draws: usize,
        seed: u64,
    ) -> Self {
        let mut sampler = Sampler::new(seed);
        let seen_from_true = errors(&mut sampler, config, draws * participants.len());
        let seen = |(seen_from_true, stream): (&Pose, &Stream)| {
            let frames = stream.frames.iter().map(|f| f.transformed(seen_from_true));
            Stream::new(frames.collect(), stream.touches.clone())
        };
        let people = seen_from_true.iter().zip(participants.iter().cycle());
        Self {
            streams: people.map(seen).collect(),
            seen_from_true,
        }
    }
}

/// What is left of the errors of registration at the next place that is touched.
#[derive(Debug, Clone, Copy)]
pub struct Left {
    /// Touches made before, at least.
    pub touches: usize,
    /// Root mean square across the surface, m.
    pub across_m: f64,
    /// Root mean square in each direction along it, m.
    pub along_m: f64,
    /// Share of the 90 % regions in space that hold it.
    pub in_90: f64,
}

/// Errors of registration that are left after more and more touches, by the ranges of the tables.
///
/// # Errors
/// Settings that the estimator refuses.
pub fn left(displaced: &Displaced, config: &RegistrationConfig) -> anyhow::Result<Vec<Left>> {
    let mut sums = TOUCHES.map(|_| [0.0; 4]);
    for (stream, seen_from_true) in displaced.streams.iter().zip(&displaced.seen_from_true) {
        let mut estimator = RegistrationEstimator::new(*config)?;
        for (made, touch) in stream.touches.iter().enumerate() {
            let seen_m = seen_from_true.transform_point(touch.target_m);
            let off_m = estimator.true_from_seen().transform_point(seen_m) - touch.target_m;
            let across_m = off_m.dot(touch.normal);
            let deviations = off_m.dot(estimator.covariance_m2(seen_m).inverse() * off_m);
            let mut ranges = TOUCHES.iter().zip(&mut sums);
            if let Some((_, sum)) = ranges.find(|((from, to), _)| (*from..*to).contains(&made)) {
                sum[0] += 1.0;
                sum[1] += across_m * across_m;
                sum[2] += 0.5 * (off_m.length_squared() - across_m * across_m);
                sum[3] += f64::from(deviations <= IN_90_OF_THREE);
            }
            let first_after = stream.frames.iter().find(|f| f.t_s >= touch.contact_s);
            let Some(tip) = first_after.and_then(|f| f.contact_point()) else {
                continue;
            };
            estimator.touched(&MeasuredTouch {
                seen_m: tip.position_m,
                surface_m: touch.target_m,
                normal: touch.normal,
                located_sd_m: None,
            })?;
        }
    }
    let of = |((touches, _), [count, across, along, inside]): ((usize, usize), [f64; 4])| Left {
        touches,
        across_m: (across / count).sqrt(),
        along_m: (along / count).sqrt(),
        in_90: inside / count,
    };
    Ok(TOUCHES.into_iter().zip(sums).map(of).collect())
}

/// 90 % of a normal distribution in three dimensions, squared deviations.
const IN_90_OF_THREE: f64 = 6.251;

/// Error and regions against touches made, for people seen with errors of registration as large as the settings say.
///
/// # Errors
/// Settings that the predictor or a filter refuses.
pub fn section(
    training: &SharedTraining,
    room: &Room,
    participants: &[Stream],
    seed: u64,
) -> anyhow::Result<String> {
    let learning = RegistrationConfig::default();
    let constant = FusedConfig {
        registration_sd_m: learning.offset_sd_m,
        ..training.config.clone()
    };
    let learnt = FusedConfig {
        registration: Some(learning),
        ..constant.clone()
    };
    let displaced = Displaced::draw(participants, &learning, DRAWS, seed);
    let run = |config: &FusedConfig, streams: &[Stream]| {
        let mut fused = training.fused(config)?;
        let predicted = predictions(fused.predictor.as_mut(), room, streams, Telling::Touches)?;
        // With the touches made before each.
        let made = streams.iter().flat_map(|s| 0..s.touches.len());
        anyhow::Ok(made.zip(predicted).collect::<Vec<_>>())
    };
    let ran = [
        run(&training.config, participants)?,
        run(&learnt, participants)?,
        run(&constant, &displaced.streams)?,
        run(&learnt, &displaced.streams)?,
    ];
    let mut table = titled(
        "touches made | touches judged | registration off, across / along the surface, mm (in 90 %, %) | tracker exact | the \
         same, learnt | tracker off | tracker off, learnt",
    );
    for ((from, to), left) in TOUCHES.into_iter().zip(left(&displaced, &learning)?) {
        let chosen = |run| touched_after(run, from..to);
        let cells = ran
            .each_ref()
            .map(|run| described(&summary(chosen(run), MOMENT)));
        let [across_mm, along_mm] = [left.across_m, left.along_m].map(|m| 1e3 * m);
        let first = [
            range_of(from, to),
            chosen(&ran[3]).count().to_string(),
            format!("{across_mm:.1} / {along_mm:.1} ({:.0})", 100.0 * left.in_90),
        ];
        table.row(first.into_iter().chain(cells));
    }
    fill(
        include_str!("registration.md"),
        &[
            ("offset", &(1e3 * learning.offset_sd_m).round()),
            (
                "turn",
                &format_args!("{:.1}", learning.turn_sd_rad.to_degrees()),
            ),
            ("people", &displaced.streams.len()),
            ("moment", &MOMENT.name()),
            ("table", &table),
        ],
    )
}

/// Touches with so many made before.
fn touched_after(
    run: &[(usize, TouchPredictions)],
    made: Range<usize>,
) -> impl Iterator<Item = &TouchPredictions> {
    let chosen = run.iter().filter(move |(before, _)| made.contains(before));
    chosen.map(|(_, touch)| touch)
}

fn described(summary: &Summary) -> String {
    format!(
        "{:.1}, {:.0} ({})",
        1e3 * summary.points.median_m,
        100.0 * summary.right,
        regions(summary)
    )
}

/// Draws of `seen_from_true`.
fn errors(sampler: &mut Sampler, config: &RegistrationConfig, count: usize) -> Vec<Pose> {
    let mut normal = |sd: f64| DVec3::from_array([0; 3].map(|_| sd * sampler.normal()));
    let centre_m = config.centre_m;
    let draw = |_| {
        let offset_m = normal(config.offset_sd_m);
        let turn = DQuat::from_scaled_axis(normal(config.turn_sd_rad));
        let rotation = DMat3::from_quat(turn);
        let true_from_seen = Pose::new(rotation, centre_m - rotation * centre_m + offset_m);
        true_from_seen.unwrap_or(Pose::IDENTITY).inverse()
    };
    (0..count).map(draw).collect()
}
