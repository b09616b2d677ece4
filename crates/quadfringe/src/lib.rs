//! Single-shot absolute 3D measurement by four-channel fringe projection.
//!
//! Images are `(rows, columns)`, x to the right, y down, z forward, pixel centres at integers; lengths in mm, phases in
//! rad, NaN means no data, and four channels come in the order R, G, B, IR. The modules stand in the order light
//! travels: what is projected ([`fringe`]), through which optics ([`optics`]), onto what ([`surface`]), as seen on the
//! virtual bench ([`rig`]); then back to millimetres ([`height`]).

pub mod error;
pub mod fringe;
pub mod height;
pub mod optics;
pub mod rig;
pub mod surface;

mod angle;
pub mod condition;
pub mod decode;
pub mod demod;
pub mod unwrap;

pub use condition::{Conditioner, Response, Shot};
pub use decode::{Decoded, Decoder, Method, Options};
pub use error::{Error, Result};
pub use fringe::{Channel, DmdLayout, FringeCode};
pub use optics::Device;
