//! The tracked hand: of a simulated person, or recorded.

use hwall_hand::{HandFilterConfig, HandFrame};
use hwall_sim::TouchSequence;

/// A tracked hand.
pub enum Hand {
    /// A simulated person, sampled by a tracker at this period, s.
    Simulated(Box<TouchSequence>, f64),
    /// Recorded frames in the base frame, in order of time, and how to filter them.
    Recorded(Vec<HandFrame>, HandFilterConfig),
}

/// Rounding tolerance, s: a frame due with a cycle comes with that cycle.
const ROUNDING_S: f64 = 1e-9;

impl Hand {
    /// First and last instant, s.
    #[must_use]
    pub fn span_s(&self) -> (f64, f64) {
        match self {
            Self::Simulated(sequence, _) => (0.0, sequence.duration_s()),
            Self::Recorded(frames, _) => (
                frames.first().map_or(0.0, |f| f.t_s),
                frames.last().map_or(0.0, |f| f.t_s),
            ),
        }
    }

    /// Filter settings for its frames.
    #[must_use]
    pub fn filter(&self) -> HandFilterConfig {
        match self {
            Self::Simulated(..) => HandFilterConfig::simulated(),
            Self::Recorded(_, filter) => *filter,
        }
    }

    /// Is the head tracked in any frame?
    #[must_use]
    pub fn sees_head(&self) -> bool {
        match self {
            Self::Simulated(..) => true,
            Self::Recorded(frames, _) => frames.iter().any(|frame| frame.head_m.is_some()),
        }
    }

    /// The next frame not later than `t_s`; `next` counts frames.
    #[must_use]
    pub fn frame(&self, next: &mut usize, t_s: f64) -> Option<HandFrame> {
        let frame = match self {
            Self::Simulated(sequence, period_s) => {
                let due_s = *next as f64 * period_s;
                (due_s <= t_s).then(|| sequence.tracked(due_s))
            }
            Self::Recorded(frames, _) => {
                let is_due = |frame: &&HandFrame| frame.t_s <= t_s + ROUNDING_S;
                frames.get(*next).filter(is_due).copied()
            }
        };
        *next += usize::from(frame.is_some());
        frame
    }
}
