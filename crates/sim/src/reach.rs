//! One reach: the noise-free way of the index fingertip to a touch and back.

use crate::SimError;
use crate::error::finite;
use glam::DVec3;

/// Least distance of the resting fingertip in front of a surface, m; less is no reach.
const MIN_HEIGHT_M: f64 = 0.02;

/// A touch to be made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchPlan {
    /// Point on the surface, base frame, m.
    pub target_m: DVec3,
    /// Normal of the surface there, facing the person, base axes; any length but zero.
    pub normal: DVec3,
}

/// What really happens in a touch, free of tracker noise. Times in s from the start of the
/// sequence, in the order of the fields.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchTruth {
    /// Point on the surface, base frame, m.
    pub target_m: DVec3,
    /// Unit normal, facing the person, base axes.
    pub normal: DVec3,
    /// How far beyond the surface the fingertip wants to go, m.
    pub depth_m: f64,
    /// The gaze leaves for the target.
    pub look_s: f64,
    /// The hand starts.
    pub start_s: f64,
    /// The index fingertip, tremor included, crosses the surface; it does so within the tremor
    /// amplitude of the target.
    pub contact_s: f64,
    /// The fingertip wants to be `depth_m` beyond the surface.
    pub press_s: f64,
    /// The hand starts to withdraw.
    pub withdraw_s: f64,
    /// The fingertip crosses the surface again.
    pub release_s: f64,
    /// The hand is back at rest.
    pub end_s: f64,
}

/// Share of a minimum-jerk movement done after the share `tau` of its time; clamped to `0..=1`.
///
/// `10 τ³ - 15 τ⁴ + 6 τ⁵`; the peak speed is 1.875 times distance over time. NaN stays NaN.
/// Source: Flash and Hogan 1985, The coordination of arm movements.
#[must_use]
pub fn minimum_jerk(tau: f64) -> f64 {
    let tau = tau.clamp(0.0, 1.0);
    tau * tau * tau * (10.0 + tau * (6.0 * tau - 15.0))
}

/// The way of the index fingertip from rest to the wished depth, by the share `tau` of the time.
///
/// Along the normal it is one minimum-jerk movement from rest to the depth, so the fingertip
/// still moves when it meets the surface; along the surface another one, that ends as the
/// surface is met, plus a sideways bow that is over by then. So the fingertip meets the surface
/// exactly at the target and then presses straight in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ReachPath {
    target_m: DVec3,
    normal: DVec3,
    depth_m: f64,
    /// Rest above the surface, along the normal.
    height_m: f64,
    /// Rest relative to the target, along the surface.
    aside_m: DVec3,
    /// Largest deviation of the bow.
    bow_m: DVec3,
    /// Share of the time at which the surface is met.
    tau_contact: f64,
}

impl ReachPath {
    /// `bow` is the deviation in shares of the distance, in two directions along the surface;
    /// `touch` is the index for error messages.
    pub(crate) fn new(
        plan: &TouchPlan,
        touch: usize,
        rest_m: DVec3,
        depth_m: f64,
        bow: [f64; 2],
    ) -> Result<Self, SimError> {
        finite("target_m", &plan.target_m.to_array())?;
        finite("normal", &plan.normal.to_array())?;
        let length = plan.normal.length();
        if !(length > 1e-12 && length.is_finite()) {
            return Err(SimError::Parameter {
                what: "length of the normal",
                value: length,
                wanted: "above 1e-12",
            });
        }
        let normal = plan.normal / length;
        let rest_from_target = rest_m - plan.target_m;
        let height_m = rest_from_target.dot(normal);
        if !(height_m >= MIN_HEIGHT_M && height_m.is_finite()) {
            return Err(SimError::BehindSurface {
                touch,
                height_m,
                needed_m: MIN_HEIGHT_M,
            });
        }
        let share = height_m / (height_m + depth_m);
        let (u, v) = normal.any_orthonormal_pair();
        Ok(Self {
            target_m: plan.target_m,
            normal,
            depth_m,
            height_m,
            aside_m: rest_from_target - normal * height_m,
            bow_m: (u * bow[0] + v * bow[1]) * rest_from_target.length(),
            tau_contact: bisect(0.0, 1.0, |tau| minimum_jerk(tau) < share),
        })
    }

    pub(crate) const fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Share of the movement along the surface, 1 from the contact on.
    pub(crate) fn approach(&self, tau: f64) -> f64 {
        minimum_jerk(tau / self.tau_contact)
    }

    pub(crate) fn tip_m(&self, tau: f64) -> DVec3 {
        let along_normal = self.height_m - (self.height_m + self.depth_m) * minimum_jerk(tau);
        let u = (tau / self.tau_contact).clamp(0.0, 1.0);
        // Peak 1 at half way; two derivatives vanish at both ends.
        let bow = (4.0 * u * (1.0 - u)).powi(3);
        self.target_m
            + self.normal * along_normal
            + self.aside_m * (1.0 - self.approach(tau))
            + self.bow_m * bow
    }
}

/// Where `before` turns from true to false between `lo` and `hi`, to the last bit or nearly.
pub(crate) fn bisect(mut lo: f64, mut hi: f64, before: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (lo + hi);
        if before(middle) {
            lo = middle;
        } else {
            hi = middle;
        }
    }
    0.5 * (lo + hi)
}
