//! Settings of the policy.

use crate::error::SessionError;
use hwall_numeric::check::{non_negative, positive, within};

/// Costs and thresholds of the policy.
///
/// In every frame the arm waits, pre-positions itself or presents a place, whichever has the least expected loss. The unit of loss is one
/// missed touch. The belief about the next touch contains all that is known about the person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolicyConfig {
    /// Loss of a false dispatch (a board sent to a place that is not touched), touches; default 0.2. It trades boards in time against false
    /// dispatches: a smaller value sends more boards. It is charged once, when the board is sent.
    pub false_dispatch: f64,
    /// Share of the loss of a touch that is saved if the board arrives after the hand, in [0, 1]; default 0.1.
    pub late_share: f64,
    /// While the hand moves: share of the remaining time that is left when its motion reveals the place, in (0, 1]; default 0.4. While the
    /// hand rests: the expected time from reveal to touch of an unknown person, as a share of the available time.
    pub onset_share: f64,
    /// Probability that an apparent reach or an apparent choice by the eyes leads to no touch, in [0, 1]; default 0.05.
    pub detour_share: f64,
    /// Hysteresis: a new choice must save at least this loss, touches; default 0.02. Less is within the noise of the predictions.
    pub least_gain: f64,
    /// Mean speed over 0.1 s towards the predicted place above which the hand is reaching, m/s; default 0.045: three standard deviations
    /// of the mean for a resting hand that is tracked with 1 mm of noise.
    pub reach_m_per_s: f64,
    /// A hand with a mean speed over 0.1 s below this is at rest, m/s; default 0.3. Noise of the tracker of 1 mm adds 0.014 m/s.
    pub still_m_per_s: f64,
    /// A hand closer than this to the predicted surface is about to touch it, m; default 0.06: within it, the direction to a point on the
    /// surface is noise.
    pub near_m: f64,
    /// Longest pause within a reach, s; default 0.3.
    pub pause_s: f64,
    /// How much of the face is slack.
    pub slack: SlackConfig,
}

/// How far the middle of the board may be from the predicted point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlackConfig {
    /// Number of standard deviations of the predicted point that must lie on the face; the rest of the face is slack. Default 1.
    pub deviations: f64,
    /// Standard deviation assumed for a prediction that states none, m; default 0.02.
    pub default_sd_m: f64,
    /// Margin at the edge of the face, in addition to [`PlaceTolerance::inset_m`](hwall_haptics::PlaceTolerance::inset_m), m; default
    /// 0.005.
    pub margin_m: f64,
}

impl Default for PolicyConfig {
    fn default() -> Self {
        Self {
            false_dispatch: 0.2,
            late_share: 0.1,
            onset_share: 0.4,
            detour_share: 0.05,
            least_gain: 0.02,
            reach_m_per_s: 0.045,
            still_m_per_s: 0.3,
            near_m: 0.06,
            pause_s: 0.3,
            slack: SlackConfig::default(),
        }
    }
}

impl Default for SlackConfig {
    fn default() -> Self {
        Self {
            deviations: 1.0,
            default_sd_m: 0.02,
            margin_m: 0.005,
        }
    }
}

impl PolicyConfig {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), SessionError> {
        for (what, value) in [
            ("false_dispatch", self.false_dispatch),
            ("least_gain", self.least_gain),
            ("still_m_per_s", self.still_m_per_s),
            ("near_m", self.near_m),
            ("pause_s", self.pause_s),
            ("deviations", self.slack.deviations),
            ("margin_m", self.slack.margin_m),
        ] {
            non_negative(what, value)?;
        }
        for (what, value) in [
            ("late_share", self.late_share),
            ("onset_share", self.onset_share),
            ("detour_share", self.detour_share),
        ] {
            within(what, value, 0.0..=1.0, "in [0, 1]")?;
        }
        positive("onset_share", self.onset_share)?;
        positive("reach_m_per_s", self.reach_m_per_s)?;
        positive("default_sd_m", self.slack.default_sd_m)?;
        Ok(())
    }
}
