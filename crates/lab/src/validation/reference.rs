//! Files of the references.

use anyhow::Context;
use serde_json::Value;
use std::path::Path;

/// A file of a reference.
pub(super) fn json(path: &Path) -> anyhow::Result<Value> {
    let context = || format!("{}: a reference", path.display());
    let text = std::fs::read_to_string(path).with_context(context)?;
    serde_json::from_str(&text).with_context(context)
}
