//! What came in, what was dropped and why, what went out.

use serde::Serialize;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Counts since the server was started.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct BridgeCounts {
    /// Clients connected at present.
    pub clients: u64,
    /// Samples of a hand handed to the loop.
    pub accepted: u64,
    /// Of these: samples in which the hand was not seen.
    pub unseen: u64,
    /// Older than [`BridgeConfig::max_age_s`](crate::BridgeConfig::max_age_s) when they came in.
    pub stale: u64,
    /// With a number, or a time, before that of the sample before.
    pub out_of_order: u64,
    /// With the number of the sample before.
    pub duplicate: u64,
    /// Messages that are not of the protocol: no JSON, wrong types, a wrong count of joints, numbers beyond all bounds, binary.
    pub malformed: u64,
    /// Messages or requests beyond the limit of their size; the connection ends.
    pub too_large: u64,
    /// Samples of clients that do not lead.
    pub looking_on: u64,
    /// Samples of the hand that is not followed.
    pub other_hand: u64,
    /// Samples whose clock had leapt.
    pub clock_leaps: u64,
    /// Samples that came faster than the loop took them.
    pub overflow: u64,
    /// Times that another client took over.
    pub takeovers: u64,
    /// Clients turned away because there were enough.
    pub refused_clients: u64,
    /// Pages served.
    pub pages: u64,
    /// Requests that were answered with an error: garbage, other paths, foreign origins, too slow.
    pub refused_requests: u64,
    /// View frames sent, over all clients.
    pub views_sent: u64,
    /// View frames that slow clients did not get.
    pub views_dropped: u64,
    /// Events that were not sent because a queue was full.
    pub events_dropped: u64,
    /// Cycles of the loop.
    pub cycles: u64,
    /// Cycles left out because the loop was far behind.
    pub skipped_cycles: u64,
    /// Datagrams that became targets.
    pub datagrams: u64,
    /// Datagrams that make no sense, or come from another sender than the one that leads.
    pub refused_datagrams: u64,
}

macro_rules! tally {
    ($($name:ident),*) => {
        /// The same, counted by many threads.
        #[derive(Debug, Default)]
        pub(crate) struct Tally { $(pub(crate) $name: Count),* }

        impl Tally {
            /// All counts at present, but for the clients.
            pub(crate) fn counts(&self, clients: usize) -> BridgeCounts {
                BridgeCounts { clients: clients as u64, $($name: self.$name.get()),* }
            }
        }
    };
}

tally!(
    accepted,
    unseen,
    stale,
    out_of_order,
    duplicate,
    malformed,
    too_large,
    looking_on,
    other_hand,
    clock_leaps,
    overflow,
    takeovers,
    refused_clients,
    pages,
    refused_requests,
    views_sent,
    views_dropped,
    events_dropped,
    cycles,
    skipped_cycles,
    datagrams,
    refused_datagrams
);

/// One count.
#[derive(Debug, Default)]
pub(crate) struct Count(AtomicU64);

impl Count {
    pub(crate) fn add(&self, n: u64) {
        self.0.fetch_add(n, Relaxed);
    }

    fn get(&self) -> u64 {
        self.0.load(Relaxed)
    }
}
