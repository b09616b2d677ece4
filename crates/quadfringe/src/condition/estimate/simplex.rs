//! Downhill simplex: Nelder and Mead, "A simplex method for function minimization", Computer Journal 7, 308 (1965).

/// Size of the simplex, in units of the first steps, at which the search ends.
const TOLERANCE: f64 = 0.005;
/// Bound of the work; about 60 rounds are usual for three parameters.
const ROUNDS_MAX: usize = 200;

type Corner<const D: usize> = ([f64; D], f64);

/// The least cost near `start` and its place; searched twice, as a simplex may collapse early.
pub(super) fn minimise<const D: usize>(
    start: [f64; D],
    step: [f64; D],
    cost: impl Fn([f64; D]) -> f64,
) -> Corner<D> {
    let first = descend(start, step, &cost);
    descend(first.0, step, &cost)
}

fn descend<const D: usize>(start: [f64; D], step: [f64; D], cost: &impl Fn([f64; D]) -> f64) -> Corner<D> {
    let corner = |point: [f64; D]| (point, cost(point));
    let mut simplex = vec![corner(start)];
    for axis in 0..D {
        let mut point = start;
        point[axis] += step[axis];
        simplex.push(corner(point));
    }
    for _ in 0..ROUNDS_MAX {
        simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
        if size(&simplex, &step) < TOLERANCE {
            break;
        }
        match replacement(&simplex, &corner) {
            Some(better) => simplex[D] = better,
            None => {
                let best = simplex[0].0;
                for old in &mut simplex[1..] {
                    *old = corner(std::array::from_fn(|i| (best[i] + old.0[i]) / 2.0));
                }
            }
        }
    }
    simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
    simplex[0]
}

/// A corner to take the place of the worst one; `None` when the simplex has to shrink.
fn replacement<const D: usize>(
    simplex: &[Corner<D>],
    corner: &impl Fn([f64; D]) -> Corner<D>,
) -> Option<Corner<D>> {
    let worst = simplex[D];
    let centre: [f64; D] =
        std::array::from_fn(|i| simplex[..D].iter().map(|c| c.0[i]).sum::<f64>() / D as f64);
    let at = |t: f64| corner(std::array::from_fn(|i| centre[i] + t * (worst.0[i] - centre[i])));
    let reflected = at(-1.0);
    if reflected.1 < simplex[0].1 {
        let expanded = at(-2.0);
        return Some(if expanded.1 < reflected.1 { expanded } else { reflected });
    }
    if reflected.1 < simplex[D - 1].1 {
        return Some(reflected);
    }
    let contracted = at(if reflected.1 < worst.1 { -0.5 } else { 0.5 });
    (contracted.1 < reflected.1.min(worst.1)).then_some(contracted)
}

fn size<const D: usize>(simplex: &[Corner<D>], step: &[f64; D]) -> f64 {
    let best = simplex[0].0;
    let reach = |c: &Corner<D>| (0..D).fold(0.0f64, |m, i| m.max(((c.0[i] - best[i]) / step[i]).abs()));
    simplex[1..].iter().map(reach).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curved_valley_is_followed_to_its_end() {
        let banana = |[x, y]: [f64; 2]| (1.0 - x).powi(2) + 100.0 * (y - x * x).powi(2);
        let ([x, y], cost) = minimise([-1.2, 1.0], [0.1, 0.1], banana);
        assert!((x - 1.0).abs() < 1e-2 && (y - 1.0).abs() < 2e-2 && cost < 1e-4, "{x} {y} {cost}");
    }

    #[test]
    fn a_wall_is_not_crossed() {
        let wall = |[x, y]: [f64; 2]| if x < 0.5 { f64::INFINITY } else { x + y * y };
        let ([x, y], _) = minimise([1.0, 1.0], [0.2, 0.2], wall);
        assert!((0.5..0.51).contains(&x) && y.abs() < 0.05, "{x} {y}");
    }
}
