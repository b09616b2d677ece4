//! The Python binding of quadfringe. A function borrows its arrays, releases the GIL, calls the kernel, maps the error and
//! returns the result; it decides nothing.

mod arrays;
mod bench;
mod conditioner;
mod decoder;
mod device;
mod height;
mod memory;
mod mesh;
mod offset;
mod pair;
mod plan;
mod projector;
mod published_stages;
mod reference;
mod render;
mod stages;
mod workers;

use pyo3::prelude::*;

#[pymodule(gil_used = true)]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("__profile__", if cfg!(debug_assertions) { "debug" } else { "release" })?;
    module.add("THREADS_MAX", workers::THREADS_MAX)?;
    module.add("REASONS", quadfringe::Reason::ALL.map(quadfringe::Reason::name).to_vec())?;
    module.add_class::<device::Device>()?;
    module.add_class::<bench::Bench>()?;
    module.add_class::<bench::Cast>()?;
    module.add_class::<decoder::Decoder>()?;
    module.add_class::<pair::PairTable>()?;
    module.add_class::<reference::StepDecoder>()?;
    module.add_class::<projector::LightCrafter>()?;
    module.add_class::<projector::Pattern>()?;
    module.add_class::<projector::PatternSequence>()?;
    module.add_class::<projector::PatternWindow>()?;
    module.add_function(wrap_pyfunction!(arrays::crc32, module)?)?;
    module.add_function(wrap_pyfunction!(device::optimum, module)?)?;
    module.add_function(wrap_pyfunction!(device::check_code, module)?)?;
    module.add_function(wrap_pyfunction!(device::pattern, module)?)?;
    module.add_function(wrap_pyfunction!(pair::predeform, module)?)?;
    module.add_function(wrap_pyfunction!(device::step_pattern, module)?)?;
    module.add_function(wrap_pyfunction!(stages::linear_light, module)?)?;
    module.add_function(wrap_pyfunction!(stages::linear_light_bayer, module)?)?;
    module.add_function(wrap_pyfunction!(stages::background, module)?)?;
    module.add_function(wrap_pyfunction!(stages::carrier, module)?)?;
    module.add_function(wrap_pyfunction!(stages::two_step, module)?)?;
    module.add_function(wrap_pyfunction!(stages::fourier, module)?)?;
    module.add_function(wrap_pyfunction!(stages::n_step, module)?)?;
    module.add_function(wrap_pyfunction!(offset::fringe_offsets, module)?)?;
    module.add_function(wrap_pyfunction!(offset::shared_brightness, module)?)?;
    module.add_function(wrap_pyfunction!(stages::unwrap, module)?)?;
    published_stages::register(module)?;
    module.add_function(wrap_pyfunction!(stages::estimate_response, module)?)?;
    module.add_function(wrap_pyfunction!(stages::estimate_response_of_shot, module)?)?;
    height::register(module)?;
    mesh::register(module)?;
    projector_functions(module)
}

/// Add the functions of the projector driver to the module.
fn projector_functions(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(projector::lightcrafters, module)?)?;
    module.add_function(wrap_pyfunction!(projector::udev_rule, module)?)?;
    module.add_function(wrap_pyfunction!(projector::power_on_drive, module)?)?;
    module.add_function(wrap_pyfunction!(projector::exposure_in_frame_us, module)?)?;
    module.add_function(wrap_pyfunction!(projector::pack_flash, module)?)?;
    module.add_function(wrap_pyfunction!(projector::outputs, module)?)?;
    Ok(())
}
