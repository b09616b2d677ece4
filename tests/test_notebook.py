"""Records in a notebook: cards of a picture and figures, and plots that give back their axes."""

from __future__ import annotations

import pickle
import re
import sys
from base64 import b64decode
from dataclasses import replace
from typing import Any

import cv2
import matplotlib as mpl
import numpy as np
import pytest

import quadfringe as qf
from quadfringe.config import Response
from quadfringe.errors import MissingExtraError

LARGEST_CARD = 60_000
CAMERA = qf.Device(width_px=320, height_px=240, focal_px=(806.0, 806.0), centre_px=(159.5, 119.5))
mpl.use("agg")


@pytest.fixture(scope="module")
def scanner() -> Any:
    scene = qf.SceneConfig(surface="face", noise=0.03, camera_exponent=(2.2, 2.2, 2.2, 2.2))
    with qf.open(qf.SystemConfig(camera=CAMERA, scene=scene)) as opened:
        yield opened


@pytest.fixture(scope="module")
def shot(scanner: qf.Scanner) -> qf.Shot:
    taken = scanner.grab()
    assert isinstance(taken, qf.Shot)
    return taken


@pytest.fixture(scope="module")
def shape(scanner: qf.Scanner, shot: qf.Shot) -> qf.Shape:
    return scanner.decode(shot)


def read(record: Any) -> tuple[str, np.ndarray]:
    """Give the words of a card and its picture."""
    card = record._repr_html_()
    assert len(card) < LARGEST_CARD
    data = re.search(r"data:image/png;base64,([^\"]+)", card)
    assert data is not None
    picture = cv2.imdecode(np.frombuffer(b64decode(data[1]), np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    return re.sub(r"<[^>]*>", " ", card), picture


def test_cards_show_what_matters_without_matplotlib(
    scanner: qf.Scanner, shot: qf.Shot, shape: qf.Shape, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    words, picture = read(shape)
    assert f"{100 * shape.returned.mean():.1f} %" in words
    assert "mm" in words
    assert "joint" in words
    assert picture.std() > 20
    words, picture = read(shot)
    assert "320 x 240 px" in words
    assert "saturated" in words
    assert picture.shape[1] >= 150
    words, _ = read(scanner.calibration)
    assert "912 x 1140 px" in words
    assert "corrected" in words


def test_cards_stay_small_and_true_to_what_is_known(shape: qf.Shape) -> None:
    rng = np.random.default_rng(1)
    noise = qf.Shot(*rng.integers(0, 65535, (4, 768, 1024), np.uint16))
    read(noise)
    phase_only = replace(shape, xyz_mm=None, uncertainty_mm=None, config={"warnings": ["a <b> & c"]})
    words, _ = read(phase_only)
    assert "98 %" not in words
    assert "a &lt;b&gt; &amp; c" in words
    words, _ = read(replace(shape, phase_rad=np.full_like(shape.quality, np.nan)))
    assert "0.0 %" in words


def test_plots_give_back_their_axes(scanner: qf.Scanner, shot: qf.Shot, shape: qf.Shape) -> None:
    axes = shape.plot()
    assert [each.get_title(loc="left") for each in axes.flat] == [
        "depth",
        "uncertainty, one standard deviation",
        "absolute phase",
        "quality",
    ]
    assert shot.plot().shape == (2, 2)
    assert replace(shot, ir=None).plot().shape == (3,)
    calibration = scanner.calibration
    assert calibration is not None
    known = calibration.model_copy(update={"response": Response.from_powers((0.02,) * 4, (2.2,) * 4)})
    rig, response = known.plot()
    assert rig.get_xlabel() == "x, mm"
    assert response.lines[0].get_ydata()[-1] == pytest.approx(0.98**2.2)
    mpl.pyplot.close("all")


def test_plots_name_the_extra_that_is_missing(shape: qf.Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtraError, match=r"quadfringe\[plot\]"):
        shape.plot()


def test_the_truth_of_a_shot_outlives_its_scene(shot: qf.Shot, scanner: qf.Scanner) -> None:
    later = pickle.loads(pickle.dumps(shot.truth))
    scanner.camera.bench.place_scene("plane")
    assert shot.truth is not None
    assert np.array_equal(later.xyz_mm, shot.truth.xyz_mm, equal_nan=True)
    assert np.array_equal(later.edge, shot.truth.edge)
    flat = scanner.camera.snap().truth
    assert flat is not None
    assert np.unique(flat.depth_mm).tolist() == [800.0]
    with pytest.raises(ValueError, match="read-only"):
        shot.truth.shadow[0, 0] = True
