//! The newest guidance, from the thread of the tracker to the thread of the control loop.

use super::guidance::{Guidance, WORDS};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering, fence};

/// After this many interrupted reads the reader keeps what it had; the next control step tries again.
const TRIES: usize = 8;

/// One value that a single writer replaces and a reader copies: the latest wins.
///
/// A sequence lock on atomic words. Neither side allocates, blocks or waits for the other; a reader that a writer interrupts
/// reads again, at most eight times. Source: [Boehm 2012], section 4.
struct Slot {
    /// Odd while a value is being written.
    sequence: AtomicU64,
    words: [AtomicU64; WORDS],
}

/// The writing end; there is only one.
pub(super) struct Sender(Arc<Slot>);

/// The reading end.
pub(super) struct Receiver {
    slot: Arc<Slot>,
    seen: u64,
}

/// Both ends of an empty hand-over.
pub(super) fn handover() -> (Sender, Receiver) {
    let slot = Arc::new(Slot {
        sequence: AtomicU64::new(0),
        words: [const { AtomicU64::new(0) }; WORDS],
    });
    let receiver = Receiver {
        slot: Arc::clone(&slot),
        seen: 0,
    };
    (Sender(slot), receiver)
}

impl Sender {
    /// Replaces what the reader will see.
    pub(super) fn send(&mut self, guidance: &Guidance) {
        let Slot { sequence, words } = &*self.0;
        let before = sequence.load(Ordering::Relaxed);
        sequence.store(before.wrapping_add(1), Ordering::Relaxed);
        fence(Ordering::Release);
        for (slot, word) in words.iter().zip(guidance.to_words()) {
            slot.store(word, Ordering::Relaxed);
        }
        sequence.store(before.wrapping_add(2), Ordering::Release);
    }
}

impl Receiver {
    /// The newest value, if one was sent since the last call.
    pub(super) fn newest(&mut self) -> Option<Guidance> {
        let Slot { sequence, words } = &*self.slot;
        for _ in 0..TRIES {
            let before = sequence.load(Ordering::Acquire);
            if before == self.seen {
                return None;
            }
            if before % 2 == 1 {
                std::hint::spin_loop();
                continue;
            }
            let copy: [u64; WORDS] = std::array::from_fn(|i| words[i].load(Ordering::Relaxed));
            fence(Ordering::Acquire);
            if sequence.load(Ordering::Relaxed) == before {
                self.seen = before;
                return Some(Guidance::from_words(&copy));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fingertip::Fingertip;
    use glam::DVec3;

    fn numbered(n: u64) -> Guidance {
        let v = DVec3::splat(n as f64);
        Guidance {
            fingertip: Some(Fingertip {
                point_m: v,
                velocity_m_per_s: v,
            }),
            world_moves: n,
            ..Guidance::default()
        }
    }

    #[test]
    fn the_latest_wins_and_is_seen_once() {
        let (mut sender, mut receiver) = handover();
        assert_eq!(receiver.newest(), None);
        for n in 0..3 {
            sender.send(&numbered(n));
        }
        assert_eq!(receiver.newest(), Some(numbered(2)));
        assert_eq!(receiver.newest(), None);
    }

    #[test]
    fn no_value_is_ever_torn_between_threads() {
        let (mut sender, mut receiver) = handover();
        let writer = std::thread::spawn(move || {
            for n in 1..200_000 {
                sender.send(&numbered(n));
            }
        });
        let mut last = 0;
        while !writer.is_finished() {
            if let Some(guidance) = receiver.newest() {
                assert_eq!(guidance, numbered(guidance.world_moves));
                assert!(guidance.world_moves > last, "values go forward");
                last = guidance.world_moves;
            }
        }
        writer.join().expect("the writer ends");
        assert!(receiver.newest().is_none_or(|g| g == numbered(199_999)));
    }
}
