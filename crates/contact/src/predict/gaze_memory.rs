//! The present and the previous fixation.

use hwall_hand::{Fixation, Gaze, GazeRay};

/// A period in which the eyes stay at one place: one fixation, or several that hardly differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::predict) struct Dwell {
    /// The mean line of sight of the newest fixation.
    pub(in crate::predict) ray: GazeRay,
    /// Angular noise of the tracker in it, rad.
    pub(in crate::predict) noise_rad: f64,
    /// Start of the fixation, s.
    pub(in crate::predict) since_s: f64,
    pub(in crate::predict) until_s: f64,
    /// Duration of earlier stays at the place, s.
    before_s: f64,
}

impl Dwell {
    const fn new(fixation: &Fixation) -> Self {
        Self {
            ray: fixation.ray,
            noise_rad: fixation.noise_rad,
            since_s: fixation.since_s,
            until_s: fixation.until_s,
            before_s: 0.0,
        }
    }

    /// Total time at the place, s.
    pub(in crate::predict) fn age_s(&self, t_s: f64) -> f64 {
        (t_s - self.since_s).max(0.0) + self.before_s
    }

    /// Is the fixation at the place of this dwell?
    fn holds(&self, fixation: &Fixation, apart_rad: f64) -> bool {
        let noise_rad = SAME_SDS * self.noise_rad.hypot(fixation.noise_rad);
        let (a, b) = (self.ray.direction, fixation.ray.direction);
        a.dot(b) >= apart_rad.hypot(noise_rad).min(WIDEST_RAD).cos()
    }

    fn goes_on(&mut self, fixation: &Fixation) {
        self.ray = fixation.ray;
        self.noise_rad = fixation.noise_rad;
        self.until_s = fixation.until_s;
    }
}

/// The present fixation and the one before it.
///
/// During saccades and short gaze loss, the last fixation stays the present one: nothing contradicts it yet. A return to the previous place
/// continues that fixation.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::predict) struct GazeMemory {
    now: Option<Dwell>,
    before: Option<Dwell>,
}

/// An ended fixation, and the time since its end, s.
pub(in crate::predict) type Ended<'a> = (&'a Dwell, f64);

/// Two mean lines of sight are at one place if they differ by at most this many standard deviations of their noise.
const SAME_SDS: f64 = 3.0;
/// Upper bound of that angle, rad.
const WIDEST_RAD: f64 = 0.35;
/// Shorter fixations are not remembered, s: too short to see anything.
const SHORTEST_S: f64 = 0.08;
/// A return after at most this time continues the fixation, s: after a glance, not after a touch.
const BACK_S: f64 = 1.0;
/// Time for which the last fixation is the present one without a line of sight, s: saccades and blinks.
const HOLD_S: f64 = 0.3;

impl GazeMemory {
    /// Takes the gaze of the next sample. Lines of sight within `apart_rad`, beyond their noise, are at one place.
    pub(in crate::predict) fn step(&mut self, t_s: f64, gaze: &Gaze, apart_rad: f64) {
        let later = |dwell: &Option<Dwell>| dwell.is_some_and(|dwell| t_s < dwell.until_s);
        if later(&self.now) || later(&self.before) {
            // The clock was reset.
            *self = Self::default();
        }
        let usable = gaze.fixation().filter(|fixation| fixation.is_usable());
        let Some(fixation) = usable else {
            if self.now.is_some_and(|now| t_s - now.until_s > HOLD_S) {
                self.pass();
            }
            return;
        };
        if let Some(now) = &mut self.now
            && (fixation.since_s == now.since_s || now.holds(fixation, apart_rad))
        {
            now.goes_on(fixation);
            return;
        }
        let back = self
            .before
            .filter(|dwell| t_s - dwell.until_s <= BACK_S && dwell.holds(fixation, apart_rad));
        self.pass();
        let mut next = Dwell::new(fixation);
        if let Some(back) = back {
            next.before_s = back.age_s(back.until_s);
            // The previous fixation is the present one again; if only a short fixation was in between, there is no previous one.
            if self
                .before
                .is_some_and(|dwell| dwell.since_s == back.since_s)
            {
                self.before = None;
            }
        }
        self.now = Some(next);
    }

    pub(in crate::predict) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Ends the present fixation.
    fn pass(&mut self) {
        if let Some(ended) = self.now.take()
            && ended.age_s(ended.until_s) >= SHORTEST_S
        {
            self.before = Some(ended);
        }
    }

    /// The present fixation, and the previous one unless it ended more than `memory_s` ago.
    pub(in crate::predict) fn dwells(
        &self,
        t_s: f64,
        memory_s: f64,
    ) -> (Option<&Dwell>, Option<Ended<'_>>) {
        let before = self
            .before
            .as_ref()
            .map(|dwell| (dwell, (t_s - dwell.until_s).max(0.0)))
            .filter(|(_, ago_s)| *ago_s < memory_s);
        (self.now.as_ref(), before)
    }

    /// The present fixation.
    pub(in crate::predict) const fn now(&self) -> Option<&Dwell> {
        self.now.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn fixed(since_s: f64, t_s: f64, y: f64) -> Gaze {
        let ray = GazeRay {
            origin_m: DVec3::Z,
            direction: DVec3::new(1.0, y, 0.0).normalize(),
        };
        Gaze::Fixed(Fixation::of_ray(since_s, t_s, ray))
    }

    #[test]
    fn a_flight_holds_the_look_and_a_landing_ends_it() {
        let mut memory = GazeMemory::default();
        memory.step(0.0, &fixed(0.0, 0.0, 0.0), 0.07);
        memory.step(0.5, &fixed(0.0, 0.5, 0.0), 0.07);
        memory.step(0.55, &Gaze::InFlight { since_s: 0.5 }, 0.07);
        assert!(memory.now().is_some_and(|dwell| dwell.since_s == 0.0));
        memory.step(0.6, &fixed(0.58, 0.6, 0.5), 0.07);
        let (now, before) = memory.dwells(0.6, 0.8);
        assert_eq!(now.map(|dwell| dwell.since_s), Some(0.58));
        assert!(
            before.is_some_and(|(dwell, ago)| dwell.since_s == 0.0 && (ago - 0.1).abs() < 1e-9)
        );
    }

    #[test]
    fn a_look_back_goes_on() {
        let mut memory = GazeMemory::default();
        for (since_s, until_s, y) in [(0.0, 0.4, 0.0), (0.5, 0.7, 0.5), (0.8, 0.9, 0.0)] {
            memory.step(since_s, &fixed(since_s, since_s, y), 0.07);
            memory.step(until_s, &fixed(since_s, until_s, y), 0.07);
        }
        let (now, before) = memory.dwells(0.9, 0.8);
        assert!(now.is_some_and(|dwell| (dwell.age_s(0.9) - 0.5).abs() < 1e-9));
        assert!(before.is_some_and(|(dwell, _)| dwell.since_s == 0.5));
    }

    #[test]
    fn a_gaze_that_stays_lost_ends_the_look() {
        let mut memory = GazeMemory::default();
        memory.step(0.0, &fixed(0.0, 0.0, 0.0), 0.07);
        memory.step(0.2, &fixed(0.0, 0.2, 0.0), 0.07);
        memory.step(0.4, &Gaze::Lost, 0.07);
        assert!(memory.now().is_some());
        memory.step(0.6, &Gaze::Lost, 0.07);
        let (now, before) = memory.dwells(0.6, 0.8);
        assert!(now.is_none() && before.is_some());
        // A clock reset clears the memory.
        memory.step(0.1, &Gaze::Lost, 0.07);
        assert_eq!(memory.dwells(0.1, 0.8), (None, None));
    }
}
