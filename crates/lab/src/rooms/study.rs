//! Predictions with a scene, in rooms of more and more surfaces and under worse and worse conditions.

use crate::contact::figures::{ErrorLine, errors};
use crate::report::{Gap, fill, quantiles, titled, yes_or_no};
use crate::rooms::contenders::{FUSED, NO_GAZE, RAY_CAST, RAY_LED};
use crate::rooms::figures::{self, ShownMoment, TouchPicture};
use crate::rooms::people::{self, Condition, StudySize, Telling};
use crate::rooms::room::ROOMS;
use crate::rooms::scores::{Bin, gained_s, reliability, summary};
use crate::rooms::setting::{Setting, counted_surfaces};
use crate::rooms::{registration, rows, tables};
use anyhow::Context;
use hwall_contact::score::Moment;
use hwall_stage::figures::COLOURS;
use plotters::style::Color;
use rayon::prelude::*;
use std::path::Path;

/// People and touches of the report; enough participants to tell shares near 100 % apart.
const SIZE: StudySize = StudySize {
    training_people: 12,
    participants: 20,
    touches: 12,
    seed: 0,
};
/// The fusion was designed on people of smaller seeds, none of whom is a participant here.
const FIRST_SEED: u64 = 1000;
/// The room that conditions are compared in, and that targets are set for.
const MAIN_ROOM: usize = 6;
/// What this project aims at in the main room: the right surface in this share of the touches ...
const TARGET_RIGHT: f64 = 0.99;
/// ... after this share of the time.
const TARGET_SHARE: f64 = 0.7;
/// Moments of the picture.
const SHOWN: [f64; 4] = [0.3, 0.5, 0.7, 0.9];

/// What the study found.
pub struct RoomsReport {
    /// All of it, Markdown.
    pub text: String,
    /// What stands under `In short`.
    pub in_short: String,
    /// What touches tell of the registration.
    pub registration: String,
}

/// The study. With a folder: `rooms_predictions.csv`, `rooms_scores.csv` and three figures.
///
/// # Errors
/// People who cannot be made, an estimator that cannot be trained, a file that cannot be written.
pub fn report(seed: u64, out: Option<&Path>) -> anyhow::Result<RoomsReport> {
    let size = StudySize {
        seed: FIRST_SEED + seed,
        ..SIZE
    };
    let usual = ROOMS.map(|surfaces| (surfaces, Condition::usual()));
    let worse = Condition::all().into_iter().skip(1);
    let worse = worse.map(|condition| (MAIN_ROOM, condition));
    let places: Vec<(usize, Condition)> = usual.into_iter().chain(worse).collect();
    let mut settings = places
        .into_par_iter()
        .enumerate()
        .map(|(i, (surfaces, condition))| Setting::new(surfaces, condition, &size, i < ROOMS.len()))
        .collect::<anyhow::Result<Vec<_>>>()?;
    // One after the other, so that every prediction is timed with the machine to itself.
    for setting in &mut settings {
        setting.run()?;
    }
    let usual = settings.iter().filter(|s| s.is_usual());
    let main = usual.clone().find(|s| s.surfaces == MAIN_ROOM);
    let main = main.context("the main room")?;
    let pooled = [RAY_CAST, FUSED, NO_GAZE].map(|name| {
        let touches = settings.iter().flat_map(|s| s.touches(name));
        (name, reliability(touches))
    });
    if let Some(folder) = out {
        write_files(folder, &settings, main, &pooled)?;
    }
    let in_short = in_short(usual.clone())?;
    let (training, participants) = (&main.training, &main.participants);
    let registration = registration::section(training, &main.room, participants, size.seed)?;
    let (learnt, judged) = (size.training_people, size.participants);
    let gaps: [Gap<'_>; 14] = [
        ("seed", &size.seed),
        ("learnt", &learnt),
        ("touches", &size.touches),
        ("first", &(learnt + 1)),
        ("last", &(learnt + judged)),
        ("first_seed", &FIRST_SEED),
        ("target", &(100.0 * TARGET_SHARE).round()),
        ("in_short", &in_short),
        ("rooms", &usual.map(room).collect::<String>()),
        ("main", &MAIN_ROOM),
        ("conditions", &conditions(&settings)),
        ("latencies", &latencies(&settings)),
        ("registration", &registration),
        ("reliabilities", &tables::reliabilities(&pooled)),
    ];
    let text = fill(include_str!("study.md"), &gaps)?;
    Ok(RoomsReport {
        text: text.trim_end().to_owned() + "\n",
        in_short,
        registration,
    })
}

fn room(s: &Setting) -> String {
    let all = s.results();
    format!(
        "\n### Room of {}: {} touches, learnt from {}\n\n{}",
        counted_surfaces(s.surfaces),
        all.first().map_or(0, |r| r.touches.len()),
        s.training.reaches.len(),
        tables::markdown(&all)
    )
}

fn conditions(settings: &[Setting]) -> String {
    let mut table = tables::conditions();
    for s in settings.iter().filter(|s| s.surfaces == MAIN_ROOM) {
        let main = s.named([
            RAY_CAST,
            RAY_LED,
            "learned, closest surface",
            FUSED,
            NO_GAZE,
        ]);
        tables::condition_rows(&mut table, &s.condition.name, &main);
    }
    table.to_string()
}

/// From the landing of the eyes to the goal, in all rooms and conditions.
fn latencies(settings: &[Setting]) -> String {
    let mut table = tables::latencies();
    for s in settings {
        let condition = match s.is_usual() {
            true => format!("usual, {}", counted_surfaces(s.surfaces)),
            false => s.condition.name.clone(),
        };
        let shown = s.named([RAY_LED, FUSED, NO_GAZE]);
        tables::latency_rows(&mut table, &condition, &shown);
    }
    table.to_string()
}

/// The target beside the result, then the moments at which the main contender is better.
fn in_short<'a>(settings: impl Iterator<Item = &'a Setting>) -> anyhow::Result<String> {
    let moment = Moment::Share(TARGET_SHARE);
    let mut table = titled(
        "surfaces | touches | target | learned, fused | met | ray cast | lead gained over the ray cast, ms, median",
    );
    let mut better_at = String::new();
    for s in settings {
        let [fused, cast] = [FUSED, RAY_CAST].map(|name| s.touches(name));
        let [right, by_cast] = [fused, cast].map(|touches| summary(touches, moment).right);
        let of = |right: f64| format!("{:.1} %", 100.0 * right);
        let [gained_s] = quantiles(gained_s(fused, cast), [0.5]);
        let (target, met) = match s.surfaces {
            MAIN_ROOM => (
                format!(">= {:.0} %", 100.0 * TARGET_RIGHT),
                yes_or_no(right >= TARGET_RIGHT),
            ),
            _ => ("none set".to_owned(), ""),
        };
        table.row([
            s.surfaces.to_string(),
            fused.len().to_string(),
            target,
            of(right),
            met.to_owned(),
            of(by_cast),
            format!("{:.0}", 1e3 * gained_s),
        ]);
        better_at += &format!("\n{}\n", better(s));
    }
    let gaps: [Gap<'_>; 2] = [("table", &table), ("better", &better_at)];
    fill(include_str!("in_short.md"), &gaps)
}

/// At which moments the main contender has a smaller median error than everyone without the learned
/// estimator.
fn better(s: &Setting) -> String {
    let own = s.touches(FUSED);
    let results = s.results();
    let (mut yes, mut no) = (Vec::new(), Vec::new());
    for moment in Moment::all().filter(|m| *m != Moment::Share(1.0)) {
        let own_m = summary(own, moment).points.median_m;
        let others = results.iter().filter(|r| !r.name.starts_with("learned"));
        let best = others
            .map(|r| (r.name, summary(r.touches, moment).points.median_m))
            .filter(|(_, m)| m.is_finite())
            .min_by(|a, b| a.1.total_cmp(&b.1));
        match best {
            Some((name, best_m)) if own_m >= best_m => no.push(format!(
                "{} ({name}: {:.1} against {:.1} mm)",
                moment.name(),
                1e3 * best_m,
                1e3 * own_m
            )),
            _ => yes.push(moment.name()),
        }
    }
    let [yes, no] = [yes, no].map(|names| match names.is_empty() {
        true => "never".to_owned(),
        false => names.join(", "),
    });
    format!(
        "{}, `{FUSED}` against every ray cast and every baseline, fused or not, by median error: better \
         at {yes}; not at {no}.",
        counted_surfaces(s.surfaces)
    )
}

fn write_files(
    folder: &Path,
    settings: &[Setting],
    main: &Setting,
    pooled: &[(&str, Vec<Bin>)],
) -> anyhow::Result<()> {
    // The predictions of all contenders would fill a hundred megabytes.
    let written = [RAY_CAST, RAY_LED, FUSED];
    rows::predictions(&folder.join("rooms_predictions.csv"), settings, written)?;
    rows::scores(&folder.join("rooms_scores.csv"), settings)?;
    let shown = main.named([
        RAY_CAST,
        RAY_LED,
        "ridge on five frames, closest surface",
        "ridge on five frames, fused",
        "learned, closest surface",
        FUSED,
        NO_GAZE,
    ]);
    let lines = shown.iter().zip(COLOURS);
    let lines: Vec<ErrorLine> = lines
        .map(|(result, colour)| ErrorLine {
            name: result.name.to_owned(),
            points: tables::medians_before(result),
            style: colour.stroke_width(3),
            dashed: false,
        })
        .collect();
    let title = format!("Room of {MAIN_ROOM} surfaces: error before contact");
    errors(&folder.join("rooms_error.svg"), &title, &lines)?;
    let title = "Stated and observed probability of the surface, all rooms, 30 to 90 %";
    figures::reliability(&folder.join("rooms_reliability.svg"), title, pooled)?;
    figures::scene(&folder.join("rooms_scene.svg"), &main.room, &picture(main)?)
}

/// The touch with the median lead gained over the ray cast.
fn picture(s: &Setting) -> anyhow::Result<TouchPicture> {
    let gained = gained_s(s.touches(FUSED), s.touches(RAY_CAST));
    let mut order: Vec<usize> = (0..gained.len()).collect();
    order.sort_by(|&a, &b| gained[a].total_cmp(&gained[b]));
    let middle = *order.get(order.len() / 2).context("a touch")?;
    let people = s.participants.iter().enumerate();
    let mut all = people.flat_map(|(k, person)| (0..person.touches.len()).map(move |i| (k, i)));
    let (person, number) = all.nth(middle).context("a touch")?;
    let one = &s.participants[person..=person];
    let touch = one[0].touches[number];
    let cast = &s.touches(RAY_CAST)[middle];
    let (mut hand_m, mut all) = (Vec::new(), Vec::new());
    let mut fused = s.training.fused(&s.training.config)?;
    let fused = fused.predictor.as_mut();
    people::run(fused, &s.room, one, Telling::Nothing, |sample| {
        let t_s = sample.seen.frame.t_s;
        if sample.touch == number && t_s >= touch.start_s {
            hand_m.extend(sample.seen.hand.map(|h| h.point_m));
            let (first, gaze) = (sample.predictions.first(), sample.seen.gaze.ray());
            all.push((t_s, first.copied(), gaze.copied()));
        }
    })?;
    let shown = SHOWN.into_iter().filter_map(|share| {
        let index = Moment::Share(share).index(all.iter().map(|a| a.0), cast.span())?;
        let (_, fused, gaze) = all[index];
        Some(ShownMoment {
            share,
            fused: fused?,
            gaze,
            cast: cast.samples.get(index)?.first,
        })
    });
    Ok(TouchPicture {
        shown: shown.collect(),
        hand_m,
        target_m: touch.target_m,
        title: format!(
            "A touch of median gain: the fusion is right for good {:.0} ms before the ray cast",
            1e3 * gained[middle]
        ),
    })
}
