//! Reference files beside the workspace.

use serde_json::Value;

/// A table of the reference; `None` if absent, reported by a visible line.
pub(crate) fn shared_csv(name: &str) -> Option<String> {
    let path = hwall_testkit::shared(&format!("reference/psychophysics/{name}"))?;
    Some(std::fs::read_to_string(path).expect("a readable file"))
}

/// Numbers of the reference.
pub(crate) fn reference(name: &str) -> Option<Value> {
    shared_csv(name).map(|text| serde_json::from_str(&text).expect("JSON"))
}
