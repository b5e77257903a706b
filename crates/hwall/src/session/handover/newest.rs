//! The newest guidance, from the thread of the tracker to the thread of the control loop.

use super::guidance::{Guidance, WORDS};
use super::sequence_lock::{Reader, Writer, sequence_lock};

/// The writing end; there is only one.
pub(in crate::session) struct Sender(Writer);

/// The reading end.
pub(in crate::session) struct Receiver(Reader);

/// Both ends of an empty hand-over.
pub(in crate::session) fn handover() -> (Sender, Receiver) {
    let (writer, reader) = sequence_lock(WORDS);
    (Sender(writer), Receiver(reader))
}

impl Sender {
    /// Replaces what the reader will see.
    pub(in crate::session) fn send(&mut self, guidance: &Guidance) {
        self.0.write(guidance.to_words());
    }
}

impl Receiver {
    /// The newest value, if one was sent since the last call.
    pub(in crate::session) fn newest(&mut self) -> Option<Guidance> {
        let mut words = [0; WORDS];
        self.0
            .read(&mut words, |_| WORDS)
            .then(|| Guidance::from_words(&words))
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
