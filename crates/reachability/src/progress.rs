//! Loops that may run on several cores, report progress and can be cancelled.

use crate::error::{ReachabilityError, Result};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Progress of a long computation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Pieces of work done.
    pub done: usize,
    /// Pieces of work in total.
    pub total: usize,
}

/// Called occasionally, from any thread; `Break` stops the computation.
pub type Monitor<'a> = dyn Fn(Progress) -> ControlFlow<()> + Sync + 'a;

/// Calls the monitor after this many pieces of work.
const STRIDE: usize = 64;

/// A monitor that does nothing.
pub(crate) fn silent(_: Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// `work(0), work(1), ...` in order, for any number of threads.
///
/// # Errors
/// [`ReachabilityError::Cancelled`], or the first error of the work.
pub(crate) fn map_indexed<T: Send>(
    total: usize,
    monitor: &Monitor,
    work: impl Fn(usize) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let (done, stopped) = (AtomicUsize::new(0), AtomicBool::new(false));
    let one = |index: usize| {
        if stopped.load(Ordering::Relaxed) {
            return Err(ReachabilityError::Cancelled);
        }
        let result = work(index)?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        let ask = done.is_multiple_of(STRIDE) || done == total;
        if ask && monitor(Progress { done, total }).is_break() {
            stopped.store(true, Ordering::Relaxed);
            return Err(ReachabilityError::Cancelled);
        }
        Ok(result)
    };
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..total).into_par_iter().map(one).collect()
    }
    #[cfg(not(feature = "parallel"))]
    {
        (0..total).map(one).collect()
    }
}
