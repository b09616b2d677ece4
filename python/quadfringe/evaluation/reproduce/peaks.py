"""The peaks surface under noise: three demodulation methods compared with the exact phase."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config import Device, Fringes
from quadfringe.data import Shot, core_device
from quadfringe.decoding import Plan, decode
from quadfringe.decoding.compare import rms
from quadfringe.decoding.stages import carrier, fourier, linear_light
from quadfringe.evaluation.reproduction import Reproduction
from quadfringe.view.report import Panel, draw_panels

__all__ = ["WIDTH_PX", "PeaksShot", "inside", "peaks", "peaks_shot"]

Map = NDArray[np.float32]

WIDTH_PX, HEIGHT_PX = 912, 1140  # the camera sees the projector's array nearly one to one
ROW = 760  # the row of the published figures
NOISE = 0.03  # standard deviation, share of full scale; then rounded to 8 bit
SEED = 1
FIELD_MM = 300.0  # width of the field of view
DEPTH_MM = 800.0  # distance of the surface
ANGLE_DEG = 45.0  # between the axes of camera and projector
DISTANCE_MM = 5000.0  # from projector to object: fringes of nearly one period
PEAKS_SCALE_MM = 4.0  # slopes take the local fringe frequency from 0.43 to 1.6 of the carrier


def peaks(out: Path) -> Reproduction:
    """Compare traditional FTP, improved FTP and the proposed method with the exact phase, under 3 % noise.

    Writes `out`/peaks.png. Figures are RMS in rad of the 36-fringe phase, over the field without a border of one
    fringe period, and along row 760.
    """
    shot, truth_rad = peaks_shot()
    light = linear_light(shot)
    period_px, _ = carrier(light["red"])
    shape = decode(shot, Plan(projector_width_px=WIDTH_PX, fringes=Fringes()))
    misses = {
        "traditional_ftp": _turnless(fourier(light["red"], period_px, band="traditional") - truth_rad),
        "improved_ftp": _turnless(fourier(light["red"], period_px, band="improved") - truth_rad),
        "proposed": shape.phase_rad - truth_rad,
    }
    errors = {name: inside(miss, period_px) for name, miss in misses.items()}
    figures = {f"{name}_rms_rad": rms(error) for name, error in errors.items()}
    figures |= {f"{name}_rms_rad_row{ROW}": rms(error[ROW]) for name, error in errors.items()}
    _draw(out / "peaks.png", shot, truth_rad, errors, figures)
    return Reproduction(figures, out / "peaks.png")


class PeaksShot(NamedTuple):
    """A shot of the peaks surface, and its exact absolute phase (H, W), rad, of 36 fringes."""

    shot: Shot
    phase_rad: Map


def peaks_shot(**light: Any) -> PeaksShot:
    """Render a shot of the peaks surface, with its exact phase.

    `light` replaces settings of the published shot, by the names of `SceneConfig`: a white surface in the dark,
    noise of 3 %, 8 bit.
    """
    bench = _core.Bench(camera=core_device(_camera()), visible=core_device(_projector()))
    cast = bench.cast_peaks(z_mm=DEPTH_MM, scale_mm=PEAKS_SCALE_MM)
    published: dict[str, Any] = {
        "albedo": (1.0,) * 4,
        "ambient": (0.0,) * 4,
        "noise": NOISE,
        "seed": SEED,
        "bit_depth": 8,
    }
    images = bench.render(cast, Fringes().numbers, **(published | light))
    phase_rad = 2 * np.pi * Fringes().numbers[0] / WIDTH_PX * cast.column_px().astype(np.float64)
    shot = Shot(images["red"], images["green"], images["blue"], images["ir"])
    return PeaksShot(shot, phase_rad.astype(np.float32))


def _camera() -> Device:
    focal_px = WIDTH_PX / FIELD_MM * DEPTH_MM
    return _device((focal_px, focal_px))


def _projector() -> Device:
    """Return a projector to the side of the camera that lights the whole field of view."""
    sine, cosine = math.sin(math.radians(ANGLE_DEG)), math.cos(math.radians(ANGLE_DEG))
    focal_px = (WIDTH_PX * DISTANCE_MM / (1.15 * FIELD_MM * cosine), WIDTH_PX * DISTANCE_MM / (1.3 * FIELD_MM))
    rotation = ((cosine, 0.0, sine), (0.0, 1.0, 0.0), (-sine, 0.0, cosine))
    translation_mm = (-DEPTH_MM * sine, 0.0, DISTANCE_MM - DEPTH_MM * cosine)
    return _device(focal_px).model_copy(update={"rotation": rotation, "translation_mm": translation_mm})


def _device(focal_px: tuple[float, float]) -> Device:
    centre_px = ((WIDTH_PX - 1) / 2, (HEIGHT_PX - 1) / 2)
    return Device(width_px=WIDTH_PX, height_px=HEIGHT_PX, focal_px=focal_px, centre_px=centre_px)


def _turnless(error: Map) -> Map:
    """Remove multiples of 2 pi, which a wrapped phase does not determine."""
    turns = np.round(error / np.float32(2 * np.pi))
    return (error - 2 * np.pi * turns).astype(np.float32)


def inside(error: Map, period_px: float) -> Map:
    """Set a border of one fringe period to NaN, (H, W)."""
    border = math.ceil(period_px)
    blank = np.full_like(error, np.nan)
    inner = np.s_[border:-border, border:-border]
    blank[inner] = error[inner]
    return blank


def _draw(path: Path, shot: Shot, truth_rad: Map, errors: Mapping[str, Map], figures: Mapping[str, float]) -> None:
    titles = {"traditional_ftp": "traditional FTP", "improved_ftp": "improved FTP", "proposed": "proposed"}
    limits = (float(np.nanmin(truth_rad)), float(np.nanmax(truth_rad)))
    maps = [Panel(titles[n], truth_rad + e, "rad", "turbo", limits) for n, e in errors.items()]
    misses = [
        Panel(f"error {titles[n]}: {figures[f'{n}_rms_rad']:.4f} rad RMS", e, "rad", "coolwarm", (-0.3, 0.3))
        for n, e in errors.items()
    ]
    rows = [
        [Panel("exact phase", truth_rad, "rad", "turbo", limits), *maps],
        [Panel("captured red", shot.red, "", "gray", (0.0, 255.0)), *misses],
    ]
    draw_panels(path, "peaks, 3 % noise, 8 bit", rows)
