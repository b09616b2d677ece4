"""What a page in the browser shows: pictures of it, and waiting for them."""

from __future__ import annotations

import time
from collections.abc import Callable
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from PIL import Image

__all__ = ["painted", "picture", "shape_on", "still_shape_on", "until"]

PATIENCE_S = 90.0
DARK = 30  # grey level


def until(what: Callable[[], Any], why: str) -> Any:
    """Repeat a question until there is an answer; fail after a time limit."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if (answer := what()) is not None:
            return answer
        time.sleep(0.3)
    return pytest.fail(f"{why} within {PATIENCE_S:g} s")


def picture(page: Any) -> np.ndarray:
    """The middle of the page, without the panel at the right and messages at the top."""
    image = np.asarray(Image.open(BytesIO(page.screenshot())).convert("RGB")).astype(int)
    return image[190:700, 60:860]


def painted(image: np.ndarray) -> np.ndarray:
    """Pixels that are not the ground of the page: dark on the live page, white with a grey grid on the others."""
    if np.median(image[-8:, -8:]) < DARK:
        return np.asarray(image.max(axis=2) > 3 * DARK)
    return (image.max(axis=2) < 200) | (np.ptp(image, axis=2) > 30)


def shape_on(page: Any) -> np.ndarray | None:
    """The picture once a shape is on it."""
    image = picture(page)
    return image if painted(image).mean() > 0.05 else None


def still_shape_on(page: Any) -> np.ndarray | None:
    """The picture of a shape that stands still, once the page has faded in."""
    first = shape_on(page)
    if first is None:
        return None
    time.sleep(1.0)
    second = picture(page)
    return second if np.abs(second - first)[painted(second)].mean() < 1 else None
