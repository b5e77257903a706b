//! When predictions are judged, and which of them are written down.

use std::collections::BTreeSet;

/// Shares of the time of a reach after which it is judged.
pub const SHARES: [f64; 6] = [0.3, 0.5, 0.7, 0.8, 0.9, 1.0];
/// Times before contact at which it is judged, s.
pub const BEFORE_S: [f64; 7] = [0.5, 0.4, 0.3, 0.2, 0.15, 0.1, 0.05];
/// Between the moments one prediction is written in each stretch of this length, s.
pub const WRITTEN_EVERY_S: f64 = 0.05;
/// Room for rounding, s.
const ROUNDING_S: f64 = 1e-9;

/// From the start of a reach to its contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// The hand starts, s.
    pub start_s: f64,
    /// It touches, s.
    pub contact_s: f64,
}

/// When a reach is judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Moment {
    /// After a share of its time.
    Share(f64),
    /// A time before contact, s.
    Before(f64),
}

impl Moment {
    /// All of them, in the order of the tables.
    pub fn all() -> impl Iterator<Item = Self> {
        let shares = SHARES.into_iter().map(Self::Share);
        shares.chain(BEFORE_S.into_iter().map(Self::Before))
    }

    /// `70 %`, `200 ms`.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Share(share) => format!("{:.0} %", 100.0 * share),
            Self::Before(s) => format!("{:.0} ms", 1e3 * s),
        }
    }

    /// The last of these times, s, that is not after the moment; `None` where all are later.
    #[must_use]
    pub fn index(self, times_s: impl IntoIterator<Item = f64>, span: Span) -> Option<usize> {
        let Span { start_s, contact_s } = span;
        let t_s = match self {
            Self::Share(share) => contact_s - (1.0 - share) * (contact_s - start_s),
            Self::Before(s) => contact_s - s,
        };
        let by_then = |&at_s: &f64| at_s <= t_s + ROUNDING_S;
        let seen = times_s.into_iter().take_while(by_then).count();
        seen.checked_sub(1)
    }
}

/// Which samples of a reach are written: those of all moments, and the first of every 50 ms.
#[must_use]
pub fn written(times_s: &[f64], span: Span) -> BTreeSet<usize> {
    let at = |m: Moment| m.index(times_s.iter().copied(), span);
    let mut chosen: BTreeSet<usize> = Moment::all().filter_map(at).collect();
    let mut last = None;
    for (i, t_s) in times_s.iter().enumerate() {
        let stretch = ((t_s - span.start_s + ROUNDING_S) / WRITTEN_EVERY_S).floor();
        if last != Some(stretch) {
            chosen.insert(i);
            last = Some(stretch);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_moment_is_written_and_one_sample_in_50_ms() {
        let times: Vec<f64> = (0..=100).map(|k| f64::from(k) * 0.01).collect();
        let span = Span {
            start_s: 0.0,
            contact_s: 1.0,
        };
        let chosen = written(&times, span);
        for moment in Moment::all() {
            let index = moment.index(times.iter().copied(), span).unwrap();
            assert!(chosen.contains(&index), "{}", moment.name());
        }
        assert!((20..30).contains(&chosen.len()), "{chosen:?}");
        let steps = chosen.iter().zip(chosen.iter().skip(1));
        assert!(steps.map(|(a, b)| b - a).max().unwrap() <= 5);
        // A reach that starts late is not judged early.
        assert_eq!(
            Moment::Before(0.3).index(times[80..].iter().copied(), span),
            None
        );
        assert_eq!(written(&[], span).len(), 0);
    }
}
