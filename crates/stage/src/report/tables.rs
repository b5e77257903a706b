//! The table of a run, and its touches as CSV.

use crate::input::numbers;
use crate::person::predictors::PredictorKind;
use crate::person::touches::Touch;
use crate::run::closed_loop::{Loss, Run};
use crate::run::judge::{Outcome, RIGHT_M};
use hwall::reachability::WallMaps;
use hwall_hand::LostReason;
use hwall_testkit::{ErrorStats, MarkdownTable, format_ns, quantile};
use hwall_texton::Level;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

/// The results of the run, one line for each number.
#[must_use]
pub fn table(run: &Run, maps: &WallMaps, mapping: Duration, outcomes: &[Outcome]) -> MarkdownTable {
    let mut table = MarkdownTable::new(["what", "value"]);
    let mut row = |what: &str, value: String| {
        table.row([what.to_owned(), value]);
    };
    let within: Vec<&Outcome> = outcomes
        .iter()
        .filter(|o| o.unreachable.is_none())
        .collect();
    let in_time: Vec<&&Outcome> = within.iter().filter(|o| o.lead_s.is_some()).collect();
    row("touches", outcomes.len().to_string());
    row("touches within the arm's reach", within.len().to_string());
    row("out of reach, with the reason", reasons(outcomes));
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
        format!("{} / {}", run.look_ups, run.moved),
    );
    let share = match within.len() {
        0 => String::new(),
        n => format!(" ({:.0} %)", 100.0 * in_time.len() as f64 / n as f64),
    };
    row(
        "board in place before the hand",
        format!("{} of {}{share}", in_time.len(), within.len()),
    );
    // Without a touch there is no value, and NaN would look like one.
    let or_none = |count: usize, text: String| if count == 0 { "none".to_owned() } else { text };
    let mut leads: Vec<f64> = in_time.iter().filter_map(|o| o.lead_s).collect();
    leads.sort_by(f64::total_cmp);
    let lead = |p: f64| 1e3 * quantile(&leads, p);
    row(
        "lead time, least / median",
        or_none(
            leads.len(),
            format!("{:.0} / {:.0} ms", lead(0.0), lead(0.5)),
        ),
    );
    let error = |f: &dyn Fn(&Outcome) -> f64| {
        let stats = ErrorStats::from_errors(within.iter().map(|o| f(o)));
        or_none(
            within.len(),
            format!("{:.1} / {:.1} mm", 1e3 * stats.median, 1e3 * stats.max),
        )
    };
    row(
        "position error at contact, median / max",
        error(&|o| o.offset_m.hypot(o.gap_m)),
    );
    row(
        "of it along the surface (harmless on the board), median / max",
        error(&|o| o.offset_m),
    );
    row(
        "of it along the normal (gap), median / max",
        error(&|o| o.gap_m),
    );
    let mut felt: Vec<f64> = within.iter().filter_map(|o| o.felt_after_s).collect();
    felt.sort_by(f64::total_cmp);
    let after = or_none(
        felt.len(),
        format!("median {:.0} ms after arrival", 1e3 * quantile(&felt, 0.5)),
    );
    row(
        "contact felt (above 3 N)",
        format!("{} of {}, {after}", felt.len(), within.len()),
    );
    row("hand lost", losses(&run.losses));
    let [gaze, direction, nearest, motion, none] = run.sources;
    row(
        "frames led by gaze / hand direction / nearest / motion / none",
        format!("{gaze} / {direction} / {nearest} / {motion} / {none}"),
    );
    row(
        "frames with the target out of reach",
        run.unreachable_frames.to_string(),
    );
    row("board led by", run.leader.name().to_owned());
    for kind in PredictorKind::ALL {
        let mut took_ns: Vec<f64> = run
            .predictions
            .iter()
            .map(|p| p.took_ns[kind as usize])
            .collect();
        took_ns.retain(|t| *t > 0.0);
        took_ns.sort_by(f64::total_cmp);
        let time = |p: f64| format_ns(quantile(&took_ns, p));
        let text = or_none(took_ns.len(), format!("{} / {}", time(0.5), time(0.99)));
        row(
            &format!(
                "time per prediction at the tracker's rate, {}, median / p99",
                kind.name()
            ),
            text,
        );
    }
    row(
        "time per control step without prediction, median / p99",
        format!(
            "{} / {}",
            format_ns(quantile(&run.step_ns, 0.5)),
            format_ns(quantile(&run.step_ns, 0.99))
        ),
    );
    row("control steps", run.step_ns.len().to_string());
    table
}

/// For every touch: how long before it each predictor had been right; then the medians.
#[must_use]
pub fn who_was_right(touches: &[Touch], leads: &[[Option<f64>; 3]]) -> MarkdownTable {
    let [a, b, c] = PredictorKind::ALL.map(|kind| format!("{}, ms", kind.name()));
    let what = format!(
        "touch: right surface and within {:.0} mm, from how long before contact on",
        1e3 * RIGHT_M
    );
    let mut table = MarkdownTable::new([what, "at, s".to_owned(), a, b, c]);
    let ms = |lead_s: f64| format!("{:.0}", 1e3 * lead_s);
    let cells = |lead: &[Option<f64>; 3]| lead.map(|l| l.map_or("wrong".to_owned(), ms));
    for (i, (touch, lead)) in touches.iter().zip(leads).enumerate() {
        let [a, b, c] = cells(lead);
        let name = format!("{} {}", i + 1, touch.surface);
        table.row([name, format!("{:.2}", touch.contact_s), a, b, c]);
    }
    if touches.is_empty() {
        return table;
    }
    // A predictor that is wrong until the end has no lead.
    let of = |i: usize| leads.iter().map(move |l| l[i].unwrap_or(0.0));
    let median = |values: &mut dyn Iterator<Item = f64>| {
        let mut sorted: Vec<f64> = values.collect();
        sorted.sort_by(f64::total_cmp);
        ms(quantile(&sorted, 0.5))
    };
    let mut summary = |name: &str, cell: &dyn Fn(usize) -> String| {
        let [a, b, c] = [0, 1, 2].map(cell);
        table.row([name.to_owned(), String::new(), a, b, c]);
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

/// For every touch of a textured surface: what was to be felt and what was felt; empty if no texture was
/// presented.
#[must_use]
pub fn textures(run: &Run) -> String {
    let Some(touches) = run.textures.as_ref().filter(|t| !t.is_empty()) else {
        return String::new();
    };
    let mut table = MarkdownTable::new([
        "textured touch",
        "at, s",
        "roughness in the scene",
        "wanted angle, deg / speed, mm/s / roughness, um",
        "rendered",
        "speed within 5 % after, ms",
        "compared for, ms",
    ]);
    let level = |l: &Level| {
        format!(
            "{:.1} / {:.1} / {:.3}",
            l.scan.deg(),
            l.speed_mm_per_s,
            1e3 * l.magnitude
        )
    };
    for t in touches {
        table.row([
            t.surface.clone(),
            format!("{:.2}", t.felt_s),
            t.roughness.to_string(),
            level(&t.wanted),
            t.rendered.as_ref().map_or("too short".to_owned(), level),
            t.reached_s
                .map_or("never".to_owned(), |s| format!("{:.0}", 1e3 * s)),
            format!("{:.0}", 1e3 * t.lasted_s),
        ]);
    }
    format!("\n{table}")
}

fn reasons(outcomes: &[Outcome]) -> String {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for reason in outcomes.iter().filter_map(|o| o.unreachable.as_ref()) {
        *counts.entry(reason.name()).or_default() += 1;
    }
    join(
        counts
            .into_iter()
            .map(|(name, count)| format!("{count} {name}")),
    )
}

fn losses(losses: &[Loss]) -> String {
    let name = |reason: &LostReason| match reason {
        LostReason::Jump { speed_m_per_s } => format!("jump of {speed_m_per_s:.0} m/s"),
        LostReason::Gap { gap_s } => format!("gap of {gap_s:.2} s"),
        LostReason::Frozen { .. } => "frozen pose".to_owned(),
        LostReason::NoPoints => "no points".to_owned(),
        LostReason::Starting => "starting".to_owned(),
        LostReason::InvalidTime => "invalid time".to_owned(),
        other => format!("{other:?}"),
    };
    join(
        losses
            .iter()
            .map(|loss| format!("{} at {:.2} s", name(&loss.reason), loss.t_s)),
    )
}

fn join(parts: impl Iterator<Item = String>) -> String {
    let parts: Vec<String> = parts.collect();
    if parts.is_empty() {
        "none".to_owned()
    } else {
        parts.join(", ")
    }
}

/// Every touch as one row of CSV.
///
/// # Errors
/// A file that cannot be written.
pub fn touches_csv(
    path: &Path,
    outcomes: &[Outcome],
    leads: &[[Option<f64>; 3]],
) -> anyhow::Result<()> {
    let mut out = numbers::writer(Some(path))?;
    out.write_record([
        "surface",
        "px",
        "py",
        "pz",
        "start_s",
        "contact_s",
        "reason",
        "lead_s",
        "offset_m",
        "gap_m",
        "felt_after_s",
        "fused_right_s",
        "ray_led_right_s",
        "ray_cast_right_s",
    ])?;
    let optional = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.4}"));
    for (o, right_s) in outcomes.iter().zip(leads) {
        let t = &o.touch;
        let mut cells = vec![t.surface.clone()];
        cells.extend(t.point_m.to_array().map(|v| format!("{v:.4}")));
        cells.extend([t.start_s, t.contact_s].map(|v| format!("{v:.3}")));
        cells.push(
            o.unreachable
                .map_or(String::new(), |why| why.name().to_owned()),
        );
        cells.extend([
            optional(o.lead_s),
            optional(Some(o.offset_m)),
            optional(Some(o.gap_m)),
            optional(o.felt_after_s),
        ]);
        cells.extend(right_s.map(optional));
        out.write_record(&cells)?;
    }
    out.flush()?;
    Ok(())
}
