//! Which samples of which client count.

use super::clock::{ClockOffset, ClockReading};
use super::joints::{HeadsetSpace, Joints};
use super::message::{HandMessage, Side};
use crate::config::{BridgeConfig, FollowedHand};
use crate::counts::Tally;
use glam::DVec3;
use hwall::hand::{HandFrame, HandPoint};
use std::sync::mpsc::{SyncSender, TrySendError};

/// Samples that wait for the loop at most: more than three seconds of a headset.
pub(crate) const HAND_QUEUE: usize = 256;

/// The pace of a client's clock is taken over this time, s: a dozen samples of a headset.
const PACE_S: f64 = 0.15;

/// Longest time from a sample of the other hand to a frame that carries it, s: one sample at 30 Hz.
const OTHER_AGE_S: f64 = 0.035;

/// A frame on its way to the loop, its time and that of its receipt on the server's clock.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ReceivedFrame {
    pub(crate) frame: HandFrame,
    /// All joints of the hand, base frame, m.
    pub(crate) joints_m: Joints,
    pub(crate) received_s: f64,
}

/// What is remembered of one client's stream.
#[derive(Debug, Clone)]
pub(crate) struct ClientStream {
    pub(crate) id: u64,
    newest_seq: Option<u64>,
    /// Newest time on the client's clock, s, for the left and the right hand.
    newest_s: [f64; 2],
    pub(crate) clock: ClockOffset,
    /// When a sample came in, and its stamp, s: with those that follow, how fast its clock runs.
    paced_from_s: Option<[f64; 2]>,
    /// Does its clock run as if its stamps were seconds?
    pub(crate) in_seconds: bool,
}

impl ClientStream {
    pub(crate) const fn new(id: u64) -> Self {
        Self {
            id,
            newest_seq: None,
            newest_s: [f64::NEG_INFINITY; 2],
            clock: ClockOffset::new(),
            paced_from_s: None,
            in_seconds: false,
        }
    }

    /// Do its stamps count seconds where milliseconds are expected, so that its clock runs a thousand times too slow?
    fn counts_seconds(&mut self, now_s: f64, client_s: f64) -> bool {
        let [from_s, stamp_s] = *self.paced_from_s.get_or_insert([now_s, client_s]);
        if now_s - from_s >= PACE_S {
            // A clock that stands, or runs otherwise, counts nothing else.
            let pace = (client_s - stamp_s) / (now_s - from_s);
            self.in_seconds = (0.5e-3..=2e-3).contains(&pace);
            self.paced_from_s = Some([now_s, client_s]);
        }
        self.in_seconds
    }
}

/// The client, or the hand, that is followed.
#[derive(Debug, Clone, Copy)]
struct Followed<T> {
    who: T,
    /// When it last showed a hand, s.
    seen_s: f64,
}

/// Decides for every sample whether it goes to the loop. One for the server; clients take turns.
pub(crate) struct Intake {
    space: HeadsetSpace,
    hand: FollowedHand,
    max_age_s: f64,
    lost_after_s: f64,
    takeover_s: f64,
    leader: Option<Followed<u64>>,
    side: Option<Followed<Side>>,
    /// Where the other hand of the same client is, base frame, m, and when it was seen there, s.
    other: Option<(DVec3, f64)>,
    /// Time of the newest sample handed on, s.
    newest_s: f64,
    /// Has another client come to lead since the last frame that was handed on?
    is_another: bool,
    queue: Option<SyncSender<ReceivedFrame>>,
}

impl Intake {
    pub(crate) fn new(config: &BridgeConfig) -> Self {
        Self {
            space: HeadsetSpace::new(&config.base_from_headset),
            hand: config.hand,
            max_age_s: config.max_age_s,
            lost_after_s: config.lost_after_s,
            takeover_s: config.takeover_s,
            leader: None,
            side: None,
            other: None,
            newest_s: f64::NEG_INFINITY,
            is_another: false,
            queue: None,
        }
    }

    /// Where samples go from now on.
    pub(crate) fn connect(&mut self, queue: SyncSender<ReceivedFrame>) {
        self.queue = Some(queue);
    }

    /// A client is gone; anybody may lead.
    pub(crate) fn forget(&mut self, client: u64) {
        if self.leader.is_some_and(|leader| leader.who == client) {
            self.leader = None;
            self.side = None;
            self.other = None;
            self.is_another = true;
        }
    }

    /// The client that leads.
    pub(crate) fn leader(&self) -> Option<u64> {
        self.leader.map(|leader| leader.who)
    }

    /// Takes a sample that came in at `now_s`; what becomes of it is in the tally.
    pub(crate) fn take(
        &mut self,
        stream: &mut ClientStream,
        message: &HandMessage,
        now_s: f64,
        tally: &Tally,
    ) {
        let Some(frame) = in_order(stream, message, now_s, tally) else {
            return;
        };
        if stream.counts_seconds(now_s, message.frame.t_s) {
            tally.in_seconds.add(1);
            return;
        }
        let is_seen = frame.points().iter().any(Option::is_some);
        let refused = if now_s - frame.t_s > self.max_age_s {
            Some(&tally.stale)
        } else if !self.leads(stream.id, is_seen, now_s, tally) {
            Some(&tally.looking_on)
        } else if !self.follows(message.side, is_seen, now_s) {
            let frame = self.space.to_base(&frame, message.axes);
            let seen = frame.point(HandPoint::Palm);
            let seen = seen.or(frame.contact_point().map(|tip| tip.position_m));
            self.other = seen.map(|palm_m| (palm_m, frame.t_s));
            Some(&tally.other_hand)
        } else if frame.t_s <= self.newest_s {
            // Another client's clock is off by less than a frame.
            Some(&tally.out_of_order)
        } else {
            None
        };
        if let Some(count) = refused {
            count.add(1);
            return;
        }
        self.newest_s = frame.t_s;
        let mut frame = self.space.to_base(&frame, message.axes);
        frame.is_of_another = self.is_another;
        let other = self
            .other
            .filter(|(_, at_s)| frame.t_s - at_s <= OTHER_AGE_S);
        frame.other_hand_m = other.map(|(palm_m, _)| palm_m);
        let received = ReceivedFrame {
            frame,
            joints_m: self.space.joints_to_base(&message.joints_m, message.axes),
            received_s: now_s,
        };
        let Some(queue) = &self.queue else {
            // Nobody asks for hands yet.
            return;
        };
        match queue.try_send(received) {
            Ok(()) => {
                self.is_another = false;
                tally.accepted.add(1);
                tally.unseen.add(u64::from(!is_seen));
            }
            Err(TrySendError::Full(_)) => tally.overflow.add(1),
            Err(TrySendError::Disconnected(_)) => self.queue = None,
        }
    }

    /// Does this client lead, perhaps from now on? Only one that shows a hand takes over.
    fn leads(&mut self, client: u64, is_seen: bool, now_s: f64, tally: &Tally) -> bool {
        if let Some(leader) = &mut self.leader {
            if leader.who == client {
                if is_seen {
                    leader.seen_s = now_s;
                }
                return true;
            }
            if now_s - leader.seen_s <= self.takeover_s {
                return false;
            }
        }
        if !is_seen {
            return false;
        }
        if self.leader.is_some() {
            tally.takeovers.add(1);
            self.is_another = true;
        }
        self.leader = Some(Followed {
            who: client,
            seen_s: now_s,
        });
        self.side = None;
        self.other = None;
        true
    }

    fn follows(&mut self, side: Side, is_seen: bool, now_s: f64) -> bool {
        match self.hand {
            FollowedHand::Left => return side == Side::Left,
            FollowedHand::Right => return side == Side::Right,
            FollowedHand::Either => {}
        }
        if let Some(followed) = &mut self.side {
            if followed.who == side {
                if is_seen {
                    followed.seen_s = now_s;
                }
                return true;
            }
            if !is_seen || now_s - followed.seen_s <= self.lost_after_s {
                return false;
            }
        }
        self.side = Some(Followed {
            who: side,
            seen_s: now_s,
        });
        self.other = None;
        true
    }
}

/// The sample with its time on the server's clock, if it is newer than those before it.
fn in_order(
    stream: &mut ClientStream,
    message: &HandMessage,
    now_s: f64,
    tally: &Tally,
) -> Option<HandFrame> {
    if let Some(newest) = stream.newest_seq.filter(|newest| message.seq <= *newest) {
        let count = match message.seq == newest {
            true => &tally.duplicate,
            false => &tally.out_of_order,
        };
        count.add(1);
        return None;
    }
    stream.newest_seq = Some(message.seq);
    let client_s = message.frame.t_s;
    let ClockReading::At(t_s) = stream.clock.sample(now_s, client_s) else {
        tally.clock_leaps.add(1);
        stream.newest_s = [f64::NEG_INFINITY; 2];
        return None;
    };
    let newest_s = match message.side {
        Side::Left => &mut stream.newest_s[0],
        Side::Right => &mut stream.newest_s[1],
    };
    // Both hands of one sample have one time.
    if client_s <= *newest_s {
        tally.out_of_order.add(1);
        return None;
    }
    *newest_s = client_s;
    Some(HandFrame {
        t_s,
        ..message.frame
    })
}

#[cfg(test)]
mod tests {
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

        /// A sample of the right hand that comes in when it is made; was it handed on?
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
        let took = [
            (5, 0.0),
            (5, 0.01),
            (4, 0.02),
            (6, 0.03),
            (9, 0.03),
            (10, 0.04),
        ]
        .map(|(seq, t_s)| s.right(&mut stream, seq, t_s));
        assert_eq!(took, [true, false, false, true, false, true]);
        let counts = s.counts();
        assert_eq!(
            [counts.accepted, counts.duplicate, counts.out_of_order],
            [3, 1, 2]
        );
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

    /// Such a client counted as stale, and nobody knew why.
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
        // A clock that stands, and one that is late.
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
        // What the leader does not see goes to the loop, too, but does not keep it leading.
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
        // The hand that is followed changes; the first one is not seen then.
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
}
