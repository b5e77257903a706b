//! Ranges of numbers.

/// The smallest and largest value; infinity and minus infinity without values.
pub(crate) fn ends(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let nothing = (f64::INFINITY, f64::NEG_INFINITY);
    let values = values.into_iter();
    values.fold(nothing, |(low, high), v| (low.min(v), high.max(v)))
}
