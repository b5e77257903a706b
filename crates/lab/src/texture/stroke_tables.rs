//! Tables of strokes: errors of the rendered texture relative to the wanted one.

use super::stroke::StrokePath;
use super::strokes::{Felt, Met, Moment, SPEEDS_M_PER_S};
use hwall_testkit::{Column, MarkdownTable, percent_of, quantiles, table_of};

/// The texture met at a moment, if any.
type What = fn(&Moment) -> Option<Met>;
/// An error of the met texture relative to the wanted one.
type Off = fn(Met, Met) -> f64;

/// Moments at which the session renders nothing are evaluated for neither.
const HELD: What = |moment| moment.rendered.map(|_| moment.held);
const SESSION: What = |moment| moment.rendered;
const DEGREES: Off = |is, wanted| is.angle_deg - wanted.angle_deg;
const BUMPS: Off = |is, wanted| 100.0 * (is.bumps_hz / wanted.bumps_hz - 1.0);
const ROUGH: Off = |is, wanted| 100.0 * (is.roughness / wanted.roughness - 1.0);

/// Strokes under a name.
struct Row<'a> {
    name: String,
    felt: Vec<&'a Felt>,
}

impl<'a> Row<'a> {
    fn of(name: String, felt: &'a [Felt], keep: impl Fn(&Felt) -> bool) -> Self {
        Self {
            name,
            felt: felt.iter().filter(|f| keep(f)).collect(),
        }
    }

    fn moments(&self) -> impl Iterator<Item = &Moment> {
        self.felt.iter().flat_map(|f| &f.moments)
    }

    /// Median and 90th percentile of an error over all moments.
    fn off(&self, met: What, off: Off) -> String {
        let off = self
            .moments()
            .filter_map(|m| Some(off(met(m)?, m.wanted).abs()));
        pair(off.filter(|off| off.is_finite()), 0)
    }

    /// The same for roughness summed over a stroke, relative to the wanted sum over the same moments.
    fn whole(&self, met: What) -> String {
        let off = self.felt.iter().filter_map(|felt| {
            let both = felt.moments.iter();
            let both = both.filter_map(|m| Some((met(m)?.roughness, m.wanted.roughness)));
            let (is, wanted) = both.fold((0.0, 0.0), |sum, (a, b)| (sum.0 + a, sum.1 + b));
            (wanted > 0.0).then(|| 100.0 * (is / wanted - 1.0).abs())
        });
        pair(off, 0)
    }
}

/// Median and 90th percentile.
fn pair(values: impl Iterator<Item = f64>, decimals: usize) -> String {
    let [median, most] = quantiles(values, [0.5, 0.9]);
    format!("{median:.decimals$} / {most:.decimals$}")
}

/// Strokes by path and by speed.
pub fn table(felt: &[Felt]) -> MarkdownTable {
    let paths = StrokePath::ALL.into_iter();
    let mut rows: Vec<Row<'_>> = paths
        .map(|path| Row::of(path.name().to_owned(), felt, |f| f.path == path))
        .collect();
    for (range, speeds) in SPEEDS_M_PER_S.into_iter().enumerate() {
        let [low, high] = speeds.map(|speed| 1e3 * speed);
        for (name, curved) in [("straight", false), ("curved", true)] {
            let name = format!("{name}, {low:.0} to {high:.0} mm/s");
            rows.push(Row::of(name, felt, |f| {
                f.range == range && f.path.is_curved() == Some(curved)
            }));
        }
    }
    let columns: [Column<'_, Row<'_>>; 12] = [
        ("stroke", &|row| row.name.clone()),
        ("strokes", &|row| row.felt.len().to_string()),
        ("finger, mm/s", &|row| {
            pair(row.moments().map(|m| 1e3 * m.finger_m_per_s), 0)
        }),
        ("turns, rad/s", &|row| {
            pair(row.moments().map(|m| m.turns_rad_per_s), 1)
        }),
        ("board moves, % of the time", &|row| {
            let moves = row.moments().filter(|m| m.board_moves).count();
            percent_of(moves, row.moments().count(), 0, "none")
        }),
        ("angle off, degrees, held", &|row| row.off(HELD, DEGREES)),
        ("session", &|row| row.off(SESSION, DEGREES)),
        ("bumps per s off, %, held", &|row| row.off(HELD, BUMPS)),
        ("session", &|row| row.off(SESSION, BUMPS)),
        ("roughness off, %, held", &|row| row.off(HELD, ROUGH)),
        ("session", &|row| row.off(SESSION, ROUGH)),
        ("of a whole stroke, %, held, session", &|row| {
            format!("{}, {}", row.whole(HELD), row.whole(SESSION))
        }),
    ];
    table_of(rows, &columns)
}
