//! Selects the samples that go to the loop.

use super::clock::{ClockOffset, ClockReading};
use super::joints::{Axes, HeadsetSpace, Joints};
use super::message::{HandMessage, Side};
use crate::calibration::Served;
use crate::config::{BridgeConfig, FollowedHand};
use crate::counts::Tally;
use glam::DVec3;
use hwall::geometry::Pose;
use hwall::hand::{HandFrame, HandPoint};
use std::sync::mpsc::{SyncSender, TrySendError};

/// Most samples that wait for the loop: more than three seconds of a headset.
pub(crate) const HAND_QUEUE: usize = 256;

/// The rate of a client's clock is measured over this time, s: a dozen samples of a headset.
const RATE_S: f64 = 0.15;

/// Longest time from a sample of the other hand to the frame that includes it, s: one sample at 30 Hz.
const OTHER_AGE_S: f64 = 0.035;

/// A frame for the loop, with its time and its time of receipt on the server's clock.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ReceivedFrame {
    pub(crate) frame: HandFrame,
    /// All joints of the hand, base frame, m.
    pub(crate) joints_m: Joints,
    pub(crate) received_s: f64,
}

/// State of one client's stream.
#[derive(Debug, Clone)]
pub(crate) struct ClientStream {
    pub(crate) id: u64,
    newest_seq: Option<u64>,
    /// Newest time on the client's clock, s, for the left and the right hand.
    newest_s: [f64; 2],
    pub(crate) clock: ClockOffset,
    /// Time of receipt and stamp of the first sample, s, to measure the rate of the client's clock.
    paced_from_s: Option<[f64; 2]>,
    /// Does its clock run as if its stamps were in seconds?
    pub(crate) in_seconds: bool,
    /// The headset that it comes from.
    pub(crate) headset: Option<u64>,
    /// Its last hand was dropped because it has not named its headset.
    pub(crate) is_nameless: bool,
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
            headset: None,
            is_nameless: false,
        }
    }

    /// Are its stamps in seconds instead of milliseconds, so that its clock runs a thousand times too slow?
    fn counts_seconds(&mut self, now_s: f64, client_s: f64) -> bool {
        let [from_s, stamp_s] = *self.paced_from_s.get_or_insert([now_s, client_s]);
        if now_s - from_s >= RATE_S {
            // A clock that stands still, or has another rate, does not count seconds.
            let rate = (client_s - stamp_s) / (now_s - from_s);
            self.in_seconds = (0.5e-3..=2e-3).contains(&rate);
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

/// Decides for every sample whether it goes to the loop. One per server; clients take turns.
pub(crate) struct Intake {
    space: HeadsetSpace,
    served: Served,
    hand: FollowedHand,
    max_age_s: f64,
    lost_after_s: f64,
    takeover_s: f64,
    leader: Option<Followed<u64>>,
    side: Option<Followed<Side>>,
    /// Palm of the other hand of the same client, base frame, m, and the time at which it was seen, s.
    other: Option<(DVec3, f64)>,
    /// Time of the newest sample passed on, s.
    newest_s: f64,
    /// Has the leading client changed since the last frame passed on?
    is_another: bool,
    queue: Option<SyncSender<ReceivedFrame>>,
}

impl Intake {
    pub(crate) fn new(config: &BridgeConfig) -> Self {
        Self {
            space: HeadsetSpace::new(&config.base_from_headset),
            served: Served::Any,
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

    /// Sends samples to this queue from now on.
    pub(crate) fn connect(&mut self, queue: SyncSender<ReceivedFrame>) {
        self.queue = Some(queue);
    }

    /// Sets the pose of the headset's space.
    pub(crate) fn place(&mut self, base_from_headset: &Pose) {
        self.space = HeadsetSpace::new(base_from_headset);
    }

    /// Sets which headsets count.
    pub(crate) fn serve(&mut self, served: Served) {
        self.served = served;
    }

    /// Removes a client; then any client may lead.
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

    /// Takes a sample that arrived at `now_s`; the tally counts what becomes of it.
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
        let is_served = message.axes == Axes::Base || self.served.has(stream.headset);
        stream.is_nameless = !is_served && stream.headset.is_none();
        let is_seen = frame.points().iter().any(Option::is_some);
        let refused = if now_s - frame.t_s > self.max_age_s {
            Some(&tally.stale)
        } else if !is_served {
            Some(&tally.uncalibrated)
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
            // No loop is connected yet.
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

    /// Does this client lead, perhaps from now on? Only a client that shows a hand takes over.
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

/// The sample with its time on the server's clock, if it is newer than the previous ones.
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
    // Both hands of one sample have the same time.
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
mod tests;
