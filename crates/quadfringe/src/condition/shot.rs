//! The images of one exposure, borrowed: planes, or the raw mosaic of a Bayer chip, with or without an infrared image.

use super::Sample;
use super::params::LIGHT_MAX;
use crate::encoding::FourChannel;
use crate::error::Limit;
use crate::{BayerPattern, Channel, Error, Result};
use ndarray::{Array2, ArrayView2};

/// The images of one exposure, all `(rows, columns)` of one type; views may be strided.
#[derive(Debug, Clone)]
pub struct Shot<'a, T> {
    pub(super) images: Images<'a, T>,
    full_scale: f32,
    /// Greatest magnitude of the intensities.
    greatest: f32,
}

/// The images that the chips of the camera deliver.
#[derive(Debug, Clone)]
pub(super) enum Images<'a, T> {
    /// R, G, B, and IR of a camera with an infrared chip.
    Planes { colours: [ArrayView2<'a, T>; 3], infrared: Option<ArrayView2<'a, T>> },
    /// Mosaic with one colour at each pixel, and IR of a camera with an infrared chip.
    Bayer { raw: ArrayView2<'a, T>, pattern: BayerPattern, infrared: Option<ArrayView2<'a, T>> },
}

impl<'a, T: Sample> Shot<'a, T> {
    /// A shot of four images in the order R, G, B, IR. Full scale is the greatest value of the type (255, 65535; 1.0 for
    /// `f32`).
    ///
    /// # Errors
    /// [`Error::Shape`] when the four images differ in size or are empty; [`Error::NotFinite`] for NaN or infinity.
    ///
    /// ```
    /// use ndarray::Array2;
    /// use quadfringe::Shot;
    /// let image = Array2::<u8>::zeros((4, 8));
    /// let shot = Shot::new([image.view(), image.view(), image.view(), image.view()])?;
    /// assert_eq!(shot.shape(), [4, 8]);
    /// # Ok::<(), quadfringe::Error>(())
    /// ```
    pub fn new([red, green, blue, infrared]: [ArrayView2<'a, T>; 4]) -> Result<Self> {
        Self::planes([red, green, blue], Some(infrared))
    }

    /// A shot of three images in the order R, G, B, of a camera without infrared. Full scale as in [`Self::new`].
    ///
    /// # Errors
    /// As [`Self::new`].
    ///
    /// ```
    /// use ndarray::Array2;
    /// use quadfringe::Shot;
    /// let image = Array2::<u8>::zeros((4, 8));
    /// let shot = Shot::rgb([image.view(), image.view(), image.view()])?;
    /// assert!(!shot.has_infrared());
    /// # Ok::<(), quadfringe::Error>(())
    /// ```
    pub fn rgb(colours: [ArrayView2<'a, T>; 3]) -> Result<Self> {
        Self::planes(colours, None)
    }

    fn planes(colours: [ArrayView2<'a, T>; 3], infrared: Option<ArrayView2<'a, T>>) -> Result<Self> {
        let shape = colours[0].shape().to_vec();
        if shape.contains(&0) {
            return Err(Error::shape("red image", &[1, 1], &shape));
        }
        let mut greatest = 0.0f32;
        for (plane, channel) in colours.iter().chain(&infrared).zip(Channel::ALL) {
            if plane.shape() != shape {
                let what = format!("{} image", channel.name());
                return Err(Error::shape(what, &shape, plane.shape()));
            }
            greatest = greatest.max(T::greatest(plane, channel.name())?);
        }
        Ok(Self { images: Images::Planes { colours, infrared }, full_scale: T::FULL_SCALE, greatest })
    }

    /// A shot of a camera with two chips: the raw mosaic of the visible one and the infrared image. Full scale is the
    /// greatest value of the type.
    ///
    /// The missing colours of each pixel are interpolated at its position, after dark level and response are corrected,
    /// from samples of the same colour only. The decoded phase therefore belongs to the position of the pixel.
    ///
    /// # Errors
    /// [`Error::Shape`] when the two images differ in size or the mosaic is smaller than 2 x 2; [`Error::NotFinite`] for
    /// NaN or infinity.
    ///
    /// ```
    /// use ndarray::Array2;
    /// use quadfringe::{BayerPattern, Conditioner, Shot, condition::linearise};
    /// // A red wall, and no infrared light.
    /// let raw = Array2::from_shape_fn((6, 8), |(y, x)| if y % 2 == 0 && x % 2 == 0 { 204u8 } else { 0 });
    /// let infrared = Array2::zeros((6, 8));
    /// let shot = Shot::bayer(raw.view(), BayerPattern::Rggb, infrared.view())?;
    /// let [red, green, ..] = linearise(&shot, &Conditioner::default())?;
    /// assert!((red[[3, 3]] - 0.8).abs() < 1e-6 && green[[3, 3]] == 0.0);
    /// # Ok::<(), quadfringe::Error>(())
    /// ```
    pub fn bayer(raw: ArrayView2<'a, T>, pattern: BayerPattern, infrared: ArrayView2<'a, T>) -> Result<Self> {
        Self::mosaics(raw, pattern, Some(infrared))
    }

    /// A shot of a camera with a visible chip only: its raw mosaic, as in [`Self::bayer`].
    ///
    /// # Errors
    /// [`Error::Shape`] when the mosaic is smaller than 2 x 2; [`Error::NotFinite`] for NaN or infinity.
    ///
    /// ```
    /// use ndarray::Array2;
    /// use quadfringe::{BayerPattern, Shot};
    /// let raw = Array2::<u8>::zeros((6, 8));
    /// assert_eq!(Shot::bayer_rgb(raw.view(), BayerPattern::Rggb)?.shape(), [6, 8]);
    /// # Ok::<(), quadfringe::Error>(())
    /// ```
    pub fn bayer_rgb(raw: ArrayView2<'a, T>, pattern: BayerPattern) -> Result<Self> {
        Self::mosaics(raw, pattern, None)
    }

    fn mosaics(
        raw: ArrayView2<'a, T>,
        pattern: BayerPattern,
        infrared: Option<ArrayView2<'a, T>>,
    ) -> Result<Self> {
        if raw.nrows() < 2 || raw.ncols() < 2 {
            return Err(Error::shape("raw mosaic", &[2, 2], raw.shape()));
        }
        let mut greatest = T::greatest(&raw, "raw mosaic")?;
        if let Some(infrared) = &infrared {
            if infrared.shape() != raw.shape() {
                return Err(Error::shape("IR image", raw.shape(), infrared.shape()));
            }
            greatest = greatest.max(T::greatest(infrared, Channel::Ir.name())?);
        }
        let images = Images::Bayer { raw, pattern, infrared };
        Ok(Self { images, full_scale: T::FULL_SCALE, greatest })
    }

    /// Set the intensity of full scale, for example 4095 for 12-bit data in 16-bit words.
    ///
    /// # Errors
    /// [`Error::Value`] unless positive and finite.
    pub fn with_full_scale(mut self, full_scale: f32) -> Result<Self> {
        self.full_scale = checked_full_scale(full_scale)?;
        Ok(self)
    }

    /// Rows and columns.
    #[must_use]
    pub fn shape(&self) -> [usize; 2] {
        let (Images::Planes { colours: [first, ..], .. } | Images::Bayer { raw: first, .. }) = &self.images;
        let (rows, columns) = first.dim();
        [rows, columns]
    }

    /// Whether there is an infrared image.
    #[must_use]
    pub fn has_infrared(&self) -> bool {
        self.infrared().is_some()
    }

    /// The image of one channel; `None` for R, G and B of a mosaic, and for IR of a camera without infrared.
    #[must_use]
    pub fn plane(&self, channel: Channel) -> Option<ArrayView2<'a, T>> {
        match (&self.images, channel) {
            (_, Channel::Ir) => self.infrared().copied(),
            (Images::Planes { colours, .. }, _) => Some(colours[channel.index()]),
            (Images::Bayer { .. }, _) => None,
        }
    }

    /// The raw mosaic and its pattern; `None` for a shot of planes.
    #[must_use]
    pub fn mosaic(&self) -> Option<(ArrayView2<'a, T>, BayerPattern)> {
        match &self.images {
            Images::Planes { .. } => None,
            Images::Bayer { raw, pattern, .. } => Some((*raw, *pattern)),
        }
    }

    /// The intensity of full scale.
    #[must_use]
    pub fn full_scale(&self) -> f32 {
        self.full_scale
    }

    /// Refuses intensities that are no fractions of full scale by any measure; their squares would overflow.
    ///
    /// # Errors
    /// [`Error::Value`] when the greatest intensity is more than 10 000 times full scale.
    pub(crate) fn check_light(&self) -> Result<()> {
        let light = self.greatest / self.full_scale;
        if light <= LIGHT_MAX {
            return Ok(());
        }
        let expected = format!("at most {LIGHT_MAX} times full scale, which is {} here", self.full_scale);
        Err(Error::value("intensity of a shot", expected, self.greatest))
    }

    /// Refuses a shot that lacks the infrared image that the encoding has, or has one that it lacks.
    ///
    /// # Errors
    /// [`Error::Value`], which says what came.
    pub(crate) fn check_channels(&self, code: &FourChannel) -> Result<()> {
        let images = |infrared| if infrared { "R, G, B and IR" } else { "R, G and B" };
        let (expected, actual) = (code.has_infrared(), self.has_infrared());
        if expected == actual {
            return Ok(());
        }
        let expected = format!("{}, the channels of the encoding", images(expected));
        Err(Error::value("images of a shot", expected, images(actual)))
    }

    pub(super) fn infrared(&self) -> Option<&ArrayView2<'a, T>> {
        let (Images::Planes { infrared, .. } | Images::Bayer { infrared, .. }) = &self.images;
        infrared.as_ref()
    }
}

/// A shot from four images in the order R, G, B, IR, as [`Shot::new`].
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::Shot;
/// let images = [(); 4].map(|()| Array2::<u8>::zeros((4, 8)));
/// assert_eq!(Shot::try_from(&images)?.shape(), [4, 8]);
/// # Ok::<(), quadfringe::Error>(())
/// ```
impl<'a, T: Sample> TryFrom<&'a [Array2<T>; 4]> for Shot<'a, T> {
    type Error = Error;

    fn try_from(images: &'a [Array2<T>; 4]) -> Result<Self> {
        Self::new(images.each_ref().map(|image| image.view()))
    }
}

/// A shot from a list of three or four images.
impl<'a, T: Sample> TryFrom<&'a [Array2<T>]> for Shot<'a, T> {
    type Error = Error;

    fn try_from(images: &'a [Array2<T>]) -> Result<Self> {
        let expected = "four images, R, G, B and IR, or the first three";
        match images {
            [red, green, blue] => Self::rgb([red.view(), green.view(), blue.view()]),
            [red, green, blue, infrared] => {
                Self::new([red.view(), green.view(), blue.view(), infrared.view()])
            }
            _ => Err(Error::value("images of a shot", expected, images.len())),
        }
    }
}

/// The intensity of full scale, if it is positive and finite.
pub(crate) fn checked_full_scale(full_scale: f32) -> Result<f32> {
    if full_scale.is_finite() && full_scale > 0.0 {
        return Ok(full_scale);
    }
    Err(Error::value("full_scale", Limit::Positive, full_scale))
}
