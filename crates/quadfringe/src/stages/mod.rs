//! The stages of the published method. Each has a file that derives it, states its source, and can be used alone.
//!
//! | stage | equation |
//! |---|---|
//! | [`carrier()`], [`quadrature_carrier`], [`row_period_px`]: the fringe period in camera pixels | |
//! | [`block_means`], [`fill_gaps`]: means over blocks of pixels | |
//! | [`background()`]: the illumination without the fringes | |
//! | [`two_step()`], [`modulation_ratio`]: wrapped phase of R and B | (S2) |
//! | [`fourier()`], [`fourier_pair`]: wrapped phase of G and IR | (S3) |
//! | [`unwrap`], [`Ladder`]: fringe orders by beats | (S4) |
//! | [`RayRow`], [`height::PairTable`](crate::height::PairTable): fringe orders along the camera ray | |
//! | [`nearest_turn`]: absolute phase | |
//! | [`discard_invalid`], [`wrong_order_probability`]: what can be trusted | |
//! | [`columns_from_phase`]: projector columns | (S1) |
//! | [`n_step()`]: the reference by N-step phase shifting | |
//! | [`fringe_offsets`], [`shared_brightness`]: by which angle fringes lie off a known phase | |
//!
//! The published decoder calls the same functions row by row. The test `tests/stages.rs` composes the public functions
//! and gets bit-identical results; the source of `published/mod.rs` holds the recipe.

mod absolute;
mod along_ray;
mod background;
mod band;
mod blocks;
mod carrier;
mod columns;
mod even_weights;
mod fourier;
mod ladder;
mod lit_carrier;
mod n_step;
mod offset;
mod params;
mod phases;
mod quadrature;
mod two_step;
mod validity;
mod wrong_order;

pub(crate) use absolute::with_turns_of;
pub use absolute::{Absolute, nearest_turn};
pub(crate) use along_ray::AlongRay;
pub use along_ray::RayRow;
pub use background::{Background, background};
pub(crate) use background::{Scratch as BackgroundScratch, row_background};
pub use blocks::{Blocks, block_means, fill_gaps, repeat_rows};
pub(crate) use blocks::{add, coarsen, fill_row_gaps, scale};
pub use carrier::{Carrier, carrier, row_period_px};
pub(crate) use carrier::{LineSpectrum, period_rows};
pub use columns::{Columns, columns_from_phase};
pub use fourier::{Band, Demodulated, Fringes, fourier, fourier_pair};
pub(crate) use fourier::{Half, Interpolation, RowFilter, RowPair, RowScratch, lesser};
pub use ladder::{Ladder, Ordered, unwrap};
pub use n_step::{NStep, n_step};
pub use offset::{fringe_offsets, shared_brightness};
pub(crate) use params::SAMPLE_STRIDE;
pub use phases::Phases;
pub use quadrature::{difference_carrier, quadrature_carrier};
pub(crate) use two_step::row_modulation_ratio;
pub use two_step::{modulation, modulation_ratio, two_step, two_step_coarse};
pub(crate) use validity::Judged;
pub use validity::{Limits, Valid, discard_invalid};
pub use wrong_order::wrong_order_probability;
pub(crate) use wrong_order::{WrongOrderTable, deviation, is_sampled};
