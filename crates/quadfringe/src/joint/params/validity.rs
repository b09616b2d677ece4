//! Step 8: validity. `quadfringe demo` prints the two percentages that each limit trades: wrong and returned.

/// Phases belong to one surface if they differ by less than this, in rad, or a second difference of pixels is less. R and B do not
/// see an order jump between wrapped phases that are as close; only G and IR do. Larger: small steps count as smooth. Smaller: curved
/// surfaces break into components, and pixels next to edges have more surfaces to choose from. Varied as a second difference: x0.7,
/// near edges of steps -17 %; x1.4, near edges of steps +27 %, of dim steps +10 %; otherwise no effect.
pub const SAME_SURFACE_RAD: f32 = 0.3;

/// Limit of the root mean square residual of a pixel and its neighbours, in units of the noise. [`MISFIT_MAX`], in
/// units of the modulation, is added to it in squares. Larger: wrong orders (varied x1.4: dim steps 190 -> 288 ppm, 0.2
/// points more of the textured face). Smaller: fewer pixels (x0.7: 112 ppm, 0.1 points less).
pub const RESIDUAL_NOISES_MAX: f32 = 1.5;
/// See [`RESIDUAL_NOISES_MAX`]. Varied x0.7: wrong orders of steps 20 -> 10 ppm, of dim steps 190 -> 143 ppm, 0.4 points less
/// of the textured face; x1.4: 49 and 256 ppm, 0.4 points more.
pub const MISFIT_MAX: f32 = 0.28;

/// Limit of the root mean square residual of a single pixel, in units of the noise. [`PIXEL_MISFIT_MAX`], in units of the
/// modulation of the pixel, is added to it in squares. The limit on the neighbourhood does not suffice, because a pixel
/// in a narrow shadow is dim, and its residual is small compared with the light of its neighbours. Varied x1.4: wrong
/// orders of steps 20 -> 31 ppm; x0.7: dim steps 190 -> 173 ppm.
pub const PIXEL_RESIDUAL_NOISES_MAX: f32 = 3.0;
/// See [`PIXEL_RESIDUAL_NOISES_MAX`]. Varied: no effect, but 0.05 points less of the textured face at x0.7. 0.35: 0.13 points less
/// of the painted face, plate -4 %. It also limits pixels that are added by region growing, together with [`RESIDUAL_NOISES_MAX`].
/// With 0.35 for these alone, 2.8 points less of photographs, 0.3 of the bottle and 0.4 of patches, whose RMS is 3 % less; with 0.6,
/// 1.3 points more of photographs, and rods have 0.007 points more wrong orders (`python evaluation/world.py --half tune`, `python
/// evaluation/captures_report.py`).
pub const PIXEL_MISFIT_MAX: f32 = 0.5;

/// Least number of passed pixels in the 5 x 5 pixels around a pixel, including the pixel itself; a straight edge leaves 15 of
/// them. More: corners are lost. Fewer: narrow strips stay. Varied (7 and 14): no effect.
pub const NEIGHBOURS_MIN: u8 = 10;

/// Side, in fringe periods, of a square with the area of the smallest component that is kept. Larger: small objects are lost.
/// Smaller: patches of wrong orders stay. Varied: no effect.
pub const COMPONENT_SIDE: f64 = 0.25;
/// Side, in fringe periods, of a square with the area of the smallest component that may grow. Follows from the neighbourhood that
/// supports an order. Varied: no effect at x0.7 and x1.4; at a quarter, 0.04 points more wrong orders of rods.
pub const SEED_SIDE: f64 = super::photometry::NEIGHBOURHOOD as f64;

/// Number of pixels on each side of such a jump that may belong to the other side. With 3 or 4 there are a few wrong orders
/// less, but half a per cent or more of the pixels of steps are lost (`quadfringe demo`). Varied (1 and 3): no effect, but 16
/// ppm more wrong orders of dim steps at 3.
pub const AMBIGUOUS_REACH: usize = 2;

/// Where a component grew further than exclusion reaches, no pixel of another surface may be valid within this number of
/// pixels. Follows from the reach of exclusion: one pixel more.
pub const FACING_REACH: usize = AMBIGUOUS_REACH + 1;

/// Steps lower than this number of turns leave strips with the order of the wrong side. Larger: regions give no order next to higher
/// steps, where it would be right. Smaller: strips of a wrong order are returned (`python evaluation/world.py --half tune --only rods
/// clutter steps`).
pub const CLOSE_TURNS_MAX: f32 = 1.5;

/// Cells from such a step within which a region gives no order, as windows see both sides there. Larger: narrow objects with steps are
/// lost. Smaller: strips of a wrong order are returned (`python evaluation/world.py --half tune --only rods clutter`).
pub const CLOSE_CELLS: usize = 3;

/// Number of rows from one that is compared for such steps to the next. Larger: steps of short edges are missed. Smaller: time. Not
/// measured: no step along a row fits between two of them.
pub const CLOSE_ROW_STEP: usize = 2;
