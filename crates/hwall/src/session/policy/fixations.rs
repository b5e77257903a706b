//! Do this person's fixations lead to touches?

/// Fraction of this person's fixations that led to a reach, with exponential forgetting.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fixations {
    led: f64,
    all: f64,
    /// Mean duration of the fixations that led to no reach, s.
    glance_s: f64,
    /// Start and last sample of the current fixation, s.
    under_way: Option<[f64; 2]>,
    /// Start of the fixation counted last, s: a reach may last longer than one frame.
    counted_s: Option<f64>,
}

/// One frame of gaze and hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FixationFrame {
    /// Time, s.
    pub(super) t_s: f64,
    /// Start of the fixation, if the hand was at rest, s.
    pub(super) since_s: Option<f64>,
    /// Is the hand reaching for the fixated place?
    pub(super) reaches: bool,
    /// Is the hand at rest?
    pub(super) is_still: bool,
}

/// Weight of a fixation relative to the next one.
const FADES: f64 = 0.9;
/// Prior: one fixation that led to a reach.
const LED_BEFORE: f64 = 1.0;
/// Mean duration of fixations on scenes, s [Henderson, Trends in Cognitive Sciences 7(11):498, 2003].
const NOMINAL_GLANCE_S: f64 = 0.33;
/// Shortest fixation that counts, s.
const SHORTEST_S: f64 = 0.1;
/// Longest time from the end of a fixation to its reach, s.
const FOLLOWS_S: f64 = 0.15;

impl Default for Fixations {
    fn default() -> Self {
        Self {
            led: LED_BEFORE,
            all: LED_BEFORE,
            glance_s: NOMINAL_GLANCE_S,
            under_way: None,
            counted_s: None,
        }
    }
}

impl Fixations {
    /// The fraction that led to a reach.
    pub(super) fn share(&self) -> f64 {
        self.led / self.all
    }

    /// Mean duration of this person's fixations that lead to no reach, s.
    pub(super) const fn glance_s(&self) -> f64 {
        self.glance_s
    }

    /// Probability that a fixation that has lasted `lasted_s` leads to a reach. `awaited`: probability that its reach is still to come, if it leads
    /// to one. Durations of the other fixations have a heavy tail, because people also stare: the longer a fixation has lasted, the longer it is
    /// likely to continue.
    pub(super) fn leads(&self, prior: f64, lasted_s: f64, awaited: f64) -> f64 {
        let leads = prior * self.share() * awaited;
        let glances = (1.0 - prior * self.share()) * self.glance_s / (self.glance_s + lasted_s);
        leads / (leads + glances).max(f64::MIN_POSITIVE)
    }

    /// Drops the current fixation without counting it.
    pub(super) const fn forget_fixation(&mut self) {
        self.under_way = None;
    }

    /// The next frame. A fixation that ends because the hand moves elsewhere is not counted: after a touch, the eyes lead the
    /// retracting hand.
    pub(super) fn step(&mut self, frame: &FixationFrame) {
        if !frame.is_still && !frame.reaches {
            self.under_way = None;
        }
        let fixation = frame
            .since_s
            .filter(|since_s| Some(*since_s) != self.counted_s);
        let is_over = |[since_s, seen_s]: [f64; 2]| match fixation {
            Some(now_s) => now_s != since_s,
            None => frame.t_s - seen_s > FOLLOWS_S,
        };
        match self.under_way {
            Some([since_s, _]) if frame.reaches => {
                self.counted_s = Some(since_s);
                self.ended(true);
                return;
            }
            Some(seen) if is_over(seen) => self.ended(false),
            _ => {}
        }
        if let Some(since_s) = fixation {
            self.under_way = Some([since_s, frame.t_s]);
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
            if !led {
                // The assumed duration counts as one more fixation.
                let others = (self.all - self.led).max(1.0);
                self.glance_s += (lasted_s - self.glance_s) / (others + 1.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(t_s: f64, since_s: Option<f64>, reaches: bool) -> FixationFrame {
        FixationFrame {
            t_s,
            since_s,
            reaches,
            is_still: true,
        }
    }

    /// Fixations of 0.4 s, a second apart; each leads to a reach or does not.
    fn share_after(led: &[bool]) -> f64 {
        let mut fixations = Fixations::default();
        for (i, led) in led.iter().enumerate() {
            let since_s = i as f64;
            for k in 0..40 {
                fixations.step(&frame(since_s + 0.01 * f64::from(k), Some(since_s), false));
            }
            fixations.step(&frame(since_s + 0.45, None, *led));
            fixations.step(&frame(since_s + 0.9, None, false));
        }
        fixations.share()
    }

    #[test]
    fn a_look_in_vain_costs_trust_and_touches_win_it_back() {
        assert_eq!(share_after(&[]), 1.0);
        assert_eq!(share_after(&[true; 5]), 1.0);
        assert!(share_after(&[false]) < 0.6);
        assert!(share_after(&[true, true, false]) < 0.8);
        let mut forgiven = vec![false];
        forgiven.extend([true; 12]);
        assert!(share_after(&forgiven) > 0.9);
    }

    #[test]
    fn a_glimpse_is_no_look() {
        let mut fixations = Fixations::default();
        fixations.step(&frame(0.0, Some(0.0), false));
        fixations.step(&frame(0.05, Some(0.0), false));
        fixations.step(&frame(0.5, None, false));
        assert_eq!(fixations.share(), 1.0);
    }

    #[test]
    fn a_fixation_that_outlasts_glances_leads_to_a_reach() {
        let mut fixations = Fixations::default();
        // Three of four are glances of 0.2 s.
        for fixation in 0..40 {
            let since_s = f64::from(fixation);
            for k in 0..=20 {
                fixations.step(&frame(since_s + 0.01 * f64::from(k), Some(since_s), false));
            }
            fixations.step(&frame(since_s + 0.4, None, fixation % 4 == 3));
        }
        let glance_s = fixations.glance_s();
        assert!((glance_s - 0.2).abs() < 0.02, "{glance_s}");
        let leads = [0.0, 0.2, 0.4, 0.8].map(|s| fixations.leads(1.0, s, 1.0));
        assert!((leads[0] - fixations.share()).abs() < 1e-12);
        assert!(leads.is_sorted() && leads[3] > 0.6, "{leads:?}");
        // It leads to no reach once that reach should have come.
        assert!(fixations.leads(1.0, 0.8, 1e-3) < 0.1);
        assert_eq!(fixations.leads(1.0, 1e9, 0.0), 0.0);
        assert_eq!(Fixations::default().leads(1.0, 1.0, 0.0), 0.0);
    }

    #[test]
    fn a_reach_of_many_frames_counts_once() {
        let mut fixations = Fixations::default();
        fixations.step(&frame(0.0, Some(0.0), false));
        for k in 0..30 {
            fixations.step(&frame(0.3 + 0.01 * f64::from(k), Some(0.0), true));
        }
        // Otherwise the reach would offset a false fixation at once.
        assert!((fixations.all - (LED_BEFORE * FADES + 1.0)).abs() < 1e-12);
    }

    #[test]
    fn a_hand_that_goes_back_after_a_touch_proves_nothing() {
        let mut fixations = Fixations::default();
        for k in 0..30 {
            fixations.step(&frame(0.01 * f64::from(k), Some(0.0), false));
        }
        fixations.step(&FixationFrame {
            is_still: false,
            ..frame(0.3, None, false)
        });
        fixations.step(&frame(1.0, None, false));
        assert_eq!(fixations.share(), 1.0);
    }
}
