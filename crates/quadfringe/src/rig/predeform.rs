//! The pre-deformed infrared pattern that corrects a deviated projector (S11).

use ndarray::{Array2, Axis};
use rayon::prelude::*;

use super::{Bench, Light};
use crate::encoding::mirror_column;
use crate::error::Result;
use crate::optics::check_plane;

impl Bench {
    /// Image for the infrared projector, `(rows, columns)`, linear light 0 to 1, that puts the same light on the plane z =
    /// `plane_z_mm` as the visible projector showing `light`. It is the image that a camera in place of the infrared projector
    /// would take of that plane. Mirrors whose ray misses the plane stay dark.
    ///
    /// The result is exact on that plane. If the centres of the projectors differ, the error grows with the distance
    /// from it.
    ///
    /// # Errors
    /// [`crate::Error::Value`] when the plane is not at a finite positive depth or the light is not valid;
    /// [`crate::Error::Shape`] when the light is an image that does not have the size of the visible projector.
    ///
    /// ```
    /// use quadfringe::rig::{Bench, Light};
    /// let bench = Bench::reference();
    /// let image = bench.predeform(&Light::fringes(30.0, 0.0), 800.0)?;
    /// assert!((image[[500, 0]] - 1.0).abs() < 1e-6);
    /// # Ok::<(), quadfringe::error::Error>(())
    /// ```
    pub fn predeform(&self, light: &Light<'_>, plane_z_mm: f64) -> Result<Array2<f32>> {
        check_plane(plane_z_mm)?;
        light.check(&self.visible)?;
        let mut image = Array2::zeros((self.infrared.height, self.infrared.width));
        image.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(row, mut line)| {
            for (column, level) in line.iter_mut().enumerate() {
                let mirror = [mirror_column(self.layout, row, column), row as f64];
                let Some(seen) = self.infrared.through_plane(mirror, &self.visible, plane_z_mm) else {
                    continue;
                };
                *level = light.level(&self.visible, self.layout, seen) as f32;
            }
        });
        Ok(image)
    }
}
