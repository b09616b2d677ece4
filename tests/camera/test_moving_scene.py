"""The moving hand over GigE Vision: every pixel arrives and is recorded."""

from __future__ import annotations

from pathlib import Path

from support.bars import hold

import quadfringe as qf
from quadfringe.evaluation import moving_scene
from quadfringe.evaluation.reproduce import hand
from quadfringe.recording import Recording

SMALL = qf.Device(width_px=256, height_px=192, focal_px=(645.0, 645.0), centre_px=(127.5, 95.5))


def test_the_hand_is_filmed_over_the_wire(tmp_path: Path) -> None:
    made = hand(tmp_path, 5, moving_scene.hand_system().model_copy(update={"camera": SMALL}))
    figures, movie = made.figures, made.pictures[1]
    assert figures["hand_over_gige_vision"] == 1
    assert (figures["hand_shots"], figures["hand_shapes"], figures["hand_lost"]) == (5, 5, 0)
    assert figures["hand_shots_with_wrong_pixels"] == 0
    hold("demo.hand_depth_rms_mm", figures["hand_depth_rms_mm_median"])
    assert movie.stat().st_size > 10_000
    with Recording(tmp_path / "hand.h5") as take:
        assert len(take) == 5
        assert take.header.chips == ("visible", "infrared")
        assert take.calibration is not None
