//! The loop's end of the hand queue.

use super::intake::ReceivedFrame;
use super::joints::Joints;
use super::window::WindowMinimum;
use glam::DVec3;
use hwall::hand::HandFrame;
use std::sync::mpsc::Receiver;
use std::time::Instant;

/// The two clocks are compared over this time, s. It is short, because the clock of a simulated controller falls behind whenever its
/// machine is busy, but long enough that some cycle in it was on time.
const WINDOW_S: f64 = 0.25;
/// Most time that a frame may be ahead of its cycle, s: a cycle that catches up represents a past instant.
const AHEAD_S: f64 = 0.05;
/// An arm's clock that goes back by more than this has restarted, s.
const ANEW_S: f64 = 0.5;
/// Period at which the loss of a hand is repeated, s.
const SAY_S: f64 = 0.05;

/// Frames of the tracked hand for the loop, in order of time, on the arm's clock.
///
/// Takes no lock and allocates nothing: it only uses `try_recv` on std's bounded channel. If nothing comes for a while, frames without
/// points report the hand as lost.
pub struct HandQueue {
    frames: Receiver<ReceivedFrame>,
    server_start: Instant,
    lost_after_s: f64,
    /// Server time minus arm time of a cycle, s.
    server_minus_arm_s: WindowMinimum,
    /// Time of the newest cycle, s on the arm's clock.
    cycle_s: f64,
    /// Receipt of the newest frame, or time of the last loss report, s on the server's clock; `None` before the first frame.
    heard_s: Option<f64>,
    /// Time of the newest frame returned, s on the arm's clock.
    newest_s: f64,
    newest: Option<(HandFrame, Joints)>,
}

impl HandQueue {
    pub(crate) fn new(
        frames: Receiver<ReceivedFrame>,
        server_start: Instant,
        lost_after_s: f64,
    ) -> Self {
        Self {
            frames,
            server_start,
            lost_after_s,
            server_minus_arm_s: WindowMinimum::new(WINDOW_S),
            cycle_s: f64::NEG_INFINITY,
            heard_s: None,
            newest_s: f64::NEG_INFINITY,
            newest: None,
        }
    }

    /// The last frame returned, in the base frame, and all joints of its hand in OpenXR's order, m.
    #[must_use]
    pub const fn newest(&self) -> Option<&(HandFrame, [Option<DVec3>; 26])> {
        self.newest.as_ref()
    }

    /// The next frame that has arrived by now (s, the arm's clock) and was not yet returned.
    pub fn next_frame(&mut self, now_s: f64) -> Option<HandFrame> {
        let server_s = self.server_start.elapsed().as_secs_f64();
        self.next_frame_at(now_s, server_s)
    }

    /// Offset of the two clocks: a cycle may be late but never early, so the least difference is the most accurate.
    fn server_minus_arm_s(&mut self, now_s: f64, server_s: f64) -> f64 {
        if now_s < self.cycle_s - ANEW_S {
            self.server_minus_arm_s = WindowMinimum::new(WINDOW_S);
            self.newest_s = f64::NEG_INFINITY;
        }
        self.cycle_s = now_s;
        let difference_s = server_s - now_s;
        self.server_minus_arm_s.add(server_s, difference_s);
        let least_s = self.server_minus_arm_s.minimum(server_s);
        least_s.unwrap_or(difference_s)
    }

    fn next_frame_at(&mut self, now_s: f64, server_s: f64) -> Option<HandFrame> {
        let offset_s = self.server_minus_arm_s(now_s, server_s);
        while let Ok(received) = self.frames.try_recv() {
            let ReceivedFrame {
                frame,
                joints_m,
                received_s,
            } = received;
            self.heard_s = Some(received_s);
            let t_s = (frame.t_s - offset_s).min(now_s + AHEAD_S);
            // Skip frames from before the hand was reported as lost.
            if t_s > self.newest_s {
                self.newest_s = t_s;
                let frame = HandFrame { t_s, ..frame };
                self.newest = Some((frame, joints_m));
                return Some(frame);
            }
        }
        let heard_s = self.heard_s?;
        if server_s - heard_s <= self.lost_after_s || now_s <= self.newest_s {
            return None;
        }
        // Repeat the report, but not in every cycle.
        self.heard_s = Some(server_s - self.lost_after_s + SAY_S);
        self.newest_s = now_s;
        let lost = HandFrame::empty(now_s);
        self.newest = Some((lost, [None; _]));
        Some(lost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{SyncSender, sync_channel};

    fn queue() -> (SyncSender<ReceivedFrame>, HandQueue) {
        let (sender, receiver) = sync_channel(8);
        (sender, HandQueue::new(receiver, Instant::now(), 0.15))
    }

    fn seen(t_s: f64) -> ReceivedFrame {
        let mut frame = HandFrame::empty(t_s);
        frame.palm_m = Some(DVec3::X);
        ReceivedFrame {
            frame,
            joints_m: [None; _],
            received_s: t_s,
        }
    }

    #[test]
    fn silence_is_a_lost_hand_and_not_a_frozen_one() {
        let (sender, mut queue) = queue();
        // Before the first hand, nothing is lost.
        assert_eq!(queue.next_frame_at(0.0, 100.0), None);
        sender.send(seen(100.0)).expect("room in the queue");
        let is_seen = |frame: HandFrame| frame.palm_m.is_some();
        assert!(queue.next_frame_at(0.0, 100.0).is_some_and(is_seen));
        let mut said = 0;
        for cycle in 1..=1000 {
            let t_s = 1e-3 * f64::from(cycle);
            if let Some(frame) = queue.next_frame_at(t_s, 100.0 + t_s) {
                assert!(t_s > 0.149 && frame == HandFrame::empty(t_s));
                said += 1;
            }
        }
        assert!((15..=18).contains(&said), "{said}");
        sender.send(seen(101.0005)).expect("room in the queue");
        assert!(queue.next_frame_at(1.001, 101.001).is_some_and(is_seen));
    }

    #[test]
    fn times_are_of_the_arms_clock_though_cycles_come_late() {
        let (sender, mut queue) = queue();
        let mut last_s = f64::NEG_INFINITY;
        for cycle in 0..5000 {
            let now_s = 1e-3 * f64::from(cycle);
            // The arm's clock is 0.01 % slow, and some cycles are late by up to 3 ms.
            let late_s = 1e-3 * f64::from(cycle % 4);
            let server_s = 50.0 + 1.0001 * now_s + late_s;
            if cycle % 14 == 0 {
                let frame = seen(50.0 + 1.0001 * now_s);
                sender.send(frame).expect("room in the queue");
            }
            while let Some(frame) = queue.next_frame_at(now_s, server_s) {
                assert!(frame.t_s > last_s);
                assert!((frame.t_s - now_s).abs() < 0.004, "{} {now_s}", frame.t_s);
                last_s = frame.t_s;
            }
        }
        assert!(last_s > 4.9);
    }

    #[test]
    fn an_arm_whose_clock_falls_behind_gets_frames_of_its_present() {
        let (sender, mut queue) = queue();
        let (mut now_s, mut last_s, mut given) = (0.0, f64::NEG_INFINITY, 0);
        for cycle in 0..20_000 {
            // One period in ten takes twice as long, and one stops for 0.3 s.
            let server_s = 7.0 + 1.1e-3 * f64::from(cycle) + if cycle > 9000 { 0.3 } else { 0.0 };
            if cycle % 14 == 0 {
                sender.send(seen(server_s)).expect("room in the queue");
            }
            while let Some(frame) = queue.next_frame_at(now_s, server_s) {
                assert!(frame.t_s > last_s);
                assert!((frame.t_s - now_s).abs() < 0.06, "{} {now_s}", frame.t_s);
                assert!(frame.palm_m.is_some());
                last_s = frame.t_s;
                given += 1;
            }
            now_s += 1e-3;
        }
        assert!(given > 1300, "{given} frames of 1429");
    }

    #[test]
    fn a_clock_that_begins_anew_does_not_lose_the_hand() {
        let (sender, mut queue) = queue();
        for (now_s, server_s) in [(30.0, 50.0), (0.0, 50.1)] {
            sender.send(seen(server_s)).expect("room in the queue");
            let frame = queue.next_frame_at(now_s, server_s).expect("a frame");
            assert!((frame.t_s - now_s).abs() < 1e-9, "{} {now_s}", frame.t_s);
        }
    }
}
