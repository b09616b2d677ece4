"""The moving hand: recording, PLY of every instant and movie; tests/camera record it over GigE Vision."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from support.bars import hold

import quadfringe as qf
from quadfringe.errors import InputError
from quadfringe.evaluation import moving_scene
from quadfringe.evaluation.reproduce import hand
from quadfringe.recording import Recording
from quadfringe.view.colours import texture
from quadfringe.view.movie import movie, solid_picture

SMALL = qf.Device(width_px=256, height_px=192, focal_px=(645.0, 645.0), centre_px=(127.5, 95.5))


def frames_of(path: Path) -> list[np.ndarray]:
    reader = cv2.VideoCapture(str(path))
    frames = []
    while True:
        got, frame = reader.read()
        if not got:
            return frames
        frames.append(frame.astype(int))


def test_a_film_of_the_hand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(moving_scene, "find_spec", lambda _: None)  # as without the extra
    system = moving_scene.hand_system().model_copy(update={"camera": SMALL})
    made = hand(tmp_path, 4, system)
    figures, path = made.figures, made.pictures[1]
    assert (figures["hand_shots"], figures["hand_shapes"], figures["hand_lost"]) == (4, 4, 0)
    assert figures["hand_shots_with_wrong_pixels"] == figures["hand_over_gige_vision"] == 0
    hold("demo.hand_depth_rms_mm", figures["hand_depth_rms_mm_median"])
    assert sorted(p.name for p in (tmp_path / "hand").iterdir()) == [f"shot_{k:06d}.ply" for k in range(4)]
    with Recording(tmp_path / "hand.h5") as take:
        assert len(take) == 4
        assert take.header.bayer == "rggb"
    frames = frames_of(path)
    assert len(frames) == 4
    shown = frames[0][:, 640:]
    assert shown.shape == (480, 640, 3)
    assert (shown.max(axis=2) > 60).mean() > 0.4  # the shape fills the picture, its shadows do not
    assert np.abs(frames[1] - frames[0]).mean() > 2  # and moves


def test_a_solid_is_lit_by_its_slope_and_hides_what_lies_behind() -> None:
    with qf.open(qf.SystemConfig(camera=SMALL, scene=qf.SceneConfig(surface="sphere"))) as scanner:
        shot = scanner.grab()
        shape = scanner.decode(shot)
    white = np.full((*shape.phase_rad.shape, 3), 200, np.uint8)
    top = np.unravel_index(np.nanargmin(shape.depth_mm), shape.depth_mm.shape)
    assert shape.xyz_mm is not None
    picture = solid_picture(shape, white, turn_deg=(0.0, 0.0), middle_mm=tuple(shape.xyz_mm[top]))
    middle = picture[200:280, 280:360].astype(int)
    assert middle[:40, :40].mean() > middle[40:, 40:].mean() + 3  # light comes from above left
    assert texture(shot, shape).shape == white.shape
    with pytest.raises(InputError, match="phase only"):
        solid_picture(qf.Shape(*[shape.phase_rad] * 4), white)


def test_a_movie_is_whole_or_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="one size"), movie(tmp_path / "a.mp4", 10.0) as pictures:  # noqa: PT012
        pictures.add(np.zeros((48, 64, 3), np.uint8))
        pictures.add(np.zeros((64, 48, 3), np.uint8))
    with pytest.raises(InputError, match=r"\.mp4"), movie(tmp_path / "a.avi", 10.0):
        pass
    assert not list(tmp_path.iterdir())
