//! What came in, what was dropped and why, what went out.

use serde::Serialize;
use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

macro_rules! counts {
    ($($(#[$doc:meta])* $name:ident,)*) => {
        /// Counts since the server was started.
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
        pub struct BridgeCounts {
            /// Clients connected at present.
            pub clients: u64,
            $($(#[$doc])* pub $name: u64,)*
        }

        /// The same, counted by many threads.
        #[derive(Debug, Default)]
        pub(crate) struct Tally { $(pub(crate) $name: Count,)* }

        impl Tally {
            /// All counts at present, but for the clients.
            pub(crate) fn counts(&self, clients: usize) -> BridgeCounts {
                BridgeCounts { clients: clients as u64, $($name: self.$name.get(),)* }
            }
        }
    };
}

counts! {
    /// Samples of a hand handed to the loop.
    accepted,
    /// Of these: samples in which the hand was not seen.
    unseen,
    /// Older than [`BridgeConfig::max_age_s`](crate::BridgeConfig::max_age_s) when they came in.
    stale,
    /// Whose stamps look like seconds; milliseconds are expected.
    in_seconds,
    /// With a number, or a time, before that of the sample before.
    out_of_order,
    /// With the number of the sample before.
    duplicate,
    /// Messages that are not of the protocol: no JSON, wrong types, a wrong count of joints, numbers beyond all bounds, binary.
    malformed,
    /// Messages or requests beyond the limit of their size; the connection ends.
    too_large,
    /// Samples of clients that do not lead.
    looking_on,
    /// Samples of the hand that is not followed.
    other_hand,
    /// Samples whose clock had leapt.
    clock_leaps,
    /// Samples that came faster than the loop took them.
    overflow,
    /// Times that another client took over.
    takeovers,
    /// Clients turned away because there were enough.
    refused_clients,
    /// Pages served.
    pages,
    /// Requests that were answered with an error: garbage, other paths, foreign origins, too slow.
    refused_requests,
    /// View frames sent, over all clients.
    views_sent,
    /// View frames that slow clients did not get.
    views_dropped,
    /// Events that were not sent because a queue was full.
    events_dropped,
    /// Cycles of the loop.
    cycles,
    /// Cycles left out because the loop was far behind.
    skipped_cycles,
    /// Datagrams that became targets.
    datagrams,
    /// Datagrams at exactly 0,0,0: their sender sees nothing.
    unseen_datagrams,
    /// Datagrams that make no sense, or come from another sender than the one that leads.
    refused_datagrams,
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
        let not_taken = [
            (self.unseen_datagrams, "without a place"),
            (self.refused_datagrams, "refused"),
        ];
        if self.datagrams + self.unseen_datagrams + self.refused_datagrams > 0 {
            write!(f, "\nDatagrams: {} taken", self.datagrams)?;
            listed(f, ", ", &not_taken)?;
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
            unseen_datagrams: 2,
            refused_datagrams: 1,
            ..BridgeCounts::default()
        };
        assert!(
            told.to_string()
                .ends_with("\nDatagrams: 4 taken, 2 without a place, 1 refused.")
        );
    }
}
