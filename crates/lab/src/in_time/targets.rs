//! What was promised of each kind of person, beside what was measured.

use crate::in_time::study::Row;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::report::summary::Summary;
use hwall_testkit::MarkdownTable;

/// One number that is promised.
struct Target {
    what: &'static str,
    /// The number, or `None` where nothing was touched.
    measured: fn(&Summary) -> Option<f64>,
    bound: Bound,
    /// How it is printed: a factor and the unit.
    shown: (f64, &'static str),
}

#[derive(Clone, Copy)]
enum Bound {
    Least(f64),
    Most(f64),
}

const PERCENT: (f64, &str) = (1e2, "%");
const MM: (f64, &str) = (1e3, "mm");

/// In place, of the touches within reach and of the possible ones.
fn in_place(of_reachable: f64, of_possible: Option<f64>) -> Vec<Target> {
    let reachable = Target {
        what: "in place, of those within reach",
        measured: Summary::in_place_of_reachable,
        bound: Bound::Least(of_reachable),
        shown: PERCENT,
    };
    let possible = of_possible.map(|share| Target {
        what: "in place, of the possible ones",
        measured: Summary::in_place_of_possible,
        bound: Bound::Least(share),
        shown: PERCENT,
    });
    std::iter::once(reachable).chain(possible).collect()
}

fn targets(kind: PersonKind) -> Vec<Target> {
    match kind {
        PersonKind::Plain => {
            let mut targets = in_place(0.93, Some(0.97));
            targets.extend([
                Target {
                    what: "gap at contact, median",
                    measured: |s| s.gap_median_m,
                    bound: Bound::Most(1e-3),
                    shown: MM,
                },
                Target {
                    what: "gap at contact, nine of ten",
                    measured: |s| s.gap_p90_m,
                    bound: Bound::Most(5e-3),
                    shown: MM,
                },
                Target {
                    what: "board turned back, median",
                    measured: |s| s.reversals_median,
                    bound: Bound::Most(0.0),
                    shown: (1.0, "times"),
                },
                Target {
                    what: "control step, 99 of 100",
                    measured: |s| s.step_p99_us,
                    bound: Bound::Most(20.0),
                    shown: (1.0, "us"),
                },
            ]);
            targets
        }
        PersonKind::Varied => in_place(0.85, Some(0.93)),
        PersonKind::Glancing => {
            let mut targets = in_place(0.8, None);
            targets.push(Target {
                what: "boards in vain for each touch",
                measured: |s| s.in_vain_per_touch,
                bound: Bound::Most(1.0),
                shown: (1.0, ""),
            });
            targets
        }
        PersonKind::Fast | PersonKind::Slow => Vec::new(),
    }
}

/// Every target of the kinds that were run.
pub fn table(rows: &[Row]) -> MarkdownTable {
    let mut table = MarkdownTable::new(["person", "target", "bound", "measured", "met"]);
    for row in rows {
        for target in targets(row.kind) {
            let (factor, unit) = target.shown;
            let text = |value: f64| format!("{} {unit}", (1e4 * factor * value).round() / 1e4);
            let (bound, meets): (String, fn(f64, f64) -> bool) = match target.bound {
                Bound::Least(least) => (format!("at least {}", text(least).trim_end()), |a, b| {
                    a >= b
                }),
                Bound::Most(most) => (format!("at most {}", text(most).trim_end()), |a, b| a <= b),
            };
            let (Bound::Least(limit) | Bound::Most(limit)) = target.bound;
            let measured = (target.measured)(&row.summary);
            let met = measured.map_or("-", |value| if meets(value, limit) { "yes" } else { "no" });
            let value = measured.map_or("none".to_owned(), |value| {
                format!("{:.1} {unit}", factor * value)
                    .trim_end()
                    .to_owned()
            });
            table.row([
                row.kind.name().to_owned(),
                target.what.to_owned(),
                bound,
                value,
                met.to_owned(),
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
        assert!(
            text.contains("at least 93 %") && text.contains("at most 1 mm"),
            "{text}"
        );
        let nobody = table(&[row(PersonKind::Glancing, &|_| {})]).to_string();
        assert!(
            nobody.contains("none") && !nobody.contains("NaN"),
            "{nobody}"
        );
        let kinds = [PersonKind::Fast, PersonKind::Slow].map(|kind| row(kind, &|_| {}));
        assert_eq!(table(&kinds).to_string().lines().count(), 2);
    }
}
