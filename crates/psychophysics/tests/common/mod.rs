//! Reference files beside the workspace, and the largest deviation from them.

use serde_json::Value;
use std::path::Path;

/// A table of the reference, or `None` with a message where there is none.
pub(crate) fn shared_csv(name: &str) -> Option<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/reference/psychophysics")
        .join(name);
    let text = std::fs::read_to_string(path).ok();
    if text.is_none() {
        println!("skipped: no {name}");
    }
    text
}

/// Numbers of the reference.
pub(crate) fn reference(name: &str) -> Option<Value> {
    shared_csv(name).map(|text| serde_json::from_str(&text).expect("JSON"))
}

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
