//! A right hand as a palm and five fingertips.

use super::profile::minimum_jerk;
use glam::{DMat3, DQuat, DVec3};

/// Hand gesture. The index finger leads in all gestures; in a grasp, it leads together with the thumb.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Gesture {
    /// Index finger extended, the others curled, all the time.
    #[default]
    Pointing,
    /// All fingers extended, all the time.
    Flat,
    /// Clenched at rest, all fingers extended at contact.
    Opening,
    /// All fingers extended and spread, then closed around the object at contact.
    Grasping,
    /// The open palm turned to the surface, fingers upwards.
    Pushing,
    /// Fingers extended; the fingertip comes along the surface and slides on until the hand withdraws.
    Stroking,
}

impl Gesture {
    /// The three touching gestures; the others must be requested.
    pub const ALL: [Self; 3] = [Self::Pointing, Self::Flat, Self::Opening];
    /// One gesture for each thing a hand may do: touch, push, grasp, stroke.
    pub const TASKS: [Self; 4] = [
        Self::Pointing,
        Self::Pushing,
        Self::Grasping,
        Self::Stroking,
    ];
}

/// Hand length (wrist to the tip of the middle finger) of the tables below, m.
const REFERENCE_LENGTH_M: f64 = 0.19;

/// Fingertips relative to the centre of the palm, thumb first, m: x along the extended fingers, y
/// towards the thumb, z out of the back of the hand. Rough proportions of an adult hand, an
/// assumption; the middle finger is slightly bent so that the index finger touches first.
const POINTING_M: [DVec3; 5] = [
    DVec3::new(0.040, 0.042, -0.030),
    DVec3::new(0.100, 0.025, 0.000),
    DVec3::new(0.035, 0.004, -0.038),
    DVec3::new(0.030, -0.016, -0.036),
    DVec3::new(0.025, -0.034, -0.030),
];
const FLAT_M: [DVec3; 5] = [
    DVec3::new(0.045, 0.078, -0.012),
    DVec3::new(0.100, 0.028, 0.000),
    DVec3::new(0.099, 0.005, -0.010),
    DVec3::new(0.091, -0.018, -0.006),
    DVec3::new(0.070, -0.042, -0.004),
];
const CLENCHED_M: [DVec3; 5] = [
    DVec3::new(0.038, 0.020, -0.045),
    DVec3::new(0.042, 0.022, -0.036),
    DVec3::new(0.038, 0.003, -0.040),
    DVec3::new(0.034, -0.016, -0.038),
    DVec3::new(0.028, -0.033, -0.032),
];

/// A hand before a grasp, and in a grasp.
const SPREAD_M: [DVec3; 5] = [
    DVec3::new(0.050, 0.080, -0.030),
    DVec3::new(0.096, 0.034, -0.012),
    DVec3::new(0.100, 0.006, -0.014),
    DVec3::new(0.092, -0.022, -0.012),
    DVec3::new(0.070, -0.050, -0.010),
];
const AROUND_M: [DVec3; 5] = [
    DVec3::new(0.062, 0.026, -0.050),
    DVec3::new(0.078, 0.020, -0.040),
    DVec3::new(0.076, 0.002, -0.044),
    DVec3::new(0.070, -0.016, -0.042),
    DVec3::new(0.058, -0.034, -0.036),
];
/// Fraction of the time to contact at which a grasping hand starts to close.
const CLOSES_FROM: f64 = 0.6;

/// A hand with a size and a gesture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hand {
    pub(super) gesture: Gesture,
    pub(super) length_m: f64,
    /// Fraction of the time to contact at which an opening hand is fully open.
    pub(super) open_by: f64,
    /// How far the hand takes the shape of its gesture on the way, from that of a hand at rest, 0 to 1; `None`: it has the shape all the time.
    pub(super) takes_shape: Option<f64>,
}

impl Hand {
    /// Palm and fingertips, thumb first, with the index fingertip at `index_tip_m`, after the
    /// fraction `elapsed` of the time to contact.
    pub(super) fn place(
        &self,
        elapsed: f64,
        base_from_hand: DQuat,
        index_tip_m: DVec3,
    ) -> (DVec3, [DVec3; 5]) {
        let table = match self.gesture {
            Gesture::Pointing => POINTING_M,
            Gesture::Flat | Gesture::Pushing | Gesture::Stroking => FLAT_M,
            Gesture::Grasping => {
                // The hand closes in the last part of the reach.
                let closed = minimum_jerk((elapsed - CLOSES_FROM) / (1.0 - CLOSES_FROM));
                std::array::from_fn(|i| SPREAD_M[i].lerp(AROUND_M[i], closed))
            }
            Gesture::Opening => {
                let open = minimum_jerk(elapsed / self.open_by);
                std::array::from_fn(|i| CLENCHED_M[i].lerp(FLAT_M[i], open))
            }
        };
        let table = match self.takes_shape {
            None => table,
            Some(most) => {
                let taken = most * minimum_jerk(elapsed / self.open_by);
                // A hand at rest is half open.
                std::array::from_fn(|i| CLENCHED_M[i].lerp(FLAT_M[i], 0.5).lerp(table[i], taken))
            }
        };
        let size = self.length_m / REFERENCE_LENGTH_M;
        let from_palm = table.map(|tip| base_from_hand * (tip * size));
        let palm_m = index_tip_m - from_palm[1];
        // Keep the index tip exact.
        let mut tips_m = from_palm.map(|tip| palm_m + tip);
        tips_m[1] = index_tip_m;
        (palm_m, tips_m)
    }

    /// Orientation at the contact with a surface of this unit normal.
    pub(super) fn at_contact(&self, fingers: DVec3, normal: DVec3) -> DQuat {
        match self.gesture {
            // The back of the hand faces away from the surface.
            Gesture::Pushing => {
                let y = normal
                    .cross(fingers)
                    .normalize_or(normal.any_orthonormal_vector());
                DQuat::from_mat3(&DMat3::from_cols(y.cross(normal), y, normal))
            }
            _ => orientation(fingers),
        }
    }
}

/// Orientation of a hand whose fingers point along a unit vector, with its back as far up as possible.
pub(super) fn orientation(fingers: DVec3) -> DQuat {
    // Fingers straight up or down: the back of the hand faces away from x, an arbitrary choice.
    let up = if fingers.z.abs() < 0.999 {
        DVec3::Z
    } else {
        DVec3::X
    };
    let y = up.cross(fingers).normalize();
    DQuat::from_mat3(&DMat3::from_cols(fingers, y, fingers.cross(y)))
}
