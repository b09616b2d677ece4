//! Downhill simplex: Nelder and Mead, "A simplex method for function minimization", Computer Journal 7, 308 (1965).

use crate::condition::params::{SIMPLEX_ROUNDS_MAX, SIMPLEX_TOLERANCE};

/// A point and its cost.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner<const D: usize> {
    pub point: [f64; D],
    pub cost: f64,
}

/// The point of least cost near `start`. The search runs a second time from its result, because a simplex may collapse
/// early.
pub(super) fn minimise<const D: usize>(
    start: [f64; D],
    step: [f64; D],
    cost: impl Fn([f64; D]) -> f64,
) -> Corner<D> {
    let first = descend(start, step, &cost);
    descend(first.point, step, &cost)
}

fn descend<const D: usize>(start: [f64; D], step: [f64; D], cost: &impl Fn([f64; D]) -> f64) -> Corner<D> {
    let corner = |point: [f64; D]| Corner { point, cost: cost(point) };
    let mut simplex = vec![corner(start)];
    for axis in 0..D {
        let mut point = start;
        point[axis] += step[axis];
        simplex.push(corner(point));
    }
    for _ in 0..SIMPLEX_ROUNDS_MAX {
        simplex.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        if size(&simplex, &step) < SIMPLEX_TOLERANCE {
            break;
        }
        match replacement(&simplex, &corner) {
            Some(better) => simplex[D] = better,
            None => {
                let best = simplex[0].point;
                for old in &mut simplex[1..] {
                    *old = corner(std::array::from_fn(|i| (best[i] + old.point[i]) / 2.0));
                }
            }
        }
    }
    simplex.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    simplex[0]
}

/// A new corner in place of the worst one; `None` if the simplex must shrink.
fn replacement<const D: usize>(
    simplex: &[Corner<D>],
    corner: &impl Fn([f64; D]) -> Corner<D>,
) -> Option<Corner<D>> {
    let worst = simplex[D];
    let centre: [f64; D] =
        std::array::from_fn(|i| simplex[..D].iter().map(|c| c.point[i]).sum::<f64>() / D as f64);
    let at = |t: f64| corner(std::array::from_fn(|i| centre[i] + t * (worst.point[i] - centre[i])));
    let reflected = at(-1.0);
    if reflected.cost < simplex[0].cost {
        let expanded = at(-2.0);
        return Some(if expanded.cost < reflected.cost { expanded } else { reflected });
    }
    if reflected.cost < simplex[D - 1].cost {
        return Some(reflected);
    }
    let contracted = at(if reflected.cost < worst.cost { -0.5 } else { 0.5 });
    (contracted.cost < reflected.cost.min(worst.cost)).then_some(contracted)
}

fn size<const D: usize>(simplex: &[Corner<D>], step: &[f64; D]) -> f64 {
    let best = simplex[0].point;
    let reach = |c: &Corner<D>| (0..D).fold(0.0f64, |m, i| m.max(((c.point[i] - best[i]) / step[i]).abs()));
    simplex[1..].iter().map(reach).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curved_valley_is_followed_to_its_end() {
        let banana = |[x, y]: [f64; 2]| (1.0 - x).powi(2) + 100.0 * (y - x * x).powi(2);
        let Corner { point: [x, y], cost } = minimise([-1.2, 1.0], [0.1, 0.1], banana);
        assert!((x - 1.0).abs() < 1e-2 && (y - 1.0).abs() < 2e-2 && cost < 1e-4, "{x} {y} {cost}");
    }

    #[test]
    fn a_wall_is_not_crossed() {
        let wall = |[x, y]: [f64; 2]| if x < 0.5 { f64::INFINITY } else { x + y * y };
        let Corner { point: [x, y], .. } = minimise([1.0, 1.0], [0.2, 0.2], wall);
        assert!((0.5..0.51).contains(&x) && y.abs() < 0.05, "{x} {y}");
    }
}
