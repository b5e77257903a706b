//! The moments at which estimates of a reach are evaluated, and the samples that are written.

use hwall_hand::LabelledReach;
use std::collections::BTreeSet;

/// Shares of the duration of a reach at which it is evaluated.
pub const SHARES: [f64; 6] = [0.3, 0.5, 0.7, 0.8, 0.9, 1.0];
/// Times before contact at which it is evaluated, s.
pub const BEFORE_S: [f64; 7] = [0.5, 0.4, 0.3, 0.2, 0.15, 0.1, 0.05];
/// In addition to the moments, one prediction is written per interval of this length, s.
pub const WRITTEN_EVERY_S: f64 = 0.05;
/// Rounding tolerance, s.
const ROUNDING_S: f64 = 1e-9;

/// From the start of a reach to its contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Start of the hand, s.
    pub start_s: f64,
    /// Contact, s.
    pub contact_s: f64,
}

impl Span {
    /// The span of a reach.
    #[must_use]
    pub fn of(reach: &LabelledReach) -> Self {
        Self {
            start_s: reach.contact_s - reach.duration_s(),
            contact_s: reach.contact_s,
        }
    }
}

/// A moment of evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Moment {
    /// After a share of the duration.
    Share(f64),
    /// A time before contact, s.
    Before(f64),
    /// When the hand clearly moves: when an online system knows that it has started ([`ReachOnset`](hwall_hand::ReachOnset)).
    Started,
    /// Once the touching point has moved this far from its first position, m: detectable online.
    Gone(f64),
}

impl Moment {
    /// The default ones, shares of the duration first.
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
            Self::Started => "hand starts".to_owned(),
            Self::Gone(m) => format!("after {:.0} mm", 1e3 * m),
        }
    }

    /// The frame of a reach at the moment: the last one up to that time, or the first one at that distance; `None` if the reach
    /// starts later.
    #[must_use]
    pub fn frame(self, reach: &LabelledReach) -> Option<usize> {
        match self {
            Self::Started => reach.onset().map(|[_, clear]| clear),
            Self::Gone(far_m) => {
                let place = |k: usize| reach.frames[k].point(reach.point);
                let first_m = (0..reach.frames.len()).find_map(place)?;
                (0..reach.frames.len())
                    .find(|&k| place(k).is_some_and(|at_m| at_m.distance(first_m) >= far_m))
            }
            _ => self.index(reach.frames.iter().map(|f| f.t_s), Span::of(reach)),
        }
    }

    /// Index of the last of these times, s, not after the moment; `None` if all are later, and for moments not defined by time.
    #[must_use]
    pub fn index(self, times_s: impl IntoIterator<Item = f64>, span: Span) -> Option<usize> {
        let Span { start_s, contact_s } = span;
        let t_s = match self {
            Self::Share(share) => contact_s - (1.0 - share) * (contact_s - start_s),
            Self::Before(s) => contact_s - s,
            Self::Started | Self::Gone(_) => return None,
        };
        let by_then = |&at_s: &f64| at_s <= t_s + ROUNDING_S;
        let seen = times_s.into_iter().take_while(by_then).count();
        seen.checked_sub(1)
    }
}

/// Samples of a reach to write: those of all moments, and the first of every 50 ms.
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
    use glam::DVec3;
    use hwall_hand::{HandFrame, HandPoint};

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
        // A reach that starts late is not evaluated early.
        let late = times[80..].iter().copied();
        assert_eq!(Moment::Before(0.3).index(late, span), None);
        assert_eq!(written(&[], span).len(), 0);
    }

    #[test]
    fn reaches_that_start_later_are_not_judged_earlier() {
        let frame = |k: u32| {
            let mut frame = HandFrame::empty(f64::from(k) * 0.01);
            frame.set_point(HandPoint::Index, Some(DVec3::splat(frame.t_s)));
            frame
        };
        let frames = (0..=100).map(frame).collect();
        let mut short = LabelledReach::new(HandPoint::Index, frames, DVec3::ONE, 1.0);
        short.frames.drain(..80);
        // A hand that moves 0.1 m never moves 10 m, and it moves from the first sample on.
        for (moment, frame) in [
            (Moment::Before(0.3), None),
            (Moment::Before(0.1), Some(10)),
            (Moment::Share(1.0), Some(20)),
            (Moment::Gone(0.1), Some(6)),
            (Moment::Gone(10.0), None),
            (Moment::Started, Some(0)),
        ] {
            assert_eq!(moment.frame(&short), frame, "{}", moment.name());
        }
    }
}
