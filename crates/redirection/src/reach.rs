//! A reach with a real end that differs from its virtual end.

use crate::error::{RedirectionError, Result};
use crate::reach_thresholds::{ReachFrame, ReachShift, ReachThresholds};
use glam::DVec3;
use hwall_geometry::direction;
use hwall_numeric::check::all_finite;

/// Within this distance of the start a hand is not shifted, m: angles are undefined there.
const AT_START_M: f64 = 1e-6;

/// Bisection steps for a shift that would be noticed.
const HALVINGS: usize = 40;

/// Gradually shifts the virtual hand from the real one, so that it meets the virtual surface when the real hand
/// meets the board.
///
/// Board and virtual surface are parallel. The shift grows in proportion to the progress towards the board along its normal:
/// zero at the start, full at the board. A hand that takes another path, or reaches for another place on the board, therefore
/// also meets both surfaces at the same instant. Source of the growing shift: body warping in [Azmandian 2016], which uses
/// distances from the start instead of planes.
///
/// ```
/// use hwall_redirection::glam::DVec3;
/// use hwall_redirection::{ReachFrame, ReachShift, ReachThresholds, RedirectedReach};
///
/// let (start, seen) = (DVec3::new(1.0, 0.1, 0.7), DVec3::new(0.6, 0.0, 0.9));
/// let shift = ReachShift { horizontal_rad: 0.05, vertical_rad: 0.0, gain: 0.9 };
/// let board = ReachFrame::new(start, seen)?.real_goal_m(&shift);
/// let reach = RedirectedReach::new(start, seen, board, DVec3::X, &ReachThresholds::default())?;
/// let hand = reach.virtual_hand(board)?;
/// assert!(hand.position_m.distance(seen) < 1e-12 && !hand.limited);
/// # Ok::<(), hwall_redirection::RedirectionError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RedirectedReach {
    frame: ReachFrame,
    thresholds: ReachThresholds,
    shift: ReachShift,
    normal: DVec3,
    /// Distance from the start to the plane of the board, m.
    before_m: f64,
    /// Virtual minus real position at the board, m.
    offset_m: DVec3,
}

/// The virtual hand at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VirtualHand {
    /// Displayed position, m.
    pub position_m: DVec3,
    /// Vector from the real hand to the virtual one, m.
    pub shift_m: DVec3,
    /// The shift is smaller than the reach requires, because the full shift would be noticed here: the hand is not at the
    /// intended position.
    pub limited: bool,
}

impl RedirectedReach {
    /// From the start of the hand, the virtual point, the real point on the board (m, one frame, z up), and the normal of
    /// both surfaces towards the person (any length but zero).
    ///
    /// # Errors
    /// NaN, infinity, a normal without a direction, no reach, a start that is not in front of both surfaces, a shift beyond the
    /// thresholds, thresholds out of range.
    pub fn new(
        start_m: DVec3,
        virtual_goal_m: DVec3,
        real_goal_m: DVec3,
        normal: DVec3,
        thresholds: &ReachThresholds,
    ) -> Result<Self> {
        thresholds.validate()?;
        all_finite("real_goal_m", &real_goal_m.to_array())?;
        let frame = ReachFrame::new(start_m, virtual_goal_m)?;
        let normal = direction("normal", normal)?;
        let before_m = (start_m - real_goal_m).dot(normal);
        let before_both_m = before_m.min((start_m - virtual_goal_m).dot(normal));
        if before_both_m <= 0.0 {
            return Err(RedirectionError::NotBefore {
                before_m: before_both_m,
            });
        }
        let shift = frame.shift_to(real_goal_m);
        thresholds.check(&shift)?;
        Ok(Self {
            frame,
            thresholds: *thresholds,
            shift,
            normal,
            before_m,
            offset_m: virtual_goal_m - real_goal_m,
        })
    }

    /// Difference of the real reach from the virtual one.
    #[must_use]
    pub const fn shift(&self) -> &ReachShift {
        &self.shift
    }

    /// Vector from the real point to the virtual one at the board, m.
    #[must_use]
    pub const fn offset_m(&self) -> DVec3 {
        self.offset_m
    }

    /// The virtual hand for a real hand position, m. Continuous in the position; does not allocate.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn virtual_hand(&self, real_hand_m: DVec3) -> Result<VirtualHand> {
        all_finite("real_hand_m", &real_hand_m.to_array())?;
        let start_m = self.frame.start_m();
        let done = ((start_m - real_hand_m).dot(self.normal) / self.before_m).clamp(0.0, 1.0);
        let shown = |share: f64| {
            let shift_m = self.offset_m * (done * share);
            VirtualHand {
                position_m: real_hand_m + shift_m,
                shift_m,
                limited: share < 1.0,
            }
        };
        if done == 0.0 {
            return Ok(shown(1.0));
        }
        let unnoticed = |share: f64| {
            let between = self
                .frame
                .shift_between(real_hand_m, shown(share).position_m);
            self.thresholds.check(&between).is_ok()
        };
        if unnoticed(1.0) {
            return Ok(shown(1.0));
        }
        if real_hand_m.distance(start_m) < AT_START_M {
            return Ok(shown(0.0));
        }
        let (mut fine, mut noticed) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (fine + noticed);
            if unnoticed(middle) {
                fine = middle;
            } else {
                noticed = middle;
            }
        }
        Ok(shown(fine))
    }
}
