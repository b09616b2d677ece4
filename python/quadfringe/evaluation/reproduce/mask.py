"""A mask: four channels, wrapped phases, unwrapped phase and shape of one shot."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quadfringe.config import Device
from quadfringe.data import xyz_mm_of
from quadfringe.evaluation.reproduce._scene import draw, figures_of, measured, wrong_words
from quadfringe.evaluation.reproduction import Reproduction
from quadfringe.view.report import Graph

__all__ = ["mask"]


def mask(out: Path, camera: Device | None = None) -> Reproduction:
    """Measure a face in one shot of the virtual bench, 3 % noise, 8 bit, as the paper shows a plaster mask.

    `camera` replaces the camera of the published bench. Writes `out`/mask.png. Figures, for the published and the joint
    method: depth RMS in mm over the right orders away from edges, wrong orders and returned pixels in per cent.
    """
    seen = measured("face", camera)
    path = out / "mask.png"
    depth_mm = xyz_mm_of(seen.shapes["joint"])[:, :, 2]
    row = depth_mm.shape[0] // 2
    truth = seen.shot.truth
    assert truth is not None, "the virtual bench knows the truth"
    x = np.arange(depth_mm.shape[1])
    lines = {"measured": (x, depth_mm[row]), "true": (x, truth.depth_mm[row])}
    draw(path, "a mask in one shot, 3 % noise, 8 bit", seen, Graph(f"depth along row {row}", "column, px", "mm", lines))
    joint = seen.found["joint"]
    right = f"{joint.right.rms:.2g} mm RMS on {joint.returned_percent:.1f} % of the lit pixels"
    verdict = f"{right} by the joint method; by the published one {wrong_words(seen)}"
    return Reproduction(tuple(figures_of("mask", seen)), (path,), verdict)
