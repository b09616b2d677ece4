//! Step 8: validity. `quadfringe demo` prints both sides of the price of each limit: wrong and returned per cent.

/// Greatest second difference of the phase of a smooth surface, in rad per pixel^2. Larger: small steps count as smooth.
/// Smaller: curved surfaces break into components. Varied x0.7: near edges of steps -17 %; x1.4: near edges of steps +27 %, of
/// dim steps +10 %.
pub const BEND_MAX_RAD: f32 = 0.3;

/// Greatest root mean square residual of a pixel and its neighbours: in units of the noise, and with it of the modulation
/// ([`MISFIT_MAX`]). Larger: wrong orders (varied x1.4: dim steps 190 -> 288 ppm, 0.2 points more of the textured face).
/// Smaller: fewer pixels (x0.7: 112 ppm, 0.1 points less).
pub const RESIDUAL_NOISES_MAX: f32 = 1.5;
/// See [`RESIDUAL_NOISES_MAX`]. Varied x0.7: wrong orders of steps 20 -> 10 ppm, of dim steps 190 -> 143 ppm, 0.4 points less
/// of the textured face; x1.4: 49 and 256 ppm, 0.4 points more.
pub const MISFIT_MAX: f32 = 0.28;

/// Greatest root mean square residual of a single pixel: in units of the noise, and with it of its modulation
/// ([`PIXEL_MISFIT_MAX`]). A pixel in a narrow shadow is dim, and its residual small against the light of its neighbours.
/// Varied x1.4: wrong orders of steps 20 -> 31 ppm; x0.7: dim steps 190 -> 173 ppm.
pub const PIXEL_RESIDUAL_NOISES_MAX: f32 = 3.0;
/// See [`PIXEL_RESIDUAL_NOISES_MAX`]. Varied: no effect, but 0.05 points less of the textured face at x0.7.
pub const PIXEL_MISFIT_MAX: f32 = 0.5;

/// As [`PIXEL_MISFIT_MAX`] for a pixel that a component grows into, with [`RESIDUAL_NOISES_MAX`]; stricter, because less
/// supports it. Larger: more pixels, some wrong (varied x1.4: 0.4 points more of the textured face, edges of steps 6 % worse).
/// Smaller: x0.7, 0.4 points less.
pub const GROWN_MISFIT_MAX: f32 = 0.35;

/// Least number of passed pixels among the 25 around, itself included; a straight edge leaves 15. More: corners are lost.
/// Fewer: narrow strips stay. Varied (7 and 14): no effect.
pub const NEIGHBOURS_MIN: u8 = 10;

/// Side of the least component in fringe periods, as if it were a square. Larger: small objects are lost. Smaller: patches of
/// wrong orders stay. Varied: no effect.
pub const COMPONENT_SIDE: f64 = 0.25;
/// Side of the least component that may grow, in fringe periods. Varied: no effect.
pub const SEED_SIDE: f64 = 1.0;

/// Width (sigma) in fringe periods of the neighbourhood that supports an order. Larger: edges lose support from what lies
/// beyond them. Smaller: noise. Varied: no effect.
pub const SUPPORT_WIDTH: f32 = 1.0;

/// Wrapped phases nearer than this, in rad, are the same to R and B, so that only G and IR see an order jump between them.
/// Varied: no effect.
pub const AMBIGUOUS_RAD: f32 = 0.3;
/// Pixels to each side of such a jump that may lie on its other side. 3 and 4 save a few wrong orders and cost half a per cent
/// and more of the pixels of steps (`quadfringe demo`). Varied (1 and 3): no effect, but 16 ppm more wrong orders of dim steps
/// at 3.
pub const AMBIGUOUS_REACH: usize = 2;

/// Pixels around which no other surface may be valid, where a component grew further than exclusion reaches. Follows from
/// the reach, of which it is one more.
pub const FACING_REACH: usize = AMBIGUOUS_REACH + 1;
