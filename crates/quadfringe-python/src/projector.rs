//! The projectors of a real bench: `LightCrafter`, its sequences, the window on its HDMI output, the packer for flash.

mod backend;
mod errors;
mod names;
mod sequence;
mod window;

pub use backend::udev_rule;
pub use sequence::{Pattern, PatternSequence, exposure_in_frame_us, pack_flash};
pub use window::{PatternWindow, outputs};

use backend::usb::{self, Selector, UsbTransport};
use errors::device_error;
use lightcrafter::command::{
    DisplayFreeze, Gamma, PowerMode, TestPatternColours, Timing, TriggerIn2Edge, Validation, Versions,
};
use lightcrafter::{LightCrafter as Driver, Profile, Status, TriggerOut, Triggers};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Mutex, PoisonError};

/// A LightCrafter 4500 on USB.
#[pyclass(frozen, module = "quadfringe._core")]
pub struct LightCrafter {
    driver: Mutex<Option<Driver<UsbTransport>>>,
    place: String,
}

impl LightCrafter {
    /// Call the driver without the GIL, one call at a time, because the driver has one transaction in flight.
    fn call<T: Send>(
        &self,
        py: Python<'_>,
        f: impl FnOnce(&mut Driver<UsbTransport>) -> lightcrafter::Result<T> + Send,
    ) -> PyResult<T> {
        py.detach(|| {
            let mut driver = self.driver.lock().unwrap_or_else(PoisonError::into_inner);
            match driver.as_mut() {
                Some(driver) => f(driver).map_err(device_error),
                None => Err(PyValueError::new_err(format!(
                    "the projector at {} is closed: open it again",
                    self.place
                ))),
            }
        })
    }
}

#[pymethods]
impl LightCrafter {
    #[new]
    #[pyo3(signature = (port = None, *, serial = None, light = "evm", drive_limit = None, current_inverted = None,
        trigger_invert_byte = None))]
    fn new(
        py: Python<'_>,
        port: Option<&str>,
        serial: Option<String>,
        light: &str,
        drive_limit: Option<[u8; 3]>,
        current_inverted: Option<bool>,
        trigger_invert_byte: Option<u8>,
    ) -> PyResult<Self> {
        let selector = match (port, serial) {
            (None, None) => Selector::Only,
            (Some(port), None) => Selector::Port(port.parse().map_err(device_error)?),
            (None, Some(serial)) => Selector::Serial(serial),
            (Some(_), Some(_)) => return Err(PyValueError::new_err("expected port or serial, got both")),
        };
        let mut profile = names::profile(light)?;
        profile.drive_limit = drive_limit.or(profile.drive_limit);
        profile.current_inverted = current_inverted.unwrap_or(profile.current_inverted);
        profile.trigger_invert_byte = trigger_invert_byte.unwrap_or(profile.trigger_invert_byte);
        let transport = py.detach(|| UsbTransport::open(&selector)).map_err(device_error)?;
        let driver = Driver::new(transport).with_profile(profile);
        Ok(Self { place: driver.place(), driver: Mutex::new(Some(driver)) })
    }

    #[getter]
    fn port(&self) -> &str {
        &self.place
    }

    fn close(&self, py: Python<'_>) {
        py.detach(|| drop(self.driver.lock().unwrap_or_else(PoisonError::into_inner).take()));
    }

    fn __enter__(this: Py<Self>) -> Py<Self> {
        this
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, py: Python<'_>, _exception: &Bound<'_, PyAny>) {
        self.close(py);
    }

    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let Status { hardware, system, main, power, mode, run, input, signal } =
            self.call(py, Driver::status)?;
        let dict = PyDict::new(py);
        dict.set_item("initialised", hardware.initialised)?;
        dict.set_item("memory_passed", system.memory_passed)?;
        dict.set_item("parked", main.parked)?;
        dict.set_item("running", main.running)?;
        dict.set_item("frozen", main.frozen)?;
        dict.set_item("gamma", main.gamma)?;
        dict.set_item("power", names::of_power(power))?;
        dict.set_item("mode", names::of_mode(mode))?;
        dict.set_item("run", names::of_run(run))?;
        dict.set_item("input", names::of_port(input.port))?;
        dict.set_item("video_locked", signal.locked())?;
        dict.set_item("video", signal.to_string())?;
        let status = Status { hardware, system, main, power, mode, run, input, signal };
        dict.set_item("faults", status.faults())?;
        Ok(dict)
    }

    fn versions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let Versions { application, api, software, sequencer } = self.call(py, Driver::versions)?;
        let dict = PyDict::new(py);
        let all =
            [("application", application), ("api", api), ("software", software), ("sequencer", sequencer)];
        for (name, version) in all {
            dict.set_item(name, version.to_string())?;
        }
        Ok(dict)
    }

    fn firmware_tag(&self, py: Python<'_>) -> PyResult<String> {
        self.call(py, Driver::firmware_tag)
    }

    fn flash_image_count(&self, py: Python<'_>) -> PyResult<u8> {
        self.call(py, Driver::flash_image_count)
    }

    #[pyo3(signature = (images, tag = None))]
    fn check_flash(&self, py: Python<'_>, images: u8, tag: Option<&str>) -> PyResult<()> {
        self.call(py, |driver| driver.check_flash(images, tag))
    }

    fn measure_image_load_ms(&self, py: Python<'_>, first: u8, count: u8) -> PyResult<f64> {
        self.call(py, |driver| driver.measure_image_load_ms(first, count))
    }

    fn wake(&self, py: Python<'_>) -> PyResult<()> {
        self.call(py, |driver| driver.set_power(PowerMode::Normal))
    }

    fn sleep(&self, py: Python<'_>) -> PyResult<()> {
        self.call(py, |driver| driver.set_power(PowerMode::Standby))
    }

    fn show_video(&self, py: Python<'_>) -> PyResult<()> {
        self.call(py, Driver::show_video)
    }

    #[pyo3(signature = (name, *, foreground = [1023; 3], background = [0; 3]))]
    fn show_test_pattern(
        &self,
        py: Python<'_>,
        name: &str,
        foreground: [u16; 3],
        background: [u16; 3],
    ) -> PyResult<()> {
        let pattern = names::test_pattern(name)?;
        self.call(py, |driver| {
            driver.show_test_pattern(pattern, TestPatternColours { foreground, background })
        })
    }

    fn show_flash_image(&self, py: Python<'_>, image: u8) -> PyResult<()> {
        self.call(py, |driver| driver.show_flash_image(image))
    }

    fn load(&self, py: Python<'_>, sequence: &PatternSequence) -> PyResult<Vec<&'static str>> {
        self.call(py, |driver| driver.load(&sequence.0)).map(|verdict: Validation| verdict.warnings())
    }

    fn play(&self, py: Python<'_>, sequence: &PatternSequence) -> PyResult<Vec<&'static str>> {
        self.call(py, |driver| driver.play(&sequence.0)).map(|verdict| verdict.warnings())
    }

    fn start(&self, py: Python<'_>) -> PyResult<()> {
        self.call(py, Driver::start)
    }

    fn pause(&self, py: Python<'_>) -> PyResult<()> {
        self.call(py, Driver::pause)
    }

    fn stop(&self, py: Python<'_>) -> PyResult<()> {
        self.call(py, Driver::stop)
    }

    #[pyo3(signature = (exposure_us, period_us = None))]
    fn set_timing(&self, py: Python<'_>, exposure_us: u32, period_us: Option<u32>) -> PyResult<()> {
        let timing = Timing { exposure_us, period_us: period_us.unwrap_or(exposure_us) };
        self.call(py, |driver| driver.set_timing(timing)).map(|_| ())
    }

    fn led_drive(&self, py: Python<'_>) -> PyResult<(u8, u8, u8)> {
        self.call(py, Driver::led_drive).map(<(u8, u8, u8)>::from)
    }

    fn set_led_drive(&self, py: Python<'_>, drive: [u8; 3]) -> PyResult<()> {
        self.call(py, |driver| driver.set_led_drive(drive))
    }

    /// With None the patterns select the LEDs.
    fn set_leds(&self, py: Python<'_>, leds: Option<&str>) -> PyResult<()> {
        let enable = names::led_enable(leds)?;
        self.call(py, |driver| driver.set_leds(enable))
    }

    fn set_led_delays_us(&self, py: Python<'_>, rising_us: [f64; 3], falling_us: [f64; 3]) -> PyResult<()> {
        self.call(py, |driver| driver.set_led_delays_us(rising_us, falling_us))
    }

    #[pyo3(signature = (*, out_1_inverted = false, out_1_rising_us = 0.0, out_1_falling_us = 0.0,
        out_2_inverted = false, out_2_rising_us = 0.0, in_1_delay_us = 0.0, in_2_falling = false))]
    #[expect(clippy::too_many_arguments, reason = "one for each register")]
    fn set_triggers(
        &self,
        py: Python<'_>,
        out_1_inverted: bool,
        out_1_rising_us: f64,
        out_1_falling_us: f64,
        out_2_inverted: bool,
        out_2_rising_us: f64,
        in_1_delay_us: f64,
        in_2_falling: bool,
    ) -> PyResult<()> {
        let (rising_us, falling_us) = (out_1_rising_us, out_1_falling_us);
        let triggers = Triggers {
            out_1: TriggerOut { inverted: out_1_inverted, rising_us, falling_us },
            out_2: TriggerOut { inverted: out_2_inverted, rising_us: out_2_rising_us, falling_us: 0.0 },
            in_1_delay_us,
            in_2_edge: if in_2_falling { TriggerIn2Edge::Falling } else { TriggerIn2Edge::Rising },
        };
        self.call(py, |driver| driver.set_triggers(&triggers))
    }

    fn triggers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let Triggers { out_1, out_2, in_1_delay_us, in_2_edge } = self.call(py, Driver::triggers)?;
        let dict = PyDict::new(py);
        dict.set_item("out_1_inverted", out_1.inverted)?;
        dict.set_item("out_1_rising_us", out_1.rising_us)?;
        dict.set_item("out_1_falling_us", out_1.falling_us)?;
        dict.set_item("out_2_inverted", out_2.inverted)?;
        dict.set_item("out_2_rising_us", out_2.rising_us)?;
        dict.set_item("in_1_delay_us", in_1_delay_us)?;
        dict.set_item("in_2_falling", in_2_edge == TriggerIn2Edge::Falling)?;
        Ok(dict)
    }

    fn flips(&self, py: Python<'_>) -> PyResult<(bool, bool)> {
        self.call(py, Driver::flips)
    }

    fn set_flips(&self, py: Python<'_>, long_axis: bool, short_axis: bool) -> PyResult<()> {
        self.call(py, |driver| driver.set_flips(long_axis, short_axis))
    }

    /// None means linear light.
    fn set_gamma(&self, py: Python<'_>, table: Option<u8>) -> PyResult<()> {
        let gamma = table.map_or(Gamma::LINEAR, |table| Gamma { enabled: true, table });
        self.call(py, |driver| driver.set_gamma(gamma))
    }

    fn set_inverted(&self, py: Python<'_>, inverted: bool) -> PyResult<()> {
        self.call(py, |driver| driver.set_inverted(inverted))
    }

    fn set_frozen(&self, py: Python<'_>, frozen: bool) -> PyResult<()> {
        self.call(py, |driver| driver.write(&DisplayFreeze(frozen)))
    }

    fn __repr__(&self) -> String {
        format!("LightCrafter({:?})", self.place)
    }
}

/// Port, address and serial number (None when it may not be read) of every projector on the bus.
#[pyfunction]
pub fn lightcrafters(py: Python<'_>) -> PyResult<Vec<(String, u8, Option<String>)>> {
    let found = py.detach(usb::list).map_err(device_error)?;
    Ok(found.into_iter().map(|device| (device.port.to_string(), device.address, device.serial)).collect())
}

/// The drive of the LEDs after power-on, which is also the limit of TI's light engine.
#[pyfunction]
pub fn power_on_drive() -> (u8, u8, u8) {
    Profile::POWER_ON_DRIVE.into()
}
