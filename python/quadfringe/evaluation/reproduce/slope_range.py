"""The range of slopes of Fourier profilometry (FTP): the traditional filter against the improved one.

A camera looks straight down on a reference plane from the distance L0, a projector of the same height stands d to its
side, and the fringes have the frequency f0 on the plane. A point of height h << L0 sees the fringe of a point d h / L0
further on, so that a row has the phase 2 pi f0 (x + d h(x) / L0) and the local frequency f0 (1 + q), with
q = (d / L0) dh/dx. On a surface of slopes up to |q| the first lobe of the spectrum takes f0 (1 - |q|) to f0 (1 + |q|).

- The traditional filter meets light as the camera gives it. The response adds a second harmonic at 2 f0 (1 - |q|) to
  2 f0 (1 + |q|). It is apart from the lobe while 1 + |q| < 2 (1 - |q|): |q| < 1/3, so |dh/dx| < L0 / (3 d).
- The improved filter meets linear light without background. Neither a harmonic nor a zero order is left, and the lobe
  only has to stay at positive frequencies: |q| < 1, so |dh/dx| < L0 / d (S3), three times as much. On the side that
  turns away from the projector that is also the slope at which the light grazes the surface: more would be shadow.

Both limits are those of filters with vertical flanks. The flanks of the package (docs/method/model.md) let the harmonic
in from q = 0.2 on, fully from 0.3, and weaken the lobe from 0.7 on, so that about two thirds of either limit are left.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from quadfringe import _core
from quadfringe.config import Fringes
from quadfringe.decoding.stages import fourier
from quadfringe.evaluation.reproduction import Figure, Reproduction
from quadfringe.view.report import Graph, draw_panels

__all__ = ["slope_range"]

Line = NDArray[np.float64]
WIDTH_PX, HEIGHT_PX = 912, 33
FIELD_MM = 300.0  # width of the field of view
DISTANCE_MM, BASELINE_MM = 5000.0, 2500.0  # L0 and d: far away, so that h << L0
STEEPEST = 0.97  # of L0 / d, at the ends of the ramp; at 1 the light grazes
GAMMA = 2.2  # response of the projector
FULL = 65535  # of 16 bit
# RMS over a fringe, rad, from which a phase fails: the ladder multiplies it by six, and five times that is half a turn.
FAILS_RAD = np.pi / 30
WAYS = {
    "traditional": "traditional filter, light as captured",
    "traditional_linear": "traditional filter, linear light",
    "improved": "improved filter, linear light",
}


def slope_range(out: Path) -> Reproduction:
    """Measure the slope at which the traditional and the improved filter fail, on a ramp of growing slope.

    The ramp is a parabola along the rows, whose slope reaches 0.97 L0 / d at both ends, under a projector with gamma
    2.2, without noise. The traditional filter gets the light as captured, the improved one the linear light. A filter
    fails at the least slope, up or down, at which its phase error has more than pi / 30 RMS over a fringe. Writes
    `out`/range.png. Figures: the limits as shares of L0 / d, their ratio, and the limit of the traditional filter when
    it gets linear light, where the width of its band is what fails.
    """
    ramp = _ramp()
    errors = {way: _error(ramp, way) for way in WAYS}
    limits = {way: _limit(ramp.slope, error, ramp.period_px) for way, error in errors.items()}
    factor = limits["improved"] / limits["traditional"]
    records = (
        Figure(
            "range_traditional", "traditional filter: limit of |dh/dx|", limits["traditional"], "L0/d", 1 / 3, 1 / 3
        ),
        Figure("range_improved", "improved filter: limit of |dh/dx|", limits["improved"], "L0/d", 1.0, 1.0),
        Figure("range_factor", "improved over traditional", factor, "times", 3.0, 3.0),
        Figure("range_traditional_linear", "traditional filter on linear light", limits["traditional_linear"], "L0/d"),
    )
    path = out / "range.png"
    _draw(path, ramp, errors, limits)
    left = " and ".join(
        f"{100 * limits[way] / ideal:.0f}" for way, ideal in (("traditional", 1 / 3), ("improved", 1.0))
    )
    verdict = (
        f"the improved filter follows slopes {factor:.2g} times as steep; flanks leave {left} % of the ideal ranges"
    )
    return Reproduction(records, (path,), verdict)


class _Ramp(NamedTuple):
    """The ramp along the middle row: slope as a share of L0 / d, height, exact phase; and its captured red light."""

    slope: Line
    height_mm: Line
    phase_rad: Line
    light: NDArray[np.float32]
    period_px: float


def _ramp() -> _Ramp:
    bench = _bench()
    plane = bench.cast_plane(point_mm=(0.0, 0.0, DISTANCE_MM), normal=(0.0, 0.0, -1.0))
    reach, half = np.linspace(-200.0, 200.0, 2401), FIELD_MM / 2
    steepest = STEEPEST * DISTANCE_MM / BASELINE_MM
    height_mm = steepest * (half / 4 - reach**2 / (2 * half))
    pitch_mm = (float(reach[1] - reach[0]), 200.0)
    relief = np.tile(height_mm, (3, 1))
    cast = bench.cast_height_map(relief, pitch_mm=pitch_mm, origin_mm=(-200.0, -200.0), z_mm=DISTANCE_MM)
    images = bench.render(
        cast,
        Fringes().numbers,
        projector_exponent=(GAMMA,) * 4,
        albedo=(1.0,) * 4,
        ambient=(0.0,) * 4,
        bit_depth=16,
    )
    row = HEIGHT_PX // 2
    per_px = 2 * np.pi * Fringes().numbers[0] / WIDTH_PX
    x_mm, z_mm = (cast.xyz_mm()[row, :, i].astype(np.float64) for i in (0, 2))
    even = float(np.nanmedian(np.diff(plane.column_px()[row].astype(np.float64))))
    return _Ramp(
        slope=np.gradient(DISTANCE_MM - z_mm) / np.gradient(x_mm) * BASELINE_MM / DISTANCE_MM,
        height_mm=DISTANCE_MM - z_mm,
        phase_rad=per_px * cast.column_px()[row].astype(np.float64),
        light=images["red"].astype(np.float32) / np.float32(FULL),
        period_px=2 * np.pi / (per_px * even),
    )


def _bench() -> _core.Bench:
    """Return the parallel bench: camera and projector look straight down, which makes even fringes on the plane."""
    focal_px = WIDTH_PX / FIELD_MM * DISTANCE_MM
    middle_px = ((WIDTH_PX - 1) / 2, (HEIGHT_PX - 1) / 2)
    camera = _core.Device(WIDTH_PX, HEIGHT_PX, (focal_px, focal_px), middle_px)
    wider_px = focal_px / 1.15
    aside_px = (middle_px[0] - wider_px * BASELINE_MM / DISTANCE_MM, (1140 - 1) / 2)
    projector = _core.Device(WIDTH_PX, 1140, (wider_px, wider_px), aside_px, translation_mm=(BASELINE_MM, 0.0, 0.0))
    return _core.Bench(camera=camera, visible=projector, infrared=projector)


def _error(ramp: _Ramp, way: str) -> Line:
    """Return the phase error of a filter along the middle row, rad, without whole turns."""
    light = ramp.light if way == "traditional" else ramp.light ** np.float32(1 / GAMMA)
    found = fourier(light, ramp.period_px, band=way.partition("_")[0])[HEIGHT_PX // 2]
    error = found - ramp.phase_rad
    return np.asarray(error - 2 * np.pi * np.round(error / (2 * np.pi)))


def _over_a_fringe(error: Line, period_px: float) -> Line:
    """Return the RMS over one fringe of the plane, rad; pixels without data count as right."""
    return np.asarray(np.sqrt(uniform_filter1d(np.nan_to_num(error) ** 2, round(period_px))))


def _limit(slope: Line, error: Line, period_px: float) -> float:
    """Return the least size of the slope at which the phase fails, a fringe away from the ends of the row."""
    inner = np.s_[round(period_px) : -round(period_px)]
    size, rms = np.abs(slope[inner]), _over_a_fringe(error, period_px)[inner]
    failed = size[rms > FAILS_RAD]
    return float(failed.min()) if failed.size else float(np.nanmax(size))


def _draw(path: Path, ramp: _Ramp, errors: dict[str, Line], limits: dict[str, float]) -> None:
    x = np.arange(WIDTH_PX)
    curves = {
        f"{WAYS[way]}: fails at {limits[way]:.2f}": (ramp.slope, np.maximum(_over_a_fringe(e, ramp.period_px), 1e-4))
        for way, e in errors.items()
    }
    marks = {"L0 / (3 d)": (-1 / 3, 1 / 3), "L0 / d": (-1.0, 1.0)}
    along = {WAYS[way]: (x, errors[way]) for way in ("traditional", "improved")}
    level = {"": (x, ramp.light[HEIGHT_PX // 2])}
    fails = ("fails: pi / 30", FAILS_RAD)
    rows = [
        [
            Graph("ramp of growing slope", "column, px", "height, mm", {"": (x, ramp.height_mm)}),
            Graph("captured red light, gamma 2.2", "column, px", "share of full scale", level),
        ],
        [
            Graph("phase error over a fringe", "slope, L0/d", "rad RMS", curves, limit=fails, log=True, marks=marks),
            Graph("phase error along the row", "column, px", "rad", along),
        ],
    ]
    draw_panels(path, "range of slopes of Fourier profilometry", rows)
