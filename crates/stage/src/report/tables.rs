//! The table of a run, and its touches as CSV.

use crate::input::numbers;
use crate::person::gestures::{self, GestureAtTouch};
use crate::person::predictors::{PREDICTORS, PredictorKind};
use crate::report::summary::{Sorted, Summary, step_ns};
use crate::run::evaluation::judge::{Outcome, RIGHT_M};
use crate::run::evaluation::regret::Miss;
use crate::run::logs::log::Run;
use crate::run::logs::push_log::Push;
use crate::run::logs::texture_log::TextureTouch;
use crate::run::people::{JudgedTouch, PersonRun};
use hwall::reachability::WallMaps;
use hwall_hand::LostReason;
use hwall_testkit::{Column, MarkdownTable, format_ns, or_none, table_of, yes_or_no};
use hwall_texton::Level;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

/// The results of the runs, one line for each number.
#[must_use]
pub fn table(runs: &[PersonRun], maps: &WallMaps, mapping: Duration) -> MarkdownTable {
    let judged: Vec<&JudgedTouch> = runs.iter().flat_map(|run| &run.touches).collect();
    let outcomes: Vec<&Outcome> = judged.iter().map(|touch| &touch.outcome).collect();
    let summary = Summary::new(runs);
    let sum = |count: &dyn Fn(&Run) -> usize| runs.iter().map(|run| count(&run.run)).sum::<usize>();
    let mut table = MarkdownTable::new(["what", "value"]);
    let mut row = |what: &str, value: String| {
        table.row([what.to_owned(), value]);
    };
    let within: Vec<&Outcome> = outcomes
        .iter()
        .copied()
        .filter(|o| o.unreachable.is_none())
        .collect();
    let in_time: Vec<&Outcome> = within.iter().copied().filter(|o| o.in_place()).collect();
    if runs.len() > 1 {
        row("people, each in a run of their own", runs.len().to_string());
    }
    row("touches", outcomes.len().to_string());
    row("touches within the arm's reach", within.len().to_string());
    row("out of reach, with the reason", reasons(&outcomes));
    let (walls, lines) = maps
        .map()
        .map_or((0, 0), |map| (map.walls().len(), map.report().lines));
    row(
        "reachability maps of the walls nearby",
        format!(
            "{walls} walls, {lines} lines, {:.1} ms",
            1e3 * mapping.as_secs_f64()
        ),
    );
    row(
        "predictions looked up / sent to the nearest place in reach",
        format!("{} / {}", sum(&|run| run.look_ups), sum(&|run| run.moved)),
    );
    row(
        "board in place before the hand",
        of(in_time.len(), within.len()),
    );
    row(
        "touches at which it could have been (gaze, arm and waiting posture allowed it)",
        of(summary.possible, within.len()),
    );
    row(
        "of those in place",
        of(summary.possible_in_place, summary.possible),
    );
    row("not in place, by reason", misses(&summary));
    if !summary.stops.is_empty() {
        let stops = summary.stops.iter();
        let stops = stops.map(|(stop, count)| format!("{count} {stop}"));
        row("of those with the arm stopped, by what", join(stops));
    }
    row(
        "arm held / of these latched, until a person lets it go",
        format!("{} / {}", summary.holds, summary.latches),
    );
    let detours = summary.reversals_median.zip(summary.in_vain_per_touch);
    row(
        "board turned back on its way before a touch, median; boards sent in vain for each touch",
        detours.map_or("none".to_owned(), |(reversals, vain)| {
            format!("{reversals}; {vain:.2}")
        }),
    );
    let in_front = summary.link_in_front.unwrap_or(0.0);
    let most_mm = 1e3 * summary.link_in_front_most_m.unwrap_or(0.0);
    row(
        "time with a link of the arm in front of a wall within the person's reach, most",
        format!("{:.1} %, {most_mm:.0} mm", 100.0 * in_front),
    );
    let ms = |s: f64| format!("{:.0}", 1e3 * s);
    let mm = |m: f64| format!("{:.1}", 1e3 * m);
    let leads = Sorted::of(in_time.iter().filter_map(|o| o.lead_s));
    let text = leads.text(&[0.0, 0.5], " ms", ms);
    row("lead time, least / median", text);
    let error = |f: &dyn Fn(&Outcome) -> f64| {
        Sorted::of(within.iter().map(|o| f(o).abs())).text(&[0.5, 1.0], " mm", mm)
    };
    let text = error(&|o| o.offset_m.hypot(o.gap_m));
    row(
        "position error at contact, misses included, median / max",
        text,
    );
    row(
        "of it along the surface (harmless on the board), median / max",
        error(&|o| o.offset_m),
    );
    let text = error(&|o| o.gap_m);
    row("of it along the normal (gap), median / max", text);
    let gaps = Sorted::of(within.iter().map(|o| o.gap_m));
    row("gap, nine of ten at most", gaps.text(&[0.9], " mm", mm));
    let felt = Sorted::of(within.iter().filter_map(|o| o.felt_after_s));
    let after = felt.text(&[0.5], " ms after arrival", |s| format!("median {}", ms(s)));
    let text = format!("{} of {}, {after}", felt.len(), within.len());
    row("contact felt (above 3 N)", text);
    row("hand lost", losses(runs));
    let [gaze, direction, nearest, motion, none] =
        std::array::from_fn(|i| sum(&|run| run.sources[i]));
    row(
        "frames led by gaze / hand direction / nearest / motion / none",
        format!("{gaze} / {direction} / {nearest} / {motion} / {none}"),
    );
    let count = sum(&|run| run.unreachable_frames);
    row("frames with the target out of reach", count.to_string());
    let leader = runs.first().map_or("nobody", |run| run.run.leader.name());
    row("board led by", leader.to_owned());
    for kind in PredictorKind::ALL {
        let records = runs.iter().flat_map(|run| &run.run.predictions);
        let took_ns = records.map(|p| p.took_ns[kind as usize]);
        let took_ns = Sorted::of(took_ns.filter(|t| *t > 0.0));
        let what = format!(
            "time per prediction at the tracker's rate, {}, median / p99",
            kind.name()
        );
        row(&what, took_ns.text(&[0.5, 0.99], "", format_ns));
    }
    let step_ns = step_ns(runs);
    row(
        "time per control step without prediction, median / p99 / p99.99 / most",
        step_ns.text(&[0.5, 0.99, 0.9999, 1.0], "", format_ns),
    );
    row("control steps", step_ns.len().to_string());
    table
}

/// `part` of `all`, with the share if `all` is not zero.
fn of(part: usize, all: usize) -> String {
    match all {
        0 => format!("{part} of {all}"),
        n => format!("{part} of {all} ({:.0} %)", 100.0 * part as f64 / n as f64),
    }
}

fn misses(summary: &Summary) -> String {
    let counts = Miss::ALL.iter().zip(summary.misses);
    let counts = counts.filter(|(miss, count)| **miss != Miss::Unreachable && *count > 0);
    join(counts.map(|(miss, count)| format!("{count} {}", miss.name())))
}

/// Touches of more people than these are not listed one by one.
const LISTED_PEOPLE: usize = 2;

/// Prefix for one of several people: `person 2: `; counted from 1, as in [`touches_csv`].
fn of_person(runs: &[PersonRun], person: usize) -> String {
    match runs.len() {
        0 | 1 => String::new(),
        _ => format!("person {}: ", person + 1),
    }
}

/// For every touch: how long before it each predictor had been right; then the medians. With many people: touches of the first,
/// medians of all.
#[must_use]
pub fn who_was_right(runs: &[PersonRun]) -> MarkdownTable {
    // An untrained predictor has no records.
    let took_part = |kind: &PredictorKind| {
        let mut records = runs.iter().flat_map(|run| &run.run.predictions);
        *kind != PredictorKind::EndToEnd || records.any(|p| p.took_ns[*kind as usize] > 0.0)
    };
    let kinds: Vec<PredictorKind> = PredictorKind::ALL.into_iter().filter(took_part).collect();
    let what = format!(
        "touch: right surface and within {:.0} mm, from how long before contact on",
        1e3 * RIGHT_M
    );
    let names = kinds.iter().map(|kind| format!("{}, ms", kind.name()));
    let mut table = MarkdownTable::new([what, "at, s".to_owned()].into_iter().chain(names));
    let ms = |lead_s: f64| format!("{:.0}", 1e3 * lead_s);
    let lead_of = |lead: &[Option<f64>; PREDICTORS], kind: PredictorKind| {
        lead[kind as usize].map_or("wrong".to_owned(), ms)
    };
    for (name, touch) in listed(runs) {
        let cells = kinds.iter().map(|kind| lead_of(&touch.leads_s, *kind));
        let at = format!("{:.2}", touch.outcome.touch.contact_s);
        table.row([name, at].into_iter().chain(cells));
    }
    let all = runs.iter().flat_map(|run| &run.touches);
    let leads: Vec<[Option<f64>; PREDICTORS]> = all.map(|touch| touch.leads_s).collect();
    if leads.is_empty() {
        return table;
    }
    // A predictor that is wrong until the contact has a lead of zero.
    let of = |i: usize| leads.iter().map(move |l| l[i].unwrap_or(0.0));
    let median = |values: &mut dyn Iterator<Item = f64>| Sorted::of(values).text(&[0.5], "", ms);
    let mut summary = |name: &str, cell: &dyn Fn(usize) -> String| {
        let cells = kinds.iter().map(|kind| cell(*kind as usize));
        table.row([name.to_owned(), String::new()].into_iter().chain(cells));
    };
    summary("median", &|i| median(&mut of(i)));
    summary("median gained over the ray cast", &|i| {
        median(
            &mut of(i)
                .zip(of(PredictorKind::RayCast as usize))
                .map(|(a, b)| a - b),
        )
    });
    summary("touches foreseen at all", &|i| {
        leads.iter().filter(|l| l[i].is_some()).count().to_string()
    });
    table
}

/// For every touch: what was possible, and the outcome. With many people: touches of the first.
#[must_use]
pub fn regrets(runs: &[PersonRun]) -> MarkdownTable {
    let ms = |s: Option<f64>| or_none(s.map(|s| 1e3 * s), 0);
    let at_s = |touch: &JudgedTouch| touch.outcome.touch.contact_s;
    let columns: [Column<'_, (String, &JudgedTouch)>; 8] = [
        ("touch: was it possible to be there", &|(name, _)| {
            name.clone()
        }),
        ("at, s", &|(_, t)| format!("{:.2}", at_s(t))),
        ("known before, ms", &|(_, t)| {
            ms(Some(at_s(t) - t.regret.known_s))
        }),
        ("least time from waiting / from there, ms", &|(_, t)| {
            format!(
                "{} / {}",
                ms(t.regret.from_waiting_s),
                ms(t.regret.from_there_s)
            )
        }),
        ("possible", &|(_, t)| {
            yes_or_no(t.regret.possible).to_owned()
        }),
        (
            "in place",
            &|(_, t)| match (t.regret.miss, t.regret.stopped_by) {
                (None, _) => "yes".to_owned(),
                (Some(miss), None) => format!("no: {}", miss.name()),
                (Some(miss), Some(stop)) => format!("no: {}, arm stopped: {stop}", miss.name()),
            },
        ),
        ("led to it before, ms", &|(_, t)| ms(t.regret.foreseen_s)),
        ("turned back / in vain", &|(_, t)| {
            format!(
                "{} / {}",
                t.regret.detours.reversals, t.regret.detours.in_vain
            )
        }),
    ];
    table_of(listed(runs), &columns)
}

/// The touches listed one by one, with person (if several), number and surface. Each person's are counted from 1, because
/// each has a separate clock.
fn listed(runs: &[PersonRun]) -> impl Iterator<Item = (String, &JudgedTouch)> {
    let people = match runs.len() {
        count if count <= LISTED_PEOPLE => count,
        _ => 1,
    };
    let people = runs[..people].iter().enumerate();
    people.flat_map(|(person, run)| {
        let whose = of_person(runs, person);
        let touches = run.touches.iter().enumerate();
        touches.map(move |(i, touch)| {
            let surface = &touch.outcome.touch.surface;
            (format!("{whose}{} {surface}", i + 1), touch)
        })
    })
}

/// How early gestures were told apart; empty without gestures.
#[must_use]
pub fn gestures(runs: &[PersonRun]) -> String {
    let touches = runs.iter().flat_map(|run| &run.touches);
    let inferred: Vec<GestureAtTouch> = touches.filter_map(|touch| touch.gesture).collect();
    match inferred.is_empty() {
        true => String::new(),
        false => format!("\n{}", gestures::table(&inferred)),
    }
}

/// For every touch of the first person on a textured surface: wanted and felt texture; empty if no texture was
/// presented.
#[must_use]
pub fn textures(runs: &[PersonRun]) -> String {
    let touches = runs.first().and_then(|first| first.run.textures.as_ref());
    let Some(touches) = touches.filter(|t| !t.is_empty()) else {
        return String::new();
    };
    let of_first = of_person(runs, 0);
    let level = |l: &Level| {
        let um = 1e3 * l.magnitude;
        format!("{:.1} / {:.1} / {um:.3}", l.scan.deg(), l.speed_mm_per_s)
    };
    let columns: [Column<'_, &TextureTouch>; 7] = [
        (&format!("{of_first}textured touch"), &|t| t.surface.clone()),
        ("at, s", &|t| format!("{:.2}", t.felt_s)),
        ("roughness in the scene", &|t| t.roughness.to_string()),
        ("wanted angle, deg / speed, mm/s / roughness, um", &|t| {
            level(&t.wanted)
        }),
        ("rendered", &|t| {
            t.rendered.as_ref().map_or("too short".to_owned(), level)
        }),
        ("speed within 5 % after, ms", &|t| {
            t.reached_s
                .map_or("never".to_owned(), |s| format!("{:.0}", 1e3 * s))
        }),
        ("compared for, ms", &|t| format!("{:.0}", 1e3 * t.lasted_s)),
    ];
    format!("\n{}", table_of(touches, &columns))
}

/// Pushes of the first person at doors and other moving surfaces: force, opening, energy.
#[must_use]
pub fn pushes(runs: &[PersonRun]) -> String {
    let pushes = runs.first().map_or(&[][..], |first| &first.run.pushes);
    if pushes.is_empty() {
        return String::new();
    }
    let of_first = of_person(runs, 0);
    let opening = |p: &Push| {
        let (factor, unit) = match p.turns {
            true => (1f64.to_degrees(), "deg"),
            false => (1e3, "mm"),
        };
        let [before, most] = [p.opening_before, p.opening_most].map(|opening| factor * opening);
        format!("{before:.1} / {most:.1} {unit}")
    };
    let columns: [Column<'_, &Push>; 6] = [
        (&format!("{of_first}pushed"), &|p| p.surface.clone()),
        ("at, s", &|p| format!("{:.2}", p.felt_s)),
        ("for, ms", &|p| format!("{:.0}", 1e3 * p.lasted_s)),
        ("peak force, N", &|p| format!("{:.1}", p.peak_n)),
        ("opening before / most", &|p| opening(p)),
        ("energy given / returned, mJ", &|p| {
            format!("{:.0} / {:.0}", 1e3 * p.given_j, 1e3 * p.returned_j)
        }),
    ];
    format!("\n{}", table_of(pushes, &columns))
}

fn reasons(outcomes: &[&Outcome]) -> String {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for reason in outcomes.iter().filter_map(|o| o.unreachable.as_ref()) {
        *counts.entry(reason.name()).or_default() += 1;
    }
    let counts = counts.into_iter();
    join(counts.map(|(name, count)| format!("{count} {name}")))
}

fn losses(runs: &[PersonRun]) -> String {
    let name = |reason: &LostReason| match reason {
        LostReason::Jump { speed_m_per_s } => format!("jump of {speed_m_per_s:.0} m/s"),
        LostReason::Gap { gap_s } => format!("gap of {gap_s:.2} s"),
        LostReason::Frozen { .. } => "frozen pose".to_owned(),
        LostReason::NoPoints => "no points".to_owned(),
        LostReason::Starting => "starting".to_owned(),
        LostReason::InvalidTime => "invalid time".to_owned(),
        other => other.to_string(),
    };
    let people = runs.iter().enumerate();
    let lost = people.flat_map(|(person, run)| run.run.losses.iter().map(move |l| (person, l)));
    join(lost.map(|(person, loss)| {
        let whose = of_person(runs, person);
        format!("{whose}{} at {:.2} s", name(&loss.reason), loss.t_s)
    }))
}

fn join(parts: impl Iterator<Item = String>) -> String {
    let parts: Vec<String> = parts.collect();
    if parts.is_empty() {
        "none".to_owned()
    } else {
        parts.join(", ")
    }
}

/// A column of the touches: its name, and its cell for a touch of person n, from 1.
type CsvColumn = (&'static str, fn(usize, &JudgedTouch) -> String);

/// Do not reorder: readers use the first columns by position.
const COLUMNS: [CsvColumn; 25] = [
    ("surface", |_, t| t.outcome.touch.surface.clone()),
    ("px", |_, t| digits(4, t.outcome.touch.point_m.x)),
    ("py", |_, t| digits(4, t.outcome.touch.point_m.y)),
    ("pz", |_, t| digits(4, t.outcome.touch.point_m.z)),
    ("start_s", |_, t| digits(3, t.outcome.touch.start_s)),
    ("contact_s", |_, t| digits(3, t.outcome.touch.contact_s)),
    ("reason", |_, t| {
        let why = t.outcome.unreachable.as_ref();
        why.map_or("", |why| why.name()).to_owned()
    }),
    ("lead_s", |_, t| digits(4, t.outcome.lead_s)),
    ("offset_m", |_, t| digits(4, t.outcome.offset_m)),
    ("gap_m", |_, t| digits(4, t.outcome.gap_m)),
    ("felt_after_s", |_, t| digits(4, t.outcome.felt_after_s)),
    ("fused_right_s", |_, t| right_s(t, PredictorKind::Fused)),
    ("ray_led_right_s", |_, t| right_s(t, PredictorKind::RayLed)),
    ("ray_cast_right_s", |_, t| {
        right_s(t, PredictorKind::RayCast)
    }),
    ("person", |person, _| person.to_string()),
    ("tilt_deg", |_, t| {
        digits(3, t.outcome.tilt_rad.to_degrees())
    }),
    ("known_s", |_, t| digits(3, t.regret.known_s)),
    ("least_from_waiting_s", |_, t| {
        digits(4, t.regret.from_waiting_s)
    }),
    ("least_from_there_s", |_, t| {
        digits(4, t.regret.from_there_s)
    }),
    ("possible", |_, t| u8::from(t.regret.possible).to_string()),
    ("missed_by", |_, t| {
        t.regret.miss.map_or("", Miss::name).to_owned()
    }),
    ("foreseen_s", |_, t| digits(4, t.regret.foreseen_s)),
    ("reversals", |_, t| t.regret.detours.reversals.to_string()),
    ("in_vain", |_, t| t.regret.detours.in_vain.to_string()),
    ("end_to_end_right_s", |_, t| {
        right_s(t, PredictorKind::EndToEnd)
    }),
];

/// With `count` decimals; empty without a value.
fn digits(count: usize, value: impl Into<Option<f64>>) -> String {
    let value = value.into();
    value.map_or(String::new(), |value| format!("{value:.count$}"))
}

fn right_s(touch: &JudgedTouch, kind: PredictorKind) -> String {
    digits(4, touch.leads_s[kind as usize])
}

/// Every touch as one row of CSV.
///
/// # Errors
/// A file that cannot be written.
pub fn touches_csv(path: &Path, runs: &[PersonRun]) -> anyhow::Result<()> {
    let mut out = numbers::writer(Some(path))?;
    out.write_record(COLUMNS.map(|(name, _)| name))?;
    for (person, run) in (1..).zip(runs) {
        for touch in &run.touches {
            out.write_record(COLUMNS.map(|(_, cell)| cell(person, touch)))?;
        }
    }
    out.flush()
}
