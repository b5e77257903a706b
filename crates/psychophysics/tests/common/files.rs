//! Reference files beside the workspace.

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
