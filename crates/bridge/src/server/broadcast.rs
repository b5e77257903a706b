//! Sends from the loop to all clients.

use super::reply::{self, Reply};
use super::shared::{FromLoop, Shared};
use crate::bridge::REQUESTED;
use crate::locked::locked;
use hwall_view::ViewFrame;
use std::time::Duration;
use tungstenite::{Bytes, Message};

/// How often the loop's queues are polled. Nothing blocks on them: the loop would have to wake a blocked receiver, which takes a lock.
const LOOK: Duration = Duration::from_millis(4);
/// Period of the pings, s.
const PING_S: f64 = 0.25;
/// Period of the counts, s.
const COUNTS_S: f64 = 1.0;
/// Shortest period of explanations, s: as fast as somebody can read that one has changed.
const EXPLANATIONS_S: f64 = 0.2;

/// Runs until the server stops.
pub(super) fn broadcast(shared: &Shared) {
    let mut bytes = Vec::with_capacity(ViewFrame::MOST_BYTES);
    let [mut ping_s, mut counts_s, mut explanation_s] = [0.0; 3];
    while !shared.is_stopped() {
        let now_s = shared.now_s();
        if let Some(from_loop) = &*locked(&shared.from_loop) {
            forward(shared, from_loop, now_s, &mut bytes);
            let asked = shared.explained.is_within(REQUESTED);
            from_loop.explanations.ask(asked);
            if asked
                && now_s >= explanation_s
                && let Some(why) = from_loop.explanations.take()
            {
                explanation_s = now_s + EXPLANATIONS_S;
                shared.say(&reply::explanation(&why));
            }
        }
        if now_s >= ping_s {
            ping_s = now_s + PING_S;
            for client in locked(&shared.clients).iter() {
                client.ping(now_s);
            }
        }
        if now_s >= counts_s {
            counts_s = now_s + COUNTS_S;
            tell_counts(shared);
        }
        std::thread::sleep(LOOK);
    }
}

fn forward(shared: &Shared, from_loop: &FromLoop, now_s: f64, bytes: &mut Vec<u8>) {
    for event in from_loop.events.try_iter() {
        shared.say(&reply::event(&event));
    }
    // Of several views, send the newest.
    let Some(view) = from_loop.views.try_iter().last() else {
        return;
    };
    let is_news = from_loop.arm.poses(&view.q).last().is_some_and(|face| {
        let mut procedure = locked(&shared.procedure);
        procedure.see_board(now_s, face, &from_loop.board)
    });
    if is_news {
        shared.tell_calibration();
    }
    bytes.clear();
    view.encode(bytes);
    let binary = Message::Binary(Bytes::copy_from_slice(bytes));
    let mut json = None;
    for client in locked(&shared.clients).iter() {
        let message = match client.json {
            true => json.get_or_insert_with(|| Message::text(view.to_json(&from_loop.arm))),
            false => &binary,
        };
        client.show(message, now_s, &shared.tally);
    }
}

fn tell_counts(shared: &Shared) {
    let counts = shared.counts();
    let leader = locked(&shared.intake).leader();
    for client in locked(&shared.clients).iter() {
        let leads = leader == Some(client.id);
        client.say(&Reply::Counts { leads, counts }.to_json(), &shared.tally);
    }
}
