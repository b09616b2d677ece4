"""The live view in a real browser: headless chromium with software rendering.

`make test-live` installs it and runs these tests; plain pytest leaves this folder out.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from typing import Any

import pytest

FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]


if "QUADFRINGE_BROWSER" not in os.environ:
    collect_ignore_glob = ["test_*.py"]


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A running chromium."""
    program = shutil.which("chromium")
    if program is None:
        pytest.fail("no chromium; scripts/set-up browser installs it")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=program, args=FLAGS)
        yield chromium
        chromium.close()
