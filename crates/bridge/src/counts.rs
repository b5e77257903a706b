//! What came in, what was dropped and why, what went out.

use serde::Serialize;
use std::fmt;
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
    /// Whose stamps look like seconds; milliseconds are expected.
    pub in_seconds: u64,
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

impl fmt::Display for BridgeCounts {
    /// In sentences; what did not happen is left out.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "The loop ran {} cycles", self.cycles)?;
        listed(f, " and left out ", &[(self.skipped_cycles, "")])?;
        write!(f, ".\nHands: {} samples taken", self.accepted)?;
        listed(f, ", of which ", &[(self.unseen, "saw no hand")])?;
        let dropped = [
            (self.stale, "too old"),
            (self.in_seconds, "with stamps that look like seconds"),
            (self.out_of_order, "out of order"),
            (self.duplicate, "repeated"),
            (self.malformed, "malformed"),
            (self.too_large, "too large"),
            (self.looking_on, "of clients that looked on"),
            (self.other_hand, "of the other hand"),
            (self.clock_leaps, "from a clock that leapt"),
            (self.overflow, "faster than the loop"),
        ];
        listed(f, "; not taken: ", &dropped)?;
        write!(
            f,
            ".\nPages: {} served, {} views sent",
            self.pages, self.views_sent
        )?;
        let others = [
            (self.views_dropped, "views that slow clients did not get"),
            (self.events_dropped, "events that found no room"),
            (self.takeovers, "times another client took over"),
            (self.refused_clients, "clients too many"),
            (self.refused_requests, "requests refused"),
        ];
        listed(f, "; ", &others)?;
        write!(f, ".")?;
        if self.datagrams + self.refused_datagrams > 0 {
            write!(f, "\nDatagrams: {} taken", self.datagrams)?;
            listed(f, ", ", &[(self.refused_datagrams, "refused")])?;
            write!(f, ".")?;
        }
        Ok(())
    }
}

/// What is not zero, after an introduction.
fn listed(f: &mut fmt::Formatter<'_>, before: &str, counts: &[(u64, &str)]) -> fmt::Result {
    let mut before = before;
    for (count, what) in counts.iter().filter(|(count, _)| *count > 0) {
        let space = if what.is_empty() { "" } else { " " };
        write!(f, "{before}{count}{space}{what}")?;
        before = ", ";
    }
    Ok(())
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
    in_seconds,
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

#[cfg(test)]
mod tests {
    use super::BridgeCounts;

    #[test]
    fn counts_are_told_in_sentences() {
        let counts = BridgeCounts {
            cycles: 5000,
            skipped_cycles: 7,
            accepted: 360,
            unseen: 12,
            stale: 3,
            malformed: 1,
            pages: 2,
            views_sent: 290,
            ..BridgeCounts::default()
        };
        assert_eq!(
            counts.to_string(),
            "The loop ran 5000 cycles and left out 7.\n\
             Hands: 360 samples taken, of which 12 saw no hand; not taken: 3 too old, 1 malformed.\n\
             Pages: 2 served, 290 views sent."
        );
        let told = BridgeCounts {
            datagrams: 4,
            refused_datagrams: 1,
            ..BridgeCounts::default()
        };
        assert!(
            told.to_string()
                .ends_with("\nDatagrams: 4 taken, 1 refused.")
        );
    }
}
