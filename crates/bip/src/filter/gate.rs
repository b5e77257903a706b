//! Outliers: values too far from their prediction are not believed.

/// When a value is an outlier.
///
/// Every value is judged by itself, against its own prediction and the variance of that, so that
/// one lost finger does not cost the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gate {
    /// Largest distance of a value from its prediction, in standard deviations of the innovation.
    /// Default 5: a good value in two million is refused.
    pub deviations: f64,
    /// After this many observations in a row of which more than half was refused, the next one is
    /// taken whole: then the belief is what is wrong. Default 5.
    pub patience: usize,
}

impl Default for Gate {
    fn default() -> Self {
        Self {
            deviations: 5.0,
            patience: 5,
        }
    }
}
