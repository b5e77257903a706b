//! Work on a separate thread.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

/// A worker on its own thread. It sleeps while there is nothing to do, until it is woken.
pub(super) struct Worker<T> {
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<T>>,
}

impl<T: Send + 'static> Worker<T> {
    /// `work` returns whether there was something to do.
    pub(super) fn spawn(
        name: &str,
        mut value: T,
        work: impl Fn(&mut T) -> bool + Send + 'static,
    ) -> io::Result<Self> {
        let ends = Arc::new(AtomicBool::new(false));
        let is_over = Arc::clone(&ends);
        let work = move || {
            while !is_over.load(Ordering::Acquire) {
                if !work(&mut value) {
                    thread::park();
                }
            }
            value
        };
        let thread = thread::Builder::new().name(name.to_owned());
        Ok(Self {
            ends,
            thread: Some(thread.spawn(work)?),
        })
    }
}

impl<T> Worker<T> {
    /// Has the thread ended? Before `end`, only a panic ends it.
    pub(super) fn is_over(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    pub(super) fn wake(&self) {
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
    }

    /// Ends the thread. `None` if it panicked.
    pub(super) fn end(&mut self) -> Option<T> {
        self.ends.store(true, Ordering::Release);
        self.wake();
        self.thread.take()?.join().ok()
    }
}

impl<T> Drop for Worker<T> {
    fn drop(&mut self) {
        self.end();
    }
}
