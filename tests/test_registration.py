"""Messages state the shift of infrared by whole fringes, with its sign, and on objects of few fringes."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
from support.halves import changed, half_plan, half_shot

import quadfringe as qf
from quadfringe.decoding.closures import closure_of
from quadfringe.decoding.registration import _whole_fringes_px
from quadfringe.evaluation import broken

MEND = re.compile(r"a shift of ([-+][\d.]+) px along x(?: and ([-+][\d.]+) px along y)? would mend it")


def mending(shot: qf.Shot, *, whole: bool = False) -> tuple[float, float]:
    """Give the shift that a refusal proposes, px along x and y, 0 where it tells none along y."""
    with pytest.raises(qf.DecodeError) as refused:
        qf.decode(shot, half_plan(whole=whole))
    assert refused.value.reason == "infrared registration"
    words = MEND.search(str(refused.value))
    assert words is not None, refused.value
    return float(words[1]), float(words[2] or 0)


# The infrared fringes have a period of about 20 px.
SHIFTS = [
    ("face", 9, 11, 0),
    ("face", 24, -11, 0),
    ("face", 25, 20, 0),
    ("steps", 7, -20, 3),
    ("clutter", 8, -42, 3),
    ("clutter", 26, 21, -2),
]


@pytest.mark.parametrize(("scene", "seed", "columns", "rows"), SHIFTS)
def test_a_shift_near_half_a_fringe_or_more_is_told(scene: str, seed: int, columns: int, rows: int) -> None:
    x, y = mending(changed(half_shot(scene, seed), broken.shifted(columns, rows)))
    assert abs(x + columns) < 0.7
    assert abs(y + rows) < 0.7


@pytest.mark.parametrize(("seed", "columns", "rows"), [(31, 6, 0), (31, 12, 5), (34, 12, 0)])
def test_a_shift_on_an_object_of_three_fringes_is_told(seed: int, columns: int, rows: int) -> None:
    shot = broken.cut_out(half_shot("face", seed, whole=True), 0.06, seed + 30)
    x, _ = mending(changed(shot, broken.shifted(columns, rows)), whole=True)
    assert abs(x + columns) < 1.5


def test_a_small_shift_on_narrow_objects_is_mostly_warned_of() -> None:
    told = []
    for seed in (11, 27, 29):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            qf.decode(changed(half_shot("clutter", seed), broken.shifted(0.8, 0)), half_plan())
        told.append(any(re.search(r"a shift of -\d\.\d px along x", str(one.message)) for one in caught))
    assert sum(told) >= 2, told


@pytest.mark.parametrize("scene", ["face", "clutter", "steps", "face_patches_12"])
def test_a_sound_shot_is_not_shifted_by_whole_fringes(scene: str) -> None:
    closure = closure_of(half_shot(scene, 28), half_plan())
    assert closure is not None
    assert np.isfinite(closure.shift_px)
    assert _whole_fringes_px(half_plan(), closure, fits=True) is None
