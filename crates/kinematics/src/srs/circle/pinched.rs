//! A joint with very narrow limits, down to zero width.

use super::elbow_circle::ElbowCircle;
use super::sinusoid::{Direction, Sinusoid};
use super::window::{SignedCone, Window, Windows, magnitude_ranges};
use crate::joints::JointLimit;
use crate::srs::branch::Branch;

/// Limits narrower than this are treated as pinched, rad.
const PINCHED_RAD: f64 = 0.3;

/// The joint (not the elbow) with the narrowest limits, and the limits of the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::srs) struct Pinched {
    place: Place,
    /// `cos, sin` of the middle of its limits (of their absolute values for joints 2 and 6).
    middle: [f64; 2],
    /// The limits of all other joints.
    pub(in crate::srs) others: Windows,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    /// Joint 1, 3, 5 or 7, as index 0 to 3.
    Turning(usize),
    /// Joint 2 or 6, and the branches of its sign.
    Tilting(usize, u8),
}

impl Pinched {
    pub(in crate::srs) fn of(limits: &[JointLimit; 7]) -> Option<Self> {
        let width = |joint: usize| limits[joint].max_rad - limits[joint].min_rad;
        let joint = [0, 1, 2, 4, 5, 6]
            .into_iter()
            .min_by(|&a, &b| width(a).total_cmp(&width(b)))?;
        if width(joint) > PINCHED_RAD {
            return None;
        }
        let JointLimit { min_rad, max_rad } = limits[joint];
        let mut others = Windows::new(limits);
        let (place, middle) = if joint % 2 == 0 {
            others.turning[joint / 2] = Window::new(JointLimit::FREE);
            (Place::Turning(joint / 2), 0.5 * (min_rad + max_rad))
        } else {
            // A range around zero contains the joint's own singularity: no path passes through its middle.
            let [positive, negative] = magnitude_ranges(limits[joint]);
            let masks = if joint == 1 {
                Branch::SHOULDER
            } else {
                Branch::WRIST
            };
            let (range, mask) = match (positive, negative) {
                (Some(range), None) => (range, masks[0]),
                (None, Some(range)) => (range, masks[1]),
                _ => return None,
            };
            others.tilting[joint / 4] = SignedCone::FREE;
            (Place::Tilting(joint / 4, mask), 0.5 * (range[0] + range[1]))
        };
        Some(Self {
            place,
            middle: [middle.cos(), middle.sin()],
            others,
        })
    }

    pub(in crate::srs) const fn in_shoulder(&self) -> bool {
        matches!(self.place, Place::Turning(0 | 1) | Place::Tilting(0, _))
    }

    /// Zero if the joint, or the joint rotated by half a turn, is in the middle of its limits.
    pub(in crate::srs) fn middle_of(&self, circle: &ElbowCircle) -> Sinusoid {
        let [cos, sin] = self.middle;
        match self.place {
            Place::Turning(i) => {
                let [x, y] = &circle.turning[i];
                Sinusoid::combine(cos, y, -sin, x)
            }
            Place::Tilting(i, _) => circle.tilting[i].minus(cos),
        }
    }

    /// Branches for which the root is the middle and not its opposite, by more than a slack.
    pub(in crate::srs) fn sides(&self, circle: &ElbowCircle, psi: Direction, slack: f64) -> u8 {
        match self.place {
            Place::Turning(i) => {
                let [same, opposite] = Branch::TURNING[i];
                let [x, y] = &circle.turning[i];
                let towards = self.middle[0] * x.at(psi) + self.middle[1] * y.at(psi);
                if towards > slack {
                    same
                } else if towards < -slack {
                    opposite
                } else {
                    0
                }
            }
            Place::Tilting(_, mask) => mask,
        }
    }
}
