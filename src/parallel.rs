//! Work on many cores whose result does not depend on their number.
//!
//! For items that take some microseconds or more each: what spreads them knows neither their type nor that of the results, and is compiled once. Inner loops
//! use rayon themselves.

use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

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
    #[should_panic(expected = "of the third")]
    fn a_panic_is_that_of_the_item() {
        map_numbers(9, |i| assert_ne!(i, 2, "of the third"));
    }
}
