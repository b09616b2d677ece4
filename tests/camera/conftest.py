"""Tests over GigE Vision: `make test-camera` runs them in network namespaces; plain pytest leaves this folder out."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from wire import emulated, shared_emulator

from quadfringe.devices.aravis import AravisCamera
from quadfringe.devices.emulator import Emulator

if "QUADFRINGE_LOOPBACK" not in os.environ:
    collect_ignore_glob = ["test_*.py"]


@pytest.fixture
def emulator() -> Emulator:
    """The emulated camera of all tests, as after power-on."""
    shared = shared_emulator()
    shared.order("reset")
    return shared


@pytest.fixture
def camera(emulator: Emulator) -> Iterator[AravisCamera]:
    """The emulated camera, opened."""
    with AravisCamera(emulated(emulator, timeout_s=6.0)) as opened:
        yield opened
