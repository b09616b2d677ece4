//! Step 8: how well every number of turns explains the light of a part of a region, and how well every shift does (J38).

use super::sums::{ChannelSums, Sums};
use crate::joint::model::weights;
use crate::joint::params::regions::{GREEN_OFF_RAD, LEAD_MIN, OWN_LEAD_MIN, SHIFTS};
use std::f32::consts::{PI, TAU};

/// Scores parts of regions. A score is the negative logarithm of a likelihood, up to a constant.
#[derive(Debug)]
pub(super) struct Scorer {
    /// Fringe numbers divided by the first.
    ratios: [f32; 4],
    range_rad: [f32; 2],
    /// Variance of the light.
    variance: f32,
    /// Number of pixels that err together.
    shared: f32,
    /// Greatest number of turns that a region may lack.
    most: i32,
}

/// A number of turns that a part lacks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Choice {
    pub turns: f32,
    /// Evidence for it against all others; 0 if the part alone speaks for another.
    pub lead: f32,
}

/// Scores of parts with their numbers of turns, and for further shifts of G and of IR.
#[derive(Debug)]
pub(super) struct Shifts {
    chosen: f32,
    further: [[f32; SHIFTS]; 2],
}

impl Default for Shifts {
    fn default() -> Self {
        Self { chosen: 0.0, further: [[0.0; SHIFTS]; 2] }
    }
}

/// Evidence against an order.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Contradiction {
    /// For further shifts of G and IR.
    pub whole: f32,
    /// For shifts beyond those that crosstalk and chips a few pixels apart explain, which cost no order.
    pub of_order: f32,
}

impl Scorer {
    /// `shared` is the number of pixels that err together.
    pub fn new(ratios: [f32; 4], range_rad: [f32; 2], noise: f32, shared: f32) -> Self {
        let most = ((range_rad[1] - range_rad[0]) / TAU).ceil() as i32;
        Self { ratios, range_rad, variance: noise * noise, shared, most }
    }

    /// Makes `sum` the scores of no light.
    pub fn start(&self, sum: &mut Vec<f32>) {
        sum.clear();
        sum.resize(self.turns(), 0.0);
    }

    /// Adds the scores of a part for all numbers of turns.
    pub fn add(&self, scores: &[f32], sum: &mut [f32]) {
        sum.iter_mut().zip(scores).for_each(|(sum, score)| *sum += score);
    }

    /// Appends the scores of a part with this phase: of every number of turns from the least one up, then of every shift of G, then of
    /// IR.
    pub fn append(&self, sums: &Sums, phase: f32, out: &mut Vec<f32>) {
        let fits = sums.channels.each_ref().map(|channel| Fit::new(channel, sums));
        let present = [1, 3].map(|channel| weights(self.ratios)[channel]);
        let score = |channel: usize, shift: f32| {
            let residual = fits[channel].residual(shift) + self.variance;
            0.5 * sums.weight / self.shared * present[channel] * residual.max(f32::MIN_POSITIVE).ln()
        };
        out.extend((0..self.turns()).map(|k| {
            let turns = self.turns_of(k);
            let [green, infrared] = self.shift(turns);
            if self.in_range(turns, phase) { score(0, green) + score(1, infrared) } else { 0.0 }
        }));
        out.extend(
            [0, 1]
                .into_iter()
                .flat_map(|channel| (0..SHIFTS).map(move |i| (channel, i)))
                .map(|(channel, i)| score(channel, SHIFT * i as f32)),
        );
    }

    /// Chooses the number of turns of a part with this phase by the sum of the scores around it; `own` are those of the part.
    pub fn choose(&self, sum: &[f32], own: &[f32], phase: f32) -> Choice {
        let none = self.most as usize;
        let best = self.others(none, phase).min_by(|&a, &b| sum[a].total_cmp(&sum[b])).unwrap_or(none);
        let chosen = if sum[none] - sum[best] > LEAD_MIN { best } else { none };
        let lead = |scores: &[f32]| {
            let others = self.others(chosen, phase).map(|k| scores[k]).reduce(f32::min);
            others.map_or(0.0, |other| other - scores[chosen])
        };
        // Where two surfaces are connected by a gentle slope, the parts around speak for the larger one.
        Choice { turns: self.turns_of(chosen), lead: if lead(own) > OWN_LEAD_MIN { lead(sum) } else { 0.0 } }
    }

    /// Adds the scores of a part that lacks so many turns.
    pub fn add_shifts(&self, scores: &[f32], turns: f32, out: &mut Shifts) {
        let (by_turns, by_shift) = scores.split_at(self.turns());
        out.chosen += by_turns[(turns as i32 + self.most) as usize];
        let channels = by_shift.chunks(SHIFTS).zip(self.shift(turns));
        for (out, (scores, shift)) in out.further.iter_mut().zip(channels) {
            let first = (shift / SHIFT).round().rem_euclid(SHIFTS as f32) as usize;
            out.iter_mut().enumerate().for_each(|(i, out)| *out += scores[(first + i) % SHIFTS]);
        }
    }

    /// The evidence for further shifts of G and IR. None with two phases, where every shift is one of an order.
    pub fn contradiction(&self, shifts: &Shifts) -> Contradiction {
        if self.ratios[3] == 0.0 {
            return Contradiction::default();
        }
        let least = |scores: &[f32]| scores.iter().copied().fold(f32::INFINITY, f32::min);
        let near = |scores: &[f32], most: f32| {
            let most = (most / SHIFT) as usize;
            least(&scores[..=most]).min(least(&scores[SHIFTS - most..]))
        };
        let [green, infrared] = &shifts.further;
        let half_order = PI * (1.0 - self.ratios[3]).abs();
        let of_order = [(green, GREEN_OFF_RAD), (infrared, half_order)];
        Contradiction {
            whole: (shifts.chosen - least(green) - least(infrared)).max(0.0),
            of_order: of_order.into_iter().map(|(scores, most)| near(scores, most) - least(scores)).sum(),
        }
    }

    /// The shifts of G and IR in rad for a number of turns.
    fn shift(&self, turns: f32) -> [f32; 2] {
        [1, 3].map(|channel| TAU * turns * self.ratios[channel])
    }

    /// All numbers of turns but one that keep the phase in the range of the projector.
    fn others(&self, but: usize, phase: f32) -> impl Iterator<Item = usize> {
        (0..self.turns()).filter(move |&k| k != but && self.in_range(self.turns_of(k), phase))
    }

    fn turns(&self) -> usize {
        2 * self.most as usize + 1
    }

    fn turns_of(&self, k: usize) -> f32 {
        (k as i32 - self.most) as f32
    }

    fn in_range(&self, turns: f32, phase: f32) -> bool {
        let phase = phase + TAU * turns;
        phase > self.range_rad[0] - PI && phase < self.range_rad[1] + PI
    }
}

/// One shift in rad.
const SHIFT: f32 = TAU / SHIFTS as f32;

/// Second moments of the carrier and the light of one channel, per pixel, without what the brightness explains.
struct Fit {
    cosine_cosine: f64,
    cosine_sine: f64,
    sine_sine: f64,
    cosine_light: f64,
    sine_light: f64,
    light_light: f64,
}

impl Fit {
    fn new(sums: &ChannelSums, part: &Sums) -> Self {
        let share = 1.0 / f64::from(part.weight).max(1.0);
        // Sums over the root of the squared brightness, so that their products are what the brightness explains.
        let root = (share / part.bright_bright.max(f64::MIN_POSITIVE)).sqrt();
        let [c, s, l] = [sums.bright_cosine, sums.bright_sine, sums.bright_light].map(|sum| sum * root);
        Self {
            cosine_cosine: sums.cosine_cosine * share - c * c,
            cosine_sine: sums.cosine_sine * share - c * s,
            sine_sine: sums.sine_sine * share - s * s,
            cosine_light: sums.cosine_light * share - c * l,
            sine_light: sums.sine_light * share - s * l,
            light_light: sums.light_light * share - l * l,
        }
    }

    /// Mean squared residual of the best offset and amplitude for a shift of the phase; an amplitude is not negative.
    fn residual(&self, shift: f32) -> f32 {
        let (sine, cosine) = f64::from(shift).sin_cos();
        let along = (cosine * self.cosine_light - sine * self.sine_light).max(0.0);
        let square = cosine * cosine * self.cosine_cosine - 2.0 * cosine * sine * self.cosine_sine
            + sine * sine * self.sine_sine;
        let explained = if square > 1e-9 { along * along / square } else { 0.0 };
        (self.light_light - explained).max(0.0) as f32
    }
}
