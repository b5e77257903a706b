//! The largest deviation from a reference.

/// The largest relative deviation of many numbers.
#[derive(Default)]
pub(crate) struct Deviation {
    worst: f64,
    what: String,
    count: usize,
}

impl Deviation {
    pub(crate) fn add(&mut self, what: &str, got: f64, want: f64) {
        let off = if want == 0.0 {
            got.abs()
        } else {
            (got / want - 1.0).abs()
        };
        self.count += 1;
        if off > self.worst || off.is_nan() {
            self.worst = off;
            self.what = format!("{what}: {got:e}, wanted {want:e}");
        }
    }

    pub(crate) fn check(&self, name: &str, tolerance: f64) {
        println!(
            "{name}: {} numbers, largest deviation {:.1e} ({})",
            self.count, self.worst, self.what
        );
        assert!(
            self.worst <= tolerance,
            "{name}: {:e}, {}",
            self.worst,
            self.what
        );
    }
}
