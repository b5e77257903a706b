//! Words that one thread replaces and another copies: the latest wins.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering, fence};

/// After this many interrupted reads, the reader keeps its old value and tries again later.
const TRIES: usize = 8;

/// A sequence lock on atomic words. Neither side allocates, blocks or waits for the other; a reader that a writer interrupts
/// reads again, at most eight times. Source: [Boehm 2012], section 4.
struct Slot {
    /// Odd while words are being written.
    sequence: AtomicU64,
    words: Box<[AtomicU64]>,
}

/// The writing end; there is only one.
pub(super) struct Writer(Arc<Slot>);

/// The reading end; there is only one.
pub(super) struct Reader {
    slot: Arc<Slot>,
    seen: u64,
}

/// Both ends for this many words, all zero.
pub(super) fn sequence_lock(words: usize) -> (Writer, Reader) {
    let slot = Arc::new(Slot {
        sequence: AtomicU64::new(0),
        words: (0..words).map(|_| AtomicU64::new(0)).collect(),
    });
    let reader = Reader {
        slot: Arc::clone(&slot),
        seen: 0,
    };
    (Writer(slot), reader)
}

impl Writer {
    /// Replaces the first words; surplus ones are ignored.
    pub(super) fn write(&mut self, words: impl IntoIterator<Item = u64>) {
        let Slot {
            sequence,
            words: slots,
        } = &*self.0;
        let before = sequence.load(Ordering::Relaxed);
        sequence.store(before.wrapping_add(1), Ordering::Relaxed);
        fence(Ordering::Release);
        for (slot, word) in slots.iter().zip(words) {
            slot.store(word, Ordering::Relaxed);
        }
        sequence.store(before.wrapping_add(2), Ordering::Release);
    }
}

impl Reader {
    /// Copies the words if they were replaced since the last call; returns whether they were. If not, the contents of `copy` are
    /// meaningless. `count` maps the first word to the number of words to copy.
    pub(super) fn read(&mut self, copy: &mut [u64], count: impl Fn(u64) -> usize) -> bool {
        let Slot { sequence, words } = &*self.slot;
        for _ in 0..TRIES {
            let before = sequence.load(Ordering::Acquire);
            if before == self.seen {
                return false;
            }
            if before % 2 == 1 {
                std::hint::spin_loop();
                continue;
            }
            let first = words.first().map_or(0, |word| word.load(Ordering::Relaxed));
            for (to, from) in copy.iter_mut().zip(words).take(count(first)) {
                *to = from.load(Ordering::Relaxed);
            }
            fence(Ordering::Acquire);
            if sequence.load(Ordering::Relaxed) == before {
                self.seen = before;
                return true;
            }
        }
        false
    }
}
