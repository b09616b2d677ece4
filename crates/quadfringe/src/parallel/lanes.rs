//! Rows of pixels as vectors: arithmetic over arrays by value, which a compiler turns into that of vectors.

/// Pixels that are worked on side by side; rows of planes are padded to a multiple.
pub(crate) const LANES: usize = 16;
/// A vector of pixels.
pub(crate) type Lanes = [f32; LANES];

/// A padded row as vectors.
#[inline(always)]
pub(crate) fn lanes(row: &[f32]) -> &[Lanes] {
    row.as_chunks().0
}

/// A padded row as vectors to write.
#[inline(always)]
pub(crate) fn lanes_mut(row: &mut [f32]) -> &mut [Lanes] {
    row.as_chunks_mut().0
}

/// Vector `i` of several rows, as values: loops over values have no memory to watch, which is what lets them vectorise.
#[inline(always)]
pub(crate) fn take<const N: usize>(rows: &[&[Lanes]; N], i: usize) -> [Lanes; N] {
    std::array::from_fn(|k| rows[k][i])
}

/// Writes vector `i` of several rows.
#[inline(always)]
pub(crate) fn put<const N: usize>(rows: &mut [&mut [Lanes]; N], i: usize, values: &[Lanes; N]) {
    for (row, value) in rows.iter_mut().zip(values) {
        row[i] = *value;
    }
}

/// Adds terms to sums.
#[inline(always)]
pub(crate) fn add<const N: usize>(sums: &mut [Lanes; N], terms: &[Lanes; N]) {
    for (sum, term) in sums.as_flattened_mut().iter_mut().zip(terms.as_flattened()) {
        *sum += term;
    }
}
