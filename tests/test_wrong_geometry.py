"""Images that moved and devices that were turned are found where the border of the light is in view."""

from __future__ import annotations

import warnings
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from support.bars import hold
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.cli import app
from quadfringe.data.shot_files import write_shot
from quadfringe.decoding import params
from quadfringe.decoding.fringe_fit import pixels_of
from quadfringe.decoding.light_border import borders_of, moved_border
from quadfringe.doctor import examine_shot
from quadfringe.evaluation.wrong_geometry import CLOSE, FAULTS, WIDE, Exposed, exposed, with_boards

# Wrong calibrations that the border of the light shows; `python evaluation/geometry.py` has more, and more scenes.
SHOWN = ("rows 20", "columns 20", "pan 5")


@cache
def case(camera: qf.Device, scene: str = "plane") -> Exposed:
    (only,) = exposed(camera, (scene,))
    return only


def decoded(one: Exposed, fault: str | None = None, *, boards: bool = False) -> qf.Shape:
    known = one.calibration if fault is None else FAULTS[fault](one.calibration)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", qf.DecodeWarning)
        return qf.decode(one.shot, qf.Plan(912, calibration=with_boards(known) if boards else known))


def test_the_border_of_the_light_shows_what_moved() -> None:
    told = [decoded(case(WIDE), fault).warnings for fault in SHOWN]
    print(told)
    hold("diagnosis.moved_told_percent", 100 * np.mean([len(words) > 0 for words in told]))
    assert all("light" in words[0] for words in told)


def test_a_sound_shot_has_its_borders_at_their_place_and_no_warning() -> None:
    shape = decoded(case(WIDE, "face"))
    assert shape.warnings == ()
    assert [border.name for border in borders_of(shape)] == ["upper", "lower"]
    hold("diagnosis.border_px", [abs(border.inside_px) for border in borders_of(shape)])
    assert shape.geometry == (
        "rows checked: the upper and the lower border of the projected light lie within 2 projector rows of its place"
    )


def test_depths_beyond_the_boards_are_told() -> None:
    assert decoded(case(CLOSE), boards=True).warnings == ()
    (words,) = decoded(case(CLOSE), "distance 1.2", boards=True).warnings
    assert words.startswith("the median depth is 960 mm, and the calibration was made at 730 to 870 mm")


def test_a_straight_edge_of_an_object_is_not_the_border_of_the_light() -> None:
    """Here it follows a row of the projector; it ends in view, as the border of the light does not."""
    shape = decoded(case(WIDE))
    assert shape.xyz_mm is not None
    assert shape.calibration is not None
    rows = np.full(shape.phase_rad.shape, np.nan)
    rows[shape.returned] = pixels_of(shape.xyz_mm[shape.returned].astype(np.float64), shape.calibration.projector)[:, 1]
    cut = ~(rows > 200.0)
    cut[:, :130] = cut[:, -130:] = True
    for values in (shape.phase_rad, shape.column_px, shape.xyz_mm):
        values[cut] = np.nan
    borders = borders_of(shape)
    upper = borders[0]
    assert (upper.name, upper.goes_on) == ("upper", False)
    assert upper.inside_px > params.ROWS_PX
    assert moved_border(shape, borders) is None


def test_points_are_projected_as_by_opencv() -> None:
    """Among them points behind the device, and one without data."""
    turn, _ = cv2.Rodrigues(np.array([0.1, -0.2, 0.05]))
    lens = (-0.1, 0.08, 3e-4, -2e-4, 0.01)
    pose = {"rotation": turn.tolist(), "translation_mm": (-120.0, 5.0, 30.0)}
    device = qf.Device(
        width_px=912, height_px=1140, focal_px=(1200, 2400), centre_px=(450, 900), distortion=lens, **pose
    )
    points_mm = np.random.default_rng(1).uniform(-900, 900, (40, 50, 3))
    points_mm[0, 0] = np.nan
    matrix = np.array([[1200, 0, 450], [0, 2400, 900], [0, 0, 1.0]])
    right, _ = cv2.projectPoints(
        points_mm.reshape(-1, 1, 3), turn, np.array(pose["translation_mm"]), matrix, np.array(lens)
    )
    found = pixels_of(points_mm, device)
    assert np.isnan(found[0, 0]).all()
    np.testing.assert_allclose(found.reshape(-1, 2)[1:], right[1:, 0], rtol=1e-9)


def test_what_no_shot_can_check_is_said_on_the_command_line(tmp_path: Path) -> None:
    """A note is no warning: the doctor exits with 0, and says what to do by hand."""
    one = case(CLOSE)
    assert isinstance(one.shot, qf.Shot)
    write_shot(tmp_path / "shot", one.shot)
    FAULTS["rows 20"](one.calibration).save(tmp_path / "bench.json")
    given = ["--fringes", "36", "35", "30", "--projector-width", "912"]
    words = ["decode", str(tmp_path / "shot"), *given, "--calibration", str(tmp_path / "bench.json")]
    run = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "x.npz"), "--json", str(tmp_path / "x.json")])
    assert run.stderr.startswith(
        "note: rows not checked: neither the upper nor the lower border of the projected light"
    )
    assert "rows not checked" in (tmp_path / "x.json").read_text()
    assert qf.Shape.load(tmp_path / "x.npz").geometry.startswith("rows not checked")
    doctor = CliRunner().invoke(app, ["doctor", str(tmp_path / "shot"), str(tmp_path / "bench.json"), *given])
    assert (doctor.exit_code, "note    geometry along y: rows not checked" in doctor.stdout) == (0, True)
    assert "by hand: once for a bench, show a flat board (quadfringe doctor --board)" in doctor.stdout


def test_the_doctor_finds_the_border_good() -> None:
    one = case(WIDE)
    found = {each.name: each for each in examine_shot(one.shot, qf.Plan(912, calibration=one.calibration))}
    assert (found["geometry along y"].grade, found["geometry along y"].fix) == ("good", "")


def test_phase_without_a_calibration_says_nothing_of_geometry() -> None:
    assert qf.decode(case(CLOSE).shot, qf.Plan(912)).geometry == ""
