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
def corrugated() -> Take:
    """Give a shot of a plane with fine waves across the fringes."""
    bench = _core.Bench()
    period_mm = PERIOD_PX * PLANE_Z_MM / bench.camera.focal_px[0]
    return expose(bench, World(waves(period_mm, HEIGHT_MM, "x", 0.3).cast(bench)), SEED, NOISE)


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
    """Finer relief is more uncertain, as it is noisier."""
    taken = corrugated()
    stated = {detail: float(np.nanmedian(uncertainty(decoded(taken, detail)))) for detail in (0.5, 2.0)}
    noise = {detail: kept_and_noise(detail)[1] for detail in (0.5, 2.0)}
    hold("detail.stated_over_noise", stated[2.0] / stated[0.5] / (noise[2.0] / noise[0.5]))


def uncertainty(shape: qf.Shape) -> np.ndarray:
    assert shape.uncertainty_rad is not None
    return shape.uncertainty_rad


@pytest.mark.parametrize("detail", [0.0, 0.2, 4.5, -1.0, np.nan])
def test_a_detail_out_of_range_is_refused(detail: float) -> None:
    with pytest.raises(ConfigError, match="detail"):
        qf.DecodeConfig(detail=detail)


def test_the_published_method_has_no_detail() -> None:
    with pytest.raises(ConfigError, match=r"detail needs method = \"joint\""):
        qf.DecodeConfig(method="published", detail=2.0)
    with pytest.raises((InputError, ValueError), match="detail"):
        _core.Decoder((64, 64), (36, 35, 30), 912, method="published", detail=2.0)
