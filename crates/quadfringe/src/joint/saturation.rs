//! Step 6, saturated light. A saturated sample says that there is at least so much light. Once a phase is known, the model (S1)
//! says how much: the albedo follows from the other channels of the pixel.
//!
//! A decoding with the light as it was captured bends the phase, because the crests of the fringes are cut off. So steps 2 to 6
//! are repeated with the restored light, as expectation and maximisation alternate for censored data.

use super::cells::RowMaps;
use super::infrared::{Waves, with_waves};
use super::model::{FringeRows, count};
use super::params::saturation::{
    BRIGHT_MIN, CHANNEL_SHARE_MAX, CHANNELS_MIN, GAIN, RESTORED_MAX, SHARE_MIN, TILE_PX,
};
use super::photometry::Photometry;
use super::pyramid::Level;
use super::scene::{PhaseMap, ScaledGrid, Scene};
use crate::Reason;
use crate::condition::Saturated;
use crate::parallel::lanes::LANES;
use rayon::prelude::*;

/// The saturated samples of a shot, and its light as it was captured.
#[derive(Debug, Default)]
pub(super) struct Saturation {
    /// The saturated channels of every pixel, in padded rows.
    pub saturated: Vec<Saturated>,
    captured: [Vec<f32>; 4],
    /// Whether the shot has enough saturated samples to be restored.
    pub restores: bool,
    /// Phase before the last round, and then by how much this round has changed it, in rad; empty without a restoration.
    moved: Vec<f32>,
}

impl Saturation {
    /// Decides whether a shot is restored: whether somewhere many pixels side by side have a saturated channel and others that are
    /// not, and no channel is saturated in nearly all bright pixels.
    pub fn judge(&mut self, light: &[Vec<f32>; 4], stride: usize, ratios: [f32; 4]) {
        let bands = self.saturated.par_chunks(TILE_PX * stride);
        let cut =
            bands.any(|band| (0..stride).step_by(TILE_PX).any(|left| is_cut(band, stride, left, ratios)));
        self.restores = cut && !self.is_blind(light);
        self.moved.clear();
    }

    /// Whether a channel is saturated in nearly all bright pixels.
    fn is_blind(&self, light: &[Vec<f32>; 4]) -> bool {
        let [red, green, blue, infrared] = light.each_ref().map(|plane| plane.par_iter());
        let pixels = red.zip(green).zip(blue.zip(infrared)).zip(&self.saturated);
        // Bright pixels, and those of them whose R, G, B, IR is saturated.
        let [bright, by_channel @ ..]: [u64; 5] = pixels
            .filter(|(((red, green), (blue, infrared)), _)| {
                red.max(**green).max(**blue).max(**infrared) > BRIGHT_MIN
            })
            .map(|(_, saturated)| {
                let [red, green, blue, infrared] = [0, 1, 2, 3].map(|c| u64::from(saturated.has(c)));
                [1, red, green, blue, infrared]
            })
            .reduce(|| [0; 5], |sums, more| std::array::from_fn(|k| sums[k] + more[k]));
        by_channel.iter().any(|&saturated| saturated as f64 > CHANNEL_SHARE_MAX * bright as f64)
    }

    /// Writes the masks with which steps 2 to 6 begin, and the reasons why pixels take no part. What other steps have found is
    /// forgotten, except which pixels the infrared chip does not see. Few saturated pixels are left out, and what is saturated
    /// in both R and B is glare, because fringes cannot do this; if there are many, what is left of them takes part.
    pub fn write_masks(
        &self,
        [height, width]: [usize; 2],
        ratios: [f32; 4],
        level: &mut Level,
        reasons: &mut [Reason],
    ) {
        let (stride, channels) = (level.lit.len() / height, count(ratios));
        let masks = level.lit.par_chunks_mut(stride).zip(level.usable.par_chunks_mut(stride));
        let rows = masks.zip(reasons.par_chunks_mut(stride).zip(self.saturated.par_chunks(stride)));
        rows.for_each(|((lit, usable), (reasons, saturated))| {
            let masks = lit[..width].iter_mut().zip(&mut usable[..width]);
            for ((lit, usable), (reason, saturated)) in masks.zip(reasons.iter_mut().zip(saturated)) {
                let seen = *reason != Reason::NoImage;
                let good = channels - saturated.count() as f32;
                let [most, least] =
                    if self.restores { [0.0, CHANNELS_MIN] } else { [channels - 1.0, channels] };
                let glare = !self.restores & saturated.has(0) & saturated.has(2);
                *lit = if seen & !glare { 1.0 } else { 0.0 };
                *usable = if seen & (good > most) { 1.0 } else { 0.0 };
                let told = if good >= least { Reason::Returned } else { Reason::Saturated };
                *reason = if seen { told } else { Reason::NoImage };
            }
        });
    }

    /// Removes from `valid` the pixels of a restored shot that are saturated in all channels, which windows reach into.
    pub fn invalidate(&self, ratios: [f32; 4], valid: &mut [u8]) {
        if self.restores {
            let pixels = valid.par_iter_mut().zip(&self.saturated);
            let all = count(ratios) as u32;
            pixels.for_each(|(valid, saturated)| *valid *= u8::from(saturated.count() < all));
        }
    }

    /// Keeps the light of the level, as it was captured.
    pub fn begin(&mut self, level: &Level) {
        for (kept, light) in self.captured.iter_mut().zip(&level.light) {
            kept.clone_from(light);
        }
    }

    /// Keeps the phase before the last round.
    pub fn keep(&mut self, phase: &[f32]) {
        self.moved.extend_from_slice(phase);
    }

    /// Compares the phase after the last round with the one before. The rounds approach the phase by about a half each, so the
    /// last change is also what is still missing.
    pub fn compare(&mut self, phase: &[f32]) {
        self.moved.par_iter_mut().zip(phase).for_each(|(moved, phase)| *moved -= phase);
    }

    /// Widens the standard deviations of row `y`: a restored sample says nothing new about its pixel, and the rounds end before
    /// nothing changes any more.
    pub fn widen(&self, scene: &Scene<'_>, y: usize, ratios: [f32; 4], deviations: &mut [f32]) {
        if self.moved.is_empty() {
            return;
        }
        let (channels, moved) = (count(ratios), scene.row(&self.moved, y));
        let pixels = scene.row(&self.saturated, y).iter().zip(moved);
        for (deviation, (saturated, moved)) in deviations.iter_mut().zip(pixels) {
            let good = (channels - saturated.count() as f32).max(1.0);
            *deviation = (*deviation * *deviation * channels / good + moved * moved).sqrt();
        }
    }

    /// Moves the light of saturated samples towards what the model says, but never below what was captured.
    pub fn restore(
        &self,
        level: &mut Level,
        scaled: ScaledGrid<'_>,
        ratios: [f32; 4],
        photometry: &Photometry,
        map: PhaseMap<'_>,
    ) {
        let (Level { light, pair, .. }, ScaledGrid { grid, period_px, factor }) = (level, scaled);
        let captured = self.captured.each_ref().map(Vec::as_slice);
        let scene = Scene { light: captured, usable: &[], grid, period_px, factor, pair: pair.as_ref() };
        let [red, green, blue, infrared] = light.each_mut().map(|plane| plane.par_chunks_mut(grid.stride));
        let rows = red.zip(green).zip(blue.zip(infrared)).enumerate();
        rows.for_each_init(RowMaps::default, |maps, (y, ((red, green), (blue, infrared)))| {
            let row = Row {
                fringes: photometry.sample(&scene, y, maps),
                saturated: scene.row(&self.saturated, y),
                phase: scene.row(map.phase, y),
                captured: scene.rows(y),
            };
            with_waves!(scene, y, ratios, |waves| row.restore(waves, [red, green, blue, infrared]));
        });
    }
}

/// Whether many pixels of a tile have a saturated channel and enough others: the tile of a band of rows at column `left`.
fn is_cut(band: &[Saturated], stride: usize, left: usize, ratios: [f32; 4]) -> bool {
    let restorable = |saturated: &&Saturated| {
        (saturated.count() > 0) & (count(ratios) - saturated.count() as f32 >= CHANNELS_MIN)
    };
    let pixels = band.chunks(stride).flat_map(|row| &row[left..(left + TILE_PX).min(stride)]);
    pixels.filter(restorable).count() as f64 > SHARE_MIN * (TILE_PX * TILE_PX) as f64
}

/// What is known of a row of pixels.
struct Row<'a> {
    fringes: FringeRows<'a>,
    saturated: &'a [Saturated],
    phase: &'a [f32],
    captured: [&'a [f32]; 4],
}

impl Row<'_> {
    fn restore<W: Waves>(&self, waves: W, light: [&mut [f32]; 4]) {
        let marked = self.saturated.iter().enumerate().filter(|(_, saturated)| saturated.count() > 0);
        for (x, saturated) in marked {
            let carriers = waves.carriers(&waves.vector(x / LANES), x % LANES, self.phase[x]);
            let FringeRows { offset, amplitude } = &self.fringes;
            let model: [f32; 4] =
                std::array::from_fn(|c| offset[c][x] + amplitude[c][x] * carriers.cosine[c]);
            let (mut seen, mut square) = (0.0f32, 1e-9f32);
            for c in (0..4).filter(|&c| !saturated.has(c)) {
                seen += model[c] * self.captured[c][x];
                square += model[c] * model[c];
            }
            for c in (0..4).filter(|&c| saturated.has(c)) {
                let expected = (seen / square * model[c]).min(RESTORED_MAX * self.captured[c][x]);
                let restored = light[c][x] + GAIN * (expected - light[c][x]);
                light[c][x] = restored.max(self.captured[c][x]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATIOS: [f32; 4] = [1.0, 35.0 / 36.0, 1.0, 30.0 / 36.0];
    const WIDTH: usize = 64;

    /// A row of fringes in linear light: half of it offset, half amplitude.
    fn light(phase: &[f32], albedo: f32) -> [Vec<f32>; 4] {
        let wave = |c: usize, phase: f32| match c {
            2 => -phase.sin(),
            _ => (RATIOS[c] * phase).cos(),
        };
        std::array::from_fn(|c| phase.iter().map(|phase| albedo * (0.5 + 0.5 * wave(c, *phase))).collect())
    }

    #[test]
    fn cut_light_is_restored_from_the_other_channels() {
        let phase: Vec<f32> = (0..WIDTH).map(|x| 0.2 * x as f32).collect();
        let whole = light(&phase, 1.2);
        let cut = whole.each_ref().map(|row| row.iter().map(|light| light.min(1.0)).collect::<Vec<_>>());
        let saturated: Vec<_> =
            (0..WIDTH).map(|x| Saturated::new([0, 1, 2, 3].map(|c| whole[c][x] >= 1.0))).collect();
        assert!(saturated.iter().map(|saturated| saturated.count()).sum::<u32>() > 40);
        let half = vec![0.5; WIDTH];
        let row = Row {
            fringes: FringeRows { offset: [&half; 4], amplitude: [&half; 4] },
            saturated: &saturated,
            phase: &phase,
            captured: cut.each_ref().map(Vec::as_slice),
        };
        let mut restored = cut.clone();
        for _ in 0..8 {
            let waves = crate::joint::infrared::Coaxial { ratios: RATIOS };
            row.restore(waves, restored.each_mut().map(Vec::as_mut_slice));
        }
        for (x, saturated) in saturated.iter().enumerate().filter(|(_, saturated)| saturated.count() < 4) {
            for c in 0..4 {
                let error = (restored[c][x] - whole[c][x]).abs();
                assert!(error < 1e-2, "{c} at {x}, {saturated:?}: {error}");
            }
        }
    }

    /// Pixels with 0 to 4 saturated channels, then one that the infrared chip does not see; two of padding.
    fn masks(restores: bool) -> (Level, Vec<Reason>) {
        let marks = [0, 1, 2, 3, 4].map(|count| Saturated::new([0, 1, 2, 3].map(|c| c < count)));
        let saturated = [marks.to_vec(), vec![Saturated::default(); 3]].concat();
        let saturation = Saturation { saturated, restores, ..Default::default() };
        let mut level = Level::default();
        level.resize(8);
        let mut reasons = vec![Reason::Shadow; 8];
        reasons[5] = Reason::NoImage;
        saturation.write_masks([1, 6], RATIOS, &mut level, &mut reasons);
        (level, reasons)
    }

    #[test]
    fn masks_and_reasons_follow_from_the_number_of_saturated_channels() {
        let (yes, no, unseen) = (Reason::Returned, Reason::Saturated, Reason::NoImage);
        let (level, reasons) = masks(true);
        assert_eq!(level.lit, [1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        assert_eq!(level.usable, [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(reasons[..6], [yes, yes, yes, no, no, unseen]);
        // The third pixel is saturated in R and G, the fourth in R, G and B.
        let (level, reasons) = masks(false);
        assert_eq!(level.lit, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(level.usable, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(reasons[..6], [yes, no, no, no, no, unseen]);
    }

    /// Whether a shot of 64 x 64 pixels is restored in which the pixels `[x, y]` that `is` selects have saturated `channels`.
    fn restores(channels: [bool; 4], is: fn([usize; 2]) -> bool) -> bool {
        let marked = |i: usize| is([i % WIDTH, i / WIDTH]);
        let saturated =
            (0..WIDTH * WIDTH).map(|i| Saturated::new(channels.map(|channel| channel & marked(i))));
        let mut saturation = Saturation { saturated: saturated.collect(), ..Default::default() };
        saturation.judge(&[(); 4].map(|()| vec![0.5; WIDTH * WIDTH]), WIDTH, RATIOS);
        saturation.restores
    }

    #[test]
    fn highlights_are_restored_but_not_what_noise_saturates() {
        let red = [true, false, false, false];
        assert!(restores(red, |[x, y]| x < 20 && y < 20));
        // As many pixels all over the shot.
        assert!(!restores(red, |[x, y]| (7 * x + 3 * y) % 10 == 0));
        // Glare in all channels tells nothing, and a channel without fringes cannot be restored.
        assert!(!restores([true; 4], |[x, y]| x < 20 && y < 20));
        assert!(!restores(red, |_| true));
    }
}
