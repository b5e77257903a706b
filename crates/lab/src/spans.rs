//! Between which ends numbers lie.

/// The least and the largest value; from infinity to minus infinity where there are none.
pub(crate) fn ends(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let nothing = (f64::INFINITY, f64::NEG_INFINITY);
    let values = values.into_iter();
    values.fold(nothing, |(low, high), v| (low.min(v), high.max(v)))
}
