//! Single-shot absolute 3D measurement by four-channel fringe projection: from the images of one exposure to points in mm.
//!
//! A visible projector shows fringes in red, green and blue, an infrared projector a fourth set, and a camera with a
//! visible and an infrared chip takes all four at one instant. R and B are in quadrature and give a wrapped phase at every
//! pixel; G and IR, with other fringe numbers, tell which fringe it is. The absolute phase gives the projector column that
//! lights the pixel; the camera ray meets the sheet of light of this column in the point.
//!
//! # Three entry points
//! 1. [`Decoder`]: one call from a [`Shot`] to the maps of [`Decoded`]. Start here.
//! 2. [`stages`]: the steps of the published method as separate functions, for teaching, inspection, or another chain.
//! 3. The parts: [`encoding`], [`condition`], [`height`], and the virtual bench in [`rig`] and [`surface`].
//!
//! # Conventions
//! - **Arrays** are `(rows, columns)` or `(rows, columns, axes)`, row by row. x runs along the columns to the right, y along
//!   the rows down, and pixel centres lie at whole numbers: the centre of the top-left pixel is the origin.
//! - **No data** is NaN. There is no separate mask.
//! - **Units** stand in names: `height_mm`, `phase_rad`, `period_px`, `exposure_us`. Light is a fraction of full scale.
//! - **Precision**: maps of pixels are `f32`, geometry and fits `f64`.
//! - **Frames** follow OpenCV: x right, y down, z forward. A device has the pose `P_device = R P_camera + T`, and all
//!   points are given in the camera frame. Lens distortion has the order (k1, k2, p1, p2, k3).
//! - **Channels** of a shot come in the order R, G, B, IR. Channel `c` shows `0.5 + 0.5 cos(Phi_c + delta_c)` with
//!   `Phi_c = 2 pi N_c u / W` at column `u` of a projector of `W` columns (S1). R and B have the same fringe number `N_c`;
//!   `delta_c` is `pi/2` for B and 0 for the others. Phase is 0 at column 0.
//! - **Wrapped phases** lie in `[-pi, pi]`. The absolute phase is the phase of R and B, counted from column 0.
//! - **Equation numbers** (S1) to (S11) refer to `docs/method`.
//! - **Threads**: work runs in the current thread pool of rayon. Results are bit-identical for any number of threads.
//!
//! # Map
//! A module uses only modules above it in this table.
//!
//! | module | contents |
//! |---|---|
//! | [`error`] | errors, with what was expected, what came and what to do |
//! | [`encoding`] | the channels that are projected, their ideal images, the layout of the mirrors |
//! | [`optics`] | pinhole devices (a projector is an inverse camera), poses, the Bayer chip |
//! | [`surface`] | forward: surfaces to measure, as implicit functions |
//! | [`rig`] | forward: the virtual bench, from a surface to the images of a shot |
//! | [`condition`] | inverse: raw images to linear light |
//! | [`stages`] | inverse: linear light to wrapped phases and to absolute phase, step by step |
//! | [`height`] | inverse: absolute phase to mm |
//! | [`mesh`] | inverse: points to triangles and normals |
//! | `published` | inverse: the method of the paper |
//! | `joint` | inverse: the default method, which fits all four channels together |
//! | [`decode`] | inverse: one shot through all steps, by either method |
//! | [`mod@reference`] | inverse: the reference measurement, from many images of a still object |
//!
//! The forward half (surface, rig) and the inverse half (condition to reference) never import each other. Only tests use
//! both: they render a surface, decode it and compare. The two methods never import each other either.
//!
//! # Render a shot and decode it
//! ```
//! use quadfringe::rig::{Bench, Light, RenderOptions};
//! use quadfringe::{Decoder, Device, Encoding, Shot, height::Triangulator, surface::scene};
//!
//! // Forward: what a camera of 256 x 192 pixels sees of a scene under four channels of fringes.
//! let mut bench = Bench::reference();
//! bench.camera = Device::pinhole(256, 192, [645.0; 2], [127.5, 95.5])?;
//! let encoding = Encoding::optimum(36, 912)?;
//! let cast = bench.cast(scene("peaks", 0.0)?.as_ref());
//! let images = bench.render(&cast, &Light::shot(&encoding)?, &RenderOptions::default())?.into_u8()?;
//!
//! // Inverse: planned and checked once, then run for every shot.
//! let triangulator = Triangulator::new(&bench.camera, &bench.visible)?;
//! let mut decoder = Decoder::builder(&encoding, [192, 256]).triangulator(triangulator).build()?;
//! let decoded = decoder.decode(&Shot::try_from(&images)?)?;
//!
//! // A decoder with a triangulator gives points.
//! if let Some(xyz_mm) = &decoded.xyz_mm {
//!     let (depth_mm, truth_mm) = (xyz_mm[[96, 128, 2]], cast.depth_mm()[[96, 128]]);
//!     println!("depth {depth_mm:.2} mm, true {truth_mm:.2} mm");
//! #     assert!((depth_mm - truth_mm).abs() < 0.5);
//! }
//! # assert!(decoded.xyz_mm.is_some());
//! # Ok::<(), quadfringe::Error>(())
//! ```

// Used by both halves. Blank lines keep the order, because rustfmt sorts adjacent declarations.
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

pub mod mesh;

mod published;

mod joint;

pub mod decode;

pub mod reference;

pub use condition::{Conditioner, Response, Shot};
pub use decode::{Decoded, Decoder, DecoderBuilder, JointOptions, Method, Options, PublishedOptions, Reason};
pub use encoding::{Channel, DmdLayout, Encoding};
pub use error::{Error, Result};
pub use optics::{BayerPattern, Device};

/// Runs the Rust blocks of the README as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
