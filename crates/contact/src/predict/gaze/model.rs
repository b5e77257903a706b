//! How people look at what they are going to touch.

use super::resting_hand::RestingHand;
use super::shares::LookTable;
use crate::error::ContactError;
use hwall_numeric::check::positive;

/// How people look while they rest and reach: at the place they are going to touch, or elsewhere.
///
/// The angle between the mean line of sight of a fixation and the contact point, seen from the head, has a density that is a
/// mixture of two: about the contact point with a small spread (the person's aim, the calibration of the eye tracker; the noise
/// of its samples comes on top and is that of the fixation), and with a wide one. How often it is which depends on how far the
/// reach is, on how long the look has lasted, and on whether this person's eyes rest at its place in pauses, too: people who look
/// around look for a moment, a look that leads a hand stays, and eyes that mean nothing rest where they rested before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GazeModel {
    /// Spread while the person looks at the place to be touched, in each of two directions, rad. Default
    /// 0.03 (1.7 degrees): an eye tracker of 1 degree and a person who is about as accurate.
    pub on_target_sd_rad: f64,
    /// Spread of the looks elsewhere, in each of two directions, rad. Default 0.5: half the room.
    pub elsewhere_sd_rad: f64,
    /// How long a look that has ended still counts, s. Default 0.8: the eyes leave for the next
    /// target up to half a second before the hand arrives.
    pub memory_s: f64,
    /// How often the present look, the one before it, or neither is at the place that will be touched.
    pub looks: LookTable,
    /// Where a person touches, seen from the resting hand.
    pub rest: RestingHand,
    /// How many touches this was learnt from; 0 for the default.
    pub touches: usize,
}

impl Default for GazeModel {
    fn default() -> Self {
        Self {
            on_target_sd_rad: 0.03,
            elsewhere_sd_rad: 0.5,
            memory_s: 0.8,
            looks: LookTable::default(),
            rest: RestingHand::default(),
            touches: 0,
        }
    }
}

/// Lines of sight further apart than this many times the spread about a target are looks at different places ...
const APART_SDS: f64 = 2.5;
/// ... but within these limits, rad.
const APART_RAD: [f64; 2] = [0.035, 0.35];

impl GazeModel {
    pub(in crate::predict) fn validate(&self) -> Result<(), ContactError> {
        positive("on_target_sd_rad", self.on_target_sd_rad)?;
        positive("elsewhere_sd_rad", self.elsewhere_sd_rad)?;
        positive("memory_s", self.memory_s)?;
        self.looks.validate()?;
        self.rest.validate()
    }

    /// Lines of sight further apart than this are on different places, rad.
    pub(in crate::predict) fn apart_rad(&self) -> f64 {
        let [least, most] = APART_RAD;
        (APART_SDS * self.on_target_sd_rad).clamp(least, most)
    }
}
