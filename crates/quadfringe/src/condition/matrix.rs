//! The inverse of a crosstalk matrix.

/// Inverse by Gauss-Jordan elimination with row pivoting; `None` for a singular or badly conditioned matrix.
pub(super) fn invert_4x4(matrix: &[[f64; 4]; 4]) -> Option<[[f64; 4]; 4]> {
    let mut a = [[0.0; 8]; 4];
    for i in 0..4 {
        a[i][..4].copy_from_slice(&matrix[i]);
        a[i][4 + i] = 1.0;
    }
    for column in 0..4 {
        let pivot = (column..4).max_by(|&p, &q| a[p][column].abs().total_cmp(&a[q][column].abs()))?;
        a.swap(column, pivot);
        let head = a[column][column];
        if !head.is_finite() || head.abs() < 1e-6 {
            return None;
        }
        a[column].iter_mut().for_each(|v| *v /= head);
        let lead = a[column];
        for (row, values) in a.iter_mut().enumerate() {
            if row != column {
                let factor = values[column];
                values.iter_mut().zip(lead).for_each(|(v, l)| *v -= factor * l);
            }
        }
    }
    Some(std::array::from_fn(|i| std::array::from_fn(|j| a[i][4 + j])))
}
