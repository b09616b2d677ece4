//! The encoding that is projected, and the optics: `optimum`, `check_code`, `pattern`, `Device`.

use crate::arrays::value_error;
use crate::workers::detached;
use numpy::{IntoPyArray, PyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use quadfringe::encoding::{self, Axis, Channel, DmdLayout, Encoding};
use quadfringe::optics;

/// A camera or a projector.
#[pyclass(frozen, from_py_object, module = "quadfringe._core")]
#[derive(Clone)]
pub struct Device(pub optics::Device);

#[pymethods]
impl Device {
    #[new]
    #[pyo3(signature = (width, height, focal_px, centre_px, *, distortion = [0.0; 5],
        rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation_mm = [0.0; 3]))]
    fn new(
        width: usize,
        height: usize,
        focal_px: [f64; 2],
        centre_px: [f64; 2],
        distortion: [f64; 5],
        rotation: [[f64; 3]; 3],
        translation_mm: [f64; 3],
    ) -> PyResult<Self> {
        optics::Device::new(width, height, focal_px, centre_px, distortion, rotation, translation_mm)
            .map(Self)
            .map_err(value_error)
    }

    #[getter]
    fn width(&self) -> usize {
        self.0.width
    }

    #[getter]
    fn height(&self) -> usize {
        self.0.height
    }

    #[getter]
    fn focal_px(&self) -> [f64; 2] {
        self.0.focal_px
    }

    #[getter]
    fn centre_px(&self) -> [f64; 2] {
        self.0.centre_px
    }

    #[getter]
    fn distortion(&self) -> [f64; 5] {
        self.0.distortion
    }

    #[getter]
    fn rotation(&self) -> [[f64; 3]; 3] {
        self.0.rotation
    }

    #[getter]
    fn translation_mm(&self) -> [f64; 3] {
        self.0.translation_mm
    }

    /// Pixel (column, row) of a point in the camera frame; None if the point is not in front of the device.
    fn project(&self, point_mm: [f64; 3]) -> Option<[f64; 2]> {
        self.0.project(point_mm)
    }

    /// Origin (mm) and unit direction, in the camera frame, of the ray of a pixel (column, row).
    fn ray(&self, pixel: [f64; 2]) -> ([f64; 3], [f64; 3]) {
        let ray = self.0.ray(pixel);
        (ray.origin_mm, ray.direction)
    }

    /// Position in another device of the point on the plane z that this position sees or lights; None if there is none.
    #[pyo3(signature = (position, other, z_mm))]
    fn through_plane(&self, position: [f64; 2], other: &Self, z_mm: f64) -> Option<[f64; 2]> {
        self.0.through_plane(position, &other.0, z_mm)
    }

    fn __repr__(&self) -> String {
        format!("Device({} x {}, focal_px={:?})", self.0.width, self.0.height, self.0.focal_px)
    }
}

/// Fringe numbers of an encoding: of R with B, of G, and of IR if there is an infrared projector; or of R, G, B, each alone, and 0 for
/// the infrared projector that there is not.
#[derive(Clone, Copy)]
pub enum FringeNumbers {
    Colours([f64; 2]),
    Four([f64; 3]),
    Alone([f64; 3]),
}

impl<'a, 'py> FromPyObject<'a, 'py> for FringeNumbers {
    type Error = PyErr;

    fn extract(numbers: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let numbers: Vec<f64> = numbers.extract()?;
        match numbers[..] {
            [quadrature, green] => Ok(Self::Colours([quadrature, green])),
            [quadrature, green, infrared] => Ok(Self::Four([quadrature, green, infrared])),
            [red, green, blue, 0.0] => Ok(Self::Alone([red, green, blue])),
            _ => {
                let expected =
                    "three (R with B, G, IR), two without infrared, or four (R, G, B and 0 for IR)";
                let message = format!("fringe numbers: expected {expected}, got {}", numbers.len());
                Err(PyValueError::new_err(message))
            }
        }
    }
}

impl FringeNumbers {
    /// The encoding over a projector of this width, of which a range of columns lights the scene.
    pub fn encoding(
        self,
        projector_width: usize,
        columns_px: Option<[f64; 2]>,
    ) -> quadfringe::Result<Encoding> {
        let columns = columns_px.unwrap_or([0.0, projector_width as f64]);
        match self {
            Self::Colours(numbers) => Encoding::rgb_within(numbers, projector_width, columns),
            Self::Four(numbers) => Encoding::four_channel_within(numbers, projector_width, columns),
            Self::Alone(numbers) => {
                let encoding = Encoding::three_colours_within(numbers, projector_width, columns)?;
                encoding.four_channel_view().map(|_| encoding)
            }
        }
    }
}

/// Fringe numbers N, N - 1, N - sqrt(N).
#[pyfunction]
pub fn optimum(n: u32, projector_width: usize) -> PyResult<[f64; 3]> {
    let four = || Encoding::optimum(n, projector_width)?.four_channel_view();
    four().map(|four| four.numbers()).map_err(value_error)
}

/// The ambiguity margin in rad of fringe numbers over a projector.
#[pyfunction]
#[pyo3(signature = (fringe_numbers, projector_width, *, columns_px = None))]
pub fn check_code(
    fringe_numbers: FringeNumbers,
    projector_width: usize,
    columns_px: Option<[f64; 2]>,
) -> PyResult<f64> {
    let encoding = fringe_numbers.encoding(projector_width, columns_px).map_err(value_error)?;
    Ok(encoding.ambiguity_margin_rad())
}

/// Ideal image of a channel, (height, width) float32.
#[pyfunction]
#[pyo3(signature = (channel, fringe_numbers, width, height, *, layout = "regular", columns_px = None))]
pub fn pattern<'py>(
    py: Python<'py>,
    channel: &str,
    fringe_numbers: FringeNumbers,
    width: usize,
    height: usize,
    layout: &str,
    columns_px: Option<[f64; 2]>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let encoding = fringe_numbers.encoding(width, columns_px).map_err(value_error)?;
    let (name, layout) = (channel, layout_named(layout)?);
    let known = encoding.channels().get(channel_named(name)?.index());
    let channel =
        *known.ok_or_else(|| unknown("channel of an encoding without infrared", name, "R, G or B"))?;
    let image = detached(py, || encoding::pattern(&channel, [width, height], layout))?;
    Ok(image.into_pyarray(py))
}

/// Ideal image of one step of an N-step capture, (height, width) float32.
#[pyfunction]
#[pyo3(signature = (fringe_number, shift_rad, width, height, *, axis = "columns", layout = "regular"))]
pub fn step_pattern<'py>(
    py: Python<'py>,
    fringe_number: f64,
    shift_rad: f64,
    width: usize,
    height: usize,
    axis: &str,
    layout: &str,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let (axis, layout) = (axis_named(axis)?, layout_named(layout)?);
    let size = [width, height];
    let image = detached(py, || encoding::step_pattern(fringe_number, shift_rad, axis, size, layout))?;
    Ok(image.map_err(value_error)?.into_pyarray(py))
}

fn channel_named(name: &str) -> PyResult<Channel> {
    let found = Channel::ALL.into_iter().find(|channel| channel.name() == name);
    found.ok_or_else(|| unknown("channel", name, "R, G, B or IR"))
}

/// The axis of this name, along which fringes are counted.
pub fn axis_named(name: &str) -> PyResult<Axis> {
    match name {
        "columns" => Ok(Axis::Columns),
        "rows" => Ok(Axis::Rows),
        _ => Err(unknown("axis", name, "columns or rows")),
    }
}

/// The mirror layout of this name.
pub fn layout_named(name: &str) -> PyResult<DmdLayout> {
    match name {
        "regular" => Ok(DmdLayout::Regular),
        "diamond" => Ok(DmdLayout::Diamond),
        _ => Err(unknown("layout", name, "regular or diamond")),
    }
}

/// The error for an unknown name, with the known ones.
pub fn unknown(what: &str, name: &str, known: &str) -> PyErr {
    PyValueError::new_err(format!("{what}: expected {known}, got {name:?}"))
}
