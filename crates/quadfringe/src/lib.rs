//! Single-shot absolute 3D measurement by four-channel fringe projection.
//!
//! # Conventions
//! - Images are `(rows, columns)`, x to the right, y down, z forward, the origin at the centre of the top-left pixel.
//! - Lengths in mm, phases in rad; maps of pixels are `f32`, geometry and fits `f64`. NaN means no data.
//! - Four channels come in the order R, G, B, IR. R and B carry N1 fringes over the width W of the projector, G carries
//!   N2 and IR N3: channel c shows `0.5 + 0.5 cos(Phi_c + shift_c)` with `Phi_c = 2 pi N_c u / W` at column u, shift
//!   `pi/2` for B and 0 for the others. Column 0 has phase 0.
//! - A device stands at `P_device = R P_camera + T`; distortion in OpenCV's order (k1, k2, p1, p2, k3).
//!
//! # Map
//! In the order light travels; a module uses only what stands above it.
//!
//! | | |
//! |---|---|
//! | [`error`] | what can be wrong with an input |
//! | [`encoding`] | what is projected: numbers, shifts, channels, ideal images |
//! | [`optics`] | the pinhole device, of which a projector is an inverse one, and the Bayer chip |
//! | [`surface`] | forward: what is measured, as implicit surfaces |
//! | [`rig`] | forward: the virtual bench, from a surface to a shot |
//! | [`condition`] | inverse: raw shot to linear light |
//! | [`stages`] | inverse: the stages of the published method, each by itself: linear light to wrapped and absolute phase |
//! | [`height`] | inverse: absolute phase to mm |
//! | `published` | inverse: the published method, strip by strip |
//! | `joint` | inverse: the default method, which fits all four channels together |
//! | [`decode`] | one shot through all of the inverse half, by either method |
//!
//! The forward half (surface, rig) and the inverse half (condition to decode) never import each other: they meet in
//! tests, where `inverse(forward(h))` gives h back. The two methods never import each other either.
//!
//! # A shot, there and back
//! ```
//! use quadfringe::rig::{Bench, Light, Planes, RenderOptions};
//! use quadfringe::{Conditioner, Decoder, Device, FringeCode, Options, Shot, height::Triangulator, surface::scene};
//!
//! let mut bench = Bench::reference();
//! bench.camera = Device::pinhole(256, 192, [645.0; 2], [127.5, 95.5])?;
//! let code = FringeCode::optimum(36, 912)?;
//! let cast = bench.cast(scene("peaks", 0.0)?.as_ref());
//! let Planes::U8(shot) = bench.render(&cast, &Light::shot(&code), &RenderOptions::default())? else { panic!("8 bit") };
//!
//! let triangulator = Triangulator::new(&bench.camera, &bench.visible)?;
//! let mut decoder = Decoder::new(code, [192, 256], &Conditioner::default(), Options::default())?
//!     .triangulate_with(triangulator)?;
//! let decoded = decoder.decode(&Shot::new(shot.each_ref().map(|image| image.view()))?)?;
//! let depth_mm = decoded.xyz_mm.expect("calibrated")[[96, 128, 2]];
//! assert!((depth_mm - cast.depth_mm()[[96, 128]]).abs() < 0.5);
//! # Ok::<(), quadfringe::Error>(())
//! ```

// Common ground. Comments keep the order: rustfmt sorts neighbours.
pub mod error;

mod parallel;

pub mod encoding;

pub mod optics;

// Forward.
pub mod surface;

pub mod rig;

// Inverse.
pub mod condition;

pub mod stages;

pub mod height;

mod published;

mod joint;

pub mod decode;

pub use condition::{Conditioner, Response, Shot};
pub use decode::{Decoded, Decoder, Method, Options, aligned_zeros};
pub use encoding::{Channel, DmdLayout, FringeCode};
pub use error::{Error, Result};
pub use optics::{BayerPattern, Device};

/// The Rust of the README is run too.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
