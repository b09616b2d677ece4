//! Ground truth of a cast scene, as maps.

use ndarray::{Array2, Array3};

use super::{Cast, Hit, Projector};
use crate::encoding::Encoding;

impl Cast {
    /// Size of the maps (rows, columns).
    #[must_use]
    pub fn shape(&self) -> (usize, usize) {
        self.hits.dim()
    }

    /// The hit of each pixel, in double precision.
    #[must_use]
    pub const fn hits(&self) -> &Array2<Hit> {
        &self.hits
    }

    /// The hit of each pixel of the infrared chip.
    pub(super) fn infrared_hits(&self) -> &Array2<Hit> {
        self.infrared_hits.as_ref().unwrap_or(&self.hits)
    }

    /// Depth z in mm, NaN where the pixel sees no surface.
    #[must_use]
    pub fn depth_mm(&self) -> Array2<f32> {
        self.hits.map(|hit| hit.xyz_mm[2] as f32)
    }

    /// Points in the camera frame, `(rows, columns, 3)` in mm, NaN where the pixel sees no surface.
    #[must_use]
    pub fn xyz_mm(&self) -> Array3<f32> {
        let (rows, columns) = self.shape();
        Array3::from_shape_fn((rows, columns, 3), |(row, column, axis)| {
            self.hits[[row, column]].xyz_mm[axis] as f32
        })
    }

    /// Projector column that lights each pixel, NaN where the projector does not light it.
    #[must_use]
    pub fn column_px(&self, projector: Projector) -> Array2<f32> {
        self.hits.map(|hit| hit.lit_from_px[projector.index()][0] as f32)
    }

    /// Projector row that lights each pixel, NaN where the projector does not light it.
    #[must_use]
    pub fn row_px(&self, projector: Projector) -> Array2<f32> {
        self.hits.map(|hit| hit.lit_from_px[projector.index()][1] as f32)
    }

    /// Absolute phase in rad of the first fringe number, 0 at column 0 of the visible projector; NaN where dark.
    #[must_use]
    pub fn phase_rad(&self, encoding: &Encoding) -> Array2<f32> {
        self.hits.map(|hit| encoding.absolute_phase_rad(hit.lit_from_px[0][0]) as f32)
    }

    /// Fringe order of the first fringe number: the number of whole turns in the absolute phase; NaN where dark.
    #[must_use]
    pub fn order(&self, encoding: &Encoding) -> Array2<f32> {
        let period = encoding.period_px();
        self.hits.map(|hit| (hit.lit_from_px[0][0] / period).floor() as f32)
    }

    /// Whether the pixel sees a surface that at least one projector does not light.
    #[must_use]
    pub fn shadow(&self) -> Array2<bool> {
        self.hits
            .map(|hit| hit.is_surface() && Projector::ALL.iter().any(|projector| !hit.is_lit(*projector)))
    }

    /// Distance in pixels to the nearest edge, which is a step in depth, the border of a shadow, or the border of the
    /// surface. Pixels on either side of an edge have the distance 0. Without any edge, all distances are infinite.
    #[must_use]
    pub fn edge_distance_px(&self) -> Array2<f32> {
        let edges = self.edges();
        let (rows, columns) = self.shape();
        let mut squared = Array2::from_elem((rows, columns), f32::INFINITY);
        for (mut line, marks) in squared.columns_mut().into_iter().zip(edges.columns()) {
            let marks: Vec<f32> = marks.iter().map(|edge| if *edge { 0.0 } else { f32::INFINITY }).collect();
            line.iter_mut().zip(squared_distance(&marks)).for_each(|(out, d)| *out = d);
        }
        for mut line in squared.rows_mut() {
            let before = line.to_vec();
            line.iter_mut().zip(squared_distance(&before)).for_each(|(out, d)| *out = d.sqrt());
        }
        squared
    }

    /// Whether a pixel is less than `reach_px` from the nearest edge; the same as `edge_distance_px() < reach_px`, and
    /// faster for short reaches.
    #[must_use]
    pub fn is_near_edge(&self, reach_px: f32) -> Array2<bool> {
        let edges = self.edges();
        let (rows, columns) = self.shape();
        let widest = reach_px.clamp(0.0, rows.max(columns) as f32).ceil() as isize;
        let steps: Vec<[isize; 2]> = (-widest..=widest)
            .flat_map(|down| (-widest..=widest).map(move |right| [down, right]))
            .filter(|[down, right]| ((down * down + right * right) as f32).sqrt() < reach_px)
            .collect();
        let mut near = Array2::from_elem((rows, columns), false);
        for (place, _) in edges.indexed_iter().filter(|(_, edge)| **edge) {
            for [down, right] in &steps {
                let at = [place.0.checked_add_signed(*down), place.1.checked_add_signed(*right)];
                if let [Some(row), Some(column)] = at
                    && let Some(mark) = near.get_mut([row, column])
                {
                    *mark = true;
                }
            }
        }
        near
    }

    fn edges(&self) -> Array2<bool> {
        let (rows, columns) = self.shape();
        let mut edges = Array2::from_elem((rows, columns), false);
        for row in 0..rows {
            for column in 0..columns {
                for next in [[row, column + 1], [row + 1, column]] {
                    if next[0] < rows && next[1] < columns {
                        let pair = [&self.hits[[row, column]], &self.hits[next]];
                        if self.is_edge(pair) {
                            edges[[row, column]] = true;
                            edges[next] = true;
                        }
                    }
                }
            }
        }
        edges
    }

    fn is_edge(&self, [a, b]: [&Hit; 2]) -> bool {
        let differs = |projector: &Projector| a.is_lit(*projector) != b.is_lit(*projector);
        let (za, zb) = (a.xyz_mm[2], b.xyz_mm[2]);
        a.is_surface() != b.is_surface()
            || Projector::ALL.iter().any(differs)
            || (za - zb).abs() > self.step_per_depth * za.min(zb)
    }
}

/// A parabola of the lower envelope.
#[derive(Clone, Copy)]
struct Parabola {
    /// Position of the apex.
    at: usize,
    /// Position where the envelope starts to follow this parabola.
    from: f32,
}

/// Squared distance transform along a line: the lower envelope of the parabolas `values[q] + (p - q)^2`
/// (Felzenszwalb and Huttenlocher, 2012).
fn squared_distance(values: &[f32]) -> Vec<f32> {
    let mut hull: Vec<Parabola> = Vec::new();
    for (q, value) in values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
        let height = |at: usize, value: f32| value + (at * at) as f32;
        let mut from = f32::NEG_INFINITY;
        while let Some(Parabola { at: last, from: start }) = hull.last().copied() {
            from = (height(q, *value) - height(last, values[last])) / (2 * (q - last)) as f32;
            if from > start {
                break;
            }
            hull.pop();
            from = f32::NEG_INFINITY;
        }
        hull.push(Parabola { at: q, from });
    }
    let mut segment = 0;
    (0..values.len())
        .map(|p| {
            while segment + 1 < hull.len() && hull[segment + 1].from < p as f32 {
                segment += 1;
            }
            hull.get(segment).map_or(f32::INFINITY, |parabola| {
                let step = p.abs_diff(parabola.at) as f32;
                values[parabola.at] + step * step
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::Bench;
    use crate::{Device, surface::scene};

    #[test]
    fn near_edges_are_those_at_a_short_distance() {
        let mut bench = Bench::reference();
        bench.camera = Device::pinhole(96, 72, [240.0; 2], [47.5, 35.5]).expect("valid device");
        let cast = bench.cast(scene("steps", 0.0).expect("known scene").as_ref());
        let distance = cast.edge_distance_px();
        for reach in [0.0, 0.5, 1.0, 2.0, 3.5] {
            assert_eq!(cast.is_near_edge(reach), distance.mapv(|d| d < reach), "{reach}");
        }
    }

    #[test]
    fn distance_along_a_line_is_exact() {
        let far = f32::INFINITY;
        let values = [far, 4.0, far, far, far, 0.0, far, 1.0, far, far];
        for (p, fast) in squared_distance(&values).into_iter().enumerate() {
            let slow = (0..values.len())
                .map(|q| values[q] + (p.abs_diff(q) * p.abs_diff(q)) as f32)
                .fold(far, f32::min);
            assert_eq!(fast, slow);
        }
        assert!(squared_distance(&[far; 4]).iter().all(|d| d.is_infinite()));
    }
}
