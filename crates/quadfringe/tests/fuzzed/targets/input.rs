//! Numbers from bytes. An input that has run out gives zeros.

use ndarray::Array2;

/// Numbers at which code breaks: zeros, denormals, borders of types, no numbers at all.
const SPECIAL: [f64; 20] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN,
    f64::MIN_POSITIVE,
    5e-324,
    1e-40,
    1e-20,
    1e20,
    3.4e38,
    -3.4e38,
    2_147_483_648.0,
    1.8e19,
    1e-6,
];

/// The bytes that are left of an input.
pub struct Input<'a> {
    left: &'a [u8],
}

impl<'a> Input<'a> {
    pub fn new(left: &'a [u8]) -> Self {
        Self { left }
    }

    pub fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.left.split_first() else { return 0 };
        self.left = rest;
        *first
    }

    pub fn flag(&mut self) -> bool {
        self.byte() & 1 == 1
    }

    fn bytes<const COUNT: usize>(&mut self) -> [u8; COUNT] {
        std::array::from_fn(|_| self.byte())
    }

    pub fn word(&mut self) -> u32 {
        u32::from_le_bytes(self.bytes())
    }

    /// A number from 0 to `end - 1`.
    pub fn below(&mut self, end: usize) -> usize {
        usize::from(self.byte()) % end
    }

    /// One of these.
    pub fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }

    /// Any size, most often a small one.
    pub fn size(&mut self) -> usize {
        match self.below(8) {
            0 => usize::MAX,
            1 => self.word() as usize,
            2 => (self.word() % 100_000) as usize,
            _ => self.below(100),
        }
    }

    /// A number from `from` to `to`.
    pub fn within(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * f64::from(u16::from_le_bytes(self.bytes())) / 65535.0
    }

    /// Any number, also NaN and infinity.
    pub fn any(&mut self) -> f64 {
        match self.below(4) {
            0 => f64::from_le_bytes(self.bytes()),
            1 => f64::from(f32::from_le_bytes(self.bytes())),
            _ => self.one_of(&SPECIAL),
        }
    }

    /// A number from `from` to `to`, or one time in sixteen any number.
    pub fn near(&mut self, from: f64, to: f64) -> f64 {
        if self.byte() >= 240 { self.any() } else { self.within(from, to) }
    }

    /// [`Self::near`] for every place of an array.
    pub fn all_near<const COUNT: usize>(&mut self, from: f64, to: f64) -> [f64; COUNT] {
        std::array::from_fn(|_| self.near(from, to))
    }

    /// [`Self::all_near`] in single precision.
    pub fn singles_near<const COUNT: usize>(&mut self, from: f64, to: f64) -> [f32; COUNT] {
        self.all_near(from, to).map(|number| number as f32)
    }

    /// A map of numbers near `from` to `to`: a plane with ripples, noise or nothing more, and then some pixels or a
    /// block of any numbers.
    pub fn map(&mut self, shape: [usize; 2], from: f64, to: f64) -> Array2<f32> {
        let (level, slope_x, slope_y) = (self.near(from, to), self.within(-1.0, 1.0), self.within(-1.0, 1.0));
        let (period, noise) =
            (self.within(2.0, 40.0), self.within(0.0, 1.0) * f64::from(u8::from(self.flag())));
        let span = to - from;
        let mut seed = self.word() | 1;
        let mut map = Array2::from_shape_fn(shape, |(y, x)| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let random = f64::from(seed >> 8) / 16_777_216.0 - 0.5;
            let (x, y) = (x as f64, y as f64);
            let ripple = 0.25 * span * (std::f64::consts::TAU * (x + slope_y * y) / period).cos();
            (level + ripple + span * noise * random + 0.1 * span * (slope_x * x + slope_y * y)) as f32
        });
        self.spoil(&mut map);
        map
    }

    /// Replaces some pixels, or a block, by any numbers.
    pub fn spoil(&mut self, map: &mut Array2<f32>) {
        let (rows, columns) = map.dim();
        if rows == 0 || columns == 0 {
            return;
        }
        for _ in 0..self.below(4) {
            let (y, x, value) = (self.below(rows), self.below(columns), self.any() as f32);
            if self.byte() < 64 {
                let (height, width) = (self.below(rows - y), self.below(columns - x));
                map.slice_mut(ndarray::s![y..=y + height, x..=x + width]).fill(value);
            } else {
                map[[y, x]] = value;
            }
        }
    }
}
