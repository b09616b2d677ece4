"""Ctrl-C during a long decode: answered at once, and the decoder stays usable."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

import numpy as np
import pytest

import quadfringe as qf
from quadfringe.config.cameras import VirtualConfig


class Stopped(Exception):  # noqa: N818 - a signal, not an error
    """What the handler of the signal raises."""


@contextmanager
def alarm(after_s: float) -> Iterator[None]:
    """Raise `Stopped` in the main thread after some time, as Ctrl-C raises KeyboardInterrupt."""

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise Stopped

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, after_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("threads", [None, 1])
def test_a_long_decode_answers_and_goes_on(threads: int | None) -> None:
    scene = qf.SceneConfig(surface="hand", noise=0.01)
    camera = {"width_px": 1400, "height_px": 1200, "focal_px": (3527.0, 3527.0), "centre_px": (699.5, 599.5)}
    decode = qf.DecodeConfig(method="joint", response="linear", threads=threads)
    with qf.open(qf.SystemConfig(capture=VirtualConfig(), scene=scene, camera=camera, decode=decode)) as scanner:
        shot = scanner.grab()
        decoder = qf.Decoder(shot, scanner.plan)
    began = time.monotonic()
    expected = decoder.decode_without_verdict(shot)
    whole_s = time.monotonic() - began
    began = time.monotonic()
    with alarm(0.1 * whole_s), pytest.raises(Stopped):
        decoder.decode_without_verdict(shot)
    answered_s = time.monotonic() - began
    assert answered_s < 0.6 * whole_s + 0.2, "the answer came only after the shot"
    for name, values in decoder.decode_without_verdict(shot).maps.items():
        np.testing.assert_array_equal(values, expected.maps[name])


def test_an_error_of_a_long_decode_is_that_of_a_short_one() -> None:
    from quadfringe import _core

    for side in (64, 600):
        decoder = _core.Decoder((side, side), (36.0, 35.0, 30.0), 912)
        image = np.zeros((side + 1, side), np.uint8)
        with pytest.raises(ValueError, match=f"expected .*{side}.*{side}"):
            decoder.decode(image, image, image, image)
