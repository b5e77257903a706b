//! One reach: the noise-free path of the index fingertip to a touch and back.

use super::bisect::bisect;
use super::config::PersonConfig;
use super::glances::Glance;
use super::profile::{Profile, minimum_jerk};
use crate::error::SimError;
use glam::DVec3;
use hwall_numeric::check::{all_finite, that};

/// Minimum distance of the resting fingertip in front of a surface, m.
const MIN_HEIGHT_M: f64 = 0.02;

/// Time in which the hand switches to another target, as a fraction of the time to contact.
const TURN: f64 = 0.35;

/// A touch to plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchPlan {
    /// Point on the surface, base frame, m.
    pub target_m: DVec3,
    /// Normal of the surface there, facing the person, base axes; any length but zero.
    pub normal: DVec3,
}

/// A reach to plan: a touch, and optionally another target that is meant first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReachPlan {
    /// The final touch.
    pub touch: TouchPlan,
    /// The initial target, if the person has a change of mind during the reach.
    pub meant_first: Option<TouchPlan>,
}

impl From<TouchPlan> for ReachPlan {
    fn from(touch: TouchPlan) -> Self {
        Self {
            touch,
            meant_first: None,
        }
    }
}

/// The initial target before a change of mind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChangeOfMind {
    /// Point meant at first, base frame, m.
    pub target_m: DVec3,
    /// Unit normal of the surface there, facing the person, base axes.
    pub normal: DVec3,
    /// The hand starts to switch to the other target, s from the start of the sequence.
    pub switch_s: f64,
}

/// Ground truth of a touch, without tracker noise. Times are in s from the start of the sequence; those from `look_s`
/// to `end_s` increase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchTruth {
    /// Point on the surface, base frame, m.
    pub target_m: DVec3,
    /// Unit normal, facing the person, base axes.
    pub normal: DVec3,
    /// Intended fingertip depth beyond the surface, m.
    pub depth_m: f64,
    /// The gaze shift to the target starts.
    pub look_s: f64,
    /// The hand starts.
    pub start_s: f64,
    /// The index fingertip, tremor included, crosses the surface, within the tremor amplitude of the target.
    pub contact_s: f64,
    /// The intended fingertip position reaches `depth_m` beyond the surface.
    pub press_s: f64,
    /// The hand starts to withdraw.
    pub withdraw_s: f64,
    /// The fingertip crosses the surface again.
    pub release_s: f64,
    /// The hand is back at rest.
    pub end_s: f64,
    /// The initial target, if there was a change of mind.
    pub changed: Option<ChangeOfMind>,
    /// The gaze is off target during the whole reach.
    pub gaze_missed: bool,
    /// The gaze lands on the target; `None` if it does not land before contact. After a change of mind: on the final
    /// target.
    pub landed_s: Option<f64>,
    /// Glances in the preceding pause, in order.
    pub glances: [Option<Glance>; PersonConfig::MOST_GLANCES],
}

/// Shape of a reach, drawn per reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shape {
    /// Depth beyond the surface, m.
    pub(super) depth_m: f64,
    /// Largest lateral deviation in two directions along the surface, as fractions of the distance.
    pub(super) bow: [f64; 2],
    /// Miss of the first part before the correction, in the same directions and unit.
    pub(super) stray: [f64; 2],
    pub(super) profile: Profile,
}

/// The path of the index fingertip from rest to the intended depth, as a function of the fraction `tau` of the time.
///
/// Along the normal it is one movement from rest to the depth, so the fingertip still moves at contact. Along
/// the surface it is another movement, plus a lateral bow and the misdirection of the first part; all of these
/// end at contact. So the fingertip reaches the surface exactly at the target and then presses straight in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ReachPath {
    target_m: DVec3,
    normal: DVec3,
    depth_m: f64,
    /// Height of the rest position above the surface, along the normal.
    height_m: f64,
    /// Rest position relative to the target, along the surface.
    aside_m: DVec3,
    /// Largest deviation of the bow.
    bow_m: DVec3,
    /// Misdirection of the first part.
    stray_m: DVec3,
    profile: Profile,
    /// Share of the time at which the hand meets the surface.
    tau_contact: f64,
}

impl ReachPath {
    /// `touch`: index for error messages.
    pub(super) fn new(
        plan: &TouchPlan,
        touch: usize,
        rest_m: DVec3,
        shape: &Shape,
    ) -> Result<Self, SimError> {
        all_finite("target_m", &plan.target_m.to_array())?;
        all_finite("normal", &plan.normal.to_array())?;
        let length = plan.normal.length();
        let long = length > 1e-12 && length.is_finite();
        that(long, "length of the normal", length, "above 1e-12")?;
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
        let Shape {
            depth_m,
            bow,
            stray,
            profile,
        } = *shape;
        let share = height_m / (height_m + depth_m);
        let (u, v) = normal.any_orthonormal_pair();
        let along_surface = |[a, b]: [f64; 2]| (u * a + v * b) * rest_from_target.length();
        Ok(Self {
            target_m: plan.target_m,
            normal,
            depth_m,
            height_m,
            aside_m: rest_from_target - normal * height_m,
            bow_m: along_surface(bow),
            stray_m: along_surface(stray),
            profile,
            tau_contact: bisect(0.0, 1.0, |tau| profile.done(tau) < share),
        })
    }

    pub(super) const fn target_m(&self) -> DVec3 {
        self.target_m
    }

    pub(super) const fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Straight distance from rest to the target, m.
    pub(super) fn length_m(&self) -> f64 {
        self.aside_m.length().hypot(self.height_m)
    }

    /// Share of the time at which the hand meets the surface.
    pub(super) const fn tau_contact(&self) -> f64 {
        self.tau_contact
    }

    /// Fraction of the time to contact, 1 after contact.
    pub(super) fn elapsed(&self, tau: f64) -> f64 {
        (tau / self.tau_contact).clamp(0.0, 1.0)
    }

    /// Fraction of the movement along the surface, 1 after contact.
    pub(super) fn approach(&self, tau: f64) -> f64 {
        self.profile.done(self.elapsed(tau))
    }

    pub(super) fn tip_m(&self, tau: f64) -> DVec3 {
        let along_normal = self.height_m - (self.height_m + self.depth_m) * self.profile.done(tau);
        let elapsed = self.elapsed(tau);
        let u = self.profile.warped(elapsed);
        // Peak 1 at the middle; first two derivatives zero at both ends.
        let bow = (4.0 * u * (1.0 - u)).powi(3);
        self.target_m
            + self.normal * along_normal
            + self.aside_m * (1.0 - self.profile.done(elapsed))
            + self.bow_m * bow
            + self.stray_m * self.profile.astray(elapsed)
    }
}

/// The path to a touch, with or without a change of mind.
///
/// With a change of mind the hand blends from the path to the first target into the path to the other one, within
/// [`TURN`] of the time to contact. Both paths start from the same rest at the same time, so position and velocity are
/// continuous, and the end is that of the path to the other target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Approach {
    pub(super) path: ReachPath,
    /// The path meant first, and the fraction of the time to contact at which the hand switches.
    pub(super) meant: Option<(ReachPath, f64)>,
}

impl Approach {
    /// Progress of the change of mind: 0 before, 1 after.
    pub(super) fn changed(&self, tau: f64) -> f64 {
        let share = |&(_, at): &(ReachPath, f64)| {
            minimum_jerk((self.path.elapsed(tau) - at) / TURN.min(1.0 - at))
        };
        self.meant.as_ref().map_or(1.0, share)
    }

    pub(super) fn tip_m(&self, tau: f64) -> DVec3 {
        let tip_m = self.path.tip_m(tau);
        match &self.meant {
            None => tip_m,
            Some((meant, _)) => meant.tip_m(tau).lerp(tip_m, self.changed(tau)),
        }
    }

    /// Fraction of the time from which the path is that to the final touch only.
    pub(super) fn tau_settled(&self) -> f64 {
        self.meant
            .as_ref()
            .map_or(0.0, |(_, at)| (at + TURN).min(1.0) * self.path.tau_contact)
    }
}
