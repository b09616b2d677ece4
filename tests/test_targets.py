"""Boards: printed files, and detection in images of the virtual bench."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from support.bars import hold
from typer.testing import CliRunner

from quadfringe.calibration._centres import refined_centres
from quadfringe.calibration._grid import blobs, homography, symmetries, through
from quadfringe.calibration.detect import TargetNotFoundError, View, find_target
from quadfringe.calibration.rehearsal import VirtualBoard
from quadfringe.calibration.targets import (
    Target,
    asymmetric_grid,
    charuco_board,
    circle_grid,
    drawing,
    raster,
    ring_board,
)
from quadfringe.cli import app
from quadfringe.config import Device, SceneConfig, SystemConfig
from quadfringe.data import core_device
from quadfringe.errors import ConfigError, InputError

BOARDS = {
    "rings": ring_board(),
    "circles": circle_grid(),
    "asymmetric": asymmetric_grid(),
    "charuco": charuco_board(),
}
LENS = (-0.1, 0.08, 3e-4, -2e-4, 0.0)
CAMERA = Device(width_px=1024, height_px=768, focal_px=(2580.0, 2585.0), centre_px=(505.0, 390.0), distortion=LENS)
SHAKEN = {"noise": 0.01, "blur_px": 0.8, "shading": True, "projector_exponent": (2.2, 2.2, 2.2, 2.2), "seed": 3}
TILTS = {
    "straight": (0.0, 0.0, 0.05),
    "45 degrees about x": (np.pi / 4, 0.0, 0.1),
    "45 degrees about y": (0.0, -np.pi / 4, 0.2),
    "upside down": (0.3, 0.2, 3.0),
}


@cache
def room(kind: str, **scene: Any) -> VirtualBoard:
    return VirtualBoard(SystemConfig(camera=CAMERA, scene=SceneConfig(**scene)), BOARDS[kind])


def pose(
    target: Target, turn: tuple[float, float, float], middle_mm: tuple[float, float, float]
) -> NDArray[np.float64]:
    motion = np.eye(4)
    motion[:3, :3] = cv2.Rodrigues(np.array(turn))[0]
    points = target.points_mm
    motion[:3, 3] = np.array(middle_mm) - motion[:3, :3] @ (0.5 * (points.min(axis=0) + points.max(axis=0)))
    return motion


@cache
def seen(
    kind: str, turn: tuple[float, float, float], middle_mm: tuple[float, float, float] = (0, 0, 850), **scene: Any
) -> Any:
    """Image of a board, and where its points are."""
    motion = pose(BOARDS[kind], turn, middle_mm)
    image = room(kind, **(SHAKEN | scene)).photograph(motion)
    camera = core_device(CAMERA)
    points = BOARDS[kind].points_mm @ motion[:3, :3].T + motion[:3, 3]
    return image, np.array([camera.project(tuple(p)) for p in points.tolist()])


def rms(view: View, truth: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.square(view.points_px - truth[view.ids]).sum(axis=1).mean()))


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("kind", ["rings", "circles", "asymmetric"])
def test_centres_are_found_to_a_twentieth_of_a_pixel(kind: str, tilt: str) -> None:
    image, truth = seen(kind, TILTS[tilt])
    view = find_target(image, BOARDS[kind])
    assert len(view.ids) == len(truth)
    hold("calibration.ring_centre_rms_px", rms(view, truth))


@pytest.mark.parametrize("scene", [{"blur_px": 2.5}, {"noise": 0.04}, {"gain": (0.2,) * 4}, {"bit_depth": 12}])
def test_rings_survive_blur_noise_and_little_light(scene: dict[str, Any]) -> None:
    image, truth = seen("rings", (0.4, -0.3, 0.1), **scene)
    noisy = "noise" in scene
    key = "calibration.noisy_ring_centre_rms_px" if noisy else "calibration.ring_centre_rms_px"
    hold(key, rms(find_target(image, BOARDS["rings"]), truth))


def test_rings_survive_uneven_light() -> None:
    image, truth = seen("rings", (0.4, -0.3, 0.1))
    light = np.linspace(0.25, 1.0, image.shape[1], dtype=np.float32) * np.linspace(1.0, 0.5, len(image))[:, None]
    hold("calibration.ring_centre_rms_px", rms(find_target((image * light).astype(np.float32), BOARDS["rings"]), truth))


@pytest.mark.parametrize("tilt", ["straight", "45 degrees about x"])
def test_own_centres_beat_the_blobs_of_opencv(tilt: str) -> None:
    target = BOARDS["rings"]
    image, truth = seen("rings", TILTS[tilt])
    places = blobs(np.clip(image * 255, 0, 255).astype(np.uint8), target)
    apart = np.linalg.norm(places[:, None] - truth, axis=2)
    found = apart.min(axis=0) < 3
    blob_rms = float(np.sqrt(np.square(apart.min(axis=0)[found]).mean()))
    assert np.count_nonzero(found) > 90  # of 108
    hold("calibration.centres_over_blobs", rms(find_target(image, target), truth) / blob_rms)


def test_the_middle_of_a_ring_is_not_the_middle_of_its_image() -> None:
    """Nearly without noise, so that the correction of the perspective makes the difference."""
    image, truth = seen("circles", TILTS["45 degrees about x"], noise=1e-4, bit_depth=16)
    target = BOARDS["circles"]
    from quadfringe.calibration import _centres as centres

    right = refined_centres(image, target, truth)
    matrix = homography(target.points_mm[:, :2], truth)
    wrong = right + centres.perspective_shift(matrix, target)
    missed = [float(np.sqrt(np.square(c - truth).sum(axis=1).mean())) for c in (right, wrong)]
    hold("calibration.clean_centre_rms_px", missed[0])
    hold("calibration.uncorrected_centre_rms_px", missed[1])


def test_a_charuco_board_may_be_seen_in_part() -> None:
    whole, truth = seen("charuco", (0.2, 0.3, 0.1))
    hold("calibration.charuco_rms_px", rms(find_target(whole, BOARDS["charuco"]), truth))
    part, truth = seen("charuco", (0.2, 0.3, 0.1), (90, 40, 760))
    view = find_target(part, BOARDS["charuco"])
    assert 20 < len(view.ids) < 70
    hold("calibration.charuco_rms_px", rms(view, truth))


def test_the_default_blobs_of_opencv_find_no_ring() -> None:
    image, _ = seen("rings", TILTS["straight"])
    grey = np.clip(image * 255, 0, 255).astype(np.uint8)
    assert not cv2.findCirclesGrid(grey, (12, 9), flags=cv2.CALIB_CB_SYMMETRIC_GRID)[0]


REASONS: list[tuple[str, str, Any]] = [
    ("rings", "mirrored", lambda image: image[:, ::-1]),
    ("circles", "mirrored", lambda image: image[::-1]),
    ("asymmetric", "mirrored", lambda image: image[:, ::-1]),
    ("charuco", "mirrored", lambda image: image[:, ::-1]),
    ("rings", "partial", lambda image: np.pad(image, ((0, 0), (0, 250)))[:, 250:]),
    ("rings", "dark", lambda image: 0.05 * image),
    ("rings", "low_contrast", lambda image: 0.5 + 0.04 * image),
    ("rings", "saturated", lambda image: np.minimum(40 * image, 1)),
    ("rings", "blurred", lambda image: cv2.GaussianBlur(image, (0, 0), 9)),
    ("rings", "not_found", lambda image: np.where(np.indices(image.shape).sum(axis=0) % 64 < 32, 0.2, 0.8)),
    ("charuco", "not_found", lambda image: np.where(np.indices(image.shape).sum(axis=0) % 64 < 32, 0.2, 0.8)),
    ("charuco", "partial", lambda image: np.where(np.arange(image.shape[1]) > 270, np.float32(0.7), image)),
]


@pytest.mark.parametrize(("kind", "reason", "spoiled"), REASONS, ids=[f"{k}-{r}" for k, r, _ in REASONS])
def test_a_failed_view_says_why(kind: str, reason: str, spoiled: Any) -> None:
    image, _ = seen(kind, (0.2, 0.1, 0.05))
    with pytest.raises(TargetNotFoundError) as failed:
        find_target(np.ascontiguousarray(spoiled(image), np.float32), BOARDS[kind])
    assert failed.value.reason == reason, str(failed.value)


def test_marks_that_are_covered_or_missing_are_named() -> None:
    image, truth = seen("rings", (0.2, 0.1, 0.05))
    matrix = homography(BOARDS["rings"].points_mm[:, :2], truth)
    x, y = through(matrix, BOARDS["rings"].mark_points_mm)[0].astype(int)
    image = image.copy()
    image[y - 12 : y + 13, x - 12 : x + 13] = image[y, x + 20]
    with pytest.raises(TargetNotFoundError, match="two marks"):
        find_target(image, BOARDS["rings"])
    unmarked = ring_board(marks=False)
    hold("calibration.ring_centre_rms_px", rms(find_target(image, unmarked), truth))


def test_images_that_are_none_are_refused() -> None:
    for image in (np.zeros((4, 4, 4, 4), np.uint8), np.zeros((40, 40), np.int64), np.zeros((0, 4), np.uint8)):
        with pytest.raises(InputError, match="image: expected"):
            find_target(image, BOARDS["rings"])
    with pytest.raises(InputError, match="expected finite values"):
        find_target(np.full((40, 40), np.nan, np.float32), BOARDS["rings"])


def test_grids_have_the_symmetries_of_their_shape() -> None:
    assert [len(symmetries(BOARDS[kind])) for kind in ("rings", "circles", "asymmetric")] == [4, 4, 2]
    assert len(symmetries(circle_grid(rows=7, columns=7))) == 8


def test_the_raster_has_the_area_of_the_drawing() -> None:
    target = ring_board()
    ink_mm2 = raster(target, 0.2).sum() * 0.04
    marks_mm2 = 2 * np.pi * target.mark_mm**2 / 4
    assert ink_mm2 == pytest.approx(108 * np.pi * (12**2 - 6**2) / 4 + marks_mm2, rel=1e-3)


def test_charuco_boards_are_those_of_opencv() -> None:
    target = charuco_board(rows=5, columns=7)
    ours = raster(target, 0.25)
    theirs = target.charuco().generateImage(ours.shape[::-1], marginSize=40, borderBits=1)
    hold("calibration.target_ink", np.abs((1 - theirs / 255.0) - ours).mean())
    corners = target.charuco().getChessboardCorners()
    np.testing.assert_allclose(corners - corners[0], target.points_mm - target.points_mm[0], atol=1e-4)


def test_boards_that_cannot_be_drawn_are_refused() -> None:
    for make, words in (
        (lambda: ring_board(pitch_mm=-1), "pitch_mm: expected a number above 0, got -1"),
        (lambda: ring_board(diameter_mm=19), "less than 14 mm"),
        (lambda: ring_board(hole_mm=11.9), "at most 0.8"),
        (lambda: charuco_board(marker_mm=25), "less than 20 mm"),
        (lambda: Target(kind="circles", rows=9, columns=12, pitch_mm=20), "expected diameter_mm"),
        (lambda: circle_grid(rows=1), "rows: expected a number of at least 3, got 1"),
    ):
        with pytest.raises((ConfigError, ValueError), match=words):
            make()


@pytest.mark.parametrize("kind", BOARDS)
def test_printed_boards_are_to_scale(kind: str, tmp_path: Path) -> None:
    """Detection in the rasterised file finds every point in its place on paper."""
    done = CliRunner().invoke(app, ["target", kind, "--out", str(tmp_path / "b.png"), "--dpi", "150", "--page", "a3"])
    assert done.exit_code == 0, done.output
    target = Target.model_validate(json.loads((tmp_path / "b.json").read_text()))
    assert target == BOARDS[kind]
    image = cv2.GaussianBlur(cv2.imread(str(tmp_path / "b.png"), cv2.IMREAD_GRAYSCALE), (0, 0), 1.0)
    view = find_target(image, target)
    shape, *_ = np.linalg.lstsq(
        np.c_[target.points_mm[view.ids, :2], np.ones(len(view.ids))], view.points_px, rcond=None
    )
    np.testing.assert_allclose(shape[:2] * 25.4 / 150, np.eye(2), atol=5e-4)


def test_pdf_and_svg_have_the_size_of_the_page(tmp_path: Path) -> None:
    for suffix, size in (("pdf", b"/MediaBox [ 0 0 841."), ("svg", b'width="841.')):
        path = tmp_path / f"board.{suffix}"
        done = CliRunner().invoke(app, ["target", "rings", "--out", str(path)])
        assert done.exit_code == 0, done.output
        assert size in path.read_bytes()
        assert "board 250 x 190 mm on 297 x 210 mm" in done.output
        first = path.read_bytes()
        CliRunner().invoke(app, ["target", "rings", "--out", str(path)])
        assert path.read_bytes() == first


def test_what_is_in_an_svg_is_what_was_drawn(tmp_path: Path) -> None:
    CliRunner().invoke(app, ["target", "rings", "--out", str(tmp_path / "b.svg"), "--page", "fit"])
    paths = (tmp_path / "b.svg").read_text().count("<path")
    assert paths >= len(drawing(BOARDS["rings"])) == 108 * 2 + 2


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["rings", "--pitch", "40"], "the board is 500 x 380 mm"),
        (["circles", "--hole", "3"], "--hole: a circles board has none"),
        (["charuco", "--no-marks"], "--marks: a charuco board has none"),
        (["rings", "--diameter", "19"], "less than 14 mm"),
    ],
)
def test_bad_options_leave_no_file(options: list[str], words: str, tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["target", *options, "--out", str(tmp_path / "b.pdf")])
    assert done.exit_code == 2
    assert words in done.output
    assert not list(tmp_path.iterdir())
