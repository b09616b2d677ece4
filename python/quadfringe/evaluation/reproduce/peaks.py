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
from quadfringe.evaluation.reproduction import Figure, Reproduction
from quadfringe.view.report import Graph, Panel, draw_panels
from quadfringe.view.style import DIVERGING, symmetric

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
WORDS = {"traditional_ftp": "traditional FTP", "improved_ftp": "improved FTP", "proposed": "proposed"}
PUBLISHED_RAD = {"traditional_ftp": 0.1316, "improved_ftp": 0.0408, "proposed": 0.0099}  # along the row
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
    field = [Figure(f"{name}_rms_rad", f"{WORDS[name]}, full field", rms(e), "rad RMS") for name, e in errors.items()]
    row = [
        Figure(f"{name}_rms_rad_row{ROW}", f"{WORDS[name]}, row {ROW}", rms(e[ROW]), "rad RMS", PUBLISHED_RAD[name])
        for name, e in errors.items()
    ]
    better = all(one.value <= (one.published or 0.0) for one in row[1:])
    verdict = f"improved FTP and the proposed method err {'less' if better else 'MORE'} than published"
    _draw(out / "peaks.png", shot, truth_rad, errors)
    return Reproduction((*field, *row), (out / "peaks.png",), verdict)


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


def _draw(path: Path, shot: Shot, truth_rad: Map, errors: Mapping[str, Map]) -> None:
    limits = (float(np.nanmin(truth_rad)), float(np.nanmax(truth_rad)))
    common, fine = symmetric(errors["traditional_ftp"], errors["improved_ftp"]), symmetric(errors["proposed"])
    x = np.arange(WIDTH_PX)
    along = {f"{WORDS[n]}: {rms(e[ROW]):.4f} rad RMS": (x, e[ROW]) for n, e in errors.items()}
    alone = {name: line for name, line in along.items() if name.startswith("proposed")}
    maps = [Panel(WORDS[n], truth_rad + e, "rad", "turbo", limits) for n, e in errors.items()]
    misses = [
        Panel(
            f"{WORDS[n]}: error{', finer scale' if n == 'proposed' else ''}",
            e,
            "rad",
            DIVERGING,
            fine if n == "proposed" else common,
        )
        for n, e in errors.items()
    ]
    rows: list[list[Panel | Graph]] = [
        [Panel("exact phase", truth_rad, "rad", "turbo", limits), *maps],
        [Panel("captured red", shot.red, "counts", "gray", (0.0, 255.0)), *misses],
        [
            Graph(f"error along row {ROW}", "column, px", "rad", along),
            Graph(f"error along row {ROW}, finer scale", "column, px", "rad", alone),
        ],
    ]
    draw_panels(path, "peaks, 3 % noise, 8 bit: phase of 36 fringes", rows)
