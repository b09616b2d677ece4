"""The wheel in new environments outside the checkout: `make wheel-test` runs these tests, plain pytest does not."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from environments import Environment

CHOICE = "QUADFRINGE_WHEEL"  # "light", or "all" for the large extras too
ROOT = Path(__file__).resolve().parents[2]

if CHOICE not in os.environ:
    collect_ignore_glob = ["test_*.py"]


@pytest.fixture(scope="session")
def wheel() -> Path:
    """The wheel in dist."""
    (found,) = (ROOT / "dist").glob("quadfringe-*.whl")
    return found


@pytest.fixture(scope="session")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Environment]:
    """Make an environment with the wheel and at most one extra."""

    @cache
    def install(extra: str = "") -> Environment:
        return Environment(tmp_path_factory.mktemp(f"environment_{extra}"), wheel, extra)

    return install


@pytest.fixture(scope="session")
def bare(installed: Callable[..., Environment]) -> Environment:
    """The wheel without extras."""
    return installed()
