//! Radial and tangential lens distortion in OpenCV's model, and its inverse.

use super::params::{
    CONVERGED, DETERMINANT_MIN, ITERATIONS_MAX, SOLVED, START_FACTOR, START_REDUCTIONS, STEP_PART_MIN,
};

/// Distorted normalised coordinates from ideal ones; `k` is k1, k2, p1, p2, k3.
pub(super) fn apply(k: &[f64; 5], [x, y]: [f64; 2]) -> [f64; 2] {
    let [k1, k2, p1, p2, k3] = *k;
    let r2 = x * x + y * y;
    let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    [
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    ]
}

/// Whether the distorted radius increases all the way from the axis to the point. Only there the model is one to one.
pub(super) fn is_before_fold(k: &[f64; 5], [x, y]: [f64; 2]) -> bool {
    let [k1, k2, _, _, k3] = *k;
    if k1 >= 0.0 && k2 >= 0.0 && k3 >= 0.0 {
        return true;
    }
    // d/dr of r (1 + k1 r^2 + k2 r^4 + k3 r^6), in s = r^2; its least value lies at s or at a stationary point before s.
    let s = x * x + y * y;
    let growth = |s: f64| 1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * 7.0 * k3));
    growth(s) > 0.0
        && stationary_points(3.0 * k1, 10.0 * k2, 21.0 * k3)
            .into_iter()
            .all(|q| !(q > 0.0 && q < s) || growth(q) > 0.0)
}

/// Real roots of `a + b s + c s^2`; NaN in place of a root that does not exist.
fn stationary_points(a: f64, b: f64, c: f64) -> [f64; 2] {
    if c == 0.0 {
        return [-a / b, f64::NAN];
    }
    let root = (b * b - 4.0 * a * c).sqrt();
    [(-b + root) / (2.0 * c), (-b - root) / (2.0 * c)]
}

/// Ideal normalised coordinates from distorted ones, by Newton's method with step halving; `None` if no point before
/// the fold has these distorted coordinates.
pub(super) fn remove(k: &[f64; 5], distorted: [f64; 2]) -> Option<[f64; 2]> {
    let mut point = start(k, distorted);
    let mut miss = miss_of(k, point, distorted);
    for _ in 0..ITERATIONS_MAX {
        let size = norm(miss);
        if size <= CONVERGED {
            break;
        }
        let step = newton_step(k, point, miss)?;
        let mut scale = 1.0;
        loop {
            let next = [point[0] - scale * step[0], point[1] - scale * step[1]];
            let next_miss = miss_of(k, next, distorted);
            if norm(next_miss) < size && is_before_fold(k, next) {
                (point, miss) = (next, next_miss);
                break;
            }
            scale *= 0.5;
            if scale < STEP_PART_MIN {
                // No progress: the result is exact to rounding, or there is no such point.
                return (size < SOLVED).then_some(point);
            }
        }
    }
    (norm(miss) < SOLVED).then_some(point)
}

/// Start of the iteration: the distorted point, moved towards the axis until it lies before the fold.
fn start(k: &[f64; 5], distorted: [f64; 2]) -> [f64; 2] {
    let mut point = distorted;
    for _ in 0..START_REDUCTIONS {
        if is_before_fold(k, point) {
            break;
        }
        point = point.map(|p| START_FACTOR * p);
    }
    point
}

fn miss_of(k: &[f64; 5], point: [f64; 2], distorted: [f64; 2]) -> [f64; 2] {
    let [x, y] = apply(k, point);
    [x - distorted[0], y - distorted[1]]
}

fn norm([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

/// Solution of `J step = miss` with the Jacobian of [`apply`]; `None` where it is singular.
fn newton_step(k: &[f64; 5], [x, y]: [f64; 2], miss: [f64; 2]) -> Option<[f64; 2]> {
    let [k1, k2, p1, p2, k3] = *k;
    let r2 = x * x + y * y;
    let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
    let xx = radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x;
    let xy = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y;
    let yy = radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x;
    let determinant = xx * yy - xy * xy;
    (determinant.abs() > DETERMINANT_MIN)
        .then(|| [(yy * miss[0] - xy * miss[1]) / determinant, (xx * miss[1] - xy * miss[0]) / determinant])
}
