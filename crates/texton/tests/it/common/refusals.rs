//! Arguments that were refused.

use hwall_texton::{ArgumentError, TextonError};

/// The name of the argument that an error is about.
pub(crate) fn refused<T: std::fmt::Debug>(result: Result<T, TextonError>) -> &'static str {
    match result {
        Err(TextonError::Argument(
            ArgumentError::OutOfRange { what, .. } | ArgumentError::NonFinite { what, .. },
        )) => what,
        other => panic!("{other:?}"),
    }
}
