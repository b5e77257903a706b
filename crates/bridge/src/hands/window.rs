//! Minimum of recent values.

/// Number of parts in which the window moves on.
const PARTS: usize = 10;

/// Minimum over a time window, which moves on in tenths of its length.
#[derive(Debug, Clone)]
pub(super) struct WindowMinimum {
    part_s: f64,
    /// Number of the part and its minimum.
    parts: [(i64, f64); PARTS],
}

impl WindowMinimum {
    pub(super) const fn new(window_s: f64) -> Self {
        Self {
            part_s: window_s / PARTS as f64,
            parts: [(i64::MIN, f64::INFINITY); PARTS],
        }
    }

    pub(super) fn add(&mut self, now_s: f64, value: f64) {
        let number = self.part(now_s);
        let Some(slot) = self.parts.get_mut(number.rem_euclid(PARTS as i64) as usize) else {
            return;
        };
        if slot.0 == number {
            slot.1 = slot.1.min(value);
        } else {
            *slot = (number, value);
        }
    }

    pub(super) fn minimum(&self, now_s: f64) -> Option<f64> {
        let oldest = self.part(now_s).saturating_sub(PARTS as i64);
        self.parts
            .iter()
            .filter(|(number, _)| *number > oldest)
            .map(|(_, value)| *value)
            .min_by(f64::total_cmp)
    }

    fn part(&self, now_s: f64) -> i64 {
        (now_s / self.part_s).floor() as i64
    }
}
