//! Step 3: slopes of the phase on the cells, which every window follows.

/// Width (sigma) of the window in fringe periods. Larger: slopes do not follow curved surfaces (varied x1.4: phase RMS of steps +17
/// %, near edges +61 %). Smaller: noisier slopes (x0.7: peaks +2 %, near edges of steps +10 %; the textured face gains 7 %). 0.5:
/// painted face -3 %, 0.12 points less of the bottle.
pub const WIDTH: f32 = 0.43;

/// Width (sigma) of the window of refined slopes in fringe periods. Larger: details are smoothed (varied x1.4: face +6 %).
/// Smaller: noise (x0.7: peaks and dim steps +2 %, face -3 %).
pub const FINE_WIDTH: f32 = 0.2;

/// Weight of the wide slopes in the mean with the fine ones, as a share of the number of pixels in a whole window. They dominate
/// where the fine window contains few pixels. Varied: no effect. Half or twice: face -1.3 and +1.8 %, nothing else (`python
/// evaluation/world.py --half tune`).
pub const WIDE_SHARE: f32 = 0.1;
