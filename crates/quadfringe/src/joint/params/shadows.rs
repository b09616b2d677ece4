//! Step 6: pixels of a pair that the infrared projector does not light; step 8: shadows in region growing.

/// Least share of the expected infrared fringes that a lit pixel and its neighbours show. Larger: prints that are dark in infrared
/// alone become holes. Smaller: pixels at the border of a shadow keep a phase that the missing light has bent (0.15 returns 1.7
/// times as many pixels of shadows 50 mm above, and 0.4 points more of a painted face). `python evaluation/pair.py --half tune
/// --only steps painted`. It is also the least share of the light of its neighbour that print keeps in region growing (larger: 0.5
/// returns 0.4 points less of a painted face; smaller: hairline shadows are bridged, `cargo test --test properties`).
pub const SHARE_MIN: f32 = 0.3;

/// Least sum of the expected fringes over nine pixels that allows a verdict, in standard deviations of an intensity. Larger: less is
/// seen of shadows on dark fringes. Smaller: noise makes holes. A lit pixel then fails by 4.7 standard deviations of the sum. `python
/// evaluation/pair.py --only plane`
pub const FRINGE_NOISES: f32 = 20.0;

/// Number of pixels around a pixel in shadow that are left out too: the sum over nine pixels sees a shadow one pixel late, and two more
/// mix light. Larger: wider holes. Smaller: mixed light and dark fringes remain (2: 1.4 times as many wrong orders behind steps).
/// `python evaluation/pair.py --only steps`
pub const REACH_PX: usize = 3;

/// Width of the rim of the infrared projector's image that counts as unlit, in its columns. Larger: less of the field is measured.
/// Smaller: the fit mixes pixels inside and outside of it (0: RMS of a plane at 850 mm x 2.2). `python evaluation/pair.py --only
/// plane_850`
pub const FIELD_RIM_COLUMNS: f64 = 3.0;
