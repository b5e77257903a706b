//! Counts of what was received, dropped and sent.

use serde::Serialize;
use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

macro_rules! counts {
    ($($(#[$doc:meta])* $name:ident,)*) => {
        /// Counts since the server was started.
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
        pub struct BridgeCounts {
            /// Clients currently connected.
            pub clients: u64,
            $($(#[$doc])* pub $name: u64,)*
        }

        /// The same, as atomic counters for many threads.
        #[derive(Debug, Default)]
        pub(crate) struct Tally { $(pub(crate) $name: Count,)* }

        impl Tally {
            /// All current counts; `clients` is given.
            pub(crate) fn counts(&self, clients: usize) -> BridgeCounts {
                BridgeCounts { clients: clients as u64, $($name: self.$name.get(),)* }
            }
        }
    };
}

counts! {
    /// Samples of a hand that were passed to the loop.
    accepted,
    /// Samples among these in which the hand was not seen.
    unseen,
    /// Samples older than [`BridgeConfig::max_age_s`](crate::BridgeConfig::max_age_s) on arrival.
    stale,
    /// Samples whose stamps seem to be in seconds; milliseconds are expected.
    in_seconds,
    /// Samples with a number or a time before that of the previous sample.
    out_of_order,
    /// Samples with the number of the previous sample.
    duplicate,
    /// Messages outside the protocol: no JSON, wrong types, wrong number of joints, numbers out of range, binary.
    malformed,
    /// Messages or requests above the size limit; the connection ends.
    too_large,
    /// Samples of clients that do not lead.
    looking_on,
    /// Samples of the hand that is not followed.
    other_hand,
    /// Samples of a headset that is not the calibrated one.
    uncalibrated,
    /// Samples whose clock had jumped.
    clock_leaps,
    /// Samples that arrived faster than the loop took them.
    overflow,
    /// Times that another client took over the lead.
    takeovers,
    /// Clients rejected because there were enough.
    refused_clients,
    /// Pages served.
    pages,
    /// Requests answered with an error: garbage, other paths, foreign origins, too slow.
    refused_requests,
    /// Connections that did not become encrypted: plain HTTP, a certificate that the browser does not accept, too slow.
    failed_handshakes,
    /// View frames sent, over all clients.
    views_sent,
    /// View frames dropped for slow clients.
    views_dropped,
    /// Events dropped because a queue was full.
    events_dropped,
    /// Cycles of the loop.
    cycles,
    /// Cycles skipped because the loop was far behind.
    skipped_cycles,
    /// Datagrams that became targets.
    datagrams,
    /// Datagrams at exactly 0,0,0: their sender sees nothing.
    unseen_datagrams,
    /// Invalid datagrams, or datagrams from a sender that does not lead.
    refused_datagrams,
}

impl fmt::Display for BridgeCounts {
    /// The counts in sentences, without zeros.
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
            (self.uncalibrated, "of a headset that is not calibrated"),
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
            (
                self.failed_handshakes,
                "connections that did not become encrypted",
            ),
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

/// The counts that are not zero, after an introduction.
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
        let last = "\nDatagrams: 4 taken, 2 without a place, 1 refused.";
        assert!(told.to_string().ends_with(last));
    }
}
