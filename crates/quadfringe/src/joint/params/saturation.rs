//! Step 6: saturated light. Measured by `python evaluation/saturated.py`, which exposes scenes and captures too long.

/// Share of the bright pixels with a saturated channel from which the light of a shot is restored. Larger: the crests of fringes stay
/// cut off. Smaller: noise, which saturates single pixels of a well exposed shot, and small highlights take three times the time.
pub const SHARE_MIN: f64 = 0.05;

/// Light of a channel from which a pixel is bright, as a fraction of full scale. Larger: dim objects do not count. Smaller: a black
/// background hides an object that is exposed too long.
pub const BRIGHT_MIN: f32 = 0.1;

/// Rounds of restoring and decoding. More: time, each that of a whole shot without validity and energy.
pub const ROUNDS: usize = 3;

/// Factor of a step from the present light to what the model expects. Photometry and phase were fitted to the present light,
/// and explain about half of what was cut off, so that a step with the factor 1 goes half of the way.
pub const GAIN: f32 = 1.5;

/// Channels of a pixel that must not be saturated: two determine albedo and phase, given the order. A pixel with fewer has no
/// phase of its own, and `Reason::Saturated` if it is not returned. Larger or smaller: other reasons.
pub const CHANNELS_MIN: f32 = 2.0;

/// Greatest restored light, as a multiple of the captured one. Larger: a wrong phase may lend more light. Smaller: crests of a
/// longer exposure stay cut off.
pub const RESTORED_MAX: f32 = 4.0;
