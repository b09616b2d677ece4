//! Step 6: saturated light. Measured by `python evaluation/saturated.py`, which exposes scenes and captures too long; the figures are
//! those of a face and of steps on the half for tuning.

/// Side in px of the tiles in which saturated pixels are counted. Larger: small highlights are diluted. Smaller: the crest of a single
/// fringe fills a tile. Follows from the fringes: those of 8 to 120 px have a crest of two to forty px.
pub const TILE_PX: usize = 32;
/// Share of the pixels of a tile with a saturated channel from which the light of a shot is restored. Larger: highlights are lost.
/// Smaller: noise, which saturates single pixels of a well exposed shot, takes three times the time. With 3 % noise, tiles of well
/// exposed white scenes have up to 0.03 and of painted faces 0.11; scenes that saturate at 1.15 times the exposure, and highlights, have
/// 0.66 or more. The bottle as it was captured has 0.28, in a small highlight (`python evaluation/saturated.py --half tune`).
pub const SHARE_MIN: f64 = 0.3;

/// Greatest share of the bright pixels that a channel may have saturated in a shot that is restored. Larger: a blind channel is made up
/// from the others. Smaller: shots that are exposed far too long are refused. Not measured: at 1.6 times the exposure it is 0.25, at 4
/// times 0.67.
pub const CHANNEL_SHARE_MAX: f64 = 0.75;

/// Light of a channel from which a pixel is bright, as a fraction of full scale. Larger: dim objects do not count. Smaller: a black
/// background hides an object that is exposed too long.
/// Not measured.
pub const BRIGHT_MIN: f32 = 0.1;

/// Rounds of restoring and decoding. Follows from those of motion, which end at the same distance from the limit. More: time, each that of a whole shot without validity and energy. Fewer: `python
/// evaluation/saturated.py` gives at 1.6 times the exposure 0.20 mm with two rounds of the factors 2 and 1, 0.16 mm with three.
pub const ROUNDS: usize = super::motion::ROUNDS;

/// Factor of a step from the present light to what the model expects. Photometry and phase were fitted to the present light,
/// and explain about half of what was cut off, so that a step with the factor 1 goes half of the way. By `python
/// evaluation/saturated.py`, 2 in place of 1.5 has a median of 0.027 in place of 0.014 mm at 1.15 times the exposure, 1 has 0.098 in
/// place of 0.054 mm at 1.6 times.
pub const GAIN: f32 = 1.5;

/// Channels of a pixel that must not be saturated: two determine albedo and phase, given the order. A pixel with fewer has no
/// phase from its light alone, and `Reason::Saturated` if it is not returned. Follows from the model.
pub const CHANNELS_MIN: f32 = 2.0;

/// Greatest restored light, as a multiple of the captured one. Larger: a wrong phase may lend more light. Smaller: crests of a
/// longer exposure stay cut off. Not measured: no exposure that still has fringes needs so much.
pub const RESTORED_MAX: f32 = 4.0;
