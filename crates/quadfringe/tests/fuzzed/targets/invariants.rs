//! What must hold for every result.

use ndarray::{Array, Dimension};
use quadfringe::Error;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::LazyLock;

/// Pools of one thread and of two.
static POOLS: LazyLock<[ThreadPool; 2]> = LazyLock::new(|| {
    [1, 2].map(|threads| ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool of threads"))
});

/// The result of `work`, which must have the same bits in a pool of one thread and in a pool of two.
pub fn same_on_threads<T: Send>(work: impl Fn() -> T + Sync, bits: impl Fn(&T) -> Vec<u32>) -> T {
    let [alone, together] = POOLS.each_ref().map(|pool| pool.install(&work));
    assert!(bits(&alone) == bits(&together), "another result on two threads");
    alone
}

/// Bits of a map; all NaN are the same.
pub fn bits_of<D: Dimension>(map: &Array<f32, D>) -> Vec<u32> {
    map.iter().map(|value| if value.is_nan() { f32::NAN.to_bits() } else { value.to_bits() }).collect()
}

/// The value, or `None` after a check that the error is one line of text.
pub fn refused_clearly<T>(result: Result<T, Error>) -> Option<T> {
    match result {
        Ok(value) => Some(value),
        Err(error) => {
            let text = error.to_string();
            assert!(text.len() > 10 && !text.contains('\n'), "{text}");
            None
        }
    }
}

/// Checks that every value is NaN or in a range.
pub fn all_within<'a>(name: &str, values: impl IntoIterator<Item = &'a f32>, from: f32, to: f32) {
    for value in values {
        assert!(value.is_nan() || (from..=to).contains(value), "{name}: {value} is not in {from} to {to}");
    }
}

/// Checks that every value is NaN or finite.
pub fn all_finite<'a>(name: &str, values: impl IntoIterator<Item = &'a f32>) {
    all_within(name, values, f32::MIN, f32::MAX);
}
