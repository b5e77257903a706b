//! Targets for each kind of person, compared with measurements.

use crate::in_time::study::Row;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::report::summary::Summary;
use hwall_testkit::{MarkdownTable, titled, yes_or_no};

/// A measured quantity (`None` without touches), with the factor and unit for printing.
type Number = (
    &'static str,
    fn(&Summary) -> Option<f64>,
    (f64, &'static str),
);

/// A side of a bound, and whether a measurement is on it.
type Side = (&'static str, fn(&f64, &f64) -> bool);

const LEAST: Side = ("at least", f64::ge);
const MOST: Side = ("at most", f64::le);
const PERCENT: (f64, &str) = (1e2, "%");
const MM: (f64, &str) = (1e3, "mm");

const OF_REACHABLE: Number = (
    "in place, of those within reach",
    Summary::in_place_of_reachable,
    PERCENT,
);
const OF_POSSIBLE: Number = (
    "in place, of the possible ones",
    Summary::in_place_of_possible,
    PERCENT,
);
const GAP: Number = ("gap at contact, median", |s| s.gap_median_m, MM);
const MOST_GAP: Number = ("gap at contact, nine of ten", |s| s.gap_p90_m, MM);
const BACK: Number = (
    "board turned back, median",
    |s| s.reversals_median,
    (1.0, "times"),
);
const STEP: Number = ("control step, 99 of 100", |s| s.step_p99_us, (1.0, "us"));
const IN_VAIN: Number = (
    "boards in vain for each touch",
    |s| s.in_vain_per_touch,
    (1.0, ""),
);

/// The targets by kind of person.
const TARGETS: [(PersonKind, Number, Side, f64); 12] = [
    (PersonKind::Plain, OF_REACHABLE, LEAST, 0.93),
    (PersonKind::Plain, OF_POSSIBLE, LEAST, 0.97),
    (PersonKind::Plain, GAP, MOST, 1e-3),
    (PersonKind::Plain, MOST_GAP, MOST, 5e-3),
    (PersonKind::Plain, BACK, MOST, 0.0),
    (PersonKind::Plain, STEP, MOST, 20.0),
    (PersonKind::Varied, OF_REACHABLE, LEAST, 0.85),
    (PersonKind::Varied, OF_POSSIBLE, LEAST, 0.93),
    (PersonKind::Glancing, OF_REACHABLE, LEAST, 0.8),
    (PersonKind::Glancing, IN_VAIN, MOST, 1.0),
    (PersonKind::Random, OF_POSSIBLE, LEAST, 0.88),
    (PersonKind::Random, IN_VAIN, MOST, 0.3),
];

/// All targets of the simulated kinds.
pub fn table(rows: &[Row]) -> MarkdownTable {
    let mut table = titled("person | target | bound | measured | met");
    for row in rows {
        let own = TARGETS.iter().filter(|target| target.0 == row.kind);
        for (_, (what, measured, (factor, unit)), (side, is_met), bound) in own {
            let shown = (1e4 * factor * bound).round() / 1e4;
            let measured = measured(&row.summary);
            let value = measured.map(|value| format!("{:.1} {unit}", factor * value));
            let met = measured.map(|value| is_met(&value, bound));
            table.row([
                row.kind.name(),
                *what,
                format!("{side} {shown} {unit}").trim_end(),
                value.as_deref().unwrap_or("none").trim_end(),
                met.map_or("-", yes_or_no),
            ]);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_is_met_at_its_bound_and_unknown_where_nothing_was_touched() {
        let row = |kind, change: &dyn Fn(&mut Summary)| {
            let mut summary = Summary::new(&[]);
            change(&mut summary);
            Row {
                kind,
                summary,
                leads_s: Vec::new(),
            }
        };
        let measured = |s: &mut Summary| {
            (s.reachable, s.possible, s.in_place, s.possible_in_place) = (100, 96, 93, 93);
            (s.gap_median_m, s.gap_p90_m) = (Some(1e-3), Some(6e-3));
            (s.reversals_median, s.step_p99_us) = (Some(0.0), Some(12.0));
        };
        let text = table(&[row(PersonKind::Plain, &measured)]).to_string();
        let met: Vec<&str> = text
            .lines()
            .skip(2)
            .filter_map(|line| line.trim_end_matches([' ', '|']).rsplit(' ').next())
            .collect();
        // 93 of 100, 93 of 96, 1 mm, 6 mm, none, 12 us.
        assert_eq!(met, ["yes", "no", "yes", "no", "yes", "yes"], "{text}");
        assert!(text.contains("at least 93 %"), "{text}");
        assert!(text.contains("at most 1 mm"), "{text}");
        let nobody = table(&[row(PersonKind::Glancing, &|_| {})]).to_string();
        assert!(nobody.contains("none"), "{nobody}");
        assert!(!nobody.contains("NaN"), "{nobody}");
        let kinds = [PersonKind::Fast, PersonKind::Slow].map(|kind| row(kind, &|_| {}));
        assert_eq!(table(&kinds).to_string().lines().count(), 2);
    }
}
