//! Work on many cores whose result does not depend on their number.
//!
//! For items that take some microseconds or more each: what spreads them knows neither their type nor that of the results, and is compiled once. Inner loops
//! use rayon themselves.

use rayon::prelude::*;
use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

/// `f` of each item and its number, in order.
pub(crate) fn map<'a, I: Sync, T: Send>(
    items: &'a [I],
    f: impl Fn(usize, &'a I) -> T + Sync,
) -> Vec<T> {
    map_numbers(items.len(), |i| f(i, &items[i]))
}

/// `f` of each number below `count`, in order.
pub(crate) fn map_numbers<T: Send>(count: usize, f: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let places: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    spread(count, &|i| {
        let result = f(i);
        *places[i].lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
    });
    let results = places.into_iter();
    let results = results.map(|p| p.into_inner().unwrap_or_else(PoisonError::into_inner));
    results.map(|r| r.expect("each was done")).collect()
}

fn spread(count: usize, each: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(each);
}

/// Bytes of stack of a thread: as many as the first one of a program mostly has.
const STACK: usize = 8 << 20;

/// From so many items for each thread on, none needs the others' help with one of its own.
const MANY: usize = 4;

thread_local! {
    static NUMBER: Cell<usize> = const { Cell::new(0) };
}

/// The number of this thread: 0 for the first, from 1 for those of the pool, and then those of [`beside`].
pub(crate) fn thread_number() -> usize {
    match NUMBER.get() {
        0 => rayon::current_thread_index().map_or(0, |i| i + 1),
        number => number,
    }
}

/// `f` in a thread of the pool, which can share out its parts without a thread being woken for each.
pub(crate) fn inside<T: Send>(f: impl FnOnce() -> T + Send) -> T {
    rayon::scope(|_| f())
}

/// `f` of each item, in order, for long work that uses the pool itself: on as many threads beside the pool as that has. A thread of the pool that waits for
/// others would begin the next item meanwhile, and its stack would hold many. Where there are many items, each thread does all of one by itself.
pub(crate) fn beside<I: Send, T: Send>(items: Vec<I>, f: impl Fn(I) -> T + Sync) -> Vec<T> {
    let threads = rayon::current_num_threads().min(items.len());
    if threads < 2 {
        return items.into_iter().map(f).collect();
    }
    let (count, first) = (items.len(), rayon::current_num_threads() + 1);
    let items: Vec<Mutex<Option<I>>> = items.into_iter().map(|i| Mutex::new(Some(i))).collect();
    let results: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some(i) = Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&i| i < count) {
            let item = items[i]
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .take();
            let result = item.map(&f);
            *results[i].lock().unwrap_or_else(PoisonError::into_inner) = result;
        }
    };
    let work_as = |number: usize| {
        let alone = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .stack_size(STACK)
            .start_handler(move |_| NUMBER.set(number));
        let alone = (count >= MANY * threads)
            .then(|| alone.build().ok())
            .flatten();
        match alone {
            Some(alone) => alone.install(work),
            None => work(),
        }
    };
    let work_as = &work_as;
    thread::scope(|scope| {
        let others = (1..threads).map(|k| {
            let numbered = move || {
                NUMBER.set(first + k);
                work_as(first + k);
            };
            thread::Builder::new()
                .stack_size(STACK)
                .spawn_scoped(scope, numbered)
        });
        // Where the system has no more threads, there are fewer.
        let others: Vec<_> = others.flatten().collect();
        work_as(first);
        for other in others {
            if let Err(panic) = other.join() {
                std::panic::resume_unwind(panic);
            }
        }
    });
    let results = results.into_iter();
    let results = results.map(|p| p.into_inner().unwrap_or_else(PoisonError::into_inner));
    results.map(|r| r.expect("each was done")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_order() {
        assert_eq!(map_numbers(1000, |i| i * i)[31], 961);
        assert_eq!(map(&["a", "b"], |i, s| format!("{s}{i}")), ["a0", "b1"]);
        assert!(map_numbers(0, |i| i).is_empty());
    }

    #[test]
    fn long_work_is_in_order_and_may_use_the_pool() {
        let sums: Vec<usize> = beside((0..100).collect(), |i| {
            map_numbers(i, |k| k).into_iter().sum()
        });
        let expected: Vec<usize> = (0..100)
            .map(|i: usize| i * i.saturating_sub(1) / 2)
            .collect();
        assert_eq!(sums, expected);
        assert!(beside(Vec::<u8>::new(), |x| x).is_empty());
    }

    #[test]
    #[should_panic(expected = "of the last")]
    fn a_panic_of_long_work_is_that_of_the_item() {
        beside(vec![1, 2, 3], |i| assert_ne!(i, 3, "of the last"));
    }

    #[test]
    #[should_panic(expected = "of the third")]
    fn a_panic_is_that_of_the_item() {
        map_numbers(9, |i| assert_ne!(i, 2, "of the third"));
    }
}
