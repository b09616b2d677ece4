"""Tests on the wire: `make test-camera` runs them in a network of their own; plain pytest leaves this folder out."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from wire import SIZE_PX, emulated

from quadfringe.devices.aravis import AravisCamera
from quadfringe.emulator import Emulator

if "QUADFRINGE_LOOPBACK" not in os.environ:
    collect_ignore_glob = ["test_*.py"]


@pytest.fixture
def emulator() -> Iterator[Emulator]:
    """A small emulated JAI camera whose second clock is 5000 s ahead and drifts by 50 ppm."""
    with Emulator(size_px=SIZE_PX, clock=(5000.0, 50.0)) as running:
        yield running


@pytest.fixture
def camera(emulator: Emulator) -> Iterator[AravisCamera]:
    """The emulated camera, opened."""
    with AravisCamera(emulated(emulator)) as opened:
        yield opened
