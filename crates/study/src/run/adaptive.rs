//! Adaptive procedures: the answers so far choose the next condition.

use super::record::TrialRecord;
use crate::error::StudyError;
use crate::protocol::{Procedure, Protocol, TrialKind};
use hwall::psychophysics::{
    QuestEstimate, QuestGrid, QuestPlus, Staircase, StaircaseConfig, StaircaseEstimate,
};

/// The adaptive procedure of one subject. The first level of the only factor is the reference; later levels are easier
/// to discriminate from it.
#[derive(Debug, Clone)]
pub enum Adaptive {
    /// Two right answers down, one wrong one up; stimuli are indices of levels.
    Staircase(Staircase),
    /// QUEST+; stimuli are the levels themselves.
    Quest(QuestPlus),
}

/// Confidence of the intervals of thresholds.
const CONFIDENCE: f64 = 0.95;
/// Smallest assumed lapse rate.
const LAPSE: f64 = 0.02;

impl Adaptive {
    /// The adaptive procedure of a protocol before the first answer; `None` for other procedures.
    ///
    /// # Errors
    /// More than one factor, fewer than three levels, levels that are not increasing numbers.
    pub fn of(protocol: &Protocol) -> Result<Option<Self>, StudyError> {
        if !matches!(protocol.procedure, Procedure::Staircase | Procedure::Quest) {
            return Ok(None);
        }
        let levels = protocol.rising_levels()?;
        let last = levels.len() - 1;
        if protocol.procedure == Procedure::Staircase {
            let config = StaircaseConfig {
                reversals: 100_000,
                ..StaircaseConfig::two_down(last as f64, 1.0, [1.0, last as f64])
            };
            return Ok(Some(Self::Staircase(Staircase::new(config)?)));
        }
        let (low, high) = (levels[1], levels[last]);
        let grid = QuestGrid {
            stimuli: levels[1..].to_vec(),
            lapses: vec![LAPSE],
            ..QuestGrid::over([low, high], 25, 0.5)
        };
        Ok(Some(Self::Quest(QuestPlus::new(grid)?)))
    }

    /// Updates with a subject's valid trials, in order.
    ///
    /// # Errors
    /// Answers that the procedure cannot use.
    pub fn after<'a>(
        mut self,
        records: impl Iterator<Item = &'a TrialRecord>,
    ) -> Result<Self, StudyError> {
        for record in records.filter(|r| r.trial.kind == TrialKind::Main) {
            let Some(right) = record.judged_rougher() else {
                continue;
            };
            match &mut self {
                Self::Staircase(stairs) => stairs.answer(right),
                Self::Quest(quest) => {
                    quest.answer(record.trial.condition.saturating_sub(1), right)?
                }
            }
        }
        Ok(self)
    }

    /// The next condition.
    #[must_use]
    pub fn condition(&self) -> usize {
        match self {
            Self::Staircase(stairs) => stairs.stimulus().map_or(1, |place| place.round() as usize),
            Self::Quest(quest) => quest.next_place() + 1,
        }
    }

    /// The threshold so far; a staircase's is an index of the levels.
    ///
    /// # Errors
    /// Never, with this confidence.
    pub fn threshold(&self) -> Result<AdaptiveThreshold, StudyError> {
        Ok(match self {
            Self::Staircase(stairs) => AdaptiveThreshold::Staircase(stairs.estimate(CONFIDENCE)?),
            Self::Quest(quest) => AdaptiveThreshold::Quest(quest.estimate(CONFIDENCE)?),
        })
    }
}

/// The threshold of an adaptive procedure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AdaptiveThreshold {
    /// Of a staircase; `None` with too few reversals.
    Staircase(Option<StaircaseEstimate>),
    /// Of QUEST+.
    Quest(QuestEstimate),
}
