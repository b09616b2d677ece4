"""How right the reference measurement is: on captures with truth, and on the virtual bench against its least noise."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config import SceneConfig, SystemConfig
from quadfringe.data import Shape
from quadfringe.decoding import decode_steps, read_steps
from quadfringe.evaluation._scenes import STEPS
from quadfringe.scanner import open_system
from quadfringe.scanner.reference import take_steps

__all__ = ["capture_figures", "cramer_rao_rad", "virtual_figures"]

WIDTH_PX = 1920  # columns of the projector of the captures
NUMBERS = (1920 / 42, 1920 / 45, 1920 / 48)

Map = NDArray[Any]


def capture_figures(data: Path, name: str) -> dict[str, float]:
    """Decode the 36 images of a capture, and judge the orders of the pixels whose truth is known.

    Right order: |phase - truth| < pi. `wrong_promised` is the sum of the probabilities over the same pixels.
    """
    files = sorted((data / name / "raw").glob("*h.bmp"))[: 3 * STEPS]
    shape = decode_steps(read_steps(files, 3, STEPS), NUMBERS, WIDTH_PX)
    with np.load(data / name / "single_shot.npz") as stored:
        truth_rad, known = stored["phase_abs"], stored["mask"]
    found = shape.phase_rad[known]
    right, returned = np.abs(found - truth_rad[known]) < np.pi, np.isfinite(found)
    assert shape.wrong_order_probability is not None
    return {
        "right_percent": 100 * float(right.mean()),
        "right_of_returned_percent": 100 * float(right[returned].mean()),
        "wrong": float((returned & ~right).sum()),
        "wrong_promised": float(np.nansum(shape.wrong_order_probability[known])),
        "phase_rms_rad": float(np.sqrt(np.mean((found - truth_rad[known])[right] ** 2))),
    }


def cramer_rao_rad(modulations: Sequence[Map], numbers: Sequence[float], steps: int, noise: float) -> Map:
    """Give the least standard deviation of an unbiased phase of the first fringe number, (H, W) rad (R9).

    `modulations` are the true ones of each fringe number, (H, W); `noise` is that of an intensity, in the same unit.
    """
    squares = (np.square(n / numbers[0] * b) for n, b in zip(numbers, modulations, strict=True))
    amplitude = np.sqrt(0.5 * steps * sum(squares))
    return np.asarray(np.divide(noise, amplitude, out=np.full(amplitude.shape, np.inf), where=amplitude > 0))


def virtual_figures(surface: str, steps: int, noise: float, **scene: Any) -> dict[str, float]:
    """Take a reference measurement of the virtual bench, and judge it against truth and against the least noise.

    `scene` are further settings of `SceneConfig`. Pixels at edges and in shadow do not count.
    """
    config = SystemConfig(scene=SceneConfig(surface=surface, noise=noise, **scene))
    clean = config.model_copy(update={"scene": SceneConfig(surface=surface, bit_depth=12, **scene)})
    with open_system(clean) as scanner:
        taken = take_steps(scanner.projector, scanner.camera, scanner.plan, steps, "visible")
    modulations = [_core.n_step((stack / 4095).astype(np.float32))[2] for stack in taken.stacks]
    with open_system(config) as scanner:
        shape, shot = scanner.measure(reference=True, steps=steps), scanner.grab()
    truth = shot.truth
    assert truth is not None
    least_rad = cramer_rao_rad(modulations, taken.numbers, steps, noise)
    turns = taken.numbers[0] * truth.column_px.astype(np.float64) / scanner.projector_width_px
    lit = np.isfinite(turns) & ~truth.edge & ~truth.shadow & (modulations[0] > 0.05)
    return _judged(shape, 2 * np.pi * turns, truth.depth_mm, least_rad, lit)


def _judged(shape: Shape, truth_rad: Map, depth_mm: Map, least_rad: Map, lit: Map) -> dict[str, float]:
    seen = lit & shape.returned
    error_rad = (shape.phase_rad - truth_rad)[seen]
    right = np.abs(error_rad) < np.pi
    assert shape.depth_mm is not None
    assert shape.uncertainty_mm is not None
    assert shape.wrong_order_probability is not None
    scaled = np.abs((shape.depth_mm - depth_mm)[seen][right] / shape.uncertainty_mm[seen][right])
    return {
        "returned_percent": 100 * float(seen.sum() / lit.sum()),
        "wrong": float((~right).sum()),
        "wrong_promised": float(np.nansum(shape.wrong_order_probability[seen])),
        "phase_rms_rad": float(np.sqrt(np.mean(error_rad[right] ** 2))),
        "rms_over_least": float(np.sqrt(np.mean((error_rad / least_rad[seen])[right] ** 2))),
        **{f"inside_{n}_sigma": float((scaled < n).mean()) for n in (1, 2, 3)},
    }
