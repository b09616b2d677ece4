//! Small holes, filled from their rims.

use super::nodes::{Node, Nodes, are_joined};
use super::params::{COTANGENT, DEVIATIONS, FILL_SWEEPS, FILL_TOLERANCE};
use super::vector::{Vector, difference, scaled, sum, wide};

/// Fills every hole of at most `most` pixels whose rim is one surface, and marks its pixels.
pub(super) fn fill(nodes: &mut Nodes, most: usize) -> Vec<bool> {
    let mut filled = vec![false; nodes.all.len()];
    if most == 0 {
        return filled;
    }
    let mut seen: Vec<bool> = nodes.all.iter().map(Node::is_some).collect();
    for start in 0..nodes.all.len() {
        let Some(hole) = hole_from(nodes, start, &mut seen, most) else { continue };
        let rim = Rim::new(nodes, &hole);
        if !rim.is_one_surface() {
            continue;
        }
        for (i, value) in hole.iter().zip(rim.relaxed()) {
            nodes.all[*i] = node_of(value);
            filled[*i] = true;
        }
    }
    filled
}

/// The pixels without a point around `start`, in order; `None` where they are too many, or reach the border of the image.
fn hole_from(nodes: &Nodes, start: usize, seen: &mut [bool], most: usize) -> Option<Vec<usize>> {
    if std::mem::replace(&mut seen[start], true) {
        return None;
    }
    let mut hole = vec![start];
    let (mut next, mut is_inside) = (0, true);
    while let Some(&i) = hole.get(next) {
        next += 1;
        let around = around(nodes, i);
        is_inside &= around.len() == 9;
        hole.extend(around.filter(|j| !std::mem::replace(&mut seen[*j], true)));
    }
    if !is_inside || hole.len() > most {
        return None;
    }
    hole.sort_unstable();
    Some(hole)
}

/// A pixel and those around it, row by row: nine, or fewer at the border of the image.
fn around(nodes: &Nodes, i: usize) -> impl ExactSizeIterator<Item = usize> + use<> {
    let (y, x, stride) = (i / nodes.columns, i % nodes.columns, nodes.columns);
    let [rows, columns] = [(y, nodes.rows), (x, stride)].map(|(at, n)| at.saturating_sub(1)..(at + 2).min(n));
    let width = columns.len();
    (0..rows.len() * width).map(move |k| (rows.start + k / width) * stride + columns.start + k % width)
}

/// A ray `(x, y)` of depth 1 and the inverse of the depth; a plane is linear in all three.
type Value = Vector;

fn value_of(node: Node) -> Value {
    let [x, y, z] = wide(node.point);
    [x / z, y / z, 1.0 / z]
}

fn node_of([x, y, inverse]: Value) -> Node {
    Node::new([x / inverse, y / inverse, 1.0 / inverse].map(|c| c as f32), 0.0)
}

/// A hole and the points around it.
struct Rim {
    /// For each pixel of the hole, what lies above, left, right and below.
    crosses: Vec<[Place; 4]>,
    values: Vec<Value>,
    deviations: Vec<f32>,
    /// Distance of the rays of neighbouring pixels at depth 1.
    pitch: f64,
    /// Whether all neighbours along the rim are joined.
    is_joined: bool,
}

/// A pixel of the hole, or the value of one of the rim.
#[derive(Clone, Copy)]
enum Place {
    Hole(usize),
    Rim(Value),
}

impl Rim {
    fn new(nodes: &Nodes, hole: &[usize]) -> Self {
        let mut pixels: Vec<usize> = hole.iter().flat_map(|i| around(nodes, *i)).collect();
        pixels.retain(|i| nodes.all[*i].is_some());
        pixels.sort_unstable();
        pixels.dedup();
        let place = |j: usize| match hole.binary_search(&j) {
            Ok(place) => Place::Hole(place),
            Err(_) => Place::Rim(value_of(nodes.all[j])),
        };
        let cross = |i: &usize| [i - nodes.columns, i - 1, i + 1, i + nodes.columns].map(place);
        let values: Vec<Value> = pixels.iter().map(|i| value_of(nodes.all[*i])).collect();
        let next = |i: usize, stride: usize| {
            let neighbour = pixels.binary_search(&(i + stride)).is_ok();
            !neighbour || are_joined(nodes.all[i], nodes.all[i + stride])
        };
        let width_px = range(pixels.iter().map(|i| (i % nodes.columns) as f64));
        Self {
            crosses: hole.iter().map(cross).collect(),
            pitch: range(values.iter().map(|value| value[0])) / width_px,
            is_joined: pixels.iter().all(|i| next(*i, 1) && next(*i, nodes.columns)),
            deviations: pixels.iter().map(|i| nodes.all[*i].deviation).collect(),
            values,
        }
    }

    /// Whether neighbours along the rim are joined, and all of it lies on one plane within the step that neighbouring pixels of
    /// a surface may have (T5).
    fn is_one_surface(&self) -> bool {
        let mean = mean_of(&self.values);
        let slope = slope_of(&self.values, mean);
        let step = self.pitch * COTANGENT;
        let near_plane = |([x, y, inverse], deviation): (&Value, &f32)| {
            let plane = mean[2] + slope[0] * (x - mean[0]) + slope[1] * (y - mean[1]);
            // As shares of the depth.
            let limit = step + DEVIATIONS * f64::from(*deviation);
            plane > 0.0 && (inverse / plane - 1.0).abs() <= limit
        };
        self.is_joined && self.values.iter().zip(&self.deviations).all(near_plane)
    }

    /// Values of the hole of which each is the mean of the four around it.
    fn relaxed(&self) -> Vec<Value> {
        let mut found = vec![mean_of(&self.values); self.crosses.len()];
        for _ in 0..FILL_SWEEPS {
            let mut change: f64 = 0.0;
            for (i, cross) in self.crosses.iter().enumerate() {
                let mut mean = [0.0; 3];
                for place in cross {
                    let value = match place {
                        Place::Hole(place) => found[*place],
                        Place::Rim(value) => *value,
                    };
                    mean = [0, 1, 2].map(|k| mean[k] + value[k] / 4.0);
                }
                change = change.max((mean[2] - found[i][2]).abs() / mean[2]);
                change = change.max((mean[0] - found[i][0]).abs()).max((mean[1] - found[i][1]).abs());
                found[i] = mean;
            }
            if change < FILL_TOLERANCE {
                break;
            }
        }
        found
    }
}

fn range(values: impl Iterator<Item = f64> + Clone) -> f64 {
    values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
}

fn mean_of(values: &[Value]) -> Value {
    let total = values.iter().fold([0.0; 3], |total, value| sum(total, *value));
    scaled(total, 1.0 / values.len() as f64)
}

/// Least-squares slope of the inverse depth along x and y. A rim goes around its hole, so it never lies on one line.
fn slope_of(values: &[Value], mean: Value) -> [f64; 2] {
    let (mut xx, mut xy, mut yy, mut xv, mut yv) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for [x, y, v] in values.iter().map(|value| difference(*value, mean)) {
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
        (xv, yv) = (xv + x * v, yv + y * v);
    }
    let determinant = xx * yy - xy * xy;
    [yy * xv - xy * yv, xx * yv - xy * xv].map(|v| v / determinant)
}
