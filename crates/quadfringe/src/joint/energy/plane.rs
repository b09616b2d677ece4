//! Planes of a tile: a square of cells with a rim of zeros, so that no stencil needs to know the border.

use crate::joint::params::energy::SIDE;
use crate::parallel::lanes::{LANES, Lanes};

/// Rows of zeros above and below the cells of a tile: the reach of the stencils.
const RIM: usize = 2;
/// Zeros before the cells of a row; they also follow the cells of the row above. A whole vector, so that no vector of cells lies
/// across two cache lines.
const GAP: usize = LANES;
/// Vectors of cells in a row.
pub(super) const VECTORS: usize = SIDE / LANES;
/// Length of a row of a plane.
pub(super) const STRIDE: usize = SIDE + GAP;
/// Number of values of a plane.
const LEN: usize = (SIDE + 2 * RIM) * STRIDE + GAP;

/// One value for every cell of a tile. The length is a constant, so that a vector costs one comparison with its bounds.
#[derive(Debug)]
pub(super) struct Plane(Box<Values>);

/// The values of a plane, from the start of a cache line.
#[derive(Debug)]
#[repr(align(64))]
struct Values([f32; LEN]);

impl Default for Plane {
    fn default() -> Self {
        Self(Box::new(Values([0.0; LEN])))
    }
}

/// Position of the cell (x, y) in a plane.
#[inline(always)]
pub(super) fn place(x: usize, y: usize) -> usize {
    (y + RIM) * STRIDE + x + GAP
}

/// Positions of the vectors of cells of row `y`. In nested loops over rows and these vectors, the compiler can leave out most
/// comparisons with the bounds.
#[inline(always)]
pub(super) fn row(y: usize) -> impl Iterator<Item = usize> {
    (0..VECTORS).map(move |i| place(i * LANES, y))
}

/// Positions of all vectors of cells, row by row.
#[inline(always)]
pub(super) fn vectors() -> impl Iterator<Item = usize> {
    (0..SIDE).flat_map(row)
}

impl Plane {
    /// The vector from a position on, by value.
    #[inline(always)]
    pub fn get(&self, at: usize) -> Lanes {
        *self.0.0[at..].first_chunk().expect("a vector lies inside its plane")
    }

    #[inline(always)]
    pub fn set(&mut self, at: usize, values: Lanes) {
        *self.0.0[at..].first_chunk_mut().expect("a vector lies inside its plane") = values;
    }

    pub fn copy(&mut self, from: &Self) {
        self.0.0.copy_from_slice(&from.0.0);
    }

    pub fn clear(&mut self) {
        self.0.0.fill(0.0);
    }

    /// The cells of row `y`.
    pub fn row(&self, y: usize) -> &[f32] {
        &self.0.0[place(0, y)..][..SIDE]
    }

    /// The cells of row `y`, to be changed.
    pub fn row_mut(&mut self, y: usize) -> &mut [f32] {
        &mut self.0.0[place(0, y)..][..SIDE]
    }
}

/// The vector from a position on, in four planes.
#[inline(always)]
pub(super) fn four(planes: &[Plane; 4], at: usize) -> [Lanes; 4] {
    [planes[0].get(at), planes[1].get(at), planes[2].get(at), planes[3].get(at)]
}

/// Sum of the values of a vector in double precision.
#[inline(always)]
pub(super) fn total(values: Lanes) -> f64 {
    let mut halves = values;
    let mut half = LANES / 2;
    while half > 0 {
        for x in 0..half {
            halves[x] += halves[x + half];
        }
        half /= 2;
    }
    f64::from(halves[0])
}

/// One value for each unknown of a cell.
#[derive(Debug, Default)]
pub(super) struct Fields {
    pub phase: Plane,
    /// Logarithm of the albedo of R, G, B, IR.
    pub albedo: [Plane; 4],
    /// Logarithm of the contrast of the light.
    pub contrast: Plane,
}

impl Fields {
    /// Makes all values 0.
    pub fn clear(&mut self) {
        self.planes_mut().into_iter().for_each(Plane::clear);
    }

    /// The six planes.
    pub fn planes_mut(&mut self) -> [&mut Plane; 6] {
        let [red, green, blue, infrared] = &mut self.albedo;
        [&mut self.phase, red, green, blue, infrared, &mut self.contrast]
    }

    /// The six planes.
    pub fn planes(&self) -> [&Plane; 6] {
        let [red, green, blue, infrared] = &self.albedo;
        [&self.phase, red, green, blue, infrared, &self.contrast]
    }
}

/// The unknowns of a vector of cells.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Column {
    pub phase: Lanes,
    pub albedo: [Lanes; 4],
    pub contrast: Lanes,
}

impl Column {
    #[inline(always)]
    pub fn of(fields: &Fields, at: usize) -> Self {
        let Fields { phase, albedo, contrast } = fields;
        Self { phase: phase.get(at), albedo: four(albedo, at), contrast: contrast.get(at) }
    }

    #[inline(always)]
    pub fn write(&self, fields: &mut Fields, at: usize) {
        fields.phase.set(at, self.phase);
        fields.contrast.set(at, self.contrast);
        for (plane, values) in fields.albedo.iter_mut().zip(self.albedo) {
            plane.set(at, values);
        }
    }

    /// Scalar product in every cell.
    #[inline(always)]
    pub fn times(&self, other: &Self) -> Lanes {
        let mut out = [0.0; LANES];
        for x in 0..LANES {
            out[x] = self.phase[x] * other.phase[x] + self.contrast[x] * other.contrast[x];
        }
        for c in 0..4 {
            for x in 0..LANES {
                out[x] += self.albedo[c][x] * other.albedo[c][x];
            }
        }
        out
    }
}

/// Derivatives of the intensities of R, G, B, IR with respect to the unknowns of their cell, in linear light.
#[derive(Debug, Default)]
pub(super) struct Derivatives {
    pub phase: [Plane; 4],
    pub albedo: [Plane; 4],
    pub contrast: [Plane; 4],
}

/// Weights of the squared differences between neighbours; 0 where a stencil leaves the lit cells.
#[derive(Debug, Default)]
pub(super) struct Weights {
    /// Second differences of the phase along x, along y, and mixed.
    pub bend: [Plane; 3],
    /// First differences along x and y of the mean logarithm of the four albedos.
    pub brightness: [Plane; 2],
    /// First differences along x and y of the four logarithms less their mean.
    pub colour: [Plane; 2],
    /// First differences along x and y of the contrast.
    pub contrast: [Plane; 2],
}
