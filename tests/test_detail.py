"""The option `detail`: a finer or a smoother surface than the shot suggests."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
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
def corrugated(height_mm: float = HEIGHT_MM) -> Take:
    """Give a shot of a plane with fine waves across the fringes."""
    bench = _core.Bench()
    period_mm = PERIOD_PX * PLANE_Z_MM / bench.camera.focal_px[0]
    return expose(bench, World(waves(period_mm, height_mm, "x", 0.3).cast(bench)), SEED, NOISE)


@cache
def kept_and_noise(detail: float | None) -> tuple[float, float]:
    """Give the share of the waves that a decode keeps, and the noise of its phase, rad."""
    taken = corrugated()
    found = decoded(taken, detail).phase_rad[INNER]
    truth = taken.phase_rad[INNER]
    rows, columns = np.mgrid[0 : truth.shape[0], 0 : truth.shape[1]] / 300.0
    smooth = [columns**i * rows**j for i in range(4) for j in range(3)]
    fit = np.stack(smooth, axis=-1).reshape(-1, len(smooth))
    wave = truth.ravel() - fit @ np.linalg.lstsq(fit, truth.ravel(), rcond=None)[0]
    error = (found - truth).ravel()
    used = np.isfinite(error)
    kept = 1 + float(error[used] @ wave[used] / (wave[used] @ wave[used]))
    return kept, float(np.std(error[used] - (kept - 1) * wave[used]))


def decoded(taken: Take, detail: float | None) -> qf.Shape:
    plan = qf.Plan(
        WIDTH_PX,
        qf.Fringes(numbers=taken.fringe_numbers),
        response="linear",
        decode=qf.DecodeConfig(detail=detail),
    )
    return qf.Decoder(taken.shot, plan).decode(taken.shot)


def test_more_detail_keeps_more_of_fine_relief() -> None:
    kept = {detail: kept_and_noise(detail)[0] for detail in (0.5, None, 2.0)}
    hold("detail.waves_kept_at_2", kept[2.0])
    hold("detail.waves_kept_at_1", kept[None])
    assert kept[0.5] < kept[None] < kept[2.0]


def test_less_detail_has_less_noise() -> None:
    noise = {detail: kept_and_noise(detail)[1] for detail in (0.5, None, 2.0)}
    hold("detail.noise_at_half", noise[0.5] / noise[None])
    hold("detail.noise_at_2", noise[2.0] / noise[None])


def test_one_is_what_the_shot_suggests() -> None:
    taken = corrugated()
    stated, absent = decoded(taken, 1.0), decoded(taken, None)
    np.testing.assert_array_equal(stated.phase_rad, absent.phase_rad)
    assert absent.config["decode"]["detail"] == 1.0


def test_the_stated_noise_follows() -> None:
    """On a plane, where nothing is smoothed away, more detail is more noise."""
    stated, noise = {}, {}
    for detail in (0.5, 2.0):
        error, uncertainty = errors(corrugated(height_mm=0.0), detail)
        stated[detail], noise[detail] = np.median(uncertainty), np.std(error)
    assert noise[2.0] > 1.5 * noise[0.5]
    hold("detail.stated_over_noise", stated[2.0] / stated[0.5] / (noise[2.0] / noise[0.5]))


def test_relief_that_is_smoothed_away_is_stated() -> None:
    """The uncertainty covers the loss of height as well as the noise."""
    for detail in (0.5, 1.0, 2.0):
        error, uncertainty = errors(corrugated(), detail)
        hold("detail.inside", 100 * np.mean(np.abs(error) <= 3 * uncertainty))


def errors(taken: Take, detail: float) -> tuple[np.ndarray, np.ndarray]:
    """Give the error of the phase and its stated uncertainty, rad, of the pixels inside that have a phase."""
    shape = decoded(taken, detail)
    assert shape.uncertainty_rad is not None
    error = (shape.phase_rad - taken.phase_rad)[INNER]
    used = np.isfinite(error)
    return error[used], shape.uncertainty_rad[INNER][used]


@pytest.mark.parametrize("detail", [0.0, 0.2, 4.5, -1.0, np.nan])
def test_a_detail_out_of_range_is_refused(detail: float) -> None:
    with pytest.raises(ConfigError, match="detail"):
        qf.DecodeConfig(detail=detail)


def test_the_published_method_has_no_detail() -> None:
    with pytest.raises(ConfigError, match=r"detail needs method = \"joint\""):
        qf.DecodeConfig(method="published", detail=2.0)
    with pytest.raises((InputError, ValueError), match="detail"):
        _core.Decoder((64, 64), (36, 35, 30), 912, method="published", detail=2.0)
