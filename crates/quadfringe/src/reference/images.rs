//! The images of a reference measurement, borrowed.

use super::plan::StepSet;
use crate::condition::{LIGHT_MAX, Sample, checked_full_scale};
use crate::error::{Error, Result};
use ndarray::{ArrayView3, Axis};
use std::borrow::Cow;

/// One stack of images `(steps, rows, columns)` for each fringe number, all of one type and size; views may be strided.
#[derive(Debug, Clone)]
pub struct StepImages<'a, T> {
    stacks: Vec<ArrayView3<'a, T>>,
    full_scale: f32,
}

impl<'a, T: Sample> StepImages<'a, T> {
    /// Images with the full scale of their type (255, 65535; 1.0 for `f32`).
    ///
    /// # Errors
    /// [`Error::Value`] for no stack; [`Error::Shape`] when images are empty or differ in size; [`Error::NotFinite`] for NaN or
    /// infinity.
    pub fn new(stacks: Vec<ArrayView3<'a, T>>) -> Result<Self> {
        let Some(first) = stacks.first() else {
            return Err(Error::value("stacks", "one for each fringe number", 0usize));
        };
        let (_, rows, columns) = first.dim();
        for (k, stack) in stacks.iter().enumerate() {
            let (steps, ..) = stack.dim();
            let wanted = [steps.max(1), rows.max(1), columns.max(1)];
            if stack.shape() != wanted {
                return Err(Error::shape(
                    format!("stack {k} (steps, rows, columns)"),
                    &wanted,
                    stack.shape(),
                ));
            }
        }
        let found = Self { stacks, full_scale: T::FULL_SCALE };
        found.greatest().map(|_| found)
    }

    /// Sets the intensity of full scale, for example 4095 for 12-bit data in 16-bit words.
    ///
    /// # Errors
    /// [`Error::Value`] unless positive and finite.
    pub fn with_full_scale(mut self, full_scale: f32) -> Result<Self> {
        self.full_scale = checked_full_scale(full_scale)?;
        Ok(self)
    }

    /// Rows and columns.
    #[must_use]
    pub fn shape(&self) -> [usize; 2] {
        let (_, rows, columns) = self.stacks[0].dim();
        [rows, columns]
    }

    /// Checks that these are the images that were planned.
    pub(super) fn check(&self, sets: &[StepSet], shape: [usize; 2]) -> Result<()> {
        if self.stacks.len() != sets.len() {
            let expected = format!("{}, one for each fringe number", sets.len());
            return Err(Error::value("stacks", expected, self.stacks.len()));
        }
        for (stack, set) in self.stacks.iter().zip(sets) {
            let wanted = [set.steps, shape[0], shape[1]];
            if stack.shape() != wanted {
                let name = format!("images of {} fringes (steps, rows, columns)", set.fringe_number);
                return Err(Error::shape(name, &wanted, stack.shape()));
            }
        }
        let light = self.greatest()? / self.full_scale;
        if light > LIGHT_MAX {
            let expected = format!("at most {LIGHT_MAX} times full scale, which is {} here", self.full_scale);
            return Err(Error::value("intensity of an image", expected, light * self.full_scale));
        }
        Ok(())
    }

    fn greatest(&self) -> Result<f32> {
        let mut greatest = 0f32;
        for (k, stack) in self.stacks.iter().enumerate().filter(|_| T::LEVELS == 0) {
            for (s, image) in stack.axis_iter(Axis(0)).enumerate() {
                greatest = greatest.max(T::greatest(&image, &format!("stack {k}, step {s}:"))?);
            }
        }
        Ok(greatest)
    }

    pub(super) const fn full_scale(&self) -> f32 {
        self.full_scale
    }

    /// Row `y` of step `s` of stack `k`, contiguous.
    #[inline]
    pub(super) fn row(&self, k: usize, s: usize, y: usize) -> Cow<'_, [T]> {
        let row = self.stacks[k].index_axis(Axis(0), s);
        let row = row.index_axis_move(Axis(0), y);
        match row.to_slice() {
            Some(row) => Cow::Borrowed(row),
            None => Cow::Owned(row.to_vec()),
        }
    }
}
