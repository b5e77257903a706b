//! Recent motion of the hand, to tell a hand that starts to move from tracker noise.

use glam::DVec3;

/// Positions of the hand over the last 0.1 s.
///
/// For a slow hand, the velocity from frame to frame is tracker noise: with 1 mm of noise at 90 Hz, a resting hand seems to move at 0.05
/// m/s in each axis. Averaged over 0.1 s this is 0.01 m/s, and a hand that starts to move has gone 5 mm by then.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct HandMotion {
    /// Times, s, and places, m; newest first.
    places: [Option<(f64, DVec3)>; PLACES],
    newest: Option<(f64, DVec3)>,
}

/// Mean velocities, m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MeanVelocity {
    /// Over the whole time.
    pub(super) mean_m_per_s: DVec3,
    /// Mean velocity of the second half minus that of the first.
    pub(super) gained_m_per_s: DVec3,
}

/// Averaging time, s.
const AVERAGED_S: f64 = 0.1;
/// Spacing of the stored positions, s, at any rate of the tracker.
const APART_S: f64 = 0.01;
/// Enough for the averaging time, and half of it again for frames at uneven times.
const PLACES: usize = 16;
/// A mean over more than this multiple of the averaging time is dropped: frames are missing.
const LONGEST: f64 = 2.0;
/// Tolerance of times, s.
const EXACT_S: f64 = 1e-6;

impl HandMotion {
    /// The hand of the next frame; `None`: it is lost, and its history is dropped.
    pub(super) fn step(&mut self, t_s: f64, point_m: Option<DVec3>) {
        let Some(point_m) = point_m else {
            *self = Self::default();
            return;
        };
        self.newest = Some((t_s, point_m));
        let [last, ..] = self.places;
        if last.is_none_or(|(last_s, _)| t_s - last_s >= APART_S) {
            self.places.rotate_right(1);
            self.places[0] = self.newest;
        }
    }

    /// `None` while the history is too short.
    pub(super) fn velocity(&self) -> Option<MeanVelocity> {
        let (t_s, now_m) = self.newest?;
        let ago = |age_s: f64| {
            let old = |(then_s, _): &&(f64, DVec3)| t_s - then_s >= age_s - EXACT_S;
            self.places.iter().flatten().find(old).copied()
        };
        let (first_s, first_m) = ago(AVERAGED_S)?;
        let (middle_s, middle_m) = ago(0.5 * AVERAGED_S)?;
        let takes_s = [t_s - first_s, middle_s - first_s, t_s - middle_s];
        if takes_s[0] > LONGEST * AVERAGED_S || takes_s[1] < EXACT_S {
            return None;
        }
        Some(MeanVelocity {
            mean_m_per_s: (now_m - first_m) / takes_s[0],
            gained_m_per_s: (now_m - middle_m) / takes_s[2] - (middle_m - first_m) / takes_s[1],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(frames: usize, period_s: f64, x_m: impl Fn(f64) -> f64) -> Option<MeanVelocity> {
        let mut hand_motion = HandMotion::default();
        for frame in 0..frames {
            let t_s = period_s * frame as f64;
            hand_motion.step(t_s, Some(DVec3::X * x_m(t_s)));
        }
        hand_motion.velocity()
    }

    #[test]
    fn a_steady_hand_has_its_velocity_at_any_rate() {
        for period_s in [1.0 / 1000.0, 1.0 / 90.0, 1.0 / 30.0] {
            let frames = (0.3 / period_s) as usize;
            let seen = after(frames, period_s, |t| 0.5 * t).expect("0.3 s are enough");
            assert!((seen.mean_m_per_s - DVec3::X * 0.5).length() < 1e-9);
            assert!(seen.gained_m_per_s.length() < 1e-9);
        }
    }

    #[test]
    fn a_hand_that_sets_off_gains_and_one_that_comes_to_rest_loses() {
        let off = after(30, 0.01, |t| t * t).expect("enough");
        let rest = after(30, 0.01, |t| -(0.3 - t) * (0.3 - t)).expect("enough");
        assert!(off.gained_m_per_s.x > 0.05 && off.mean_m_per_s.x > 0.0);
        assert!(rest.gained_m_per_s.x < -0.05 && rest.mean_m_per_s.x > 0.0);
    }

    #[test]
    fn too_little_a_gap_and_a_lost_hand_tell_nothing() {
        assert_eq!(after(5, 0.01, |t| t), None);
        assert_eq!(after(3, 0.3, |t| t), None);
        let mut hand_motion = HandMotion::default();
        (0..20).for_each(|i| hand_motion.step(0.01 * f64::from(i), Some(DVec3::ZERO)));
        assert!(hand_motion.velocity().is_some());
        hand_motion.step(0.2, None);
        assert_eq!(hand_motion.velocity(), None);
    }
}
