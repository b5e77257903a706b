//! Blends from the interpolator's positions to those of a program that begins at the measured position.

use crate::limits::SERVO_ERROR_RAD;
use std::f64::consts::PI;

/// The offset has faded after this time, ns.
const FADE_NS: u64 = 1_000_000_000;

/// Offset between the previously commanded positions and the first ones of a program, and its time.
///
/// A program that begins at the measured angles is off by the servo error of the arm. Its first positions would move the arm abruptly by that much;
/// so the offset is added to them, and fades.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beginning {
    difference_rad: [f64; 7],
    time_ns: u64,
}

impl Beginning {
    /// Positions that need no offset.
    pub(super) const NOWHERE_ELSE: Self = Self {
        difference_rad: [0.0; 7],
        time_ns: 0,
    };

    /// From the held positions to the first ones, both finite; `None` if they are too far apart.
    pub(super) fn of(held_rad: &[f64; 7], first_rad: &[f64; 7], time_ns: u64) -> Option<Self> {
        let difference_rad: [f64; 7] = std::array::from_fn(|i| held_rad[i] - first_rad[i]);
        let is_near = difference_rad
            .iter()
            .all(|off_rad| off_rad.abs() <= SERVO_ERROR_RAD);
        is_near.then_some(Self {
            difference_rad,
            time_ns,
        })
    }

    /// The positions to send for the requested ones. The offset fades as half a cosine: at most 0.08 rad/s and 0.25 rad/s².
    pub(super) fn lead(&self, q_rad: &[f64; 7], time_ns: u64) -> [f64; 7] {
        let gone_ns = time_ns.saturating_sub(self.time_ns).min(FADE_NS);
        if gone_ns == FADE_NS {
            return *q_rad;
        }
        let share = 0.5 * (1.0 + (PI * gone_ns as f64 / FADE_NS as f64).cos());
        std::array::from_fn(|i| q_rad[i] + share * self.difference_rad[i])
    }
}

#[cfg(test)]
mod tests {
    use super::{Beginning, FADE_NS};

    #[test]
    fn begins_where_the_arm_is_held_and_ends_where_it_is_asked_to_be() {
        let (held, first) = ([0.105; 7], [0.1; 7]);
        let beginning = Beginning::of(&held, &first, 7).expect("near");
        assert!((beginning.lead(&first, 7)[2] - 0.105).abs() < 1e-15);
        let mut last = 0.105;
        for ms in 1..=1000 {
            let lead = beginning.lead(&first, 7 + ms * 1_000_000)[2];
            assert!(lead <= last && last - lead < 8e-6, "{ms} ms: {lead}");
            last = lead;
        }
        assert_eq!(beginning.lead(&first, 7 + FADE_NS), first);
        assert!(Beginning::of(&[0.16; 7], &first, 7).is_none());
        assert!(Beginning::of(&[f64::NAN; 7], &first, 7).is_none());
    }
}
