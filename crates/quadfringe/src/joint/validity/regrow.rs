//! Step 8: region growing. Components grow back into doubtful pixels next to them (hysteresis; Canny, IEEE TPAMI 8, 679 (1986)).
//!
//! At an order jump one of the two sides is wrong, or a pixel sees both surfaces, and the exclusion removes a strip from each
//! side. Orders are chosen for cells, so a cell across the rim of a surface makes all of its pixels doubtful. A wrong side is
//! mostly a narrow strip, which is removed entirely. The remaining component takes back the pixels into which its phase continues
//! straight and whose intensities agree with this phase. Print that is finer than the windows of the photometry disagrees. So where the
//! cells of the energy around a pixel lie on one surface, which determines its phase, it is taken back whatever its residual, however
//! far the energy has moved it and at any distance, unless its light drops as at a shadow. Between two surfaces that meet, holes remain.

use crate::joint::cells::Grid;
use crate::joint::params::shadows::SHARE_MIN;
use crate::joint::params::tasks::GROUP;
use crate::joint::params::validity::{AMBIGUOUS_REACH, FACING_REACH, SAME_SURFACE_RAD};
use std::f32::consts::PI;

/// Mark of a pixel that was added to a component because its light agrees. The other pixels of a component have the mark 1.
pub(in crate::joint) const GROWN: u8 = 2;

/// What says that a pixel may be added to a component.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Consistent {
    #[default]
    No,
    /// Its intensities agree with its phase.
    ByLight,
    /// Its intensities do not, or the energy has moved it too far, but it lies on one surface with the cells of the energy around it.
    BySurface,
}

/// Maps that decide whether a pixel may be added.
#[derive(Clone, Copy)]
pub(super) struct Candidates<'a> {
    /// Linear light of R, G, B, IR.
    pub light: [&'a [f32]; 4],
    /// Absolute phase in rad.
    pub phase: &'a [f32],
    pub consistent: &'a [Consistent],
    /// 1 for pixels at an order jump.
    pub at_jump: &'a [u8],
}

/// Working lists of pixels, given by their index.
#[derive(Debug, Default)]
pub(super) struct Regrow {
    open: Vec<u32>,
    taken: Vec<u32>,
    /// Added pixels that lie at an order jump, or further away than exclusion reaches.
    far: Vec<u32>,
}

impl Regrow {
    /// Adds pixels to `valid` and to the `components`, which are a subset of it. A pixel is added if it is consistent, and the phase of
    /// two pixels of the component that lie in line with it continues straight into it. By its light alone it is added up to a cell (or
    /// the reach of exclusion) away from a component. Pixels at an order jump, or further away than exclusion reaches, are not added
    /// if another surface is valid nearby.
    pub fn run(&mut self, grid: &Grid, candidates: &Candidates<'_>, valid: &mut [u8], components: &mut [u8]) {
        let phase = candidates.phase;
        self.open_pixels(grid, candidates.consistent, valid);
        let Self { open, taken, far } = self;
        far.clear();
        for round in 0.. {
            if round == grid.step.max(AMBIGUOUS_REACH) {
                open.retain(|&at| candidates.consistent[at as usize] == Consistent::BySurface);
            }
            taken.clear();
            open.retain(|&at| {
                let continues = continues(grid, candidates, components, at as usize);
                if continues {
                    taken.push(at);
                }
                !continues
            });
            if taken.is_empty() {
                break;
            }
            for at in taken.iter().map(|&at| at as usize) {
                // The order of a pixel on one surface with the cells around is as certain as theirs.
                let mark = if candidates.consistent[at] == Consistent::ByLight { GROWN } else { 1 };
                (valid[at], components[at]) = (1, mark);
            }
            taken.retain(|&at| round >= AMBIGUOUS_REACH || candidates.at_jump[at as usize] != 0);
            far.append(taken);
        }
        far.retain(|&at| faces_another(grid, phase, valid, at as usize));
        for at in far.iter().map(|&at| at as usize) {
            (valid[at], components[at]) = (0, 0);
        }
    }

    /// Lists the consistent pixels that are not valid.
    fn open_pixels(&mut self, grid: &Grid, consistent: &[Consistent], valid: &[u8]) {
        self.open.clear();
        for y in 0..grid.height {
            let row = y * grid.stride..y * grid.stride + grid.width;
            let (consistent, valid) = (&consistent[row.clone()], &valid[row]);
            for (i, (consistent, valid)) in consistent.chunks(GROUP).zip(valid.chunks(GROUP)).enumerate() {
                let is_open = |x: &usize| (consistent[*x] != Consistent::No) & (valid[*x] == 0);
                // Most groups have no such pixel. A loop over the group without early exit compiles to vectors.
                if (0..consistent.len()).fold(false, |any, x| any | is_open(&x)) {
                    let first = y * grid.stride + i * GROUP;
                    self.open.extend((0..consistent.len()).filter(is_open).map(|x| (first + x) as u32));
                }
            }
        }
    }
}

/// Whether the phase of two pixels of a component continues straight into the pixel, in one of four directions. If the light of the
/// pixel does not agree with this phase, it must not be much less than that of the nearer one, as it would be in a shadow.
fn continues(grid: &Grid, candidates: &Candidates<'_>, components: &[u8], at: usize) -> bool {
    let Candidates { phase, light, consistent, .. } = candidates;
    let sum = |at: usize| light.iter().map(|plane| plane[at]).sum::<f32>();
    let least = if consistent[at] == Consistent::ByLight { 0.0 } else { SHARE_MIN };
    directions(grid, at, 2).any(|step| {
        let (near, far) = (at.wrapping_add_signed(step), at.wrapping_add_signed(2 * step));
        let straight = (2.0 * phase[near] - phase[far] - phase[at]).abs() < SAME_SURFACE_RAD;
        (components[near] != 0) & (components[far] != 0) & straight && sum(at) >= least * sum(near)
    })
}

/// Whether a pixel of another surface is valid nearby, in one of four directions.
fn faces_another(grid: &Grid, phase: &[f32], valid: &[u8], at: usize) -> bool {
    (1..=FACING_REACH).any(|count| {
        directions(grid, at, count).any(|step| {
            let other = at.wrapping_add_signed(count as isize * step);
            (valid[other] != 0) & ((phase[other] - phase[at]).abs() >= PI)
        })
    })
}

/// Index steps from a pixel to its four neighbours, for the directions in which the image continues for `count` pixels.
fn directions(grid: &Grid, at: usize, count: usize) -> impl Iterator<Item = isize> {
    let (y, x, down) = (at / grid.stride, at % grid.stride, grid.stride as isize);
    let left_or_up = [(x, -1), (y, -down)].map(|(before, step)| (before >= count, step));
    let right_or_down =
        [(grid.width - 1 - x, 1), (grid.height - 1 - y, down)].map(|(after, step)| (after >= count, step));
    left_or_up.into_iter().chain(right_or_down).filter_map(|(room, step)| room.then_some(step))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A surface with a step of 20 rad at column 16: its phase, the pixels at the jump, and the valid pixels, which exclude six
    /// columns around it.
    struct Step {
        grid: Grid,
        light: Vec<f32>,
        phase: Vec<f32>,
        at_jump: Vec<u8>,
        valid: Vec<u8>,
    }

    impl Step {
        fn new() -> Self {
            let grid = Grid::new([20, 32], 4.0);
            let phase =
                |x: usize, y: usize| 0.6 * x as f32 + 0.1 * y as f32 + if x >= 16 { 20.0 } else { 0.0 };
            let phase = (0..grid.pixels()).map(|i| phase(i % grid.stride, i / grid.stride)).collect();
            let columns = |from: usize, to: usize| {
                (0..grid.pixels()).map(move |i| u8::from((from..to).contains(&(i % grid.stride))))
            };
            let valid = columns(13, 19).map(|marked| 1 - marked).collect();
            let light = vec![0.5; grid.pixels()];
            Self { grid, light, phase, at_jump: columns(15, 17).collect(), valid }
        }

        fn place(&self, x: usize, y: usize) -> usize {
            y * self.grid.stride + x
        }

        /// Valid pixels after growing into the consistent pixels.
        fn grown(&self, consistent: &[Consistent]) -> Vec<u8> {
            let (mut valid, mut components) = (self.valid.clone(), self.valid.clone());
            let light = [self.light.as_slice(); 4];
            let candidates = Candidates { light, phase: &self.phase, consistent, at_jump: &self.at_jump };
            Regrow::default().run(&self.grid, &candidates, &mut valid, &mut components);
            assert!(
                valid.iter().zip(&components).all(|(valid, component)| *valid == u8::from(*component > 0))
            );
            valid
        }

        fn all(&self) -> Vec<Consistent> {
            vec![Consistent::ByLight; self.grid.pixels()]
        }
    }

    #[test]
    fn both_surfaces_grow_up_to_the_pixels_at_their_step() {
        let step = Step::new();
        for (i, valid) in step.grown(&step.all()).iter().enumerate() {
            assert_eq!(*valid == 0, (15..17).contains(&(i % step.grid.stride)), "{i}");
        }
    }

    #[test]
    fn further_than_exclusion_reaches_a_surface_stays_away_from_another() {
        let mut step = Step::new();
        step.at_jump.fill(0);
        let holes =
            |step: &Step, valid: &[u8]| (0..32).filter(|&x| valid[step.place(x, 5)] == 0).collect::<Vec<_>>();
        assert_eq!(holes(&step, &step.grown(&step.all())), [15, 16]);
        // Without a surface beyond the step.
        (0..step.grid.pixels()).filter(|i| i % step.grid.stride > 15).for_each(|i| step.valid[i] = 0);
        assert_eq!(holes(&step, &step.grown(&step.all())), (16..32).collect::<Vec<_>>());
    }

    #[test]
    fn inconsistent_pixels_and_bends_stay_holes() {
        let mut step = Step::new();
        let mut consistent = step.all();
        consistent[step.place(14, 7)] = Consistent::No;
        // Next to the step, the order of a narrow strip is too low by one, so that no pixel is valid near the other side. In the
        // lower rows the phase bends at column 13.
        for y in 0..20 {
            for x in 17..19 {
                let at = step.place(x, y);
                step.phase[at] -= std::f32::consts::TAU;
            }
            let at = step.place(13, y);
            step.phase[at] += if y < 10 { 0.0 } else { 3.0 };
        }
        let valid = step.grown(&consistent);
        let row = |y: usize| (13..19).filter(|&x| valid[step.place(x, y)] == 1).collect::<Vec<_>>();
        assert_eq!((row(3), row(7), row(15)), (vec![13, 14, 15], vec![13, 15], vec![]));
    }

    #[test]
    fn a_pixel_on_the_surface_is_added_but_for_one_in_a_shadow() {
        let mut step = Step::new();
        let mut consistent = step.all();
        // Print at columns 13 and 14 of one row, and a shadow there in another.
        for x in 13..15 {
            let [print, shadow] = [5, 9].map(|y| step.place(x, y));
            (consistent[print], consistent[shadow]) = (Consistent::BySurface, Consistent::BySurface);
            (step.light[print], step.light[shadow]) = (0.2, 0.1);
        }
        let valid = step.grown(&consistent);
        let row = |y: usize| (13..15).map(|x| valid[step.place(x, y)]).collect::<Vec<_>>();
        assert_eq!((row(5), row(9)), (vec![1, 1], vec![0, 0]));
        // A pixel whose light agrees with its phase is added however dark it is.
        (13..15).for_each(|x| consistent[step.place(x, 9)] = Consistent::ByLight);
        assert_eq!(step.grown(&consistent)[step.place(14, 9)], 1);
    }

    #[test]
    fn growth_by_light_alone_ends_after_a_cell_and_growth_by_the_surface_at_its_end() {
        let mut step = Step::new();
        step.at_jump.fill(0);
        step.valid = (0..step.grid.pixels()).map(|i| u8::from(i % step.grid.stride < 4)).collect();
        let length = |consistent: &[Consistent]| {
            let valid = step.grown(consistent);
            valid[step.place(0, 5)..][..32].iter().position(|&valid| valid == 0)
        };
        assert_eq!(length(&step.all()), Some(4 + step.grid.step));
        assert_eq!(length(&vec![Consistent::BySurface; step.grid.pixels()]), Some(16));
    }
}
