"""What the tests on the wire share: settings of the emulated camera, and the proof that a shot is right."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from quadfringe.capture import AravisConfig, ChipConfig
from quadfringe.data import AnyShot, BayerShot, Shot
from quadfringe.emulator import Emulator
from quadfringe.emulator.frames import TestPattern

SIZE_PX = (128, 96)


def emulated(emulator: Emulator, visible: str | None = None, infrared: str | None = None, **more: Any) -> AravisConfig:
    """Settings that open the emulated camera by its addresses, without a search."""
    chips = {
        name: ChipConfig(device=address, pixel_format=chosen)  # type: ignore[arg-type]
        for name, address, chosen in zip(("visible", "infrared"), emulator.addresses, (visible, infrared), strict=True)
    }
    return AravisConfig(**chips, **more)


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
