//! The one error type of the crate.

/// What can be wrong with a texture, a patch, a model, a file or a question.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TextonError {
    /// A parameter is NaN or outside its range.
    #[error("{what} is {value}, wanted: {wanted}")]
    Parameter {
        /// The parameter, with its unit.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its range.
        wanted: &'static str,
    },
    /// Neighbouring bumps overlap.
    #[error(
        "bumps overlap: those {columns} columns and {rows} rows apart are {distance} radii apart, wanted: 2"
    )]
    Overlap {
        /// Columns between the two.
        columns: i64,
        /// Rows between the two.
        rows: i64,
        /// Distance of their centres where the bumps are scaled to unit circles; 2 is touching.
        distance: f64,
    },
}

/// Rejects what is not a positive number.
pub(crate) fn positive(what: &'static str, value: f64) -> Result<(), TextonError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    let wanted = "a positive number";
    Err(TextonError::Parameter {
        what,
        value,
        wanted,
    })
}

/// Rejects NaN and infinity.
pub(crate) fn finite(what: &'static str, value: f64) -> Result<(), TextonError> {
    if value.is_finite() {
        return Ok(());
    }
    let wanted = "a finite number";
    Err(TextonError::Parameter {
        what,
        value,
        wanted,
    })
}
