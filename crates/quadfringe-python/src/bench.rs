//! The virtual bench: `Bench` casts a scene once and renders it as often as needed; `Cast` holds the true geometry.

use crate::arrays::{BAYER_IMAGES, CHANNELS, expected, value_error};
use crate::device::{Device, FringeNumbers, axis_named, layout_named, unknown};
use crate::render::render_options;
use crate::workers::detached;
use ndarray::Array2;
use numpy::{Element, IntoPyArray, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadfringe::encoding::Channel;
use quadfringe::optics::Pose;
use quadfringe::rig::{self, Light, Planes, Print, Projector};
use quadfringe::surface::{HeightMap, Interpolation, Peaks, Plane, Posed, Surface, scene};

/// A camera and two projectors in front of a surface.
#[pyclass(frozen, module = "quadfringe._core")]
pub struct Bench(rig::Bench);

#[pymethods]
impl Bench {
    #[new]
    #[pyo3(signature = (*, camera = None, visible = None, infrared = None, layout = "regular", infrared_from_visible = None))]
    fn new(
        camera: Option<Device>,
        visible: Option<Device>,
        infrared: Option<Device>,
        layout: &str,
        infrared_from_visible: Option<[[f64; 3]; 2]>,
    ) -> PyResult<Self> {
        let reference = rig::Bench::reference_with(layout_named(layout)?);
        let visible = visible.map_or(reference.visible, |device| device.0);
        let bench = rig::Bench {
            camera: camera.map_or(reference.camera, |device| device.0),
            infrared: infrared.map_or_else(|| visible.clone(), |device| device.0),
            visible,
            ..reference
        };
        let Some(affine) = infrared_from_visible else { return Ok(Self(bench)) };
        Ok(Self(bench.with_infrared_chip(affine).map_err(value_error)?))
    }

    #[getter]
    fn camera(&self) -> Device {
        Device(self.0.camera.clone())
    }

    #[getter]
    fn visible(&self) -> Device {
        Device(self.0.visible.clone())
    }

    #[getter]
    fn infrared(&self) -> Device {
        Device(self.0.infrared.clone())
    }

    /// Cast one ray through each pixel onto the scene of this name.
    #[pyo3(signature = (surface, *, time_s = 0.0))]
    fn cast(&self, py: Python<'_>, surface: &str, time_s: f64) -> PyResult<Cast> {
        let surface = scene(surface, time_s).map_err(value_error)?;
        self.cast_surface(py, surface.as_ref())
    }

    /// Cast one ray through each pixel onto the peaks function over the plane z.
    #[pyo3(signature = (*, z_mm, scale_mm))]
    fn cast_peaks(&self, py: Python<'_>, z_mm: f64, scale_mm: f64) -> PyResult<Cast> {
        let surface = Peaks::new(z_mm, scale_mm).map_err(value_error)?;
        self.cast_surface(py, &surface)
    }

    /// Cast one ray through each pixel onto a plane through a point. The normal of the plane points to the camera.
    #[pyo3(signature = (*, point_mm, normal))]
    fn cast_plane(&self, py: Python<'_>, point_mm: [f64; 3], normal: [f64; 3]) -> PyResult<Cast> {
        let surface = Plane::new(point_mm, normal).map_err(value_error)?;
        self.cast_surface(py, &surface)
    }

    /// Cast one ray through each pixel onto a height map.
    #[pyo3(signature = (heights_mm, *, pitch_mm, origin_mm, z_mm))]
    fn cast_height_map(
        &self,
        py: Python<'_>,
        heights_mm: &Bound<'_, PyAny>,
        pitch_mm: [f64; 2],
        origin_mm: [f64; 2],
        z_mm: f64,
    ) -> PyResult<Cast> {
        let heights = expected::<f64, 2>("heights_mm", heights_mm)?.to_owned_array();
        let surface = HeightMap::new(heights, origin_mm, pitch_mm, z_mm, Interpolation::default());
        self.cast_surface(py, &surface.map_err(value_error)?)
    }

    /// Cast one ray through each pixel onto a plate between two corners (x, y) on the plane z = 0 of a posed board.
    fn cast_plate(
        &self,
        py: Python<'_>,
        low_mm: [f64; 2],
        high_mm: [f64; 2],
        rotation: [[f64; 3]; 3],
        translation_mm: [f64; 3],
    ) -> PyResult<Cast> {
        let pose = Pose::new(rotation, translation_mm).map_err(value_error)?;
        let plate = Posed::plate(low_mm, high_mm, pose).map_err(value_error)?;
        self.cast_surface(py, &plate)
    }

    /// Albedo that the camera sees of a print on the plane z = 0 of a posed board, (H, W, 4 or 8) float32.
    #[pyo3(signature = (coverage, *, pitch_mm, origin_mm, paper, ink, rotation, translation_mm))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn printed<'py>(
        &self,
        py: Python<'py>,
        coverage: &Bound<'py, PyAny>,
        pitch_mm: f64,
        origin_mm: [f64; 2],
        paper: [f32; 4],
        ink: [f32; 4],
        rotation: [[f64; 3]; 3],
        translation_mm: [f64; 3],
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let coverage = expected::<f32, 2>("coverage", coverage)?.to_owned_array();
        let pose = Pose::new(rotation, translation_mm).map_err(value_error)?;
        let print = Print { coverage, pitch_mm, origin_mm, paper, ink, pose };
        let albedo = detached(py, || self.0.printed(&print))?.map_err(value_error)?;
        Ok(albedo.into_pyarray(py))
    }

    /// The images of a shot by name: four channels, or the raw mosaic and infrared of a Bayer chip.
    #[pyo3(signature = (cast, fringe_numbers, *, columns_px = None, infrared_image = None, **options))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        cast: &Cast,
        fringe_numbers: FringeNumbers,
        columns_px: Option<[f64; 2]>,
        infrared_image: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let encoding = fringe_numbers.encoding(self.0.visible.width, columns_px).map_err(value_error)?;
        let image = infrared_image.map(|image| expected::<f32, 2>("infrared_image", image)).transpose()?;
        let mut lights = Light::shot(&encoding).map_err(value_error)?;
        if let Some(image) = &image {
            lights[Channel::Ir.index()] = Light::Image(image.as_array());
        }
        self.render_lights(py, cast, &lights, options)
    }

    /// The images of one step of an N-step capture, with the same fringes in all channels or in those of one projector.
    #[pyo3(signature = (cast, fringe_number, shift_rad, *, axis = "columns", beam = None, **options))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn render_step<'py>(
        &self,
        py: Python<'py>,
        cast: &Cast,
        fringe_number: f64,
        shift_rad: f64,
        axis: &str,
        beam: Option<&str>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let beam = beam.map(projector_named).transpose()?;
        let lights = Light::step(fringe_number, shift_rad, axis_named(axis)?, beam);
        self.render_lights(py, cast, &lights, options)
    }

    /// The images under even light, with a level from 0 to 1 for each channel.
    #[pyo3(signature = (cast, levels, **options))]
    fn render_levels<'py>(
        &self,
        py: Python<'py>,
        cast: &Cast,
        levels: [f64; 4],
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        self.render_lights(py, cast, &levels.map(Light::Uniform), options)
    }
}

impl Bench {
    fn cast_surface(&self, py: Python<'_>, surface: &dyn Surface) -> PyResult<Cast> {
        detached(py, || self.0.cast(surface)).map(Cast)
    }

    fn render_lights<'py>(
        &self,
        py: Python<'py>,
        cast: &Cast,
        lights: &[Light<'_>; 4],
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let options = render_options(options)?;
        let planes = detached(py, || self.0.render(&cast.0, lights, &options))?.map_err(value_error)?;
        match planes {
            Planes::U8(planes) => named(py, CHANNELS, planes),
            Planes::U16(planes) => named(py, CHANNELS, planes),
            Planes::F32(planes) => named(py, CHANNELS, planes),
            Planes::BayerU8(images) => named(py, BAYER_IMAGES, images),
            Planes::BayerU16(images) => named(py, BAYER_IMAGES, images),
            Planes::BayerF32(images) => named(py, BAYER_IMAGES, images),
        }
    }
}

fn named<'py, T: Element, const COUNT: usize>(
    py: Python<'py>,
    names: [&str; COUNT],
    images: [Array2<T>; COUNT],
) -> PyResult<Bound<'py, PyDict>> {
    let named = PyDict::new(py);
    for (name, image) in names.into_iter().zip(images) {
        named.set_item(name, image.into_pyarray(py))?;
    }
    Ok(named)
}

/// A scene as the camera of the bench sees it, with the projector pixels that light it.
#[pyclass(frozen, module = "quadfringe._core")]
pub struct Cast(rig::Cast);

#[pymethods]
impl Cast {
    /// Points in the camera frame, (H, W, 3) float32 mm.
    fn xyz_mm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        Ok(detached(py, || self.0.xyz_mm())?.into_pyarray(py))
    }

    /// Projector column that lights each pixel, (H, W) float32.
    #[pyo3(signature = (*, infrared = false))]
    fn column_px<'py>(&self, py: Python<'py>, infrared: bool) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let projector = if infrared { Projector::Infrared } else { Projector::Visible };
        Ok(detached(py, || self.0.column_px(projector))?.into_pyarray(py))
    }

    /// Pixels that see a surface which at least one projector does not light, (H, W) bool.
    fn shadow<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<bool>>> {
        Ok(detached(py, || self.0.shadow())?.into_pyarray(py))
    }

    /// Pixels less than `reach_px` from the nearest edge of depth, light or surface, (H, W) bool.
    fn is_near_edge<'py>(&self, py: Python<'py>, reach_px: f32) -> PyResult<Bound<'py, PyArray2<bool>>> {
        Ok(detached(py, || self.0.is_near_edge(reach_px))?.into_pyarray(py))
    }

    /// Distance to the nearest edge of depth, light or surface, (H, W) float32 pixels.
    fn edge_distance_px<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        Ok(detached(py, || self.0.edge_distance_px())?.into_pyarray(py))
    }
}

fn projector_named(name: &str) -> PyResult<Projector> {
    match name {
        "visible" => Ok(Projector::Visible),
        "infrared" => Ok(Projector::Infrared),
        _ => Err(unknown("beam", name, "visible or infrared")),
    }
}
