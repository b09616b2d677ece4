//! Working memory of tasks: made for as many as run at once, then handed from one to the next.

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, PoisonError};

/// Values that no task has. Boxes, so that none is copied.
#[derive(Debug)]
pub(crate) struct Slots<T>(Mutex<Vec<Box<T>>>);

/// A value until the task is done with it.
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
    /// The value given back last, which is still in some cache, or a new one.
    pub fn take(&self) -> Lent<'_, T> {
        Lent { value: Some(self.free(|free| free.pop()).unwrap_or_default()), slots: self }
    }
}

impl<T> Slots<T> {
    fn free<R>(&self, change: impl FnOnce(&mut Vec<Box<T>>) -> R) -> R {
        // A panic cannot come between a push and its end.
        change(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl<T> Drop for Lent<'_, T> {
    fn drop(&mut self) {
        // What a panic left behind is working memory: the next task writes it before it reads it.
        if let Some(value) = self.value.take() {
            self.slots.free(|free| free.push(value));
        }
    }
}

impl<T> Deref for Lent<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.value.as_ref().expect("given back at the end")
    }
}

impl<T> DerefMut for Lent<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        self.value.as_mut().expect("given back at the end")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_task_has_a_value_of_its_own_and_gives_it_back() {
        let slots = Slots::<Vec<u8>>::default();
        {
            // As many as are asked for, on whatever threads.
            let mut lent = [slots.take(), slots.take(), slots.take()];
            for (value, own) in lent.iter_mut().zip(1..) {
                value.push(own);
            }
            assert!(lent.iter().zip(1..).all(|(value, own)| **value == [own]));
        }
        let again = [slots.take(), slots.take(), slots.take()];
        let mut kept: Vec<u8> = again.iter().flat_map(|value| value.iter().copied()).collect();
        kept.sort_unstable();
        assert_eq!(kept, [1, 2, 3]);
        assert!(slots.take().is_empty());
    }

    #[test]
    fn a_panic_gives_back_too() {
        let slots = Slots::<Vec<u8>>::default();
        let failed = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            slots.take().push(7);
            panic!("as a task may");
        }));
        assert!(failed.is_err());
        assert_eq!(*slots.take(), [7]);
    }
}
