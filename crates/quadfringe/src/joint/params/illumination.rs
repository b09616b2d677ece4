//! Step 2: the mask of lit pixels and the noise of the intensities.

/// Half width of the neighbourhood in which bottom and range of the light are found, in fringe periods. It must contain a whole
/// fringe (0.5) with a margin. Larger: bright neighbours hide dim surfaces. Varied: no effect, but 4 % more RMS near edges of dim
/// steps at x1.4.
pub const REACH: f32 = 0.75;

/// Least sum of the squared heights of the four channels above the bottom, in units of the range. On any lit surface R and B
/// alone reach 2 x 0.146^2 = 0.043, so half of this value leaves a margin for noise. Larger: dim pixels are lost (varied x1.4:
/// 0.2 points of the textured face, 0.1 of dim steps). Smaller: pixels in shadow count as lit (x0.7: 0.1 points more returned, no
/// more wrong orders here; `cargo test --test round_trip` checks shadows).
pub const HEIGHT_MIN: f32 = 0.02;
/// Share of this limit that some pixel of a shadow, or within two pixels of it, must be below. Larger: noise makes holes where
/// all fringes are dark at once (1: a dotted column on a plane, 0.3 points less of painted faces, `python evaluation/world.py --half
/// tune`). Smaller: narrow shadows count as lit (0.5: 11 pixels in the shadows of steps, 0.6: none, `cargo test --test round_trip`).
pub const CORE_SHARE: f32 = 0.6;

/// Least modulation of R and B that counts as light, in standard deviations of the noise of a pixel: the window and the energy find
/// the phase of many pixels together, so single ones may be noisier than a fringe. Larger: dark surfaces are lost. Smaller: noise in
/// shadows counts as light (with 0.5, 6 instead of 5 % of what only one projector of a pair lights is no shadow). From 0.33 to 1
/// nothing else changes by more than 0.2 % of the pixels: `python evaluation/dark.py`, `pytest tests/test_pair_joint.py -rP`.
pub const MODULATION_NOISES: f32 = 0.67;
/// Least modulation that counts as light when there is no noise, and least difference of light, as a fraction of full scale. Follows from the
/// rounding of 8 bits, which hides half a step. Larger: dark surfaces of cameras with more bits are lost. Smaller: noise that is
/// clipped at black counts as light (with 0.001 a small object on black loses 9 % of its pixels): `pytest tests/test_real_objects.py -rP`.
pub const MODULATION_FLOOR: f32 = 0.5 / 255.0;

/// Number of pixels from which the noise of an image or of a phase is estimated; up to twice as many are used. The median of 16,000 values
/// is certain to 1 %. Varied: no effect, but 10 ppm fewer wrong orders of dim steps at x0.7.
pub const NOISE_SAMPLES: usize = 1 << 14;

/// Groups of pixels with similar light, in each of which the noise of a channel is estimated. More: each estimate is less certain
/// (5 % with 8 groups). Fewer: less of the difference between dark and bright pixels is seen. `python evaluation/captures.py`.
pub const NOISE_GROUPS: usize = 8;
/// Bounds of the variance of the noise of a group, relative to that of the whole red image. They matter where light is clipped, at
/// black or by the response. `python evaluation/captures.py`.
pub const NOISE_LIMITS: [f32; 2] = [0.25, 25.0];

/// The same for three colours of different fringe numbers, which come closer to their bottoms together: 36, 35 and 30 fringes have a
/// mean of 0.013 where red and blue are alike and green is 60 degrees off. Varied: 0.02 loses 1.1 % of a plane, in strips
/// (`python evaluation/rgb.py --only plane`).
pub const HEIGHT_MIN_ALONE: f32 = 0.008;
