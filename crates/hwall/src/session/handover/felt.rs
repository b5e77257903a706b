//! Touches that the board felt, sent to the tracker's half.

use glam::DVec3;
use hwall_hand::{HandFrame, HandState};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Marks that no touch was felt; no touch has these bits as its time.
const NONE: u64 = u64::MAX;

/// The control half's end: the time of the newest touch, as the bits of one word, so that it is never torn.
pub(in crate::session) struct Feeler(Arc<AtomicU64>);

impl Feeler {
    /// Reports a press of the board, s, on the arm's clock. Neither allocates nor waits.
    pub(in crate::session) fn felt(&self, t_s: f64) {
        if t_s.is_finite() {
            self.0.store(t_s.to_bits(), Ordering::Release);
        }
    }
}

/// The tracker's end: where the hand was when the board felt it.
pub(in crate::session) struct FeltTouches {
    newest: Arc<AtomicU64>,
    heard: u64,
    seen: u64,
    /// The touching point of the previous frame, in the frame of the scene: time, s, and position, m.
    last: Option<(f64, DVec3)>,
    /// Position of the last touch, until the hand has left it, m.
    at_m: Option<DVec3>,
}

/// Most time between a touch and a frame of the tracker, s; beyond it one of the clocks is wrong.
const APART_S: f64 = 0.1;
/// A hand that has stayed closer than this since the last touch presses again without a new reach, m.
const AWAY_M: f64 = 0.05;

/// Both ends of the hand-over.
pub(in crate::session) fn felt_touches() -> (Feeler, FeltTouches) {
    let newest = Arc::new(AtomicU64::new(NONE));
    let touches = FeltTouches {
        newest: Arc::clone(&newest),
        heard: NONE,
        seen: NONE,
        last: None,
        at_m: None,
    };
    (Feeler(newest), touches)
}

impl FeltTouches {
    /// Makes the touches until now count in the next step.
    pub(in crate::session) fn listen(&mut self) {
        self.heard = self.newest.load(Ordering::Acquire);
    }

    /// Takes a frame in the frame of the scene, and its hand (`None` if lost). Returns where, m, and when, s, on the clock of the tracker,
    /// a touch was felt since the previous frame. A touch is dropped unless the hand was seen in both frames.
    pub(in crate::session) fn step(
        &mut self,
        frame: &HandFrame,
        hand: Option<&HandState>,
        arm_minus_tracker_s: f64,
    ) -> Option<(DVec3, f64)> {
        let tip = hand.and_then(|_| frame.contact_point());
        let now = tip.map(|tip| (frame.t_s, tip.position_m));
        let before = std::mem::replace(&mut self.last, now);
        let bits = self.heard;
        let is_new = std::mem::replace(&mut self.seen, bits) != bits;
        let (now_s, now_m) = now?;
        if self.at_m.is_some_and(|at_m| at_m.distance(now_m) > AWAY_M) {
            self.at_m = None;
        }
        let (before_s, before_m) = before?;
        if !is_new || self.at_m.is_some() {
            return None;
        }
        let felt_s = f64::from_bits(bits) - arm_minus_tracker_s;
        let is_near = before_s - APART_S <= felt_s && felt_s <= now_s + APART_S;
        if !is_near || now_s <= before_s {
            return None;
        }
        let share = (felt_s - before_s) / (now_s - before_s);
        let at_m = before_m.lerp(now_m, share.clamp(0.0, 1.0));
        self.at_m = Some(at_m);
        Some((at_m, felt_s))
    }

    /// Drops earlier positions after the world jumped.
    pub(in crate::session) const fn reset(&mut self) {
        self.last = None;
        self.at_m = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(t_s: f64, x_m: f64) -> HandFrame {
        HandFrame {
            tips_m: [None, Some(DVec3::X * x_m), None, None, None],
            ..HandFrame::empty(t_s)
        }
    }

    fn hand() -> HandState {
        let mut filter = hwall_hand::HandFilter::new(hwall_hand::HandFilterConfig::simulated())
            .expect("usual settings");
        let mut state = None;
        for k in 0..8 {
            let t_s = 0.01 * f64::from(k);
            state = filter.step(&frame(t_s, 0.1 * t_s)).state().copied();
        }
        state.expect("a hand that moves")
    }

    #[test]
    fn a_touch_is_where_the_hand_was_between_two_frames() {
        let (feeler, mut touches) = felt_touches();
        let hand = hand();
        let mut step = |t_s: f64, x_m: f64| {
            touches.listen();
            touches.step(&frame(t_s, x_m), Some(&hand), 10.0)
        };
        assert_eq!(step(1.00, 0.00), None);
        feeler.felt(11.005);
        let (at_m, t_s) = step(1.01, 0.02).expect("felt");
        assert!((at_m.x - 0.01).abs() < 1e-9 && (t_s - 1.005).abs() < 1e-9);
        // Pressed again without leaving: no new reach.
        feeler.felt(11.015);
        assert_eq!(step(1.02, 0.03), None);
        assert_eq!(step(1.03, 0.20), None);
        feeler.felt(11.035);
        assert!(step(1.04, 0.20).is_some());
    }

    #[test]
    fn a_lost_hand_and_a_clock_that_jumped_tell_nothing() {
        let (feeler, mut touches) = felt_touches();
        let hand = hand();
        touches.step(&frame(1.0, 0.0), Some(&hand), 0.0);
        feeler.felt(1.005);
        touches.listen();
        assert_eq!(touches.step(&frame(1.01, 0.0), None, 0.0), None);
        assert_eq!(touches.step(&frame(1.02, 0.0), Some(&hand), 0.0), None);
        assert_eq!(touches.step(&frame(1.03, 0.0), Some(&hand), 0.0), None);
        for bad_s in [5.0, -5.0, f64::NAN, f64::INFINITY] {
            feeler.felt(bad_s);
            touches.listen();
            assert_eq!(touches.step(&frame(1.04, 0.0), Some(&hand), 0.0), None);
        }
        // A tracker clock that stands still or goes back.
        feeler.felt(1.045);
        touches.listen();
        assert_eq!(touches.step(&frame(1.03, 0.0), Some(&hand), 0.0), None);
    }
}
