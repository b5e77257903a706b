//! Predictions with a scene, in rooms of more and more surfaces and under worse and worse conditions.

use crate::contact::figures::{ErrorLine, errors};
use crate::report::{quantiles, titled};
use crate::rooms::contenders::{Contender, FUSED, NO_GAZE, RAY_CAST, RAY_LED, SharedTraining};
use crate::rooms::figures::{self, ShownMoment, TouchPicture};
use crate::rooms::people::{self, Condition, StudyPeople, StudySize, Telling};
use crate::rooms::registration;
use crate::rooms::room::{ROOMS, Room};
use crate::rooms::scores::{TouchPredictions, gained_s, summary};
use crate::rooms::tables::{self, PooledResult, PredictionRows, PredictorResult, SettingResults};
use anyhow::Context;
use hwall_contact::score::Moment;
use hwall_stage::figures::COLOURS;
use hwall_stage::numbers::counted;
use hwall_stage::training::Stream;
use plotters::style::Color;
use rayon::prelude::*;
use std::fmt::Write;
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

/// One room under one condition, and the results in it.
struct Setting {
    surfaces: usize,
    room: Room,
    condition: Condition,
    participants: Vec<Stream>,
    training: SharedTraining,
    /// Are all contenders run, or only the main ones?
    all_contenders: bool,
    results: Vec<PredictorResult>,
}

/// The study; Markdown. With a folder: `rooms_predictions.csv`, `rooms_scores.csv` and three figures.
///
/// # Errors
/// People who cannot be made, an estimator that cannot be trained, a file that cannot be written.
pub fn report(seed: u64, out: Option<&Path>) -> anyhow::Result<String> {
    let size = StudySize {
        seed: FIRST_SEED + seed,
        ..SIZE
    };
    let usual = ROOMS.map(|surfaces| (surfaces, Condition::usual()));
    let worse = Condition::all().into_iter().skip(1);
    let places: Vec<(usize, Condition)> = usual
        .into_iter()
        .chain(worse.map(|condition| (MAIN_ROOM, condition)))
        .collect();
    let mut settings = places
        .into_par_iter()
        .enumerate()
        .map(|(i, (surfaces, condition))| Setting::new(surfaces, condition, &size, i < ROOMS.len()))
        .collect::<anyhow::Result<Vec<_>>>()?;
    // One after the other, so that every prediction is timed with the machine to itself.
    for setting in &mut settings {
        setting.run()?;
    }
    let text = markdown(&size, &settings)?;
    if let Some(folder) = out {
        write_files(folder, &settings)?;
    }
    Ok(text)
}

impl Setting {
    fn new(
        surfaces: usize,
        condition: Condition,
        size: &StudySize,
        all_contenders: bool,
    ) -> anyhow::Result<Self> {
        let name = || format!("{}, {}", counted_surfaces(surfaces), condition.name);
        let room = Room::new(surfaces)?;
        let StudyPeople {
            training,
            participants,
        } = people::people(&room, &condition, size).with_context(name)?;
        let training = SharedTraining::new(&room.scene, &training).with_context(name)?;
        Ok(Self {
            surfaces,
            room,
            condition,
            participants,
            training,
            all_contenders,
            results: Vec::new(),
        })
    }

    /// Runs the contenders over the participants.
    fn run(&mut self) -> anyhow::Result<()> {
        let contenders = if self.all_contenders {
            self.training.all()
        } else {
            self.training.main()
        };
        for Contender {
            name,
            mut predictor,
        } in contenders?
        {
            let touches = people::predictions(predictor.as_mut(), &self.room, &self.participants)?;
            self.results.push(PredictorResult { name, touches });
        }
        Ok(())
    }

    fn touches(&self, name: &str) -> &[TouchPredictions] {
        let found = self.results.iter().find(|r| r.name == name);
        found.map_or(&[], |r| &r.touches)
    }

    fn named(&self) -> SettingResults<'_> {
        SettingResults {
            surfaces: self.surfaces,
            condition: &self.condition.name,
            results: &self.results,
        }
    }
}

fn counted_surfaces(count: usize) -> String {
    counted(count, "surface", "surfaces")
}

fn bend_name(bend: Option<f64>) -> String {
    bend.map_or_else(|| "none".to_owned(), |b| b.to_string())
}

fn markdown(size: &StudySize, settings: &[Setting]) -> anyhow::Result<String> {
    let StudySize {
        training_people: learnt,
        participants: judged,
        touches,
        seed,
    } = *size;
    let config = settings.first().map(|s| &s.training.config);
    let bend = bend_name(config.and_then(|c| c.bend));
    let mut text = format!(
        "## Rooms of several surfaces, simulated people of seed {seed}\n\n\
         Split: estimators and gaze are trained on people 1 to {learnt} of every room and condition ({touches} \
         touches each); people {} to {} are the participants ({touches} touches each). Touches in which the \
         finger would pass through something are left out of both. The fusion was designed on people of seeds \
         below {FIRST_SEED}, none of whom is here. `bend` is {bend}, its default, chosen on those.\n\n",
        learnt + 1,
        learnt + judged,
    );
    text += &target(settings)?;
    write!(
        text,
        "\nA surface is right if the most probable prediction names it; no prediction counts as wrong. A board of \
         0.2 m is missed if its middle, the prediction, is more than 0.1 m to a side or up or 0.03 m before or \
         behind the touch. Right for good: from then on the surface stays right and the point within 0.05 m. \
         Regions of 50, 70 and 90 % are in the plane of the surface, where it is right. `{RAY_LED}` follows the gaze ray \
         until the hand is within 0.06 m, so the gaze alone has no row of its own.\n"
    )?;
    for s in settings
        .iter()
        .filter(|s| s.condition == Condition::usual())
    {
        write!(text, "\n{}", room_section(s))?;
    }
    write!(
        text,
        "\n### Room of {MAIN_ROOM} under other conditions\n\nTraining people and participants meet the same \
         condition; they are different people.\n\n"
    )?;
    let mut table = tables::conditions();
    for s in settings.iter().filter(|s| s.surfaces == MAIN_ROOM) {
        let main = [
            RAY_CAST,
            RAY_LED,
            "learned, closest surface",
            FUSED,
            NO_GAZE,
        ];
        let results: Vec<PredictorResult> = main
            .iter()
            .map(|name| PredictorResult {
                name: (*name).to_owned(),
                touches: s.touches(name).to_vec(),
            })
            .collect();
        tables::condition_rows(&mut table, &s.condition.name, &results);
    }
    write!(text, "{table}\n{}", latencies(settings))?;
    if let Some(main) = settings
        .iter()
        .find(|s| s.surfaces == MAIN_ROOM && s.condition == Condition::usual())
    {
        let told = registration::section(&main.training, &main.room, &main.participants, size.seed);
        write!(text, "\n{}", told?)?;
    }
    write!(
        text,
        "\n### Are the stated probabilities of the surface right?\n\nAll rooms and conditions together, \
         30 to 90 % of the time: share in which the surface was right.\n\n{}",
        tables::reliabilities(&pooled(settings))
    )?;
    Ok(text)
}

/// From the landing of the eyes to the goal, in all rooms and conditions.
fn latencies(settings: &[Setting]) -> String {
    let mut table = tables::latencies();
    for s in settings {
        let condition = match s.condition == Condition::usual() {
            true => format!("usual, {}", counted_surfaces(s.surfaces)),
            false => s.condition.name.clone(),
        };
        let results: Vec<PredictorResult> = [RAY_LED, FUSED, NO_GAZE]
            .iter()
            .map(|name| PredictorResult {
                name: (*name).to_owned(),
                touches: s.touches(name).to_vec(),
            })
            .collect();
        tables::latency_rows(&mut table, &condition, &results);
    }
    format!(
        "### Gaze-to-goal latency\n\nTime from the landing of the eyes on the target (within 4 degrees) to the first prediction that is \
         right and stays right until the contact: the surface, and the surface with the point within 0.05 m. Where the eyes never rest on \
         the target, time from the start of the hand. `never`: not even at the contact.\n\n{table}"
    )
}

/// The predictions in all settings.
fn pooled(settings: &[Setting]) -> Vec<PooledResult<'_>> {
    [RAY_CAST, FUSED, NO_GAZE]
        .map(|name| PooledResult {
            name,
            touches: settings.iter().flat_map(|s| s.touches(name)).collect(),
        })
        .to_vec()
}

/// The target beside the result.
fn target(settings: &[Setting]) -> anyhow::Result<String> {
    let moment = Moment::Share(TARGET_SHARE);
    let mut table = titled(
        "surfaces | touches | target | learned, fused | met | ray cast | lead gained over the ray cast, ms, median",
    );
    for s in settings
        .iter()
        .filter(|s| s.condition == Condition::usual())
    {
        let [fused, cast] = [FUSED, RAY_CAST].map(|name| s.touches(name));
        let right = summary(fused, moment).right;
        let of = |right: f64| format!("{:.1} %", 100.0 * right);
        let [gained_s] = quantiles(gained_s(fused, cast), [0.5]);
        let main = s.surfaces == MAIN_ROOM;
        table.row([
            s.surfaces.to_string(),
            fused.len().to_string(),
            if main {
                format!(">= {:.0} %", 100.0 * TARGET_RIGHT)
            } else {
                "none set".to_owned()
            },
            of(right),
            match (main, right >= TARGET_RIGHT) {
                (false, _) => "",
                (true, true) => "yes",
                (true, false) => "no",
            }
            .to_owned(),
            of(summary(cast, moment).right),
            format!("{:.0}", 1e3 * gained_s),
        ]);
    }
    let mut text = format!(
        "### In short: the right surface at {:.0} % of the time\n\n{table}",
        100.0 * TARGET_SHARE
    );
    for s in settings
        .iter()
        .filter(|s| s.condition == Condition::usual())
    {
        writeln!(text, "\n{}", better(s))?;
    }
    Ok(text)
}

/// At which moments the main contender has a smaller median error than everyone without the learned
/// estimator.
fn better(s: &Setting) -> String {
    let own = s.touches(FUSED);
    let others = || s.results.iter().filter(|r| !r.name.starts_with("learned"));
    let moments = Moment::all().filter(|m| *m != Moment::Share(1.0));
    let (mut yes, mut no) = (Vec::new(), Vec::new());
    for moment in moments {
        let own_m = summary(own, moment).median_m;
        let best = others()
            .map(|r| (&r.name, summary(&r.touches, moment).median_m))
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
    let list = |names: Vec<String>| {
        if names.is_empty() {
            "never".to_owned()
        } else {
            names.join(", ")
        }
    };
    format!(
        "{}, `{FUSED}` against every ray cast and every baseline, fused or not, by median error: better \
         at {}; not at {}.",
        counted_surfaces(s.surfaces),
        list(yes),
        list(no)
    )
}

fn room_section(s: &Setting) -> String {
    let all = &s.results;
    let touches = all.first().map_or(0, |r| r.touches.len());
    format!(
        "### Room of {}: {touches} touches, learnt from {}\n\n\
         #### Right surface, %\n\n{}\n\
         #### Distance of the predicted from the true point, median / mean, mm\n\n{}\n\
         #### Boards missed, %\n\n{}\n\
         #### Regions of 50 / 70 / 90 % in the plane of the right surface hold the point, %\n\n{}\n\
         #### Per axis, mean / largest error in cm\n\n{}\n\
         #### How sure, how early, how fast\n\n{}",
        counted_surfaces(s.surfaces),
        s.training.reaches(),
        tables::right(all),
        tables::distances(all),
        tables::missed(all),
        tables::coverage(all),
        tables::axes(all),
        tables::sureness(all),
    )
}

fn write_files(folder: &Path, settings: &[Setting]) -> anyhow::Result<()> {
    let mut rows = PredictionRows::create(&folder.join("rooms_predictions.csv"))?;
    for s in settings {
        // The predictions of all contenders would fill a hundred megabytes.
        let written = |name: &str| [RAY_CAST, RAY_LED, FUSED].contains(&name);
        rows.add(&s.named(), &s.room, written)?;
    }
    rows.finish()?;
    let all: Vec<SettingResults<'_>> = settings.iter().map(Setting::named).collect();
    tables::scores_csv(&folder.join("rooms_scores.csv"), &all)?;
    let main = settings
        .iter()
        .find(|s| s.surfaces == MAIN_ROOM && s.condition == Condition::usual())
        .context("the main room")?;
    let names = [
        RAY_CAST,
        RAY_LED,
        "ridge on five frames, closest surface",
        "ridge on five frames, fused",
        "learned, closest surface",
        FUSED,
        NO_GAZE,
    ];
    let lines: Vec<ErrorLine> = names
        .iter()
        .zip(COLOURS)
        .map(|(name, colour)| ErrorLine {
            name: (*name).to_owned(),
            points: tables::medians_before(main.touches(name)),
            style: colour.stroke_width(3),
            dashed: false,
        })
        .collect();
    let title = format!("Room of {MAIN_ROOM} surfaces: error before contact");
    errors(&folder.join("rooms_error.svg"), &title, &lines)?;
    let title = "Stated and observed probability of the surface, all rooms, 30 to 90 %";
    figures::reliability(
        &folder.join("rooms_reliability.svg"),
        title,
        &pooled(settings),
    )?;
    figures::scene(&folder.join("rooms_scene.svg"), &main.room, &picture(main)?)
}

/// The touch with the median lead gained over the ray cast.
fn picture(s: &Setting) -> anyhow::Result<TouchPicture> {
    let gained = gained_s(s.touches(FUSED), s.touches(RAY_CAST));
    let mut order: Vec<usize> = (0..gained.len()).collect();
    order.sort_by(|&a, &b| gained[a].total_cmp(&gained[b]));
    let middle = *order.get(order.len() / 2).context("a touch")?;
    let mut before = middle;
    let mut stream = 0;
    while before >= s.participants[stream].touches.len() {
        before -= s.participants[stream].touches.len();
        stream += 1;
    }
    let one = &s.participants[stream..=stream];
    let touch = one[0].touches[before];
    let cast = &s.touches(RAY_CAST)[middle];
    let mut hand_m = Vec::new();
    let mut all = Vec::new();
    let mut fused = s.training.fused(&s.training.config)?;
    people::run(
        fused.predictor.as_mut(),
        &s.room,
        one,
        Telling::Nothing,
        |sample| {
            if sample.touch == before && sample.seen.frame.t_s >= touch.start_s {
                hand_m.extend(sample.seen.hand.map(|h| h.point_m));
                all.push((
                    sample.seen.frame.t_s,
                    sample.predictions.first().copied(),
                    sample.seen.gaze.ray().copied(),
                ));
            }
        },
    )?;
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
