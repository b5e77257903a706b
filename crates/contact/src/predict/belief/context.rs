//! The sources of evidence, and the variables that their shares depend on.

use crate::predict::hand::phase::ReachPhase;

/// A source of evidence for the next contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum EvidenceSource {
    /// The estimated end of the motion.
    Motion,
    /// The end of the motion, confirmed by the present fixation.
    MotionAndFixation,
    /// The present fixation: its line of sight, at the distance given by the motion.
    Fixation,
    /// The fixation before the present one.
    PreviousFixation,
    /// The places this person has touched before.
    TouchedBefore,
    /// None of the others: anywhere around a resting hand, or the end of the motion with three times the error that the estimator states.
    Anywhere,
}

impl EvidenceSource {
    /// All of them, in the order of shares.
    pub const ALL: [Self; SOURCES] = [
        Self::Motion,
        Self::MotionAndFixation,
        Self::Fixation,
        Self::PreviousFixation,
        Self::TouchedBefore,
        Self::Anywhere,
    ];
}

pub(in crate::predict) const SOURCES: usize = 6;

/// One number for each source, in the order of [`EvidenceSource::ALL`].
pub type SourceShares = [f64; SOURCES];

/// Nodes of the fixation age for the table of shares, s; shares in between are interpolated.
pub(super) const FIXATION_AGES_S: [f64; 6] = [0.05, 0.15, 0.27, 0.45, 0.8, 1.5];
/// The table has one more row, for lost gaze.
pub(super) const AGES: usize = FIXATION_AGES_S.len() + 1;
/// Nodes of [`Context::cue`] for the table of shares.
pub(super) const CUES: [f64; 3] = [0.0, 0.5, 1.0];
/// The table has one more column, for an unknown cue: all samples.
pub(super) const COLUMNS: usize = CUES.len() + 1;

/// The variables that the shares of the sources depend on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::predict) struct Context {
    pub(super) phase: ReachPhase,
    /// Age of the present fixation, s.
    pub(super) fixation_age_s: Option<f64>,
    /// Remaining weight of the previous fixation, in [0, 1].
    pub(super) before_left: f64,
    /// Has the person touched anything yet?
    pub(super) has_places: bool,
    /// Distance of the fixation from the predicted end of the motion, in [0, 1]; `None` at rest, and without a fixation.
    pub(super) cue: Option<f64>,
}

/// The two nodes around a value, with their weights.
fn nodes(kept: &[f64], value: f64) -> [(usize, f64); 2] {
    let above = kept.partition_point(|&node| node <= value);
    let below = above.saturating_sub(1);
    if above == 0 || above == kept.len() {
        return [(below, 1.0), (below, 0.0)];
    }
    let share = (value - kept[below]) / (kept[above] - kept[below]);
    [(below, 1.0 - share), (above, share)]
}

impl Context {
    /// The surrounding cells of the table of shares: age, cue, weight.
    pub(super) fn nodes(&self) -> [(usize, usize, f64); 4] {
        let ages = match self.fixation_age_s {
            Some(age_s) => nodes(&FIXATION_AGES_S, age_s),
            None => [(AGES - 1, 1.0), (AGES - 1, 0.0)],
        };
        let all = COLUMNS - 1;
        let cues = self
            .cue
            .map_or([(all, 1.0), (all, 0.0)], |cue| nodes(&CUES, cue));
        std::array::from_fn(|i| {
            let ((age, a), (cue, c)) = (ages[i / 2], cues[i % 2]);
            (age, cue, a * c)
        })
    }

    /// Removes the shares of unavailable sources and normalises the rest.
    pub(super) fn only_those_there(&self, mut shares: SourceShares) -> SourceShares {
        let moves = !matches!(self.phase, ReachPhase::Rest | ReachPhase::Drifting);
        let there = [
            f64::from(u8::from(moves)),
            f64::from(u8::from(moves && self.fixation_age_s.is_some())),
            f64::from(u8::from(self.fixation_age_s.is_some())),
            self.before_left,
            f64::from(u8::from(self.has_places)),
            1.0,
        ];
        shares
            .iter_mut()
            .zip(there)
            .for_each(|(s, there)| *s *= there);
        let sum: f64 = shares.iter().sum();
        if sum > 0.0 {
            shares.map(|share| share / sum)
        } else {
            [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
        }
    }
}
