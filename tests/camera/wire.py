"""Helpers of the tests over GigE Vision: settings of the emulated camera, and the check that a shot is right."""

from __future__ import annotations

import atexit
from functools import cache
from typing import Any

import numpy as np

from quadfringe.config.cameras import AravisConfig, ChipConfig
from quadfringe.data import AnyShot, BayerShot, Shot
from quadfringe.devices.emulator import Emulator
from quadfringe.devices.emulator.frames import TestPattern

SIZE_PX = (128, 96)
SECOND, TWO_STREAMS, OWN = ((f"127.0.0.{n}", f"127.0.0.{n + 1}") for n in (3, 7, 9))


@cache
def shared_emulator() -> Emulator:
    """A small emulated JAI camera for all tests, whose second clock is 5000 s ahead and drifts by 50 ppm."""
    emulator = Emulator(size_px=SIZE_PX, clock=(5000.0, 50.0))
    atexit.register(emulator.close)
    return emulator


def emulated(emulator: Emulator, visible: str | None = None, infrared: str | None = None, **more: Any) -> AravisConfig:
    """Settings that open the emulated camera by its addresses, without a search."""
    chips = {
        name: ChipConfig(device=address, pixel_format=chosen)  # type: ignore[arg-type]
        for name, address, chosen in zip(("visible", "infrared"), emulator.addresses, (visible, infrared), strict=True)
    }
    # On a busy machine it may take long until the first frames arrive. Small packets make many of a small frame.
    return AravisConfig(**chips, **({"timeout_s": 10.0, "packet_size": 1500} | more))


def two_sources(emulator: Emulator) -> AravisConfig:
    """Settings that open an emulated camera whose chips are two streams of one device."""
    where = emulator.addresses[0]
    chips = {name: ChipConfig(device=where, source=f"Source{n}") for n, name in enumerate(("visible", "infrared"))}
    return AravisConfig(**chips, timeout_s=10.0)  # type: ignore[arg-type]


@cache
def pattern(shape: tuple[int, int]) -> TestPattern:
    return TestPattern(shape)


def checked_exposure(shot: AnyShot) -> int:
    """Give the exposure of a shot of the test pattern, after every pixel of both chips was compared."""
    assert shot.stamp is not None
    bits = int(np.log2(shot.full_scale_value + 1))
    visible = shot.raw if isinstance(shot, BayerShot) else shot.red
    if isinstance(shot, Shot):
        assert np.array_equal(shot.red, shot.green)
        assert np.array_equal(shot.red, shot.blue)
    exposure = TestPattern.exposure(visible)
    source = pattern(shot.ir.shape)
    np.testing.assert_array_equal(visible, source.frame(0, exposure, bits))
    np.testing.assert_array_equal(shot.ir, source.frame(1, exposure, bits))
    return exposure
