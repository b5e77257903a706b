//! Errors of the libraries as one Python exception, with their messages unchanged.

use pyo3::exceptions::PyValueError;
use pyo3::{PyErr, PyResult, create_exception};

create_exception!(
    hwall,
    Error,
    PyValueError,
    "What the libraries refuse: the message says which value, and what it must be."
);

/// Conversion of a library result to a Python result.
pub(crate) trait OrRaise<T> {
    /// The value, or `hwall.Error` with the message of the library.
    fn or_raise(self) -> PyResult<T>;
    /// The same for one row of an array; the message names the row.
    fn or_raise_in_row(self, row: usize) -> PyResult<T>;
}

impl<T, E: std::error::Error> OrRaise<T> for Result<T, E> {
    fn or_raise(self) -> PyResult<T> {
        self.map_err(|error| Error::new_err(error.to_string()))
    }

    fn or_raise_in_row(self, row: usize) -> PyResult<T> {
        self.map_err(|error| Error::new_err(format!("row {row}: {error}")))
    }
}

/// An error of this package itself: a wrong shape, or an unknown name.
pub(crate) fn refuse<T>(message: impl Into<String>) -> PyResult<T> {
    Err(Error::new_err(message.into()))
}

/// Looks up one of several names.
pub(crate) fn one_of<T: Copy>(what: &str, name: &str, known: &[(&str, T)]) -> PyResult<T> {
    let found = known.iter().find(|(known, _)| *known == name);
    found.map(|(_, value)| *value).ok_or_else(|| -> PyErr {
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        Error::new_err(format!(
            "{what} {name:?} is not one of {}",
            names.join(", ")
        ))
    })
}
