//! Independent work on all cores.

use std::num::NonZero;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// `each(0)` to `each(count - 1)`, computed on all cores and returned in this order: the result does not depend on the number of cores.
///
/// The calling thread takes part and works alone if no other thread can be started. A panic of `each` is propagated.
///
/// ```
/// use hwall_numeric::parallel::map;
///
/// assert_eq!(map(4, |i| i * i), [0, 1, 4, 9]);
/// ```
pub fn map<T: Send>(count: usize, each: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let cores = thread::available_parallelism().map_or(1, NonZero::get);
    map_on(cores, count, each)
}

fn map_on<T: Send>(cores: usize, count: usize, each: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                return done;
            }
            done.push((index, each(index)));
        }
    };
    let mut all = thread::scope(|scope| {
        let others: Vec<_> = (1..cores.min(count))
            .map_while(|_| thread::Builder::new().spawn_scoped(scope, work).ok())
            .collect();
        let mut all = work();
        for other in others {
            match other.join() {
                Ok(done) => all.extend(done),
                Err(panic) => resume_unwind(panic),
            }
        }
        all
    });
    all.sort_unstable_by_key(|(index, _)| *index);
    all.into_iter().map(|(_, value)| value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::panic::{AssertUnwindSafe, catch_unwind};

    #[test]
    fn order_and_number_do_not_depend_on_the_cores() {
        for count in [0, 1, 2, 7, 1000] {
            let wanted: Vec<usize> = (0..count).map(|i| 3 * i).collect();
            assert_eq!(map(count, |i| 3 * i), wanted);
            for cores in [1, 2, 5, 64] {
                assert_eq!(map_on(cores, count, |i| 3 * i), wanted, "{cores}");
            }
        }
    }

    #[test]
    fn a_panic_is_passed_on() {
        for cores in [1, 4] {
            let caught = catch_unwind(AssertUnwindSafe(|| {
                map_on(cores, 100, |i| assert!(i != 57, "at {i}"))
            }));
            assert!(caught.is_err());
        }
    }
}
