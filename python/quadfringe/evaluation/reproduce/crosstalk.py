"""Crosstalk between channels: its effect on a shot, and the rest after it is calibrated and removed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration.channels import Channels, fit_channels
from quadfringe.calibration.levels import dark_level, mean_levels
from quadfringe.calibration.session.virtual import VirtualCaptures
from quadfringe.config import DecodeConfig, Device, Matrix4, SceneConfig, SystemConfig
from quadfringe.data import Calibration
from quadfringe.decoding import Decoder, Plan
from quadfringe.decoding.compare import compare
from quadfringe.devices.virtual import VirtualBench
from quadfringe.evaluation.reproduction import Figure, Reproduction
from quadfringe.view.report import Graph, Panel, draw_panels
from quadfringe.view.style import DIVERGING, symmetric

__all__ = ["crosstalk"]

Array = NDArray[np.float64]
SHARES = (0.0, 0.05, 0.10, 0.15)  # of the light of every other channel, each way
NOISE, SEED = 0.01, 3
CAMERA = Device(width_px=512, height_px=384, focal_px=(1290.32, 1290.32), centre_px=(255.5, 191.5))
WAYS = {"plain": "not corrected", "calibrated": "calibrated and undone", "exact": "undone exactly"}


def crosstalk(out: Path, shares: Sequence[float] = SHARES, camera: Device = CAMERA) -> Reproduction:
    """Decode the peaks surface under growing crosstalk between all four channels, before and after it is undone.

    Every channel sees these `shares` of the light of every other one, by default 0 to 15 %. The matrix is
    calibrated as on a bench, from shots of a white board under uniform light, at 15 %. The peaks are decoded by the
    published method; noise is 1 %. Writes `out`/crosstalk.png. Figures: stray light before and after the
    calibration, per cent of full scale; greatest error of the matrix; depth RMS in mm and wrong orders in per cent
    at 15 %.
    """
    found = _calibrated(shares[-1], camera)
    shots = [_Peaks(share, camera) for share in shares]
    known = {
        "plain": np.eye(4),
        "calibrated": np.array(found.channels.crosstalk),
        "exact": np.array(_matrix(shares[-1])),
    }
    last = {way: shots[-1].judged(matrix) for way, matrix in known.items()}
    curves = {
        "plain": [one.judged(np.eye(4)) for one in shots],
        "exact": [one.judged(np.array(_matrix(one.share))) for one in shots],
    }
    error = float(np.abs(known["calibrated"] - known["exact"]).max())
    path = out / "crosstalk.png"
    _draw(path, found, last, curves, shares)
    before, after = last["plain"].depth_rms_mm, last["calibrated"].depth_rms_mm
    word = "takes" if after < before else "makes it WORSE: it takes"
    verdict = (
        f"undoing {100 * shares[-1]:.0f} % of crosstalk {word} the depth error from {before:.3g} to {after:.3g} mm RMS"
    )
    return Reproduction(tuple(_records(found, error, last)), (path,), verdict)


def _records(found: _Calibrated, error: float, last: dict[str, _Judged]) -> list[Figure]:
    """Name the stray light, the error of the matrix, and the errors at the greatest share."""
    figures = found.channels.figures
    return [
        Figure("stray_before_percent", "stray light before", figures["stray_before_percent"], "% of full scale"),
        Figure(
            "stray_after_percent", "stray light after", figures["stray_after_percent"], "% of full scale", None, 0.0
        ),
        Figure(
            "matrix_error",
            "greatest error of the matrix",
            error,
            "1",
        ),
        *(
            Figure(f"{way}_depth_rms_mm", f"peaks, {WAYS[way]}: depth", one.depth_rms_mm, "mm RMS")
            for way, one in last.items()
        ),
        *(
            Figure(f"{way}_wrong_order_percent", f"peaks, {WAYS[way]}: wrong orders", one.wrong_order_percent, "%")
            for way, one in last.items()
        ),
        *(
            Figure(f"{way}_returned_percent", f"peaks, {WAYS[way]}: returned", one.returned_percent, "%")
            for way, one in last.items()
        ),
    ]


def _matrix(share: float) -> Matrix4:
    return tuple(tuple(1.0 if i == j else share for j in range(4)) for i in range(4))  # type: ignore[return-value]


def _light(share: float) -> dict[str, Any]:
    """Give the scene settings of a share: a gain that clips no crest."""
    return {"crosstalk": _matrix(share), "gain": 0.95 / (1 + 3 * share), "noise": NOISE, "seed": SEED}


class _Calibrated(NamedTuple):
    """The fitted channels, and the projected levels (K, 4) that they were fitted to."""

    channels: Channels
    levels: Array


def _calibrated(share: float, camera: Device) -> _Calibrated:
    scene = SceneConfig.model_validate(_light(share) | {"surface": "peaks"})
    captures = VirtualCaptures(SystemConfig(scene=scene, camera=camera))
    dark = dark_level([captures.shot("dark", name) for name in captures.session.captures("dark")]).level
    plan = captures.session.level_plan
    seen = np.array([mean_levels(captures.shot("levels", name)) for name in plan.names])
    return _Calibrated(fit_channels(plan, seen, dark), np.asarray(plan.levels))


class _Judged(NamedTuple):
    """The errors of a decode, and its map of depth errors (H, W), mm."""

    depth_rms_mm: float
    wrong_order_percent: float
    returned_percent: float
    difference_mm: NDArray[np.float32]


class _Peaks:
    """A shot of the peaks under a share of crosstalk."""

    def __init__(self, share: float, camera: Device) -> None:
        self.share = share
        config = SystemConfig(scene=SceneConfig.model_validate(_light(share) | {"surface": "peaks"}), camera=camera)
        bench = VirtualBench(config)
        bench.project(config.fringes)
        self._exact = bench.calibration()
        self._shot = bench.expose(seed=SEED)
        self._fringes = config.fringes

    def judged(self, matrix: Array) -> _Judged:
        """Decode with this matrix as the known one, and compare with the truth."""
        rows = tuple(tuple(float(v) for v in row) for row in matrix)
        known = Calibration.model_validate(self._exact.model_dump() | {"crosstalk": rows})
        plan = Plan(known.projector.width_px, self._fringes, known, decode=DecodeConfig(method="published"))
        shape = Decoder(self._shot, plan).decode_without_verdict(self._shot)
        assert self._shot.truth is not None
        found = compare(shape, self._shot.truth, causes=False)
        assert found.difference_mm is not None
        return _Judged(found.overall.rms, found.wrong_order_percent, found.returned_percent, found.difference_mm)


def _draw(
    path: Path, found: _Calibrated, last: dict[str, _Judged], curves: dict[str, list[_Judged]], shares: Sequence[float]
) -> None:
    percent = 100 * np.array(shares)
    level = np.repeat(100 * found.levels.max(axis=1), found.levels.shape[1])
    stray = {"before": found.channels.stray_before, "after": found.channels.stray_after}
    points = {
        f"{when}: at most {100 * np.nanmax(np.abs(one)):.3g} %": (level, 100 * np.abs(one).ravel())
        for when, one in stray.items()
    }
    depth = {WAYS[way]: (percent, np.array([one.depth_rms_mm for one in ones])) for way, ones in curves.items()}
    wrong = {WAYS[way]: (percent, np.array([one.wrong_order_percent for one in ones])) for way, ones in curves.items()}
    maps = {
        f"{WAYS[way]}: {last[way].depth_rms_mm:.3g} mm RMS": last[way].difference_mm for way in ("plain", "calibrated")
    }
    scales = (symmetric(last["plain"].difference_mm, share=0.96), symmetric(last["calibrated"].difference_mm))
    rows: list[list[Panel | Graph]] = [
        [
            *(
                Panel(words, one, "depth error, mm", DIVERGING, scale)
                for (words, one), scale in zip(maps.items(), scales, strict=True)
            ),
            Graph("stray light of evenly lit shots", "brightest channel, %", "% of full scale", points, points=True),
        ],
        [
            Graph("depth", "crosstalk each way, %", "mm RMS", depth, log=True),
            Graph("fringe orders", "crosstalk each way, %", "wrong, %", wrong),
        ],
    ]
    draw_panels(path, "crosstalk between four channels: peaks at 15 % (a, b), and from 0 to 15 %", rows)
