//! Conditioning row by row, with what can be computed beforehand.

use super::{Conditioner, Response, Sample, Shot};
use crate::Result;

/// Fraction of full scale from which on an intensity counts as saturated.
const CLIPPED: f32 = 0.998;

/// A conditioner made ready for one type of sample.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    dark: [f32; 4],
    response: [Response; 4],
    unmix: Option<[[f32; 4]; 4]>,
    registration: Option<[[f64; 3]; 2]>,
    tables: [Vec<f32>; 4],
    tables_for: Option<(usize, f32)>,
}

impl Plan {
    /// `conditioner` must have been checked.
    pub fn new(conditioner: &Conditioner) -> Result<Self> {
        let identity = Conditioner::default();
        Ok(Self {
            dark: conditioner.dark,
            response: conditioner.response,
            unmix: (conditioner.crosstalk != identity.crosstalk)
                .then(|| conditioner.crosstalk_inverse())
                .transpose()?,
            registration: (conditioner.ir_registration != identity.ir_registration)
                .then_some(conditioner.ir_registration),
            tables: std::array::from_fn(|_| Vec::new()),
            tables_for: None,
        })
    }

    /// Fill the look-up tables when the type or the full scale has changed since the last shot.
    pub fn prepare<T: Sample>(&mut self, full_scale: f32) {
        if self.tables_for == Some((T::LEVELS, full_scale)) {
            return;
        }
        for c in 0..4 {
            let linear = |level: usize| self.linear(c, level as f32 * (1.0 / full_scale));
            self.tables[c] = (0..T::LEVELS).map(linear).collect();
        }
        self.tables_for = Some((T::LEVELS, full_scale));
    }

    fn linear(&self, c: usize, fraction: f32) -> f32 {
        self.response[c].linear(fraction - self.dark[c])
    }

    #[inline(always)]
    fn values<T: Sample>(&self, c: usize, row: &[T], full_scale: f32, out: &mut [f32]) {
        let (table, scale) = (&self.tables[c][..T::LEVELS], 1.0 / full_scale);
        let pixels = out.iter_mut().zip(row);
        if self.response[c] == Response::default() {
            // Arithmetic runs on vectors, which a table does not.
            let dark = self.dark[c];
            return pixels.for_each(|(value, raw)| *value = raw.intensity() * scale - dark);
        }
        for (value, &raw) in pixels {
            *value = match raw.level() {
                Some(level) => table[level],
                None => self.linear(c, raw.intensity() * scale),
            };
        }
    }

    fn value<T: Sample>(&self, c: usize, raw: T, full_scale: f32) -> f32 {
        match raw.level() {
            Some(level) => self.tables[c][level],
            None => self.linear(c, raw.intensity() * (1.0 / full_scale)),
        }
    }

    /// One row of the shot as four rows of linear light.
    #[inline(always)]
    pub fn row<T: Sample>(&self, shot: &Shot<'_, T>, y: usize, out: &mut [&mut [f32]; 4]) {
        for (c, target) in out.iter_mut().enumerate() {
            if c == 3 && self.registration.is_some() {
                continue;
            }
            let row = shot.planes[c].row(y);
            match row.as_slice() {
                // Contiguous rows need no look at strides, pixel by pixel.
                Some(row) => self.values(c, row, shot.full_scale, target),
                None => self.values(c, &row.to_vec(), shot.full_scale, target),
            }
        }
        if let Some(map) = &self.registration {
            self.registered_row(shot, map, y, out[3]);
        }
        if let Some(unmix) = &self.unmix {
            unmix_row(unmix, out);
        }
    }

    /// Which pixels of a row are saturated in no channel, and which are glare: saturated in R and in B, which on a lit
    /// surface, a quarter period apart, are never both at the crest of their fringes.
    pub fn saturation_row<T: Sample>(
        &self,
        shot: &Shot<'_, T>,
        y: usize,
        unsaturated: &mut [bool],
        glare: &mut [bool],
    ) {
        let limit = CLIPPED * shot.full_scale;
        let rows = shot.planes.each_ref().map(|plane| plane.row(y));
        for x in 0..unsaturated.len() {
            let [red, green, blue, infrared] = rows.each_ref().map(|row| row[x].intensity() >= limit);
            unsaturated[x] = !(red || green || blue || infrared);
            glare[x] = red && blue;
        }
    }

    /// Infrared light at the visible pixels; no data outside the infrared chip.
    fn registered_row<T: Sample>(&self, shot: &Shot<'_, T>, map: &[[f64; 3]; 2], y: usize, out: &mut [f32]) {
        let plane = &shot.planes[3];
        let (rows, columns) = plane.dim();
        for (x, value) in out.iter_mut().enumerate() {
            let at = map.map(|m| m[0] * x as f64 + m[1] * y as f64 + m[2]);
            let inside =
                at[0] >= 0.0 && at[1] >= 0.0 && at[0] <= (columns - 1) as f64 && at[1] <= (rows - 1) as f64;
            *value = f32::NAN;
            if inside {
                let (x0, y0) = (at[0] as usize, at[1] as usize);
                let (x1, y1) = ((x0 + 1).min(columns - 1), (y0 + 1).min(rows - 1));
                let (fx, fy) = ((at[0] - x0 as f64) as f32, (at[1] - y0 as f64) as f32);
                let tap = |r: usize, c: usize| self.value(3, plane[[r, c]], shot.full_scale);
                let top = tap(y0, x0) * (1.0 - fx) + tap(y0, x1) * fx;
                let bottom = tap(y1, x0) * (1.0 - fx) + tap(y1, x1) * fx;
                *value = top * (1.0 - fy) + bottom * fy;
            }
        }
    }
}

fn unmix_row(unmix: &[[f32; 4]; 4], rows: &mut [&mut [f32]; 4]) {
    for x in 0..rows[0].len() {
        let seen = [rows[0][x], rows[1][x], rows[2][x], rows[3][x]];
        for (row, weights) in rows.iter_mut().zip(unmix) {
            row[x] = weights.iter().zip(seen).map(|(w, s)| w * s).sum();
        }
    }
}
