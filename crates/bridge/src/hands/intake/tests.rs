use super::*;
use crate::counts::BridgeCounts;
use crate::hands::joints::Axes;
use glam::DVec3;
use std::sync::mpsc::{Receiver, sync_channel};

struct Setup {
    intake: Intake,
    tally: Tally,
    frames: Receiver<ReceivedFrame>,
}

fn setup(config: &BridgeConfig) -> Setup {
    let (sender, frames) = sync_channel(4);
    let mut intake = Intake::new(config);
    intake.connect(sender);
    Setup {
        intake,
        tally: Tally::default(),
        frames,
    }
}

fn hand(seq: u64, t_s: f64, side: Side, is_seen: bool) -> HandMessage {
    let mut frame = HandFrame::empty(t_s);
    frame.palm_m = is_seen.then_some(DVec3::X);
    HandMessage {
        seq,
        side,
        axes: Axes::Base,
        frame,
        joints_m: [None; _],
    }
}

impl Setup {
    fn counts(&self) -> BridgeCounts {
        self.tally.counts(0)
    }

    /// A sample of the right hand that arrives as it is made; returns whether it was passed on.
    fn right(&mut self, stream: &mut ClientStream, seq: u64, t_s: f64) -> bool {
        self.intake
            .take(stream, &hand(seq, t_s, Side::Right, true), t_s, &self.tally);
        self.frames.try_recv().is_ok()
    }
}

#[test]
fn repeated_and_overtaken_samples_are_dropped_and_counted() {
    let mut s = setup(&BridgeConfig::default());
    let mut stream = ClientStream::new(1);
    for (seq, t_s, taken) in [
        (5, 0.0, true),
        (5, 0.01, false),
        (4, 0.02, false),
        (6, 0.03, true),
        (9, 0.03, false),
        (10, 0.04, true),
    ] {
        assert_eq!(s.right(&mut stream, seq, t_s), taken, "{seq} at {t_s} s");
    }
    let counts = s.counts();
    assert_eq!((counts.accepted, counts.duplicate), (3, 1));
    assert_eq!(counts.out_of_order, 2);
}

#[test]
fn a_sample_that_was_long_on_its_way_is_stale() {
    let mut s = setup(&BridgeConfig::default());
    let mut stream = ClientStream::new(1);
    assert!(s.right(&mut stream, 1, 10.0));
    let late = hand(2, 10.01, Side::Right, true);
    s.intake.take(&mut stream, &late, 10.3, &s.tally);
    assert!(s.frames.try_recv().is_err());
    assert_eq!(s.counts().stale, 1);
}

/// Regression: such a client counted as stale, without a visible reason.
#[test]
fn stamps_in_seconds_are_told_from_samples_that_are_late() {
    let mut s = setup(&BridgeConfig::default());
    let mut stream = ClientStream::new(1);
    for n in 0..72 {
        let t_s = f64::from(n) / 72.0;
        let message = hand(1 + n as u64, 1e-3 * (1.7e9 + t_s), Side::Right, true);
        s.intake.take(&mut stream, &message, 5.0 + t_s, &s.tally);
    }
    let counts = s.counts();
    assert_eq!(counts.stale, 0);
    assert!(counts.in_seconds > 50, "{}", counts.in_seconds);
    assert!(counts.to_string().contains("seconds"), "{counts}");
    // A clock that stands still, and one that is late.
    let mut standing = ClientStream::new(2);
    for n in 0..30 {
        let t_s = 10.0 + 0.014 * f64::from(n);
        let message = hand(1 + n as u64, 1e-9 * f64::from(n), Side::Right, true);
        s.intake.take(&mut standing, &message, t_s, &s.tally);
    }
    assert!(s.counts().stale > 0);
    assert_eq!(s.counts().in_seconds, counts.in_seconds);
}

#[test]
fn the_first_frame_of_another_client_says_so() {
    let mut s = setup(&BridgeConfig::default());
    let (mut one, mut two) = (ClientStream::new(1), ClientStream::new(2));
    let take = |s: &mut Setup, stream: &mut ClientStream, seq: u64, t_s: f64| {
        let message = hand(seq, t_s, Side::Right, true);
        s.intake.take(stream, &message, t_s, &s.tally);
        s.frames
            .try_recv()
            .map(|received| received.frame.is_of_another)
    };
    assert_eq!(take(&mut s, &mut one, 1, 0.0), Ok(false));
    s.intake.forget(2);
    assert_eq!(take(&mut s, &mut one, 2, 0.1), Ok(false));
    s.intake.forget(1);
    assert_eq!(take(&mut s, &mut two, 1, 0.2), Ok(true));
    assert_eq!(take(&mut s, &mut two, 2, 0.3), Ok(false));
    // Taken over.
    assert_eq!(take(&mut s, &mut one, 3, 2.0), Ok(true));
}

#[test]
fn one_client_leads_until_it_shows_no_hand_for_a_second() {
    let mut s = setup(&BridgeConfig::default());
    let (mut one, mut two) = (ClientStream::new(1), ClientStream::new(2));
    assert!(s.right(&mut one, 1, 0.0));
    assert!(!s.right(&mut two, 1, 0.5));
    // A sample in which the leader's hand is not seen goes to the loop, but does not keep the lead.
    let unseen = hand(2, 0.6, Side::Right, false);
    s.intake.take(&mut one, &unseen, 0.6, &s.tally);
    assert!(s.frames.try_recv().is_ok());
    let counts = s.counts();
    assert_eq!([counts.looking_on, counts.unseen], [1, 1]);
    assert!(s.right(&mut two, 2, 1.1));
    assert_eq!(s.intake.leader(), Some(2));
    assert!(!s.right(&mut one, 3, 1.2));
    s.intake.forget(2);
    assert!(s.right(&mut one, 4, 1.3));
    assert_eq!(s.counts().takeovers, 1);
}

#[test]
fn the_other_hand_is_followed_when_the_first_is_not_seen() {
    let mut s = setup(&BridgeConfig {
        hand: FollowedHand::Either,
        ..BridgeConfig::default()
    });
    let mut stream = ClientStream::new(1);
    let mut seq = 0;
    let mut take = |s: &mut Setup, t_s: f64, side, is_seen| {
        seq += 1;
        let message = hand(seq, t_s, side, is_seen);
        s.intake.take(&mut stream, &message, t_s, &s.tally);
        let received = s.frames.try_recv().ok()?;
        Some(received.frame.other_hand_m.is_some())
    };
    assert_eq!(take(&mut s, 0.0, Side::Right, true), Some(false));
    // The same instant, the other hand.
    assert_eq!(take(&mut s, 0.0, Side::Left, true), None);
    assert_eq!(take(&mut s, 0.03, Side::Right, false), Some(true));
    assert_eq!(take(&mut s, 0.1, Side::Right, false), Some(false));
    assert_eq!(take(&mut s, 0.1, Side::Left, true), None);
    // The followed hand changes when the first one is no longer seen.
    assert_eq!(take(&mut s, 0.2, Side::Left, true), Some(false));
    assert_eq!(take(&mut s, 0.21, Side::Right, true), None);
    assert_eq!(take(&mut s, 0.22, Side::Left, true), Some(true));
    assert_eq!(take(&mut s, 0.37, Side::Left, true), Some(false));
    assert_eq!(s.counts().other_hand, 3);
}

#[test]
fn a_loop_that_takes_nothing_fills_its_queue_and_no_more() {
    let mut s = setup(&BridgeConfig::default());
    let mut stream = ClientStream::new(1);
    for n in 0..10 {
        let t_s = 0.01 * n as f64;
        let message = hand(n + 1, t_s, Side::Right, true);
        s.intake.take(&mut stream, &message, t_s, &s.tally);
    }
    let counts = s.counts();
    assert_eq!([counts.accepted, counts.overflow], [4, 6]);
}

/// A sample of a client at a server time, s, with its stamp; returns whether it was passed on, as whose, and with another hand.
fn take(
    s: &mut Setup,
    stream: &mut ClientStream,
    (now_s, stamp_s): (f64, f64),
    side: Side,
) -> Option<(bool, bool)> {
    let seq = (1e6 * now_s) as u64 + 1;
    s.intake
        .take(stream, &hand(seq, stamp_s, side, true), now_s, &s.tally);
    let frame = s.frames.try_recv().ok()?.frame;
    Some((frame.is_of_another, frame.other_hand_m.is_some()))
}

/// The other hand of the previous leader does not belong to the new one, however recent it is.
#[test]
fn the_other_hand_is_nobody_elses() {
    for leaves in [false, true] {
        let mut s = setup(&BridgeConfig {
            takeover_s: 0.01,
            ..BridgeConfig::default()
        });
        let (mut one, mut two) = (ClientStream::new(1), ClientStream::new(2));
        let at = |s: &mut Setup, who: &mut ClientStream, t_s: f64, side: Side| {
            take(s, who, (t_s, t_s), side)
        };
        let [left, right] = [Side::Left, Side::Right];
        assert_eq!(at(&mut s, &mut one, 0.0, right), Some((false, false)));
        assert_eq!(at(&mut s, &mut one, 0.0005, left), None);
        assert_eq!(at(&mut s, &mut one, 0.001, right), Some((false, true)));
        if leaves {
            s.intake.forget(1);
        }
        for (now_s, other) in [(0.02, false), (0.03, true)] {
            let is_first = !other;
            let taken = at(&mut s, &mut two, now_s, right);
            assert_eq!(taken, Some((is_first, other)), "{leaves} {now_s}");
            assert_eq!(at(&mut s, &mut two, now_s + 1e-3, left), None);
        }
    }
}

/// Sets a client's clock forward or back by this much, s: which samples are passed on, and which of them with the other hand, which was
/// seen 5 ms before?
#[test]
fn the_other_hand_ages_over_a_leap_of_the_clock() {
    let leapt = [None, None, Some((false, true)), Some((false, false))];
    let steady = [true, true, true, false].map(|other| Some((false, other)));
    for (leap_s, expected, after) in [
        (0.0, steady, Some((false, true))),
        (5.0, leapt, Some((false, true))),
        (-5.0, [None; 4], None),
    ] {
        let mut s = setup(&BridgeConfig::default());
        let mut stream = ClientStream::new(1);
        let mut at = |now_s: f64, ahead_s: f64, side| {
            take(&mut s, &mut stream, (now_s, now_s + ahead_s), side)
        };
        at(10.0, 0.0, Side::Right).expect("the first");
        assert_eq!(at(10.005, 0.0, Side::Left), None);
        let taken = [10.01, 10.02, 10.03, 10.05].map(|now_s| at(now_s, leap_s, Side::Right));
        assert_eq!(taken, expected, "{leap_s}");
        assert_eq!(at(10.055, leap_s, Side::Left), None);
        assert_eq!(at(10.06, leap_s, Side::Right), after, "{leap_s}");
    }
}
