//! Predictions with a scene, in rooms of more and more surfaces and under worse and worse conditions.

use crate::contact::figures::{self as contact_figures, ErrorLine};
use crate::contact::moments::Moment;
use crate::rooms::contenders::{Contender, FUSED, NO_GAZE, RAY_CAST, RAY_LED, Taught};
use crate::rooms::figures::{self as figures, Picture, Shown};
use crate::rooms::people::{Cast, Condition, follow, listen, streams};
use crate::rooms::room::{ROOMS, Room};
use crate::rooms::scores::{Told, gained_s, summary};
use crate::rooms::tables::{self as tables, Row, Rows};
use anyhow::Context;
use hwall_stage::figures::COLOURS;
use hwall_stage::numbers::counted;
use hwall_stage::training::{Stream, reaches};
use hwall_testkit::MarkdownTable;
use plotters::style::Color;
use rayon::prelude::*;
use std::fmt::Write;
use std::path::Path;

/// People and touches of the report: more to be judged by than learnt from, for shares near 100 %.
const CAST: Cast = Cast {
    people: [12, 20],
    touches: 12,
    seed: 0,
};
/// The fusion was built looking at people of small seeds: none of them is judged here.
const FIRST_SEED: u64 = 1000;
/// The room that conditions are compared in, and that targets are set for.
const MAIN_ROOM: usize = 6;
/// What this project sets itself: the right surface of six in so many cases after so much of the time.
const TARGET: (f64, f64) = (0.99, 0.7);
/// Moments of the picture.
const SHOWN: [f64; 4] = [0.3, 0.5, 0.7, 0.9];

/// One room under one condition: who is judged, and what everyone said.
struct Setting {
    surfaces: usize,
    room: Room,
    condition: Condition,
    judged: Vec<Stream>,
    taught: Taught,
    /// Do all contenders follow them, or the main ones?
    everyone: bool,
    rows: Vec<Row>,
}

/// The study; Markdown. With a folder: `rooms_predictions.csv`, `rooms_scores.csv` and three figures.
///
/// # Errors
/// People who cannot be made, an estimator that cannot be trained, a file that cannot be written.
pub fn report(seed: u64, out: Option<&Path>) -> anyhow::Result<String> {
    let cast = Cast {
        seed: FIRST_SEED + seed,
        ..CAST
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
        .map(|(i, (surfaces, condition))| Setting::new(surfaces, condition, &cast, i < ROOMS.len()))
        .collect::<anyhow::Result<Vec<_>>>()?;
    // One after the other: the times are those of a prediction that has the machine for itself.
    for setting in &mut settings {
        setting.listen()?;
    }
    let text = words(&cast, &settings)?;
    if let Some(folder) = out {
        write_files(folder, &settings)?;
    }
    Ok(text)
}

impl Setting {
    fn new(
        surfaces: usize,
        condition: Condition,
        cast: &Cast,
        everyone: bool,
    ) -> anyhow::Result<Self> {
        let name = || format!("{}, {}", counted_surfaces(surfaces), condition.name);
        let room = Room::new(surfaces)?;
        let [learnt, judged] = streams(&room, &condition, cast).with_context(name)?;
        let taught =
            Taught::new(reaches(&learnt, condition.person.gaze_noise_rad)?).with_context(name)?;
        Ok(Self {
            surfaces,
            room,
            condition,
            judged,
            taught,
            everyone,
            rows: Vec::new(),
        })
    }

    /// Has everyone follow those who are judged.
    fn listen(&mut self) -> anyhow::Result<()> {
        let contenders = if self.everyone {
            self.taught.all()
        } else {
            self.taught.main()
        };
        for Contender {
            name,
            mut predictor,
        } in contenders?
        {
            let told = listen(
                predictor.as_mut(),
                &self.room,
                &self.judged,
                &self.condition,
            )?;
            self.rows.push((name, told));
        }
        Ok(())
    }

    fn told(&self, name: &str) -> &[Told] {
        let found = self.rows.iter().find(|(n, _)| n == name);
        found.map_or(&[], |(_, told)| told)
    }
}

fn counted_surfaces(count: usize) -> String {
    counted(count, "surface", "surfaces")
}

fn bend_name(bend: Option<f64>) -> String {
    bend.map_or_else(|| "none".to_owned(), |b| b.to_string())
}

fn words(cast: &Cast, settings: &[Setting]) -> anyhow::Result<String> {
    let Cast {
        people: [learnt, judged],
        touches,
        seed,
    } = *cast;
    let config = settings.first().map(|s| &s.taught.config);
    let bend = bend_name(config.and_then(|c| c.bend));
    let mut text = format!(
        "## Rooms of several surfaces, simulated people of seed {seed}\n\n\
         Split: people 1 to {learnt} of every room and condition teach estimators and gaze ({touches} touches \
         each), people {} to {} are judged ({touches} touches each; those in which the finger would pass \
         through something are left out of both). The seeds on which the fusion was built are below \
         {FIRST_SEED}: nobody of them is here. `bend` is {bend}, its default, \
         chosen on those.\n\n",
        learnt + 1,
        learnt + judged,
    );
    text += &target(settings)?;
    write!(
        text,
        "\nA surface is right if the most probable answer names it; whoever says nothing is wrong. A board of \
         0.2 m is missed if its middle, the prediction, is more than 0.1 m to a side or up or 0.03 m before or \
         behind the touch. Right for good: from then on the surface stays right and the point within 0.05 m. \
         90 % regions are those in the plane of the surface, where it is right. `{RAY_LED}` is the gaze ray \
         itself until the hand is within 0.06 m: the gaze alone has no row of its own.\n"
    )?;
    for s in settings
        .iter()
        .filter(|s| s.condition == Condition::usual())
    {
        write!(text, "\n{}", room_words(s))?;
    }
    write!(
        text,
        "\n### Room of {MAIN_ROOM} under other conditions\n\nLearnt and judged under the same condition; \
         what is learnt does not know the judged people.\n\n"
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
        let rows: Vec<Row> = main
            .iter()
            .map(|name| ((*name).to_owned(), s.told(name).to_vec()))
            .collect();
        tables::condition_rows(&mut table, &s.condition.name, &rows);
    }
    write!(
        text,
        "{table}\n### Are the stated probabilities of the surface right?\n\nAll rooms and conditions together, \
         30 to 90 % of the time: right in so many percent.\n\n{}",
        tables::reliabilities(&pooled(settings))
    )?;
    Ok(text)
}

/// What was said in all settings.
fn pooled(settings: &[Setting]) -> Vec<(&'static str, Vec<&Told>)> {
    [RAY_CAST, FUSED, NO_GAZE]
        .map(|name| (name, settings.iter().flat_map(|s| s.told(name)).collect()))
        .to_vec()
}

/// The target beside the result.
fn target(settings: &[Setting]) -> anyhow::Result<String> {
    let (wanted, share) = TARGET;
    let moment = Moment::Share(share);
    let mut table = MarkdownTable::new([
        "surfaces",
        "touches",
        "target",
        "learned, fused",
        "met",
        "ray cast",
        "lead gained over the ray cast, ms, median",
    ]);
    for s in settings
        .iter()
        .filter(|s| s.condition == Condition::usual())
    {
        let [fused, cast] = [FUSED, RAY_CAST].map(|name| s.told(name));
        let right = summary(fused, moment).right;
        let of = |right: f64| format!("{:.1} %", 100.0 * right);
        let mut gained = gained_s(fused, cast);
        gained.sort_by(f64::total_cmp);
        let main = s.surfaces == MAIN_ROOM;
        table.row([
            s.surfaces.to_string(),
            fused.len().to_string(),
            if main {
                format!(">= {:.0} %", 100.0 * wanted)
            } else {
                "none set".to_owned()
            },
            of(right),
            match (main, right >= wanted) {
                (false, _) => "",
                (true, true) => "yes",
                (true, false) => "no",
            }
            .to_owned(),
            of(summary(cast, moment).right),
            format!("{:.0}", 1e3 * hwall_testkit::quantile(&gained, 0.5)),
        ]);
    }
    let mut text = format!(
        "### In short: the right surface at {:.0} % of the time\n\n{table}",
        100.0 * share
    );
    for s in settings
        .iter()
        .filter(|s| s.condition == Condition::usual())
    {
        writeln!(text, "\n{}", better(s))?;
    }
    Ok(text)
}

/// Where the main contender has the smaller median error than everyone without learned estimator.
fn better(s: &Setting) -> String {
    let own = s.told(FUSED);
    let others = || {
        s.rows
            .iter()
            .filter(|(name, _)| !name.starts_with("learned"))
    };
    let moments = Moment::all().filter(|m| *m != Moment::Share(1.0));
    let (mut yes, mut no) = (Vec::new(), Vec::new());
    for moment in moments {
        let own_m = summary(own, moment).median_m;
        let best = others()
            .map(|(name, told)| (name, summary(told, moment).median_m))
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

fn room_words(s: &Setting) -> String {
    let all = &s.rows;
    let touches = all.first().map_or(0, |(_, told)| told.len());
    format!(
        "### Room of {}: {touches} touches, learnt from {}\n\n\
         #### Right surface, %\n\n{}\n\
         #### Distance of the predicted from the true point, median / mean, mm\n\n{}\n\
         #### Boards missed, %\n\n{}\n\
         #### 90 % regions in the plane of the right surface hold the point, %\n\n{}\n\
         #### Per axis, mean / largest error in cm\n\n{}\n\
         #### How sure, how early, how fast\n\n{}",
        counted_surfaces(s.surfaces),
        s.taught.reaches(),
        tables::right(all),
        tables::distances(all),
        tables::missed(all),
        tables::coverage(all),
        tables::axes(all),
        tables::sureness(all),
    )
}

fn write_files(folder: &Path, settings: &[Setting]) -> anyhow::Result<()> {
    let mut rows = Rows::create(&folder.join("rooms_predictions.csv"))?;
    let mut scores = Vec::new();
    for s in settings {
        let place = [s.surfaces.to_string(), s.condition.name.clone()];
        // The scores of all are in the other file; their predictions would fill a hundred megabytes.
        let written = [RAY_CAST, RAY_LED, FUSED];
        for row in s
            .rows
            .iter()
            .filter(|row| written.contains(&row.0.as_str()))
        {
            rows.add([&place[0], &place[1]], &s.room, row)?;
        }
        scores.push((place, s.rows.clone()));
    }
    rows.finish()?;
    tables::scores_csv(&folder.join("rooms_scores.csv"), &scores)?;
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
            points: tables::medians_before(main.told(name)),
            style: colour.stroke_width(3),
            dashed: false,
        })
        .collect();
    let title = format!("Room of {MAIN_ROOM} surfaces: error before contact");
    contact_figures::errors(&folder.join("rooms_error.svg"), &title, &lines)?;
    let title = "Is the surface as sure as it is said to be? All rooms, 30 to 90 %";
    figures::reliability(
        &folder.join("rooms_reliability.svg"),
        title,
        &pooled(settings),
    )?;
    figures::scene(&folder.join("rooms_scene.svg"), &main.room, &picture(main)?)
}

/// The touch with the median lead gained over the ray cast, looked at closely.
fn picture(s: &Setting) -> anyhow::Result<Picture> {
    let gained = gained_s(s.told(FUSED), s.told(RAY_CAST));
    let mut order: Vec<usize> = (0..gained.len()).collect();
    order.sort_by(|&a, &b| gained[a].total_cmp(&gained[b]));
    let middle = *order.get(order.len() / 2).context("a touch")?;
    let mut before = middle;
    let mut stream = 0;
    while before >= s.judged[stream].touches.len() {
        before -= s.judged[stream].touches.len();
        stream += 1;
    }
    let one = &s.judged[stream..=stream];
    let touch = one[0].touches[before];
    let span_s = [touch.start_s, touch.contact_s];
    let mut hand_m = Vec::new();
    let mut all = Vec::new();
    let mut fused = s.taught.fused(&s.taught.config)?;
    follow(fused.predictor.as_mut(), &s.room, one, &s.condition, |at| {
        if at.place[1] == before {
            hand_m.extend(at.seen.hand.map(|h| h.point_m));
            all.push((
                at.seen.frame.t_s,
                at.answers.first().copied(),
                at.seen.gaze.copied(),
            ));
        }
    })?;
    let cast = &s.told(RAY_CAST)[middle];
    let shown = SHOWN.into_iter().filter_map(|share| {
        let index = Moment::Share(share).index(all.iter().map(|a| a.0), span_s)?;
        let (_, fused, gaze) = all[index];
        Some(Shown {
            share,
            fused: fused?,
            gaze,
            cast: cast.heard.get(index)?.first,
        })
    });
    Ok(Picture {
        shown: shown.collect(),
        hand_m,
        target_m: touch.target_m,
        title: format!(
            "A touch of median gain: the fusion is right for good {:.0} ms before the ray cast",
            1e3 * gained[middle]
        ),
    })
}
