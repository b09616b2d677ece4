//! Rows of pixels as short arrays that are passed by value. The compiler turns arithmetic on them into vector
//! instructions.

/// Pixels in a vector. Rows of planes are padded to a multiple of this number.
pub(crate) const LANES: usize = 16;
/// A vector of pixels.
pub(crate) type Lanes = [f32; LANES];

/// A padded row as vectors.
#[inline(always)]
pub(crate) fn lanes(row: &[f32]) -> &[Lanes] {
    row.as_chunks().0
}

/// A padded row as mutable vectors.
#[inline(always)]
pub(crate) fn lanes_mut(row: &mut [f32]) -> &mut [Lanes] {
    row.as_chunks_mut().0
}

/// Vector `i` of several rows, by value. Values do not alias, so that the compiler vectorises loops over them.
#[inline(always)]
pub(crate) fn take<const N: usize>(rows: &[&[Lanes]; N], i: usize) -> [Lanes; N] {
    std::array::from_fn(|k| rows[k][i])
}

/// Write vector `i` of several rows.
#[inline(always)]
pub(crate) fn put<const N: usize>(rows: &mut [&mut [Lanes]; N], i: usize, values: &[Lanes; N]) {
    for (row, value) in rows.iter_mut().zip(values) {
        row[i] = *value;
    }
}

/// Add terms to sums.
#[inline(always)]
pub(crate) fn add<const N: usize>(sums: &mut [Lanes; N], terms: &[Lanes; N]) {
    for (sum, term) in sums.as_flattened_mut().iter_mut().zip(terms.as_flattened()) {
        *sum += term;
    }
}

/// `value - factor * by` in every lane.
#[inline(always)]
pub(crate) fn less(value: Lanes, factor: Lanes, by: Lanes) -> Lanes {
    let mut out = [0.0; LANES];
    for x in 0..LANES {
        out[x] = value[x] - factor[x] * by[x];
    }
    out
}

/// `value + factor * by` in every lane.
#[inline(always)]
pub(crate) fn plus(value: Lanes, factor: Lanes, by: Lanes) -> Lanes {
    let mut out = [0.0; LANES];
    for x in 0..LANES {
        out[x] = value[x] + factor[x] * by[x];
    }
    out
}

/// Product in every lane.
#[inline(always)]
pub(crate) fn times(value: Lanes, factor: Lanes) -> Lanes {
    let mut out = [0.0; LANES];
    for x in 0..LANES {
        out[x] = value[x] * factor[x];
    }
    out
}
