//! Do this person's looks lead to touches?

/// How many looks of this person led to a reach, counted with a memory that fades.
#[derive(Debug, Clone, Copy)]
pub(super) struct Looks {
    led: f64,
    all: f64,
    /// Since when the look under way has lasted, s, and until when it was seen.
    under_way: Option<[f64; 2]>,
}

/// Looks count for so much less after each that follows.
const FADES: f64 = 0.9;
/// What is known of a person before the first look: that one of one led to a reach.
const LED_BEFORE: f64 = 1.0;
/// A glance this short is none, s.
const SHORTEST_S: f64 = 0.1;
/// A reach begins at most this long after its look ended, s.
const FOLLOWS_S: f64 = 0.15;

impl Default for Looks {
    fn default() -> Self {
        Self {
            led: LED_BEFORE,
            all: LED_BEFORE,
            under_way: None,
        }
    }
}

impl Looks {
    /// The share that led to a reach.
    pub(super) fn share(&self) -> f64 {
        self.led / self.all
    }

    /// The look under way is over and proves nothing; what is known of the person stays.
    pub(super) const fn forget_look(&mut self) {
        self.under_way = None;
    }

    /// A frame: since when the eyes have rested on one place while the hand rested, and whether the hand reaches.
    pub(super) fn step(&mut self, t_s: f64, look: Option<f64>, reaches: bool) {
        let is_over = |[since_s, seen_s]: [f64; 2]| match look {
            Some(now_s) => now_s != since_s,
            None => t_s - seen_s > FOLLOWS_S,
        };
        match self.under_way {
            Some(_) if reaches => self.ended(true),
            Some(seen) if is_over(seen) => self.ended(false),
            _ => {}
        }
        if let Some(since_s) = look {
            self.under_way = Some([since_s, t_s]);
        }
    }

    fn ended(&mut self, led: bool) {
        let lasted_s = self
            .under_way
            .take()
            .map_or(0.0, |[since_s, seen_s]| seen_s - since_s);
        if led || lasted_s >= SHORTEST_S {
            self.led = self.led * FADES + f64::from(u8::from(led));
            self.all = self.all * FADES + 1.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks of 0.4 s, a second apart; each leads to a reach or does not.
    fn share_after(led: &[bool]) -> f64 {
        let mut looks = Looks::default();
        for (i, led) in led.iter().enumerate() {
            let since_s = i as f64;
            for frame in 0..40 {
                looks.step(since_s + 0.01 * f64::from(frame), Some(since_s), false);
            }
            looks.step(since_s + 0.45, None, *led);
            looks.step(since_s + 0.9, None, false);
        }
        looks.share()
    }

    #[test]
    fn whoever_touches_what_they_look_at_is_trusted() {
        assert_eq!(share_after(&[]), 1.0);
        assert_eq!(share_after(&[true; 5]), 1.0);
    }

    #[test]
    fn a_look_in_vain_costs_trust_and_touches_win_it_back() {
        assert!(share_after(&[false]) < 0.6);
        assert!(share_after(&[true, true, false]) < 0.8);
        let mut forgiven = vec![false];
        forgiven.extend([true; 12]);
        assert!(share_after(&forgiven) > 0.9);
    }

    #[test]
    fn a_glimpse_is_no_look() {
        let mut looks = Looks::default();
        looks.step(0.0, Some(0.0), false);
        looks.step(0.05, Some(0.0), false);
        looks.step(0.5, None, false);
        assert_eq!(looks.share(), 1.0);
    }
}
