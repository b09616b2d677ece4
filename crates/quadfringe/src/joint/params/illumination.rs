//! Step 2: the mask of lit pixels and the noise of the intensities.

/// Half width of the neighbourhood that gives bottom and range of the light, in fringe periods. It must hold a whole fringe (0.5)
/// with a margin. Larger: bright neighbours hide dim surfaces. Varied: no effect, but 4 % more RMS near edges of dim steps at
/// x1.4.
pub const REACH: f32 = 0.75;

/// Least sum of the squared heights of the four channels above the bottom, in units of the range. R and B alone reach 2 x 0.146^2
/// = 0.043 on any lit surface, so half of that leaves a margin for noise. Larger: dim pixels are lost (varied x1.4: 0.2 points of
/// the textured face, 0.1 of dim steps). Smaller: pixels in shadow count as lit (x0.7: 0.1 points more returned, no more wrong
/// orders here; `cargo test --test round_trip` holds shadows).
pub const HEIGHT_MIN: f32 = 0.02;

/// Pixels that the noise of an image is estimated from, at most twice as many. The median of 16,000 values is certain to 1 %.
/// Varied: no effect, but 10 ppm fewer wrong orders of dim steps at x0.7.
pub const NOISE_SAMPLES: usize = 1 << 14;

/// One pixel in so many is looked at for the noise of a phase. An odd number visits all columns. Varied: no effect, but 4 % near
/// edges of dim steps at x0.7.
pub const NOISE_STRIDE: usize = 13;
