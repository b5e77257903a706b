//! The inputs of a regression, in files of learned models.

use super::length;
use crate::error::ContactError;
use crate::learned::reaches::reach_track::{Inputs, MOST_LAGS};
use glam::DVec3;
use hwall_hand::{HandPoint, NamedPoint, ReachOnset};
use hwall_numeric::check::{non_negative, positive, that};
use serde::{Deserialize, Serialize};

/// Points are numbers in the order of [`NamedPoint::ALL`].
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileInputs {
    point: usize,
    others: Vec<usize>,
    head: bool,
    gaze: bool,
    lags: usize,
    offsets_m: Vec<Option<DVec3>>,
    head_m: DVec3,
    mean_gaze: DVec3,
    /// Speed below which a hand is slow before it starts, and speed above which it clearly moves, m/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    onset_m_per_s: Option<[f64; 2]>,
}

impl FileInputs {
    pub(super) fn of(inputs: &Inputs) -> Self {
        Self {
            point: inputs.point as usize,
            others: inputs.others.iter().map(|p| p.index()).collect(),
            head: inputs.head,
            gaze: inputs.gaze,
            lags: inputs.lags,
            offsets_m: inputs.offsets_m.to_vec(),
            head_m: inputs.head_m,
            mean_gaze: inputs.mean_gaze,
            onset_m_per_s: inputs.onset.map(|o| [o.slow_m_per_s, o.clear_m_per_s]),
        }
    }

    pub(super) fn validate(&self) -> Result<(), ContactError> {
        let within = |what, value: usize, ok: bool, wanted| that(ok, what, value as f64, wanted);
        let of_hand = self.point < HandPoint::ALL.len();
        within("point", self.point, of_hand, "a point of the hand")?;
        for (k, &other) in self.others.iter().enumerate() {
            within("others", other, other < NamedPoint::COUNT, "a point")?;
            let new = other != self.point && !self.others[..k].contains(&other);
            within("others", other, new, "named once")?;
        }
        within("lags", self.lags, self.lags <= MOST_LAGS, "at most 8")?;
        length("offsets_m", NamedPoint::COUNT, self.offsets_m.len())?;
        if let Some([slow, clear]) = self.onset_m_per_s {
            positive("slow speed before an onset", slow)?;
            non_negative(
                "clear speed after an onset, less the slow one",
                clear - slow,
            )?;
        }
        Ok(())
    }

    /// From a valid file.
    pub(super) fn to_inputs(&self) -> Inputs {
        Inputs {
            point: HandPoint::ALL[self.point],
            others: self.others.iter().map(|p| NamedPoint::ALL[*p]).collect(),
            head: self.head,
            gaze: self.gaze,
            lags: self.lags,
            offsets_m: std::array::from_fn(|k| self.offsets_m.get(k).copied().flatten()),
            head_m: self.head_m,
            mean_gaze: self.mean_gaze,
            onset: self.onset_m_per_s.map(|[slow, clear]| ReachOnset {
                slow_m_per_s: slow,
                clear_m_per_s: clear,
            }),
        }
    }
}
