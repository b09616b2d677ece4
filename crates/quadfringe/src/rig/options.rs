//! Effects of a real bench on the ideal image.

use ndarray::Array3;

use crate::error::{Error, Limit, Result};
use crate::optics::BayerPattern;

use super::Projector;
use super::params::BLUR_MAX_PX;

/// Albedo of the surface in each channel.
///
/// ```
/// use quadfringe::rig::{Albedo, RenderOptions};
/// let printed = Albedo::Patches { side_mm: 20.0, albedo: [0.9; 4] };
/// let options = RenderOptions { albedo: printed, ..RenderOptions::default() };
/// assert_eq!(options.noise, 0.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Albedo {
    /// The same everywhere: R, G, B, IR.
    Uniform([f32; 4]),
    /// Coloured squares of the given side in mm, printed on the surface along x and y, times the given albedo.
    Patches {
        /// Side of a square, mm.
        side_mm: f64,
        /// Albedo of the lightest square: R, G, B, IR.
        albedo: [f32; 4],
    },
    /// One albedo for each camera pixel and channel, `(rows, columns, 4)`; or `(rows, columns, 8)`, where the last four
    /// are the albedos at the pixels of the infrared chip.
    Image(Array3<f32>),
}

/// Colours of the printed squares relative to white: R, G, B, IR. Inks are nearly clear in the infrared.
const PATCH_COLOURS: [[f32; 4]; 6] = [
    [1.0, 1.0, 1.0, 1.0],
    [1.0, 0.6, 0.5, 0.95],
    [0.55, 1.0, 0.6, 0.9],
    [0.6, 0.65, 1.0, 0.9],
    [1.0, 0.95, 0.5, 0.95],
    [0.6, 0.6, 0.6, 0.8],
];

impl Albedo {
    /// Albedo of the surface point (mm) seen by the pixel (row, column) of the chip that sees a projector.
    pub(super) fn at(&self, chip: Projector, pixel: [usize; 2], [x, y, _]: [f64; 3]) -> [f32; 4] {
        match self {
            Self::Uniform(albedo) => *albedo,
            Self::Patches { side_mm, albedo } => {
                let count = PATCH_COLOURS.len();
                let square = |v: f64| ((v / side_mm).floor() as i64).rem_euclid(count as i64) as usize;
                let colour = (square(x) + 2 * square(y)) % count;
                std::array::from_fn(|c| albedo[c] * PATCH_COLOURS[colour][c])
            }
            Self::Image(image) => {
                let first = chip.index() * (image.shape()[2] - 4);
                std::array::from_fn(|c| image[[pixel[0], pixel[1], first + c]])
            }
        }
    }

    /// The greatest albedo anywhere.
    pub(super) fn greatest(&self) -> f32 {
        match self {
            Self::Uniform(albedo) | Self::Patches { albedo, .. } => {
                albedo.iter().copied().fold(0.0, f32::max)
            }
            Self::Image(image) => image.iter().copied().fold(0.0, f32::max),
        }
    }

    fn check(&self, shape: (usize, usize)) -> Result<()> {
        let valid = |level: &f32| level.is_finite() && *level >= 0.0;
        let levels_are_valid = match self {
            Self::Uniform(albedo) => albedo.iter().all(valid),
            Self::Patches { side_mm, albedo } => {
                side_mm.is_finite() && *side_mm > 0.0 && albedo.iter().all(valid)
            }
            Self::Image(image) => {
                let expected = [shape.0, shape.1, 4];
                if image.shape() != expected && image.shape() != [shape.0, shape.1, 8] {
                    return Err(Error::shape("albedo image", &expected, image.shape()));
                }
                image.iter().all(valid)
            }
        };
        if levels_are_valid {
            return Ok(());
        }
        let expected = "finite levels of at least 0 (and squares of a positive side)";
        Err(Error::value("albedo", expected, "others"))
    }
}

/// Type and rounding of the camera's intensities.
///
/// ```
/// assert_eq!(quadfringe::rig::BitDepth::Ten.full_scale(), 1023.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
#[non_exhaustive]
pub enum BitDepth {
    /// u8, full scale 255.
    #[default]
    Eight,
    /// u16, full scale 1023.
    Ten,
    /// u16, full scale 4095.
    Twelve,
    /// u16, full scale 65535.
    Sixteen,
    /// f32, full scale 1, not rounded.
    Float,
}

impl BitDepth {
    /// Bit depth from its number of bits: 8, 10, 12 or 16.
    ///
    /// # Errors
    /// [`Error::Value`] for any other number.
    ///
    /// ```
    /// use quadfringe::rig::BitDepth;
    /// assert_eq!(BitDepth::from_bits(12)?.full_scale(), 4095.0);
    /// # Ok::<(), quadfringe::error::Error>(())
    /// ```
    pub fn from_bits(bits: u32) -> Result<Self> {
        match bits {
            8 => Ok(Self::Eight),
            10 => Ok(Self::Ten),
            12 => Ok(Self::Twelve),
            16 => Ok(Self::Sixteen),
            _ => Err(Error::value("bit_depth", "8, 10, 12 or 16", bits)),
        }
    }

    /// Value of a saturated pixel.
    #[must_use]
    pub const fn full_scale(self) -> f32 {
        match self {
            Self::Eight => 255.0,
            Self::Ten => 1023.0,
            Self::Twelve => 4095.0,
            Self::Sixteen => 65535.0,
            Self::Float => 1.0,
        }
    }
}

/// How a camera turns its mosaic into three colour planes.
///
/// ```
/// use quadfringe::BayerPattern;
/// use quadfringe::rig::{Demosaic, RenderOptions};
/// let (bayer, demosaic) = (Some(BayerPattern::Rggb), Some(Demosaic::Bilinear));
/// let plain_camera = RenderOptions { bayer, demosaic, ..RenderOptions::default() };
/// assert_ne!(plain_camera, RenderOptions { demosaic: None, ..plain_camera.clone() });
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Demosaic {
    /// The mean of the nearest samples of each colour, as in most cameras and libraries.
    Bilinear,
}

/// How a scene is rendered. The default is a clean 8-bit camera before a white surface under a little room light.
///
/// ```
/// use quadfringe::rig::RenderOptions;
/// let options = RenderOptions { noise: 0.03, seed: 7, ..RenderOptions::default() };
/// assert_eq!(options.blur_px, 0.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RenderOptions {
    /// Albedo of the surface.
    pub albedo: Albedo,
    /// Room light in each channel, as a share of the brightest projected light.
    pub ambient: [f64; 4],
    /// Whether light falls off with the cosine between surface normal and projector (Lambert).
    pub shading: bool,
    /// Response of each projected channel: light = level ^ exponent.
    pub projector_exponent: [f64; 4],
    /// Rows: captured R, G, B, IR; columns: projected R, G, B, IR.
    pub crosstalk: [[f64; 4]; 4],
    /// Exposure: captured share of full scale for light 1 from a surface of albedo 1.
    pub gain: [f64; 4],
    /// Lens blur: standard deviation of a Gaussian, px; at most 100.
    pub blur_px: f64,
    /// Sensor noise: standard deviation as a share of full scale.
    pub noise: f64,
    /// Dark level of the camera, as a share of full scale.
    pub camera_offset: [f64; 4],
    /// Response of the camera: captured = offset + linear ^ (1 / exponent).
    pub camera_exponent: [f64; 4],
    /// Pattern of a visible chip that measures one colour at each pixel. `None`: all colours at every pixel.
    pub bayer: Option<BayerPattern>,
    /// How the camera interpolates three colour planes from the mosaic. `None`: the camera delivers the mosaic.
    pub demosaic: Option<Demosaic>,
    /// Rounding of the camera.
    pub bit_depth: BitDepth,
    /// Seed of the noise: the same seed gives the same images for any number of threads.
    pub seed: u64,
}

const NO_CROSSTALK: [[f64; 4]; 4] =
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

impl Default for RenderOptions {
    /// With these values the fringes on the surface span 5 to 95 % of the range of the camera.
    fn default() -> Self {
        Self {
            albedo: Albedo::Uniform([0.9; 4]),
            ambient: [0.055; 4],
            shading: false,
            projector_exponent: [1.0; 4],
            crosstalk: NO_CROSSTALK,
            gain: [1.0; 4],
            blur_px: 0.0,
            noise: 0.0,
            camera_offset: [0.0; 4],
            camera_exponent: [1.0; 4],
            bayer: None,
            demosaic: None,
            bit_depth: BitDepth::Eight,
            seed: 0,
        }
    }
}

impl RenderOptions {
    /// Check the range of every option for images of `shape` (rows, columns).
    pub(super) fn check(&self, shape: (usize, usize)) -> Result<()> {
        let non_negative = |v: f64| v.is_finite() && v >= 0.0;
        let groups: [(&str, Vec<f64>, bool); 7] = [
            ("ambient", self.ambient.to_vec(), false),
            ("gain", self.gain.to_vec(), false),
            ("crosstalk", self.crosstalk.concat(), false),
            ("camera_offset", self.camera_offset.to_vec(), false),
            ("blur_px and noise", vec![self.blur_px, self.noise], false),
            ("projector_exponent", self.projector_exponent.to_vec(), true),
            ("camera_exponent", self.camera_exponent.to_vec(), true),
        ];
        for (name, values, above_zero) in groups {
            for value in values {
                if !non_negative(value) || (above_zero && value == 0.0) {
                    let expected = if above_zero { "positive numbers" } else { "numbers of at least 0" };
                    return Err(Error::value(name, expected, value));
                }
            }
        }
        if self.blur_px > BLUR_MAX_PX {
            let expected = Limit::Range { from: 0.0, to: BLUR_MAX_PX };
            return Err(Error::value("blur_px", expected, self.blur_px));
        }
        if self.demosaic.is_some() && self.bayer.is_none() {
            return Err(Error::value("demosaic", "a Bayer pattern to interpolate", "none"));
        }
        self.albedo.check(shape)
    }
}
