//! Conditioning: from a raw shot to linear light, by dark level, response, crosstalk and registration (step 1 of both
//! methods, (S1)).
//!
//! A [`Conditioner`] holds the calibration of the four channels. A [`Shot`] borrows the images of one exposure: four
//! planes, or the raw mosaic of a Bayer chip and an infrared image. Conditioning turns intensities into fractions of full
//! scale that are linear in the projected light, for all four channels at every pixel.

mod estimate;
mod linear;
mod matrix;
mod mosaic;
mod params;
mod plan;
mod registered;
mod response;
mod sample;
mod saturated;
mod shot;
mod unmix;

pub use estimate::{ResponseEstimate, estimate_response, estimate_response_of_shot};
pub(crate) use params::{CLIPPED, LIGHT_MAX};
pub use response::Response;
pub use sample::Sample;
pub use shot::Shot;
pub(crate) use {plan::Plan, sample::Known, sample::Of, saturated::Saturated, shot::checked_full_scale};

use crate::{Channel, Error, Result, error::Limit};
use matrix::invert_4x4;
use ndarray::Array2;

/// Calibration of the intensities of the four channels.
///
/// The default leaves intensities as they are.
///
/// ```
/// use quadfringe::{Conditioner, Response};
/// let response = [Response { exponent: 0.5, ..Response::default() }; 4];
/// let conditioner = Conditioner::default().with_dark([0.01; 4]).with_response(response);
/// conditioner.check()?;
/// # Ok::<(), quadfringe::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Conditioner {
    /// Dark level per channel, as a fraction of full scale.
    pub dark: [f32; 4],
    /// Inverse response of each captured channel, which is applied before crosstalk is removed: of the camera, or of
    /// camera and projector together if there is no crosstalk.
    pub response: [Response; 4],
    /// Matrix from projected light to captured light. Rows: captured R, G, B, IR; columns: projected R, G, B, IR.
    pub crosstalk: [[f64; 4]; 4],
    /// Inverse response of each projected channel, which is applied after crosstalk is removed, because crosstalk mixes
    /// the light that the projector emits.
    pub projector_response: [Response; 4],
    /// Affine map from a visible pixel (x, y, 1) to the infrared pixel (x, y) that sees the same point.
    pub ir_registration: [[f64; 3]; 2],
}

impl Default for Conditioner {
    fn default() -> Self {
        let mut crosstalk = [[0.0; 4]; 4];
        (0..4).for_each(|i| crosstalk[i][i] = 1.0);
        Self {
            dark: [0.0; 4],
            response: [Response::default(); 4],
            crosstalk,
            projector_response: [Response::default(); 4],
            ir_registration: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        }
    }
}

impl Conditioner {
    /// This conditioner with these dark levels.
    #[must_use]
    pub const fn with_dark(mut self, dark: [f32; 4]) -> Self {
        self.dark = dark;
        self
    }

    /// This conditioner with these responses of the captured channels.
    #[must_use]
    pub const fn with_response(mut self, response: [Response; 4]) -> Self {
        self.response = response;
        self
    }

    /// This conditioner with this crosstalk matrix.
    #[must_use]
    pub const fn with_crosstalk(mut self, crosstalk: [[f64; 4]; 4]) -> Self {
        self.crosstalk = crosstalk;
        self
    }

    /// This conditioner with these responses of the projected channels.
    #[must_use]
    pub const fn with_projector_response(mut self, projector_response: [Response; 4]) -> Self {
        self.projector_response = projector_response;
        self
    }

    /// This conditioner with this registration of the infrared image.
    #[must_use]
    pub const fn with_ir_registration(mut self, ir_registration: [[f64; 3]; 2]) -> Self {
        self.ir_registration = ir_registration;
        self
    }

    /// Check the range of every number.
    ///
    /// # Errors
    /// [`Error::Value`], which names the first number that is out of range, or a crosstalk matrix that has no inverse.
    pub fn check(&self) -> Result<()> {
        for (channel, dark) in Channel::ALL.iter().zip(self.dark) {
            if !(0.0..1.0).contains(&dark) {
                let name = format!("dark level of {}", channel.name());
                return Err(Error::value(name, Limit::Fraction, dark));
            }
        }
        for (what, responses) in
            [("response", &self.response), ("projector response", &self.projector_response)]
        {
            for (channel, response) in Channel::ALL.iter().zip(responses) {
                response.check(what, channel.name())?;
            }
        }
        if self.ir_registration.iter().flatten().any(|v| !v.is_finite()) {
            let actual = format!("{:?}", self.ir_registration);
            return Err(Error::value("ir_registration", Limit::Finite, actual));
        }
        self.crosstalk_inverse().map(|_| ())
    }

    fn crosstalk_inverse(&self) -> Result<[[f32; 4]; 4]> {
        let inverse = invert_4x4(&self.crosstalk).ok_or_else(|| {
            let actual = format!("{:?}", self.crosstalk);
            Error::value("crosstalk", "an invertible 4 x 4 matrix", actual)
        })?;
        Ok(inverse.map(|row| row.map(|v| v as f32)))
    }

    /// This conditioner for shots without infrared: its infrared channel is left as it is and mixes with no other. What is
    /// known of R, G and B stays.
    ///
    /// ```
    /// use quadfringe::Conditioner;
    /// let mut mix = Conditioner::default().crosstalk;
    /// (mix[0][1], mix[0][3]) = (0.1, 0.2);
    /// let colours = Conditioner::default().with_crosstalk(mix).without_infrared();
    /// assert_eq!(colours.crosstalk[0], [1.0, 0.1, 0.0, 0.0]);
    /// ```
    #[must_use]
    pub fn without_infrared(mut self) -> Self {
        let neutral = Self::default();
        let infrared = Channel::Ir.index();
        self.dark[infrared] = neutral.dark[infrared];
        self.response[infrared] = neutral.response[infrared];
        self.projector_response[infrared] = neutral.projector_response[infrared];
        self.ir_registration = neutral.ir_registration;
        self.crosstalk[infrared] = neutral.crosstalk[infrared];
        self.crosstalk[..infrared].iter_mut().for_each(|row| row[infrared] = 0.0);
        self
    }

    pub(crate) fn plan(&self) -> Result<Plan> {
        self.check()?;
        Plan::new(self)
    }
}

/// R, G, B and IR as linear light at every pixel, `(rows, columns)`, fractions of full scale (S1). IR is NaN where the
/// infrared chip does not see the point, and 0 for a shot without infrared.
///
/// # Errors
/// As [`Conditioner::check`]; [`Error::Value`] also when an intensity is more than 10 000 times full scale.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::{Conditioner, Shot, condition::linearise};
/// let image = Array2::<u8>::from_elem((2, 3), 51);
/// let [red, ..] = linearise(&Shot::new([image.view(), image.view(), image.view(), image.view()])?, &Conditioner::default())?;
/// assert!((red[[1, 2]] - 0.2).abs() < 1e-6);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn linearise<T: Sample>(shot: &Shot<'_, T>, conditioner: &Conditioner) -> Result<[Array2<f32>; 4]> {
    let without = || conditioner.clone().without_infrared().plan();
    let mut plan = if shot.has_infrared() { conditioner.plan() } else { without() }?;
    shot.check_light()?;
    plan.prepare(shot);
    let mut planes = [(); 4].map(|()| Array2::zeros(shot.shape()));
    for y in 0..shot.shape()[0] {
        let mut rows = planes.each_mut().map(|plane| plane.row_mut(y).into_slice().expect("a fresh row"));
        plan.row(shot, y, &mut rows);
    }
    Ok(planes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::ArrayView2;

    fn planes<T: Sample>(image: &Array2<T>) -> [ArrayView2<'_, T>; 4] {
        [image.view(), image.view(), image.view(), image.view()]
    }

    #[test]
    fn crosstalk_is_undone() {
        let mut mix = Conditioner::default().crosstalk;
        mix[0][1] = 0.15;
        mix[2][3] = 0.1;
        let conditioner = Conditioner { crosstalk: mix, ..Conditioner::default() };
        let light = [0.2f32, 0.4, 0.6, 0.8];
        let seen: Vec<Array2<f32>> = (0..4)
            .map(|i| (0..4).map(|j| mix[i][j] as f32 * light[j]).sum())
            .map(|v: f32| Array2::from_elem((1, 3), v))
            .collect();
        let shot = Shot::new(std::array::from_fn(|c| seen[c].view())).unwrap();
        let mut plan = conditioner.plan().unwrap();
        plan.prepare(&shot);
        let mut out = [[0.0f32; 3]; 4];
        let [r, g, b, ir] = &mut out;
        plan.row(&shot, 0, &mut [r, g, b, ir]);
        for (row, expected) in out.iter().zip(light) {
            assert!(row.iter().all(|v| (v - expected).abs() < 1e-6));
        }
    }

    /// Light of a projector of gamma 2.2, mixed by crosstalk, seen by a camera of gamma 1.5.
    #[test]
    fn projector_and_camera_responses_are_undone_on_either_side_of_crosstalk() {
        let mut crosstalk = [[0.15; 4]; 4];
        (0..4).for_each(|i| crosstalk[i][i] = 1.0);
        let response = |exponent: f32| [Response { exponent, ..Response::default() }; 4];
        let conditioner = Conditioner {
            response: response(1.5),
            crosstalk,
            projector_response: response(1.0 / 2.2),
            ..Conditioner::default()
        };
        let levels = [0.0f32, 0.3, 0.5, 0.65];
        let seen = crosstalk.map(|row| {
            let light: f32 = row.iter().zip(levels).map(|(c, l)| *c as f32 * l.powf(2.2)).sum();
            Array2::from_elem((1, 3), light.powf(1.0 / 1.5))
        });
        let shot = Shot::new(seen.each_ref().map(|image| image.view())).unwrap();
        let found = linearise(&shot, &conditioner).unwrap();
        for (plane, level) in found.iter().zip(levels) {
            assert!(plane.iter().all(|v| (v - level).abs() < 5e-3), "{plane} for {level}");
        }
        let unmixed = Conditioner { crosstalk: Conditioner::default().crosstalk, ..conditioner };
        let both = [0.36f32; 4].map(|light| Array2::from_elem((1, 3), light));
        let [red, ..] =
            linearise(&Shot::new(both.each_ref().map(|image| image.view())).unwrap(), &unmixed).unwrap();
        assert!((red[[0, 1]] - 0.36f32.powf(1.5 / 2.2)).abs() < 1e-6);
    }

    #[test]
    fn registration_shifts_infrared_and_marks_what_it_cannot_see() {
        let image = Array2::from_shape_fn((2, 4), |(_, x)| x as f32 / 10.0);
        let conditioner =
            Conditioner { ir_registration: [[1.0, 0.0, 0.5], [0.0, 1.0, 0.0]], ..Conditioner::default() };
        let shot = Shot::new(planes(&image)).unwrap();
        let mut plan = conditioner.plan().unwrap();
        plan.prepare(&shot);
        let mut out = [[0.0f32; 4]; 4];
        let [r, g, b, ir] = &mut out;
        plan.row(&shot, 0, &mut [r, g, b, ir]);
        assert!((out[3][1] - 0.15).abs() < 1e-6);
        assert!(out[3][3].is_nan());
    }

    #[test]
    fn gaps_in_the_infrared_image_stay_in_it() {
        let image = Array2::from_elem((3, 5), 0.5f32);
        let mut crosstalk = Conditioner::default().crosstalk;
        (crosstalk[0][1], crosstalk[3][0]) = (0.1, 0.2);
        let ir_registration = [[1.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
        let conditioner = Conditioner { crosstalk, ir_registration, ..Conditioner::default() };
        let light = linearise(&Shot::new(planes(&image)).unwrap(), &conditioner).unwrap();
        assert!((light[0][[1, 4]] - 0.45).abs() < 1e-6 && (light[2][[1, 4]] - 0.5).abs() < 1e-6);
        assert!(light[3][[1, 4]].is_nan() && (light[3][[1, 3]] - 0.41).abs() < 1e-6);
    }

    #[test]
    fn bad_conditioning_is_named() {
        let singular = Conditioner { crosstalk: [[1.0; 4]; 4], ..Conditioner::default() };
        assert!(singular.check().unwrap_err().to_string().contains("invertible"));
        let dark = Conditioner { dark: [0.0, 1.5, 0.0, 0.0], ..Conditioner::default() };
        assert!(dark.check().unwrap_err().to_string().contains("dark level of G"));
    }

    #[test]
    fn images_of_two_sizes_are_refused() {
        let (a, b) = (Array2::<u8>::zeros((4, 8)), Array2::<u8>::zeros((4, 9)));
        let error = Shot::new([a.view(), a.view(), b.view(), a.view()]).unwrap_err();
        assert!(error.to_string().contains("B image"), "{error}");
    }
}
