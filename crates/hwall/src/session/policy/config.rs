//! Settings of the policy.

use crate::error::SessionError;
use hwall_numeric::check::{non_negative, positive};

/// When the board goes where.
///
/// People want a board that goes early and once and then stands still, rather than one that chases them. What the hand reaches
/// for brings the board; so does what is looked at, as long as the looks of this person lead to touches. Whoever looks around
/// only makes the arm lean towards where they look. After a touch the arm returns to its waiting posture, unless nobody's eyes are seen and
/// the hand probably comes back to a place that it has touched: there it waits for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolicyConfig {
    /// The predicted place stays while it moves less than this, m; default 0.05, half of the half width of a board.
    pub steady_m: f64,
    /// A predicted place counts once it has stayed for this long, s; default 0.05. A saccade in flight names many places.
    pub settle_s: f64,
    /// A predicted place that moves by less than this between frames stays, m; default 0.06.
    pub settle_m: f64,
    /// How far behind a surface that is looked at, or was touched before, the board gets ready, m; default 0: on it, for a board
    /// that need not move again is there sooner.
    pub ready_m: f64,
    /// A hand slower than this rests, m/s; default 0.3: that of a resting hand is seen with an error of a third of it.
    pub still_m_per_s: f64,
    /// A look counts if it began when the hand had rested for this long, s; default 0.1.
    pub still_s: f64,
    /// A look that has lasted this long without a reach no longer holds the board, s; default 1.
    pub look_s: f64,
    /// A look brings the board only while at least this share of the person's looks led to a reach; default 0.9. Whoever
    /// looks around is served when the hand sets off.
    pub trusted_share: f64,
    /// A resting hand is awaited at a place that it has touched before if it comes back there with this probability at least; default
    /// 0.37. Only of a person whose gaze is not seen.
    pub again_share: f64,
    /// A hand this fast towards the predicted place in the mean of 0.1 s reaches for it, m/s; default 0.045: three standard
    /// deviations of one that rests before a tracker with 1 mm of noise.
    pub reach_m_per_s: f64,
    /// A hand this near to the predicted surface is about to touch it, m; default 0.06.
    pub near_m: f64,
    /// Time for which a reach that pauses still counts, s; default 0.3.
    pub pause_s: f64,
    /// How many standard deviations of the predicted point must lie on the face; the rest of the face is slack. Default 1.
    pub deviations: f64,
    /// Standard deviation assumed of a prediction that comes without one, m; default 0.02.
    pub default_sd_m: f64,
    /// Largest standard deviation of the line of sight that counts of a place that is looked at, rad; default 0.026, 1.5 degrees.
    /// On the surface it is as many metres at 1 m, and more where the line of sight grazes it; the slack is that of 1 m.
    pub looked_rad: f64,
    /// A prediction whose standard deviation is larger than this moves nothing, m; default 0.2.
    pub unsure_m: f64,
    /// The same for one that would move the board away from a place that was looked at, m, unless that place is out of the
    /// question by then; default 0.08.
    pub sure_m: f64,
    /// Margin of the slack at the edge of the face besides that of [`PlaceTolerance::inset_m`](hwall_haptics::PlaceTolerance::inset_m), m; default 0.005.
    pub margin_m: f64,
}

impl Default for PolicyConfig {
    fn default() -> Self {
        Self {
            steady_m: 0.05,
            settle_s: 0.05,
            settle_m: 0.06,
            ready_m: 0.0,
            still_m_per_s: 0.3,
            still_s: 0.1,
            look_s: 1.0,
            trusted_share: 0.9,
            again_share: 0.37,
            reach_m_per_s: 0.045,
            near_m: 0.06,
            pause_s: 0.3,
            deviations: 1.0,
            default_sd_m: 0.02,
            looked_rad: 0.026,
            unsure_m: 0.2,
            sure_m: 0.08,
            margin_m: 0.005,
        }
    }
}

impl PolicyConfig {
    /// Rejects settings below zero.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), SessionError> {
        for (what, value) in [
            ("settle_s", self.settle_s),
            ("ready_m", self.ready_m),
            ("still_m_per_s", self.still_m_per_s),
            ("still_s", self.still_s),
            ("look_s", self.look_s),
            ("trusted_share", self.trusted_share),
            ("again_share", self.again_share),
            ("near_m", self.near_m),
            ("pause_s", self.pause_s),
            ("deviations", self.deviations),
            ("default_sd_m", self.default_sd_m),
            ("looked_rad", self.looked_rad),
            ("unsure_m", self.unsure_m),
            ("sure_m", self.sure_m),
            ("margin_m", self.margin_m),
        ] {
            non_negative(what, value)?;
        }
        positive("steady_m", self.steady_m)?;
        positive("settle_m", self.settle_m)?;
        positive("reach_m_per_s", self.reach_m_per_s)?;
        Ok(())
    }
}
