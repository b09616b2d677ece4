"""The option `detail`: a finer or a smoother surface than the shot suggests."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from support.bars import hold

import quadfringe as qf
from quadfringe import _core
from quadfringe.errors import ConfigError, InputError
from quadfringe.evaluation.world import Take, expose
from quadfringe.evaluation.world.relief import PLANE_Z_MM, waves
from quadfringe.evaluation.world.scenes import WIDTH_PX, World

SEED, NOISE = 3, 0.03
PERIOD_PX, HEIGHT_MM = 22, 0.2
INNER = np.s_[64:-64, 64:-64]


@cache
def corrugated(height_mm: float) -> Take:
    """Give a shot of a plane with fine waves across the fringes."""
    bench = _core.Bench()
    period_mm = PERIOD_PX * PLANE_Z_MM / bench.camera.focal_px[0]
    return expose(bench, World(waves(period_mm, height_mm, "x", 0.3).cast(bench)), SEED, NOISE)


class Errors(NamedTuple):
    """Errors of the phase of the pixels inside that have one, rad, what is stated of them, and where they are."""

    found_rad: NDArray[np.float32]
    stated_rad: NDArray[np.float32]
    used: NDArray[np.bool_]

    @property
    def rms_rad(self) -> float:
        return float(np.sqrt(np.mean(self.found_rad**2)))


class Waves(NamedTuple):
    """What a decode leaves of fine waves."""

    kept: float
    noise_rad: float


@cache
def errors(height_mm: float, detail: float | None) -> Errors:
    """Give the errors of a decode of waves of this height."""
    taken = corrugated(height_mm)
    shape = decoded(taken, detail)
    assert shape.uncertainty_rad is not None
    found = (shape.phase_rad - taken.phase_rad)[INNER]
    used = np.isfinite(found)
    return Errors(found[used], shape.uncertainty_rad[INNER][used], used)


@cache
def left(detail: float | None) -> Waves:
    """Give the share of the height that a decode keeps, and the noise of its phase without the loss."""
    truth = corrugated(HEIGHT_MM).phase_rad[INNER]
    rows, columns = np.mgrid[0 : truth.shape[0], 0 : truth.shape[1]] / 300.0
    smooth = [columns**i * rows**j for i in range(4) for j in range(3)]
    fit = np.stack(smooth, axis=-1).reshape(-1, len(smooth))
    found = errors(HEIGHT_MM, detail)
    wave = (truth.ravel() - fit @ np.linalg.lstsq(fit, truth.ravel(), rcond=None)[0])[found.used.ravel()]
    lost = float(found.found_rad @ wave / (wave @ wave))
    return Waves(1 + lost, float(np.std(found.found_rad - lost * wave)))


def decoded(taken: Take, detail: float | None) -> qf.Shape:
    plan = qf.Plan(
        WIDTH_PX,
        qf.Fringes(numbers=taken.fringe_numbers),
        response="linear",
        decode=qf.DecodeConfig(detail=detail),
    )
    return qf.Decoder(taken.shot, plan).decode(taken.shot)


def test_more_detail_keeps_more_of_fine_relief() -> None:
    kept = {detail: left(detail).kept for detail in (0.5, None, 2.0)}
    hold("detail.waves_kept_at_half", kept[0.5])
    hold("detail.waves_kept_at_2", kept[2.0])
    hold("detail.waves_kept_at_1", kept[None])
    assert kept[0.5] < kept[None] < kept[2.0]


def test_less_detail_has_less_noise() -> None:
    noise = {detail: left(detail).noise_rad for detail in (0.5, None, 2.0)}
    hold("detail.noise_at_half", noise[0.5] / noise[None])
    hold("detail.noise_at_2", noise[2.0] / noise[None])


def test_one_is_what_the_shot_suggests() -> None:
    taken = corrugated(HEIGHT_MM)
    stated, absent = decoded(taken, 1.0), decoded(taken, None)
    np.testing.assert_array_equal(stated.phase_rad, absent.phase_rad)
    assert absent.config["decode"]["detail"] == 1.0


def test_the_stated_noise_follows() -> None:
    """On a plane, where nothing is smoothed away, more detail is more noise."""
    smooth, detailed = (errors(0.0, detail) for detail in (0.5, 2.0))
    noise = np.std(detailed.found_rad) / np.std(smooth.found_rad)
    hold("detail.noise_of_a_plane", noise)
    hold("detail.stated_over_noise", np.median(detailed.stated_rad) / np.median(smooth.stated_rad) / noise)


def test_relief_that_is_smoothed_away_is_stated() -> None:
    """The uncertainty covers the loss of height as well as the noise."""
    for detail in (0.5, None, 2.0):
        one = errors(HEIGHT_MM, detail)
        hold("detail.inside", 100 * np.mean(np.abs(one.found_rad) <= 3 * one.stated_rad))
    smooth, detailed = (errors(HEIGHT_MM, detail) for detail in (0.5, 2.0))
    stated = np.median(detailed.stated_rad) / np.median(smooth.stated_rad)
    hold("detail.stated_over_error", stated / (detailed.rms_rad / smooth.rms_rad))


@pytest.mark.parametrize("detail", [0.0, 0.2, 4.5, -1.0, np.nan])
def test_a_detail_out_of_range_is_refused(detail: float) -> None:
    with pytest.raises(ConfigError, match="detail"):
        qf.DecodeConfig(detail=detail)


def test_the_published_method_has_no_detail() -> None:
    with pytest.raises(ConfigError, match=r"detail needs method = \"joint\""):
        qf.DecodeConfig(method="published", detail=2.0)
    with pytest.raises((InputError, ValueError), match="detail"):
        _core.Decoder((64, 64), (36, 35, 30), 912, method="published", detail=2.0)
