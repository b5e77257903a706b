//! Places a person fixates while no touch is intended.

use super::memory::{GazeMemory, Look};
use glam::DVec3;

/// Places that a person fixated in pauses and left again before the hand set off: straight ahead, a clock, a picture. A long fixation there says
/// less about the next touch than a long fixation on a new place.
///
/// Directions are in the room frame: a person who has turned or moved must be observed for a pause or two again.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::predict) struct IdlePlaces {
    places: [Option<IdlePlace>; MOST_PLACES],
    /// Number of pauses with such fixations, discounted with age.
    pauses: f64,
    /// Ended fixations of this pause, one per place.
    ended: [Option<Look>; MOST_LOOKS],
    /// Index to overwrite next.
    oldest: usize,
    /// Start of the newest ended fixation, s.
    newest_s: Option<f64>,
    was_reaching: bool,
}

/// A direction, and the number of pauses with a fixation there.
#[derive(Debug, Clone, Copy)]
struct IdlePlace {
    look: Look,
    pauses: f64,
}

/// Largest numbers of places, and of fixations in one pause, that are remembered.
const MOST_PLACES: usize = 8;
const MOST_LOOKS: usize = 8;
/// Discount of older pauses when a new one ends.
const KEPT: f64 = 0.9;
/// A place fixated in `n` of the pauses is idle to the degree min(1, 2 n / (pauses + 1.5)): fully if it is fixated in half of the pauses. The
/// prior of 1.5 pauses without a fixation keeps one glance from deciding.
const OFTEN: f64 = 2.0;
const ASSUMED: f64 = 1.5;
/// A fixation that began less than this before the hand set off is already at the next place, s.
const EARLY_S: f64 = 0.1;
/// A fixation whose line passes the hand within this distance is at the hand, or at what it touches, m.
const AT_HAND_M: f64 = 0.1;

impl IdlePlaces {
    pub(in crate::predict) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Takes the fixations of the next sample, and whether a reach is under way. Fixations within `apart_rad`, beyond their noise, are at one
    /// place.
    pub(in crate::predict) fn step(
        &mut self,
        memory: &GazeMemory,
        reaching: bool,
        hand_m: Option<DVec3>,
        apart_rad: f64,
    ) {
        if reaching && !self.was_reaching {
            self.end_pause(memory, apart_rad);
        }
        self.was_reaching = reaching;
        let Some(ended) = memory
            .before()
            .filter(|look| self.newest_s != Some(look.since_s))
        else {
            return;
        };
        self.newest_s = Some(ended.since_s);
        // While the hand is lost, any fixation may be at it.
        let is_beside_hand = hand_m.is_some_and(|hand_m| {
            let to_hand = hand_m - ended.ray.origin_m;
            to_hand.cross(ended.ray.direction).length() >= AT_HAND_M
        });
        if reaching || !is_beside_hand {
            return;
        }
        let same = |look: &Option<Look>| look.is_some_and(|look| look.is_at(ended, apart_rad));
        let known = self.ended.iter().position(same);
        self.ended[known.unwrap_or(self.oldest)] = Some(*ended);
        if known.is_none() {
            self.oldest = (self.oldest + 1) % MOST_LOOKS;
        }
    }

    /// A reach has begun: places fixated before but not now were not its target.
    fn end_pause(&mut self, memory: &GazeMemory, apart_rad: f64) {
        let ended = std::mem::take(&mut self.ended);
        self.oldest = 0;
        // Without gaze the intention is unknown.
        let Some(now) = memory.now() else { return };
        // A very recent fixation: the eyes left the target just before the hand set off.
        let left = memory.before().filter(|_| now.age_s(now.until_s) < EARLY_S);
        let meant = |look: &Look| {
            let mut places = [Some(now), left].into_iter().flatten();
            places.any(|place| place.is_at(look, apart_rad))
        };
        let mut idle = ended.into_iter().flatten().filter(|l| !meant(l)).peekable();
        if idle.peek().is_none() {
            return;
        }
        self.pauses = KEPT * self.pauses + 1.0;
        for place in self.places.iter_mut().flatten() {
            place.pauses *= KEPT;
        }
        let mut counted = [false; MOST_PLACES];
        for look in idle {
            let same = |place: &Option<IdlePlace>| {
                place.is_some_and(|place| place.look.is_at(&look, apart_rad))
            };
            let pauses = |i: &usize| self.places[*i].map_or(0.0, |place| place.pauses);
            let known = self.places.iter().position(same);
            let least = (0..MOST_PLACES).min_by(|a, b| pauses(a).total_cmp(&pauses(b)));
            let index = known.or(least).unwrap_or(0);
            let before = known.and(self.places[index]).map_or(0.0, |p| p.pauses);
            // Two fixations on it in one pause count once.
            let one = if known.is_some() && counted[index] {
                0.0
            } else {
                1.0
            };
            counted[index] = true;
            let pauses = before + one;
            self.places[index] = Some(IdlePlace { look, pauses });
        }
    }

    /// How often the eyes fixate the present place in pauses, from 0, never, to 1, in at least half of the pauses with any fixation; `None` before
    /// the first such pause.
    pub(in crate::predict) fn share(&self, look: &Look, apart_rad: f64) -> Option<f64> {
        let places = self.places.iter().flatten();
        let here = places.filter(|place| place.look.is_at(look, apart_rad));
        let pauses = here.map(|place| place.pauses).fold(0.0, f64::max);
        (self.pauses > 0.0).then(|| (OFTEN * pauses / (self.pauses + ASSUMED)).min(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_hand::{Fixation, Gaze, GazeRay};

    const APART_RAD: f64 = 0.07;

    /// Eyes that move from place to place, with a reach at the end of each pause.
    #[derive(Default)]
    struct Eyes {
        memory: GazeMemory,
        idle: IdlePlaces,
        t_s: f64,
    }

    impl Eyes {
        fn look(&mut self, y: f64, for_s: f64, reaching: bool, hand_m: DVec3) {
            let ray = GazeRay {
                origin_m: DVec3::Z,
                direction: DVec3::new(1.0, y, 0.0).normalize(),
            };
            let since_s = self.t_s;
            while self.t_s < since_s + for_s {
                let fixation = Fixation::of_ray(since_s, self.t_s, ray);
                self.see(Gaze::Fixed(fixation), reaching, hand_m);
            }
        }

        fn see(&mut self, gaze: Gaze, reaching: bool, hand_m: DVec3) {
            let (memory, hand_m) = (&mut self.memory, Some(hand_m));
            memory.step(self.t_s, &gaze, APART_RAD);
            self.idle.step(memory, reaching, hand_m, APART_RAD);
            self.t_s += 0.01;
        }

        /// A pause with fixations on some places; the hand then goes to the last one and stays for a while.
        fn reach(&mut self, places: &[f64]) {
            for &y in places {
                self.look(y, 0.4, false, DVec3::ZERO);
            }
            let target = places[places.len() - 1];
            self.look(target, 0.6, true, DVec3::ZERO);
            self.look(target, 0.5, false, DVec3::new(0.7, 0.7 * target, 1.0));
            self.look(0.0, 0.6, true, DVec3::ZERO);
        }

        fn share(&self) -> Option<f64> {
            self.idle.share(self.memory.now()?, APART_RAD)
        }
    }

    #[test]
    fn eyes_that_rest_ahead_in_every_pause_mean_nothing_there() {
        let mut eyes = Eyes::default();
        eyes.look(0.0, 0.3, false, DVec3::ZERO);
        assert_eq!(eyes.share(), None);
        let mut new = 1.0;
        for (target, glance) in [(0.5, -0.3), (-0.6, 0.8), (0.3, -0.9), (0.6, -0.3)] {
            eyes.reach(&[0.0, glance, target]);
            // Looking ahead again: 0.8 after one such pause, 1 after more.
            let first = target == 0.5;
            assert_eq!(eyes.share(), Some(if first { 0.8 } else { 1.0 }));
            new *= -1.4;
            eyes.look(new, 0.2, false, DVec3::ZERO);
            assert_eq!(eyes.share(), Some(0.0), "a new place");
        }
        // The touched place is not idle, although it is fixated while the hand is there.
        eyes.look(0.6, 0.2, false, DVec3::ZERO);
        assert_eq!(eyes.share(), Some(0.0));
        // An occasional glance is in between.
        eyes.look(0.8, 0.2, false, DVec3::ZERO);
        let share = eyes.share().expect("known");
        assert!((0.2..0.8).contains(&share), "{share}");
        eyes.idle.forget();
        assert_eq!(eyes.share(), None);
    }

    #[test]
    fn a_look_back_at_the_target_was_meant() {
        let mut eyes = Eyes::default();
        for _ in 0..4 {
            eyes.reach(&[0.0, 0.5, -0.4, 0.5]);
        }
        eyes.look(0.5, 0.2, false, DVec3::ZERO);
        assert_eq!(eyes.share(), Some(0.0));
        eyes.look(-0.4, 0.2, false, DVec3::ZERO);
        assert_eq!(eyes.share(), Some(1.0));
    }

    #[test]
    fn what_may_have_been_meant_is_not_counted() {
        // Gaze was lost when the hand set off; the hand was lost during the fixation; the eyes left the target just before it.
        let lost = |eyes: &mut Eyes| {
            for _ in 0..40 {
                eyes.see(Gaze::Lost, false, DVec3::ZERO);
            }
            eyes.see(Gaze::Lost, true, DVec3::ZERO);
        };
        let mut eyes = Eyes::default();
        eyes.look(0.0, 0.3, false, DVec3::ZERO);
        eyes.look(0.5, 0.3, false, DVec3::ZERO);
        lost(&mut eyes);
        eyes.look(0.5, 0.3, true, DVec3::ZERO);
        assert_eq!(eyes.share(), None);
        let mut eyes = Eyes::default();
        eyes.look(0.0, 0.3, false, DVec3::NAN);
        eyes.look(0.5, 0.3, false, DVec3::NAN);
        eyes.look(0.5, 0.3, true, DVec3::ZERO);
        assert_eq!(eyes.share(), None);
        let mut eyes = Eyes::default();
        eyes.look(0.5, 0.4, false, DVec3::ZERO);
        eyes.look(-0.3, 0.05, false, DVec3::ZERO);
        eyes.look(-0.3, 0.3, true, DVec3::ZERO);
        assert_eq!(eyes.share(), None);
    }

    #[test]
    fn of_a_long_pause_the_last_places_count() {
        let mut eyes = Eyes::default();
        for i in 0..20 {
            let y = if i % 2 == 0 { -0.4 } else { 0.4 };
            eyes.look(y, 0.2, false, DVec3::ZERO);
        }
        eyes.reach(&[0.0, 0.8]);
        for y in [-0.4, 0.4, 0.0] {
            eyes.look(y, 0.2, false, DVec3::ZERO);
            assert_eq!(eyes.share(), Some(0.8), "{y}");
        }
    }

    #[test]
    fn more_places_than_are_remembered_and_no_hand_are_no_harm() {
        let mut eyes = Eyes::default();
        for i in 0..30 {
            let y = 0.15 * f64::from(i);
            eyes.reach(&[y, y + 0.2, y + 0.4, -0.5]);
        }
        eyes.idle.step(&eyes.memory, true, None, APART_RAD);
        let share = eyes.share().expect("known");
        assert!((0.0..=1.0).contains(&share), "{share}");
    }
}
