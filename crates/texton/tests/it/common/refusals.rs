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

/// Column and row of the pixel that an error is about.
#[cfg(feature = "exr")]
pub(crate) fn pixel<T: std::fmt::Debug>(result: Result<T, TextonError>) -> [usize; 2] {
    match result {
        Err(TextonError::Pixel { column, row, .. }) => [column, row],
        other => panic!("{other:?}"),
    }
}
