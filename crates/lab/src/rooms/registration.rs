//! A tracker that stands elsewhere than is believed, and what touches tell of that.

use crate::rooms::contenders::SharedTraining;
use crate::rooms::people::{Telling, predictions_told};
use crate::rooms::room::Room;
use crate::rooms::scores::{Summary, TouchPredictions, summary_among};
use glam::{DMat3, DQuat, DVec3};
use hwall_contact::score::Moment;
use hwall_contact::{FusedConfig, RegistrationConfig};
use hwall_hand::Pose;
use hwall_stage::training::Stream;
use hwall_testkit::{MarkdownTable, Sampler};

/// The heading of the part.
pub const HEADING: &str = "### What touches tell of the registration";
/// Touches made before, from the first number up to the second.
const TOUCHES: [(usize, usize); 5] = [(0, 1), (1, 3), (3, 6), (6, 9), (9, usize::MAX)];
/// Errors of registration that each person is seen with.
const DRAWS: usize = 3;
/// Late enough that the error of the registration is not small beside that of the prediction.
const MOMENT: Moment = Moment::Share(0.9);

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
    let constant = &training.config;
    let learnt = FusedConfig {
        registration: Some(learning),
        ..constant.clone()
    };
    let mut sampler = Sampler::new(seed);
    let seen = errors(&mut sampler, &learning, DRAWS * participants.len());
    let displaced: Vec<Stream> = seen
        .iter()
        .zip(participants.iter().cycle())
        .map(|(seen_from_true, stream)| {
            let frames = stream.frames.iter().map(|f| f.transformed(seen_from_true));
            Stream::new(frames.collect(), stream.touches.clone())
        })
        .collect();
    let run = |config: &FusedConfig, streams: &[Stream]| {
        let mut fused = training.fused(config)?;
        predictions_told(fused.predictor.as_mut(), room, streams, Telling::Touches)
    };
    let exact = run(constant, participants)?;
    let exact_learnt = run(&learnt, participants)?;
    let off = run(constant, &displaced)?;
    let corrected = run(&learnt, &displaced)?;
    let made = |streams: &[Stream]| -> Vec<usize> {
        streams.iter().flat_map(|s| 0..s.touches.len()).collect()
    };
    let (made_exact, made_off) = (made(participants), made(&displaced));
    let mut table = MarkdownTable::new([
        "touches made",
        "touches judged",
        "tracker exact, mean error, mm (50 / 70 / 90 % regions hold, %)",
        "the same, registration learnt",
        "tracker off",
        "tracker off, registration learnt",
    ]);
    for (from, to) in TOUCHES {
        let cell = |touches: &[TouchPredictions], made: &[usize]| {
            let chosen = |index: usize| (from..to).contains(&made[index]);
            described(&summary_among(touches, MOMENT, chosen))
        };
        let range = match to {
            usize::MAX => format!("{from} and more"),
            _ if to == from + 1 => from.to_string(),
            _ => format!("{from} to {}", to - 1),
        };
        let judged = made_off.iter().filter(|made| (from..to).contains(*made));
        table.row([
            range,
            judged.count().to_string(),
            cell(&exact, &made_exact),
            cell(&exact_learnt, &made_exact),
            cell(&off, &made_off),
            cell(&corrected, &made_off),
        ]);
    }
    Ok(format!(
        "{HEADING}\n\nRoom of six, at {} of the time; everybody's touches are told. Off: the tracker is displaced from the scene by \
         {:.0} mm in each axis and turned by {:.1} degrees about each (standard deviations, drawn anew for each of {} people), \
         which is what the fusion assumes; learnt: `FusedConfig::registration`. What is told of a touch is where the tracker saw the \
         finger; along a wall that tells nothing.\n\n{table}",
        MOMENT.name(),
        1e3 * learning.offset_sd_m,
        learning.turn_sd_rad.to_degrees(),
        seen.len(),
    ))
}

fn described(summary: &Summary) -> String {
    let percent = |share: f64| format!("{:.0}", 100.0 * share);
    let within = summary.within.map(|within| within.map(percent).join(" / "));
    format!(
        "{:.1} ({})",
        1e3 * summary.mean_m,
        within.unwrap_or_else(|| "none".to_owned())
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
