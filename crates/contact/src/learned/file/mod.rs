//! Files of learned models.

mod blend_file;
mod input_file;
mod model_file;
mod tree_file;

use crate::error::ContactError;

/// Rejects an unexpected length.
fn length(what: &'static str, expected: usize, got: usize) -> Result<(), ContactError> {
    match expected == got {
        true => Ok(()),
        false => Err(ContactError::FileLength {
            what,
            expected,
            got,
        }),
    }
}
