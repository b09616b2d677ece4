"""A program that writes images into a folder, as the software of a camera does."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from quadfringe.io.images import write_image


@contextmanager
def written_in_turn(folder: Path, shape: tuple[int, int], rate_hz: float) -> Iterator[None]:
    """Write a colour image of this shape (H, W), whose values tell its number, again and again."""
    ended = threading.Event()

    def write() -> None:
        number = 0
        while not ended.wait(1 / rate_hz):
            number += 1
            write_image(folder / f"{number:06}.png", np.full((*shape, 3), number % 256, np.uint8))

    writer = threading.Thread(target=write, name="camera software")
    writer.start()
    try:
        yield
    finally:
        ended.set()
        writer.join()
