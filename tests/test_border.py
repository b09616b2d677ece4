"""The compiled module: arguments, results and errors."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest
from support.bars import hold

import quadfringe as qf
from quadfringe import _core
from quadfringe.config import DecodeConfig
from quadfringe.decoding import stages

CODE = ((36.0, 35.0, 30.0), 912)
CHANNELS = ("R", "G", "B", "IR")
Four = list[np.ndarray[Any, Any]]


SURENESS = ("wrong_order_probability", "uncertainty_rad")


@pytest.fixture(scope="module")
def images() -> Four:
    """Four channels, (96, 912) float32, of a camera that sees the projector one to one."""
    return [0.1 + 0.8 * _core.pattern(channel, CODE[0], CODE[1], 96) for channel in CHANNELS]


def decoder(**options: Any) -> _core.Decoder:
    return _core.Decoder((96, 912), *CODE, **options)


def eight_bit(images: Four) -> Four:
    return [np.round(image * 255).astype(np.uint8) for image in images]


@pytest.mark.parametrize("method", ["published", "joint"])
@pytest.mark.parametrize(("dtype", "full_scale"), [("uint8", 255), ("uint16", 4095), ("float32", 1)])
def test_every_dtype_gives_the_column(images: Four, method: str, dtype: str, full_scale: int) -> None:
    scaled = [image * full_scale for image in images]
    shot = [(np.round(s) if full_scale > 1 else s).astype(dtype) for s in scaled]
    maps = decoder(method=method, full_scale=full_scale).decode(*shot)
    reason = maps.pop("reason")
    assert (reason.dtype, reason.shape) == (np.uint8, (96, 912))
    np.testing.assert_array_equal(reason == 0, np.isfinite(maps["phase_rad"]))
    albedo = {} if method == "published" else {"albedo": maps.pop("albedo")}
    assert list(maps) == ["phase_rad", "column_px", "modulation", "quality", *SURENESS]
    error = np.abs(maps["column_px"] - np.arange(912))[8:-8, 30:-30]
    hold("demo.border_returned", np.isfinite(error).mean())
    hold("demo.border_column_median_px", np.nanmedian(error))
    assert all(m.dtype == np.float32 and m.shape == (96, 912) for m in maps.values())
    assert all(m.dtype == np.float32 and m.shape == (96, 912, 4) for m in albedo.values())


def test_instants_of_the_channels_are_kept_and_checked() -> None:
    instants = (-5556.0, 0.0, 5556.0, 0.0)
    assert decoder(channel_instants_us=instants).settings()["channel_instants_us"] == list(instants)
    with pytest.raises(
        ValueError, match="channel_instants_us is an option of the joint method, and the method is published"
    ):
        decoder(channel_instants_us=instants, method="published")


def test_settings_name_the_method_and_its_version() -> None:
    settings = {name: decoder(method=name).settings() for name in ("joint", "published")}
    for name, found in settings.items():
        assert (found["method"], found["method_version"]) == (name, "1")
    # The earlier name of the method, which settings and files may hold.
    assert decoder(method="best").settings() == settings["joint"] == decoder().settings()


def test_memory_is_used_again_only_when_nobody_looks_at_it(images: Four) -> None:
    decode, shot = decoder().decode, eight_bit(images)
    black = [np.zeros_like(image) for image in shot]

    def place(values: np.ndarray[Any, Any]) -> int:
        return int(values.__array_interface__["data"][0])

    kept = decode(*shot)["phase_rad"][10:20]
    expected = kept.copy()
    places = {place(decode(*black)["phase_rad"]) for _ in range(20)}
    np.testing.assert_array_equal(kept, expected)
    assert not any(0 <= place(kept) - start <= 96 * 912 * 4 for start in places)
    assert len(places) <= 8
    held = [decode(*shot)["phase_rad"] for _ in range(3)]
    assert len({place(values) for values in held}) == 3
    for values in held:
        values += 1.0
        np.testing.assert_array_equal(values[10:20], expected + np.float32(1.0))


@pytest.mark.parametrize("method", ["published", "joint"])
def test_maps_begin_with_a_cache_line(images: Four, method: str) -> None:
    camera = _core.Device(912, 96, (2000.0, 2000.0), (455.5, 47.5))
    calibrated = decoder(method=method, camera=camera, projector=_core.Bench().visible)
    for decode in (decoder(method=method).decode, calibrated.decode):
        maps = {name: values for name, values in decode(*eight_bit(images)).items() if values.dtype == np.float32}
        assert [name for name, values in maps.items() if values.ctypes.data % 64] == []


def test_strided_views_are_as_good_as_copies(images: Four) -> None:
    red, green, blue, ir = eight_bit(images)
    colour = np.stack([red, green, blue], axis=2)
    wide = np.repeat(ir, 2, axis=1)[:, ::2]
    plain, strided = decoder().decode(red, green, blue, ir), decoder().decode(*np.moveaxis(colour, 2, 0), wide)
    for name, values in plain.items():
        np.testing.assert_array_equal(values, strided[name])


@pytest.mark.parametrize("method", ["published", "joint"])
def test_any_number_of_threads_gives_the_same_bits(small_bench: Any, method: str) -> None:
    files = {name: small_bench / f"{name}.png" for name in ("red", "green", "blue", "ir")}
    shot = qf.read_shot(files)
    calibration = qf.Calibration.load(small_bench / "calibration.json")
    shapes = []
    for threads in (1, 2, 3):
        settings = DecodeConfig.model_validate({"method": method, "threads": threads})
        shapes.append(qf.decode(shot, qf.Plan(912, calibration=calibration, decode=settings)))
    for other in shapes[1:]:
        for name, values in shapes[0].maps.items():
            np.testing.assert_array_equal(values, other.maps[name], err_msg=name)


def test_linear_light_undoes_what_the_calibration_knows(images: Four) -> None:
    red, green, blue, ir = images
    leak = np.eye(4)
    leak[0, 1] = 0.1
    seen = [0.05 + np.sqrt(red + 0.1 * green), 0.05 + np.sqrt(green), 0.05 + np.sqrt(blue), 0.05 + np.sqrt(ir)]
    found = _core.linear_light(
        *[image.astype(np.float32) for image in seen],
        dark=[0.05] * 4,
        response=[(0.0, 2.0, 0.0)] * 4,
        crosstalk=leak.tolist(),
    )
    assert list(found) == ["red", "green", "blue", "ir"]
    for name, image in zip(found, images, strict=True):
        np.testing.assert_allclose(found[name], image, atol=1e-5)


def test_linear_light_is_a_fraction_of_full_scale(images: Four) -> None:
    shot = qf.Shot(*eight_bit(images))
    for name, light in stages.linear_light(shot).items():
        np.testing.assert_allclose(light, shot.channels[name] / 255, atol=1e-6)


def test_the_bench_gives_the_same_bits_again() -> None:
    config = qf.SystemConfig(scene=qf.SceneConfig(surface="sphere", noise=0.03, seed=5))
    shots = []
    for _ in range(2):
        with qf.open(config) as scanner:
            shots.append(scanner.grab())
    for name, image in shots[0].channels.items():
        np.testing.assert_array_equal(image, shots[1].channels[name])


def test_the_gil_is_free_while_the_kernel_works(images: Four) -> None:
    shot, plan, ticks = eight_bit(images), decoder(threads=1), []
    done = threading.Event()

    def count() -> None:
        while not done.wait(1e-4):
            ticks.append(1)

    counter = threading.Thread(target=count)
    counter.start()
    for _ in range(20):
        plan.decode(*shot)
    done.set()
    counter.join()
    assert len(ticks) > 10


@pytest.mark.parametrize("threads", [None, 1, 2])
def test_one_decoder_serves_several_threads(images: Four, threads: int | None) -> None:
    shot, plan = eight_bit(images), decoder(threads=threads)
    expected, found = plan.decode(*shot), []

    def decode() -> None:
        found.extend(plan.decode(*shot) for _ in range(10))

    # A thread of the decoder that waits for the shot in progress would deadlock.
    workers = [threading.Thread(target=decode, daemon=True) for _ in range(4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(timeout=60)
    assert len(found) == 40
    for maps in found:
        np.testing.assert_array_equal(maps["phase_rad"], expected["phase_rad"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda i: i.astype(np.float64), "green: expected a 2D uint8 array, got a 2D float64 array"),
        (lambda i: i.astype(np.uint16), "green: expected a 2D uint8 array, got a 2D uint16 array"),
        (lambda i: i[:, :, None], "green: expected a 2D uint8 array, got a 3D uint8 array"),
        (lambda i: i.tolist(), "green: expected a 2D uint8 array, got <class 'list'>"),
        (lambda i: i.astype(">u2"), "green: expected a 2D uint8 array, got a 2D >u2 array"),
    ],
)
def test_a_wrong_type_is_named(images: Four, change: Any, message: str) -> None:
    shot = eight_bit(images)
    shot[1] = change(shot[1])
    with pytest.raises(TypeError) as caught:
        decoder().decode(*shot)
    assert str(caught.value) == message


def test_a_wrong_first_type_names_what_is_taken() -> None:
    with pytest.raises(TypeError, match="red: expected a 2D uint8, uint16 or float32 array, got a 2D int64 array"):
        decoder().decode(*[np.zeros((96, 912), np.int64)] * 4)


def test_wrong_sizes_are_named(images: Four) -> None:
    shot = eight_bit(images)
    with pytest.raises(ValueError, match=r"expected \[96, 912\] \(rows, columns\), got \[95, 912\]"):
        decoder().decode(*[image[1:] for image in shot])
    with pytest.raises(ValueError, match="G image"):
        decoder().decode(shot[0], shot[1][1:], shot[2], shot[3])
    with pytest.raises(ValueError, match=r"\[0, 912\]"):
        decoder().decode(*[image[:0] for image in shot])


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused(images: Four, value: float) -> None:
    shot = [image.copy() for image in images]
    shot[3][7, 9] = value
    with pytest.raises(ValueError, match=r"IR image contains 1 values that are not finite .*row 7, column 9"):
        decoder().decode(*shot)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "magic"}, 'method: expected published or joint, got "magic"'),
        ({"modulation_min": 2.0}, "modulation_min"),
        ({"quality_min": -1.0}, "quality_min"),
        ({"period_px": 1.0}, "period_px"),
        ({"dark": (0.0, 2.0, 0.0, 0.0)}, "dark level of G"),
        ({"response": [(0.0, 0.0, 0.0)] * 4}, "response exponent of R"),
        ({"crosstalk": [[1.0] * 4] * 4}, "invertible"),
        ({"ir_registration": [[np.nan] * 3] * 2}, "ir_registration"),
    ],
)
def test_settings_out_of_range_are_named(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        decoder(**options)


@pytest.mark.parametrize(
    ("numbers", "width", "message"),
    [
        ((16.0, 8.0, 4.0), 912, "cannot number the fringes of 912 columns"),
        ((30.0, 30.0, 30.0), 912, "cannot number"),
        ((np.nan, 35.0, 30.0), 912, "fringe number"),
        ((36.0, 35.0, 30.0), 1, "projector_width"),
        ((36.0, 35.0, 30.0), 60, "half the projector width"),
    ],
)
def test_codes_that_cannot_work_are_explained(numbers: tuple[float, float, float], width: int, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        _core.check_code(numbers, width)
    with pytest.raises(ValueError, match=message):
        _core.Decoder((96, 912), numbers, width)


def test_devices_are_checked() -> None:
    with pytest.raises(ValueError, match="rotation"):
        _core.Device(8, 6, (20.0, 20.0), (3.5, 2.5), rotation=((1.0, 0.0, 0.0),) * 3)
    with pytest.raises(ValueError, match="focal_px"):
        _core.Device(8, 6, (0.0, 20.0), (3.5, 2.5))
    device = _core.Device(8, 6, (20.0, 20.0), (3.5, 2.5))
    assert device.project((0.0, 0.0, -1.0)) is None
    assert device.project((0.1, 0.0, 1.0)) == pytest.approx((5.5, 2.5))


def test_an_unknown_bench_option_is_named() -> None:
    bench = _core.Bench(camera=_core.Device(32, 24, (80.0, 80.0), (15.5, 11.5)))
    cast = bench.cast("plane")
    with pytest.raises(TypeError, match="nose"):
        bench.render(cast, CODE[0], nose=0.1)
    with pytest.raises(ValueError, match=r"plane, .*face"):
        bench.cast("unicorn")
