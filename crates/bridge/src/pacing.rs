//! The clock of a loop that no arm paces.

use std::time::{Duration, Instant};

/// Waits for cycle after cycle.
///
/// Cycle n is due n periods after the first. A loop that is behind catches up, because the arm's clock must not lose time; one that is far
/// behind skips cycles. The operating system determines how exactly a cycle begins: without real-time priority, expect delays of 0.1 ms,
/// and occasionally of a few milliseconds.
#[derive(Debug, Clone)]
pub struct Pacing {
    period_s: f64,
    max_behind_s: f64,
    start: Option<Instant>,
    next: u64,
    skipped: u64,
}

impl Pacing {
    pub(crate) const fn new(period_s: f64, max_behind_s: f64) -> Self {
        Self {
            period_s,
            max_behind_s,
            start: None,
            next: 0,
            skipped: 0,
        }
    }

    /// Waits until the next cycle is due and returns its time since the first, s.
    pub fn wait(&mut self) -> f64 {
        let start = *self.start.get_or_insert_with(Instant::now);
        let elapsed_s = start.elapsed().as_secs_f64();
        let due_s = self.next as f64 * self.period_s;
        if elapsed_s < due_s {
            std::thread::sleep(Duration::from_secs_f64(due_s - elapsed_s));
        }
        let t_s = self.due(start.elapsed().as_secs_f64());
        self.next += 1;
        t_s
    }

    /// Period, s.
    #[must_use]
    pub const fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Number of cycles skipped so far.
    #[must_use]
    pub const fn skipped(&self) -> u64 {
        self.skipped
    }

    /// The time of the cycle that begins now, s.
    fn due(&mut self, elapsed_s: f64) -> f64 {
        if elapsed_s - self.next as f64 * self.period_s > self.max_behind_s {
            let now = (elapsed_s / self.period_s).floor() as u64;
            self.skipped += now.saturating_sub(self.next);
            self.next = self.next.max(now);
        }
        self.next as f64 * self.period_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_catches_up_or_leaves_cycles_out() {
        let mut pacing = Pacing::new(1e-3, 0.05);
        pacing.next = 100;
        assert!((pacing.due(0.149) - 0.1).abs() < 1e-12);
        assert_eq!(pacing.skipped(), 0);
        assert!((pacing.due(0.2501) - 0.25).abs() < 1e-12);
        assert_eq!(pacing.skipped(), 150);
    }

    #[test]
    fn cycles_are_a_period_apart() {
        let mut pacing = Pacing::new(1e-3, 3600.0);
        for cycle in 0..20 {
            assert!((pacing.wait() - 1e-3 * f64::from(cycle)).abs() < 1e-12);
        }
    }
}
