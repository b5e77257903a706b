//! Work on all cores, with the feature `parallel`.

/// `f(0), f(1), ...` in order; with the feature `parallel` on all cores.
pub(super) fn map_indexed<T: Send>(count: usize, f: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().map(&f).collect()
    }
    #[cfg(not(feature = "parallel"))]
    (0..count).map(f).collect()
}
