//! Rendering: the images of a cast scene that four patterns light.

use ndarray::{Array2, Axis};
use rayon::prelude::*;

use super::quick::Quick;
use super::{Bench, Cast, Hit, Light, Projector, RenderOptions, blur, expose, mosaic};
use crate::encoding::Channel;
use crate::error::{Error, Result};

/// The images of a shot, each `(rows, columns)`: four in the order R, G, B, IR, or the raw mosaic of a Bayer chip and IR.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::rig::Planes;
/// let planes = Planes::U8([(); 4].map(|()| Array2::zeros((6, 8))));
/// assert_eq!(planes.shape(), (6, 8));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum Planes {
    /// Four images of 8 bit, full scale 255.
    U8([Array2<u8>; 4]),
    /// Four images of 10, 12 or 16 bit, full scale 1023, 4095 or 65535.
    U16([Array2<u16>; 4]),
    /// Four images, not rounded, full scale 1.
    F32([Array2<f32>; 4]),
    /// Mosaic and IR of 8 bit, full scale 255.
    BayerU8([Array2<u8>; 2]),
    /// Mosaic and IR of 10, 12 or 16 bit, full scale 1023, 4095 or 65535.
    BayerU16([Array2<u16>; 2]),
    /// Mosaic and IR, not rounded, full scale 1.
    BayerF32([Array2<f32>; 2]),
}

impl Planes {
    /// Size of each image (rows, columns).
    #[must_use]
    pub fn shape(&self) -> (usize, usize) {
        match self {
            Self::U8(planes) => planes[0].dim(),
            Self::U16(planes) => planes[0].dim(),
            Self::F32(planes) => planes[0].dim(),
            Self::BayerU8(images) => images[0].dim(),
            Self::BayerU16(images) => images[0].dim(),
            Self::BayerF32(images) => images[0].dim(),
        }
    }

    /// The four images of 8 bit.
    ///
    /// # Errors
    /// [`Error::Value`] for a shot of another bit depth, or of a Bayer chip.
    ///
    /// ```
    /// use quadfringe::rig::{Bench, Light, RenderOptions};
    /// use quadfringe::{Device, Encoding, Shot, surface::scene};
    /// let mut bench = Bench::reference();
    /// bench.camera = Device::pinhole(64, 48, [161.0; 2], [31.5, 23.5])?;
    /// let cast = bench.cast(scene("steps", 0.0)?.as_ref());
    /// let lights = Light::shot(&Encoding::optimum(36, 912)?)?;
    /// let images = bench.render(&cast, &lights, &RenderOptions::default())?.into_u8()?;
    /// assert_eq!(Shot::try_from(&images)?.shape(), [48, 64]);
    /// # Ok::<(), quadfringe::Error>(())
    /// ```
    pub fn into_u8(self) -> Result<[Array2<u8>; 4]> {
        let actual = match self {
            Self::U8(images) => return Ok(images),
            Self::U16(_) => "images of more than 8 bit",
            Self::F32(_) => "images that are not rounded",
            Self::BayerU8(_) | Self::BayerU16(_) | Self::BayerF32(_) => "the mosaic of a Bayer chip",
        };
        Err(Error::value("rendered images", "four of 8 bit: the bit depth 8 and no Bayer chip", actual))
    }

    fn from_counts(planes: [Array2<f32>; 4], full_scale: f32) -> Self {
        match Depth::of(full_scale) {
            Depth::Byte => Self::U8(planes.map(|plane| plane.mapv(|count| count as u8))),
            Depth::Word => Self::U16(planes.map(|plane| plane.mapv(|count| count as u16))),
            Depth::Float => Self::F32(planes),
        }
    }

    fn bayer_from_counts(images: [Array2<f32>; 2], full_scale: f32) -> Self {
        match Depth::of(full_scale) {
            Depth::Byte => Self::BayerU8(images.map(|image| image.mapv(|count| count as u8))),
            Depth::Word => Self::BayerU16(images.map(|image| image.mapv(|count| count as u16))),
            Depth::Float => Self::BayerF32(images),
        }
    }
}

/// Type of a stored intensity.
enum Depth {
    Byte,
    Word,
    Float,
}

impl Depth {
    fn of(full_scale: f32) -> Self {
        match full_scale {
            ..=1.0 => Self::Float,
            ..=255.0 => Self::Byte,
            _ => Self::Word,
        }
    }
}

impl Bench {
    /// Renders the shot of a scene at rest.
    ///
    /// Applies, in this order: light, projector response, albedo, shading and room light, crosstalk, exposure, blur,
    /// noise, camera response, saturation, rounding, Bayer chip. The images are bit-identical for any number of
    /// threads.
    ///
    /// # Errors
    /// [`Error::Shape`] when the cast, a pattern image or an albedo image has the wrong size; [`Error::Value`] when an
    /// option is out of range.
    ///
    /// ```
    /// use quadfringe::{Device, rig::{Bench, Light, Planes, RenderOptions}, surface::Plane};
    /// let mut bench = Bench::reference();
    /// bench.camera = Device::pinhole(8, 6, [20.0, 20.0], [3.5, 2.5])?;
    /// let cast = bench.cast(&Plane::at_z(800.0));
    /// let white = [(); 4].map(|()| Light::Uniform(1.0));
    /// let Planes::U8(planes) = bench.render(&cast, &white, &RenderOptions::default())? else { unreachable!() };
    /// assert_eq!(planes[0][[3, 4]], 242);
    /// # Ok::<(), quadfringe::error::Error>(())
    /// ```
    pub fn render(&self, cast: &Cast, lights: &[Light<'_>; 4], options: &RenderOptions) -> Result<Planes> {
        self.render_moving([cast; 3], lights, options)
    }

    /// Renders the shot of a scene that moves while the visible projector shows R, then G, then B, with one cast for each
    /// of these instants. The infrared projector shows its pattern throughout, so the infrared image is the mean of the
    /// three.
    ///
    /// # Errors
    /// As [`Bench::render`].
    pub fn render_moving(
        &self,
        casts: [&Cast; 3],
        lights: &[Light<'_>; 4],
        options: &RenderOptions,
    ) -> Result<Planes> {
        let shape = (self.camera.height, self.camera.width);
        for cast in casts {
            if cast.shape() != shape {
                let (rows, columns) = cast.shape();
                return Err(Error::shape("cast", &[shape.0, shape.1], &[rows, columns]));
            }
        }
        for (channel, light) in Channel::ALL.into_iter().zip(lights) {
            light.check(self.projector(channel.projector()))?;
        }
        options.check(shape)?;
        let mut planes = self.light_on_sensor(casts, lights, options);
        if options.blur_px > 0.0 {
            planes = planes.map(|plane| blur::blur(&plane, options.blur_px));
        }
        for (channel, plane) in planes.iter_mut().enumerate() {
            expose::expose(plane, channel, options);
        }
        let full_scale = options.bit_depth.full_scale();
        let Some(pattern) = options.bayer else {
            return Ok(Planes::from_counts(planes, full_scale));
        };
        let raw = mosaic::sample(&planes[..3], pattern);
        let [.., infrared] = planes;
        if options.demosaic.is_none() {
            return Ok(Planes::bayer_from_counts([raw, infrared], full_scale));
        }
        let rounds = full_scale > 1.0;
        let [red, green, blue] = mosaic::bilinear(&raw, pattern)
            .map(|plane| if rounds { plane.mapv_into(f32::round) } else { plane });
        Ok(Planes::from_counts([red, green, blue, infrared], full_scale))
    }

    /// Linear light of the four captured channels, 1 = full scale.
    fn light_on_sensor(
        &self,
        casts: [&Cast; 3],
        lights: &[Light<'_>; 4],
        options: &RenderOptions,
    ) -> [Array2<f32>; 4] {
        let shape = casts[0].shape();
        let mut planes = [(); 4].map(|()| Array2::zeros(shape));
        let [red, green, blue, infrared] = &mut planes;
        let moving = casts.iter().any(|cast| !std::ptr::eq(*cast, casts[0]));
        let painter = Painter { bench: self, lights, options };
        let infrared_hits = casts[0].infrared_hits.is_some().then(|| casts.map(Cast::infrared_hits));
        let quick = if moving || infrared_hits.is_some() { None } else { Quick::new(self, lights, options) };
        red.axis_iter_mut(Axis(0))
            .into_par_iter()
            .zip(green.axis_iter_mut(Axis(0)))
            .zip(blue.axis_iter_mut(Axis(0)))
            .zip(infrared.axis_iter_mut(Axis(0)))
            .enumerate()
            .for_each(|(row, (((mut red, mut green), mut blue), mut infrared))| {
                let levels = quick.as_ref().map(|quick| quick.levels(casts[0].hits.row(row)));
                for column in 0..shape.1 {
                    let pixel = [row, column];
                    let hits = casts.map(|cast| &cast.hits[pixel]);
                    let found = levels.as_ref().zip(quick.as_ref()).and_then(|(levels, quick)| {
                        quick.certain(painter.mixed(painter.light_of(pixel, hits[0], levels.at(column))))
                    });
                    let hidden = infrared_hits.map(|all| all.map(|hits| &hits[pixel]));
                    let captured = found.unwrap_or_else(|| painter.captured(pixel, hits, hidden, moving));
                    [red[column], green[column], blue[column], infrared[column]] = captured;
                }
            });
        planes
    }
}

/// Computes the light that one pixel receives.
struct Painter<'a, 'image> {
    bench: &'a Bench,
    lights: &'a [Light<'image>; 4],
    options: &'a RenderOptions,
}

impl Painter<'_, '_> {
    /// Light of the four projected channels at a pixel of a chip. `hits` holds the hit of the pixel at the instants of
    /// R, G and B.
    fn light(&self, chip: Projector, pixel: [usize; 2], hits: [&Hit; 3], moving: bool) -> [f64; 4] {
        let mut light = [0.0; 4];
        for (channel, hit) in Channel::ALL.into_iter().zip(hits) {
            light[channel.index()] = self.reflected(channel, chip, pixel, hit, None);
        }
        let infrared = |hit: &Hit| self.reflected(Channel::Ir, chip, pixel, hit, None);
        light[3] = if moving { hits.into_iter().map(infrared).sum::<f64>() / 3.0 } else { infrared(hits[0]) };
        light
    }

    /// Light that each captured channel receives at a pixel. `hits` holds its hit at the instants of R, G and B, `hidden` that
    /// of the pixel of the infrared chip if it is another one.
    fn captured(
        &self,
        pixel: [usize; 2],
        hits: [&Hit; 3],
        hidden: Option<[&Hit; 3]>,
        moving: bool,
    ) -> [f32; 4] {
        let light = self.light(Projector::Visible, pixel, hits, moving);
        let infrared = hidden.map_or(light, |hits| self.light(Projector::Infrared, pixel, hits, moving));
        let ([red, green, blue, _], [.., infrared]) = (self.mixed(light), self.mixed(infrared));
        [red, green, blue, infrared].map(|light| light as f32)
    }

    /// Light of the four projected channels at a pixel at rest, where the levels of the projectors are known.
    fn light_of(&self, pixel: [usize; 2], hit: &Hit, levels: [f64; 4]) -> [f64; 4] {
        Channel::ALL.map(|channel| {
            let level = Some(levels[channel.index()]);
            self.reflected(channel, Projector::Visible, pixel, hit, level)
        })
    }

    /// Light that each captured channel receives from all projected channels.
    fn mixed(&self, light: [f64; 4]) -> [f64; 4] {
        std::array::from_fn(|captured| {
            let row = &self.options.crosstalk[captured];
            let mixed = row.iter().zip(light).map(|(share, light)| share * light).sum::<f64>();
            self.options.gain[captured] * mixed
        })
    }

    /// Light of one projected channel; `known` is the level that its projector sends there, if it is known.
    fn reflected(
        &self,
        channel: Channel,
        chip: Projector,
        pixel: [usize; 2],
        hit: &Hit,
        known: Option<f64>,
    ) -> f64 {
        if !hit.is_surface() {
            return 0.0;
        }
        let (index, source) = (channel.index(), channel.projector());
        let mut light = self.options.ambient[index];
        if hit.is_lit(source) {
            let at = hit.lit_from_px[source.index()];
            let projector = self.bench.projector(source);
            let level = known.unwrap_or_else(|| self.lights[index].level(projector, self.bench.layout, at));
            let exponent = self.options.projector_exponent[index];
            let sent = if exponent == 1.0 { level } else { level.max(0.0).powf(exponent) };
            light += if self.options.shading { sent * hit.facing[source.index()] } else { sent };
        }
        light * f64::from(self.options.albedo.at(chip, pixel, hit.xyz_mm)[index])
    }
}
