//! One client: a small queue between its connection and the other threads.

use crate::counts::Tally;
use crate::http::stream::Stream;
use crate::locked::locked;
use std::collections::VecDeque;
use std::net::Shutdown;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};
use tungstenite::{Message, Utf8Bytes};

/// Most texts that wait for a slow client.
const MOST_TEXTS: usize = 256;
/// A client that has not answered a ping for this long gets no views, s: they would arrive late.
const LAGS_S: f64 = 0.5;

/// A client as the other threads see it.
pub(crate) struct Client {
    pub(super) id: u64,
    /// Does it want views as JSON?
    pub(super) json: bool,
    /// The headset that shows it; 0: none, or not identified.
    headset: AtomicU64,
    outbox: Mutex<Outbox>,
    wake: Condvar,
    stream: Stream,
}

/// Messages that wait to be sent.
#[derive(Default)]
struct Outbox {
    texts: VecDeque<Utf8Bytes>,
    /// The newest view; an unsent older one is dropped.
    view: Option<Message>,
    ping: Option<u64>,
    /// The unanswered ping: its number, and when it was sent, s.
    unanswered: Option<(u64, f64)>,
    pings: u64,
    ended: bool,
}

impl Client {
    pub(super) fn new(id: u64, stream: Stream, json: bool) -> Self {
        Self {
            id,
            json,
            headset: AtomicU64::new(0),
            outbox: Mutex::default(),
            wake: Condvar::new(),
            stream,
        }
    }

    /// Stores the headset that shows this client.
    pub(super) fn is_in(&self, headset: u64) {
        self.headset.store(headset, Ordering::Relaxed);
    }

    pub(super) fn headset(&self) -> Option<u64> {
        Some(self.headset.load(Ordering::Relaxed)).filter(|id| *id > 0)
    }

    /// Queues a text; a client that does not read loses the oldest.
    pub(super) fn say(&self, text: &str, tally: &Tally) {
        let mut outbox = locked(&self.outbox);
        if outbox.texts.len() == MOST_TEXTS {
            outbox.texts.pop_front();
            tally.events_dropped.add(1);
        }
        outbox.texts.push_back(text.into());
        drop(outbox);
        self.wake.notify_one();
    }

    /// Queues a view, if the client keeps up.
    pub(super) fn show(&self, view: &Message, now_s: f64, tally: &Tally) {
        let mut outbox = locked(&self.outbox);
        let lags = outbox
            .unanswered
            .is_some_and(|(_, sent_s)| now_s - sent_s > LAGS_S);
        if lags || outbox.view.is_some() {
            tally.views_dropped.add(1);
        }
        if lags {
            return;
        }
        outbox.view = Some(view.clone());
        drop(outbox);
        self.wake.notify_one();
    }

    /// Sends a ping, unless one is unanswered.
    pub(super) fn ping(&self, now_s: f64) {
        let mut outbox = locked(&self.outbox);
        if outbox.unanswered.is_none() {
            outbox.pings += 1;
            let number = outbox.pings;
            outbox.ping = Some(number);
            outbox.unanswered = Some((number, now_s));
            drop(outbox);
            self.wake.notify_one();
        }
    }

    /// When the ping of this number was sent, s, if it is the unanswered one.
    pub(super) fn answered(&self, number: u64) -> Option<f64> {
        let mut outbox = locked(&self.outbox);
        let (_, sent_s) = outbox.unanswered.take_if(|(waits, _)| *waits == number)?;
        Some(sent_s)
    }

    /// Waits for messages to send; `None` once the connection has ended.
    pub(super) fn wait(&self) -> Option<(VecDeque<Utf8Bytes>, Option<Message>, Option<u64>)> {
        let mut outbox = locked(&self.outbox);
        while outbox.texts.is_empty()
            && outbox.view.is_none()
            && outbox.ping.is_none()
            && !outbox.ended
        {
            outbox = self
                .wake
                .wait(outbox)
                .unwrap_or_else(PoisonError::into_inner);
        }
        if outbox.ended {
            return None;
        }
        let texts = std::mem::take(&mut outbox.texts);
        Some((texts, outbox.view.take(), outbox.ping.take()))
    }

    /// Ends the connection.
    pub(super) fn end(&self) {
        locked(&self.outbox).ended = true;
        self.wake.notify_one();
        // It may have ended already.
        let _ = self.stream.tcp().shutdown(Shutdown::Both);
    }
}
