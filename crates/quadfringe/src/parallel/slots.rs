//! A pool of working memory. Each running task holds one value; when it ends, another task reuses the value.

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, PoisonError};

/// The values that no task holds. They are boxed, so that taking one copies only a pointer.
#[derive(Debug)]
pub(crate) struct Slots<T>(Mutex<Vec<Box<T>>>);

/// A value that a task holds. It returns to the pool when it is dropped.
#[derive(Debug)]
pub(crate) struct Lent<'a, T> {
    value: Option<Box<T>>,
    slots: &'a Slots<T>,
}

impl<T> Default for Slots<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Default> Slots<T> {
    /// The value that was returned last, because it may still be in the cache; a new value if the pool is empty.
    pub fn take(&self) -> Lent<'_, T> {
        Lent { value: Some(self.free(|free| free.pop()).unwrap_or_default()), slots: self }
    }
}

impl<T> Slots<T> {
    fn free<R>(&self, change: impl FnOnce(&mut Vec<Box<T>>) -> R) -> R {
        // A poisoned lock is harmless: a panic cannot leave the list half-changed.
        change(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl<T> Drop for Lent<'_, T> {
    fn drop(&mut self) {
        // Working memory is valid even after a panic, because every task writes it before reading it.
        if let Some(value) = self.value.take() {
            self.slots.free(|free| free.push(value));
        }
    }
}

impl<T> Deref for Lent<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.value.as_ref().expect("returned on drop only")
    }
}

impl<T> DerefMut for Lent<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        self.value.as_mut().expect("returned on drop only")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_task_has_a_separate_value_and_returns_it() {
        let slots = Slots::<Vec<u8>>::default();
        {
            let mut lent = [slots.take(), slots.take(), slots.take()];
            for (value, number) in lent.iter_mut().zip(1..) {
                value.push(number);
            }
            assert!(lent.iter().zip(1..).all(|(value, number)| **value == [number]));
        }
        let again = [slots.take(), slots.take(), slots.take()];
        let mut kept: Vec<u8> = again.iter().flat_map(|value| value.iter().copied()).collect();
        kept.sort_unstable();
        assert_eq!(kept, [1, 2, 3]);
        assert!(slots.take().is_empty());
    }

    #[test]
    fn a_panic_returns_the_value_too() {
        let slots = Slots::<Vec<u8>>::default();
        let failed = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            slots.take().push(7);
            panic!("as a task may");
        }));
        assert!(failed.is_err());
        assert_eq!(*slots.take(), [7]);
    }
}
