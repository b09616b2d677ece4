//! Means over blocks of pixels.
//!
//! The published decoder finds fringe orders from means over a few rows, and over 2 or 4 columns if the fringes are
//! coarse enough, because a mean over `n` pixels has `1 / n` of their noise variance. The means only select the order;
//! the phase is taken from single pixels.

use super::params::{BLOCK_COLUMNS_MAX, ROWS_PER_COLUMN, SAMPLES_PER_FRINGE_MIN};
use crate::error::Limit;
use crate::parallel::Aligned;
use crate::{Error, Result};
use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;

/// Size of the blocks over which the published decoder takes means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Blocks {
    /// Rows of a block.
    pub rows: usize,
    /// Columns of a block in G and IR, a power of two. Blocks of R and B are one column wide.
    pub columns: usize,
}

impl Blocks {
    /// The widest blocks that leave enough samples in each fringe of G and IR. Their fringe periods along a row and the
    /// `width` of the image are given in camera pixels.
    ///
    /// ```
    /// use quadfringe::stages::Blocks;
    /// let blocks = Blocks::for_periods(30.0, 35.0, 1024);
    /// assert_eq!((blocks.rows, blocks.columns), (4, 2));
    /// assert_eq!(Blocks::for_periods(20.0, 23.0, 1024).columns, 1);
    /// ```
    #[must_use]
    pub fn for_periods(green_px: f32, infrared_px: f32, width: usize) -> Self {
        let finest = green_px.min(infrared_px).min(width as f32);
        let mut columns = 1;
        while columns < BLOCK_COLUMNS_MAX && finest >= SAMPLES_PER_FRINGE_MIN * (2 * columns) as f32 {
            columns *= 2;
        }
        Self { rows: ROWS_PER_COLUMN * columns, columns }
    }

    /// All numbers of columns that [`Self::for_periods`] chooses from.
    pub(crate) fn all_columns() -> impl Iterator<Item = usize> {
        (0..=BLOCK_COLUMNS_MAX.ilog2()).map(|halvings| 1 << halvings)
    }
}

/// Means over blocks of `rows` rows and `columns` columns of an image.
///
/// The result has one row for every block, and `image columns / columns` columns, rounded down; the last block may
/// contain fewer image rows than the others. The unit of the image is kept. NaN in a block makes its mean NaN; see
/// [`fill_gaps`].
///
/// # Errors
/// [`Error::Value`] when `rows` is 0, or `columns` is no power of two or wider than the image.
///
/// ```
/// use ndarray::array;
/// use quadfringe::stages::block_means;
/// let image = array![[1.0f32, 3.0, 5.0], [3.0, 5.0, 7.0], [0.0, 2.0, 9.0]];
/// assert_eq!(block_means(image.view(), 2, 2)?, array![[3.0], [1.0]]);
/// assert_eq!(block_means(image.view(), 2, 1)?, array![[2.0, 4.0, 6.0], [0.0, 2.0, 9.0]]);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn block_means(image: ArrayView2<'_, f32>, rows: usize, columns: usize) -> Result<Array2<f32>> {
    if rows == 0 {
        return Err(Error::value("rows of a block", Limit::AtLeast(1.0), rows));
    }
    if !columns.is_power_of_two() || columns > image.ncols() {
        let expected = format!("a power of two, at most the {} columns of the image", image.ncols());
        return Err(Error::value("columns of a block", expected, columns));
    }
    let mut means = Array2::zeros([image.nrows().div_ceil(rows), image.ncols() / columns]);
    let blocks = image.axis_chunks_iter(Axis(0), rows).into_par_iter();
    means.axis_iter_mut(Axis(0)).into_par_iter().zip(blocks).for_each_init(
        <[Aligned<f32>; 2]>::default,
        |[coarse, spare], (mut out, block)| {
            let mut sum = block.row(0).to_vec();
            block.axis_iter(Axis(0)).skip(1).for_each(|row| add(&row.to_vec(), &mut sum));
            coarsen(&sum, columns, coarse, spare);
            scale(coarse, block.nrows());
            out.iter_mut().zip(&**coarse).for_each(|(out, mean)| *out = *mean);
        },
    );
    Ok(means)
}

/// Fill each gap of a row (NaN or infinity) with the last value before it, and a gap at the beginning with the first value
/// after it. A row without any value becomes 0.
///
/// In the Fourier filter, one NaN would spread over the whole row. A registered infrared image has gaps where the
/// infrared chip does not see the point; discard the result there.
///
/// ```
/// use ndarray::array;
/// use quadfringe::stages::fill_gaps;
/// let image = array![[f32::NAN, 1.0, f32::NAN, 2.0]];
/// assert_eq!(fill_gaps(image.view()), array![[1.0, 1.0, 1.0, 2.0]]);
/// ```
#[must_use]
pub fn fill_gaps(image: ArrayView2<'_, f32>) -> Array2<f32> {
    let mut filled = image.as_standard_layout().into_owned();
    let mut gaps = Vec::new();
    for mut row in filled.axis_iter_mut(Axis(0)) {
        fill_row_gaps(row.as_slice_mut().expect("rows in standard layout are contiguous"), &mut gaps);
    }
    filled
}

/// Repeats each row of a map of blocks for all image rows of the block. A block has `rows` rows, the image `height`
/// rows.
///
/// # Errors
/// [`Error::Shape`] when the map does not have one row for each block of such an image.
///
/// ```
/// use ndarray::array;
/// use quadfringe::stages::repeat_rows;
/// let map = array![[1.0f32], [2.0]];
/// assert_eq!(repeat_rows(map.view(), 2, 3)?, array![[1.0], [1.0], [2.0]]);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn repeat_rows(map: ArrayView2<'_, f32>, rows: usize, height: usize) -> Result<Array2<f32>> {
    let blocks = height.div_ceil(rows.max(1));
    if map.nrows() != blocks {
        return Err(Error::shape("map of blocks", &[blocks, map.ncols()], map.shape()));
    }
    Ok(Array2::from_shape_fn([height, map.ncols()], |(y, x)| map[[y / rows.max(1), x]]))
}

/// Adds a row to a sum of rows.
#[inline(always)]
pub(crate) fn add(row: &[f32], sum: &mut [f32]) {
    sum.iter_mut().zip(row).for_each(|(sum, light)| *sum += light);
}

/// Divides a sum of `rows` rows by their number.
#[inline(always)]
pub(crate) fn scale(sum: &mut [f32], rows: usize) {
    sum.iter_mut().for_each(|sum| *sum *= 1.0 / rows as f32);
}

/// Means of `step` (a power of two) samples of a row. `spare` is working memory.
#[inline(always)]
pub(crate) fn coarsen(row: &[f32], step: usize, out: &mut Aligned<f32>, spare: &mut Aligned<f32>) {
    out.resize(row.len() / step.min(2));
    if step == 1 {
        out.copy_from_slice(row);
        return;
    }
    pair_means(row, out);
    for _ in 1..step.ilog2() {
        spare.resize(out.len() / 2);
        pair_means(out, spare);
        std::mem::swap(out, spare);
    }
}

/// Means of two neighbouring samples.
#[inline(always)]
fn pair_means(row: &[f32], out: &mut [f32]) {
    let (pairs, _) = row.as_chunks::<2>();
    for (to, [a, b]) in out.iter_mut().zip(pairs) {
        *to = 0.5 * (a + b);
    }
}

/// Fill the gaps of one row and list their columns.
#[inline(always)]
pub(crate) fn fill_row_gaps(row: &mut [f32], gaps: &mut Vec<usize>) {
    gaps.clear();
    // This first pass compiles to vectors, and most rows end here: only shots with registration have gaps.
    if row.iter().fold(true, |whole, v| whole & v.is_finite()) {
        return;
    }
    let mut seen = row.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
    for (x, value) in row.iter_mut().enumerate() {
        if value.is_finite() {
            seen = *value;
        } else {
            gaps.push(x);
            *value = seen;
        }
    }
}
