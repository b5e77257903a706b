//! Settings of the policy.

use crate::error::SessionError;
use hwall_numeric::check::{non_negative, positive};

/// When the board goes where.
///
/// People prefer a board that moves early and once to a board that chases them. The board follows a reaching hand. It also goes to
/// what is fixated, as long as this person's fixations lead to touches. For a person who looks around, the arm only prepositions:
/// it waits closer to what they look at. After a touch the arm returns to its waiting posture. Without eye tracking it waits
/// where the hand will probably return.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolicyConfig {
    /// The board does not follow a predicted point that moves by less than this, m; default 0.05, half of the half width of a board.
    pub steady_m: f64,
    /// A predicted place counts after it has stayed for this time, s; default 0.05. During a saccade, predictions change quickly.
    pub settle_s: f64,
    /// A predicted point that moves by less than this between frames counts as the same place, m; default 0.06.
    pub settle_m: f64,
    /// Distance behind the surface at which the board waits at a fixated or formerly touched place, m; default 0: on it, because a
    /// board that need not move again arrives sooner.
    pub ready_m: f64,
    /// A hand slower than this is at rest, m/s; default 0.3. A third of it is measurement noise.
    pub still_m_per_s: f64,
    /// A fixation counts if it began after the hand had been at rest for this time, s; default 0.1.
    pub still_s: f64,
    /// A fixation longer than this without a reach no longer holds the board, s; default 1.
    pub look_s: f64,
    /// Fixations dispatch the board only if at least this fraction of the person's fixations led to a reach; default 0.9.
    pub trusted_share: f64,
    /// Least probability at which the board waits at a place that was touched before; default 0.37. Only without eye tracking.
    pub again_share: f64,
    /// Mean speed over 0.1 s towards the predicted place above which the hand is reaching, m/s; default 0.045: three standard
    /// deviations of a hand at rest, seen by a tracker with 1 mm of noise.
    pub reach_m_per_s: f64,
    /// A hand closer than this to the predicted surface is about to touch it, m; default 0.06.
    pub near_m: f64,
    /// A reach may pause for this time, s; default 0.3.
    pub pause_s: f64,
    /// Standard deviations of the predicted point that must lie on the face; the rest of the face is slack. Default 1.
    pub deviations: f64,
    /// Standard deviation of a prediction that states none, m; default 0.02.
    pub default_sd_m: f64,
    /// Largest standard deviation of the line of sight that counts for a fixated place, rad; default 0.026, 1.5 degrees, which is
    /// 26 mm at 1 m.
    pub looked_rad: f64,
    /// A prediction with a larger standard deviation is ignored, m; default 0.2.
    pub unsure_m: f64,
    /// The same for a prediction that would move the board away from a fixated place that is not yet ruled out, m; default 0.08.
    pub sure_m: f64,
    /// Margin of the slack at the edge of the face, in addition to
    /// [`PlaceTolerance::inset_m`](hwall_haptics::PlaceTolerance::inset_m), m; default 0.005.
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
