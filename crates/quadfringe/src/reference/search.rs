//! Step 3: the projector column from the phases of all fringe numbers, by maximum likelihood over all orders of the finest one.
//!
//! Every order of the finest phase is a column. The other phases then have known whole turns, and the column that fits all
//! phases best follows in closed form, with its cost, a chi square (R5), (R6). The cheapest order is taken. The sum of the
//! likelihoods of all orders gives the probability that another one is right.

use super::demodulate::{BLOCK, SetRow};
use super::params::TAIL;
use super::plan::Code;
use crate::parallel::angle::round;
use std::f32::consts::TAU;
use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// A block of pixels.
pub(super) type Pixels = [f32; BLOCK];

/// Variances from which the weights of phases follow.
#[derive(Debug, Clone, Copy)]
pub(super) struct Variances {
    /// Standard deviation of an intensity, fraction of full scale.
    pub noise: f32,
    /// Standard deviation of a phase beyond noise, in rad.
    pub disagreement_rad: f32,
}

/// The search, planned once.
#[derive(Debug, Clone)]
pub(super) struct Search {
    /// The fringe number whose orders are tried, and its place.
    finest: f32,
    finest_at: usize,
    /// The other fringe numbers and their places.
    others: Vec<Other>,
    orders: RangeInclusive<i32>,
    /// First and last column that can be seen, as fractions of the projector width.
    from: f32,
    to: f32,
}

#[derive(Debug, Clone, Copy)]
struct Other {
    number: f32,
    at: usize,
}

/// What is known about a block of pixels before the search.
#[derive(Debug, Clone, Default)]
pub(super) struct Phases {
    /// For each fringe number: wrapped phase in turns.
    turns: Vec<[f32; BLOCK]>,
    /// For each fringe number: the inverse of the variance of its phase, in 1 / turns^2.
    weights: Vec<[f32; BLOCK]>,
}

/// The result of a search.
#[derive(Debug, Clone)]
pub(super) struct Found {
    /// Column as a fraction of the projector width.
    pub column: Pixels,
    /// Inverse of its variance.
    pub precision: Pixels,
    /// Cost of the cheapest order.
    pub cost: Pixels,
    /// Cost of the next cheapest order.
    pub next: Pixels,
    /// Sum of the likelihoods of all orders over that of the cheapest.
    pub likelihoods: Pixels,
    /// How many times as likely the phases are for a point of the surface as for a stray, whose phases are arbitrary (R8).
    pub evidence: Pixels,
}

impl Phases {
    /// Takes block `b` of the rows of all fringe numbers.
    #[inline(always)]
    pub fn take(&mut self, rows: &[SetRow], b: usize, variances: Variances) {
        let Variances { noise, disagreement_rad } = variances;
        self.turns.resize(rows.len(), [0.0; BLOCK]);
        self.weights.resize(rows.len(), [0.0; BLOCK]);
        let (by_noise, beyond) = (noise * noise, disagreement_rad * disagreement_rad);
        for (row, (turns, weights)) in rows.iter().zip(self.turns.iter_mut().zip(&mut self.weights)) {
            *turns = row.turns.as_chunks().0[b];
            let (modulation, gain): (&Pixels, &Pixels) =
                (&row.modulation.as_chunks().0[b], &row.gain.as_chunks().0[b]);
            for i in 0..BLOCK {
                let square = modulation[i] * modulation[i];
                weights[i] = TAU * TAU * square / (by_noise * gain[i] + beyond * square);
            }
        }
    }

    /// Mean variance of the phases of a pixel in rad^2.
    pub fn variance_rad2(&self, i: usize) -> f32 {
        let sum: f32 = self.weights.iter().map(|weights| TAU * TAU / weights[i]).sum();
        sum / self.weights.len() as f32
    }
}

impl Search {
    pub fn new(code: &Code) -> Self {
        let number = |at: usize| code.sets[at].fringe_number;
        let finest = number(code.finest);
        let others = (0..code.sets.len()).filter(|at| *at != code.finest);
        let (from, to) = (code.window.start, code.window.end);
        // The wrapped phase lies in [-1/2, 1/2] turns. An order whose columns all lie outside the window is not tried.
        let first = (finest * f64::from(from) - 0.5).floor() as i32;
        let last = (finest * f64::from(to) + 0.5).ceil() as i32;
        Self {
            finest: finest as f32,
            finest_at: code.finest,
            others: others.map(|at| Other { number: number(at) as f32, at }).collect(),
            orders: first..=last,
            from,
            to,
        }
    }

    /// Number of orders inside the window.
    fn count(&self) -> f32 {
        (self.finest * (self.to - self.from)).max(1.0)
    }

    /// Degrees of freedom of a cost: the phases less the one that gives the column.
    pub fn freedom(&self) -> usize {
        self.others.len()
    }

    /// The column of every pixel of a block. Pixels without phases get NaN or meaningless numbers.
    #[inline(always)]
    pub fn run(&self, phases: &Phases, found: &mut Found) {
        self.precision(phases, &mut found.precision);
        found.restart();
        let (mut spread, mut first, scale) = ([0.0; BLOCK], [0.0; BLOCK], 1.0 / self.finest);
        for i in 0..BLOCK {
            spread[i] = 1.0 / found.precision[i];
            first[i] = phases.turns[self.finest_at][i] * scale;
        }
        for order in self.orders.clone() {
            let place = order as f32 * scale;
            let (mut cost, mut lean, mut likelihood) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
            for other in &self.others {
                let (turns, weights) = (&phases.turns[other.at], &phases.weights[other.at]);
                for i in 0..BLOCK {
                    let apart = other.number * (first[i] + place) - turns[i];
                    let apart = apart - round(apart);
                    let pull = weights[i] * apart;
                    cost[i] += pull * apart;
                    lean[i] += pull * other.number;
                }
            }
            for i in 0..BLOCK {
                let shift = lean[i] * spread[i];
                let column = (first[i] + place) - shift;
                let (below, above) = (self.from - column, column - self.to);
                let outside = if below > above { below } else { above };
                let outside = if outside > 0.0 { outside } else { 0.0 };
                let total = cost[i] - lean[i] * shift;
                let total = if total > 0.0 { total } else { 0.0 };
                cost[i] = total + outside * outside * found.precision[i];
                lean[i] = column;
            }
            student(&cost, self.freedom(), &mut likelihood);
            found.try_order(&lean, &cost, &likelihood);
        }
        self.weigh(phases, found);
    }

    /// Inverse of the variance of the column: the sum over all phases.
    #[inline(always)]
    fn precision(&self, phases: &Phases, precision: &mut Pixels) {
        let finest = self.finest * self.finest;
        for (out, weight) in precision.iter_mut().zip(&phases.weights[self.finest_at]) {
            *out = finest * weight;
        }
        for other in &self.others {
            let square = other.number * other.number;
            for (out, weight) in precision.iter_mut().zip(&phases.weights[other.at]) {
                *out += square * weight;
            }
        }
    }

    /// Evidence (R8): the density of the other phases for a point, over that of arbitrary phases, which is one per turn.
    #[inline(always)]
    fn weigh(&self, phases: &Phases, found: &mut Found) {
        let normal = student_constant(self.freedom()) / self.count();
        let finest = self.finest * self.finest;
        let mut likelihood = [0.0; BLOCK];
        student(&found.cost, self.freedom(), &mut likelihood);
        for i in 0..BLOCK {
            let own = finest * phases.weights[self.finest_at][i] / found.precision[i];
            let density =
                self.others.iter().fold(own, |product, other| product * phases.weights[other.at][i]);
            found.evidence[i] = normal * density.sqrt() * found.likelihoods[i];
            found.likelihoods[i] /= likelihood[i];
        }
    }
}

/// Likelihood of a cost (R8), without its constant: `(1 + cost / n)^(-(n + freedom) / 2)` with `n = 2 TAIL`.
#[inline(always)]
fn student(cost: &Pixels, freedom: usize, likelihood: &mut Pixels) {
    match freedom {
        0 => student_power::<TAIL, false>(cost, likelihood),
        1 => student_power::<TAIL, true>(cost, likelihood),
        2 => student_power::<{ TAIL + 1 }, false>(cost, likelihood),
        _ => {
            let base = cost.map(|cost| 1.0 / (1.0 + cost * (0.5 / TAIL as f32)));
            *likelihood = if freedom % 2 == 1 { base.map(f32::sqrt) } else { [1.0; BLOCK] };
            for _ in 0..TAIL + freedom / 2 {
                likelihood.iter_mut().zip(&base).for_each(|(likelihood, base)| *likelihood *= base);
            }
        }
    }
}

/// The powers of the common numbers of phases, which the compiler writes out.
#[inline(always)]
fn student_power<const WHOLE: usize, const HALF: bool>(cost: &Pixels, likelihood: &mut Pixels) {
    for i in 0..BLOCK {
        let base = 1.0 / (1.0 + cost[i] * (0.5 / TAIL as f32));
        let start = if HALF { base.sqrt() } else { 1.0 };
        likelihood[i] = (0..WHOLE).fold(start, |product, _| product * base);
    }
}

/// The constant of a Student density of `freedom` dimensions: `Gamma((n + d) / 2) / (Gamma(n / 2) (n pi)^(d / 2))`.
fn student_constant(freedom: usize) -> f32 {
    let n = 2.0 * TAIL as f64;
    // Gamma(x + 1/2) / Gamma(x) by the half, from Gamma(x + 1) = x Gamma(x) and the known value at 1/2.
    let gamma = |halves: usize| {
        let start = if halves.is_multiple_of(2) { 1.0 } else { PI.sqrt() };
        let first = if halves.is_multiple_of(2) { 2 } else { 1 };
        (first..halves).step_by(2).fold(start, |product, twice| product * twice as f64 / 2.0)
    };
    (gamma(2 * TAIL + freedom) / gamma(2 * TAIL) / (n * PI).powf(freedom as f64 / 2.0)) as f32
}

impl Default for Found {
    fn default() -> Self {
        let row = [0.0; BLOCK];
        Self { column: row, precision: row, cost: row, next: row, likelihoods: row, evidence: row }
    }
}

impl Found {
    #[inline(always)]
    fn restart(&mut self) {
        self.cost = [f32::MAX; BLOCK];
        self.next = [f32::MAX; BLOCK];
        self.likelihoods = [0.0; BLOCK];
    }

    /// Takes an order where it is cheaper than all before.
    #[inline(always)]
    fn try_order(&mut self, column: &Pixels, cost: &Pixels, likelihood: &Pixels) {
        for i in 0..BLOCK {
            let is_better = cost[i] < self.cost[i];
            let (low, high) =
                (select(is_better, cost[i], self.cost[i]), select(is_better, self.cost[i], cost[i]));
            self.next[i] = if high < self.next[i] { high } else { self.next[i] };
            self.cost[i] = low;
            self.column[i] = select(is_better, column[i], self.column[i]);
            self.likelihoods[i] += likelihood[i];
        }
    }
}

/// One of two numbers, by their bits. Of a choice between two places in memory the compiler would make a branch.
#[inline(always)]
fn select(is_first: bool, first: f32, second: f32) -> f32 {
    let mask = u32::from(is_first).wrapping_neg();
    f32::from_bits((first.to_bits() & mask) | (second.to_bits() & !mask))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_student_density_adds_up_to_one() {
        for freedom in 1..=2usize {
            // Along a radius: 2 dr in one dimension, 2 pi r dr in two.
            let area = |r: f64| if freedom == 1 { 2.0 } else { 2.0 * PI * r };
            let mut sum = 0.0;
            for i in 0..400_000 {
                let r = (f64::from(i) + 0.5) * 1e-3;
                let mut likelihood = [0.0; BLOCK];
                student(&[(r * r) as f32; BLOCK], freedom, &mut likelihood);
                sum += 1e-3 * area(r) * f64::from(likelihood[0]);
            }
            sum *= f64::from(student_constant(freedom));
            assert!((sum - 1.0).abs() < 1e-3, "{freedom} {sum}");
        }
    }
}
