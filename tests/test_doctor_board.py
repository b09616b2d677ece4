"""The doctor tells a wrong calibration from wrong decoding by a shot of a board, or of a flat plate."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from support.bars import hold
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.calibration.rehearsal import INK, PAPER, TEXEL_MM, board_poses
from quadfringe.calibration.targets import Target, raster, ring_board
from quadfringe.cli import app
from quadfringe.config import Device
from quadfringe.data import Calibration
from quadfringe.data.shot_files import write_shot
from quadfringe.devices.virtual import PrintedBoard, VirtualBench
from quadfringe.doctor import Finding, examine_board, examine_plane
from quadfringe.doctor.board import measure_board
from quadfringe.doctor.flatness import flatness_of
from quadfringe.doctor.plate import judged_board
from quadfringe.errors import InputError

SMALL = Device(width_px=512, height_px=384, focal_px=(1290.0, 1290.0), centre_px=(255.5, 191.5))
BOARD = ring_board(rows=7, columns=9, pitch_mm=26.0)
POSE = board_poses(BOARD, 3, tilt_deg=20.0)[1]
Taken = tuple[qf.Shot, Calibration]


def taken(board: Target | None = BOARD, exponent: float = 1.0, noise: float = 0.01) -> Taken:
    """Capture the board, or a plane tilted by 11 degrees; the calibration is exact but does not know the exponent."""
    scene = qf.SceneConfig(surface="plane", noise=noise, projector_exponent=(exponent,) * 4)
    bench = VirtualBench(qf.SystemConfig(camera=SMALL, scene=scene))
    bench.project(qf.Fringes())
    if board is None:
        bench.place_plane((0.0, 0.0, 800.0), (float(np.sin(0.2)), 0.0, -float(np.cos(0.2))))
    else:
        bench.place(PrintedBoard(raster(board, TEXEL_MM), TEXEL_MM, board.area_mm, PAPER, INK), POSE)
    shot = bench.expose(seed=3)
    assert isinstance(shot, qf.Shot)
    return shot, bench.calibration()


@pytest.fixture(scope="module")
def sound() -> Taken:
    return taken()


@pytest.fixture(scope="module")
def sound_plane() -> Taken:
    return taken(None)


def focal(name: str, factor: float) -> Callable[[Calibration], Calibration]:
    def change(known: Calibration) -> Calibration:
        device: Device = getattr(known, name)
        longer = (device.focal_px[0] * factor, device.focal_px[1] * factor)
        return known.model_copy(update={name: device.model_copy(update={"focal_px": longer})})

    return change


def baseline(known: Calibration) -> Calibration:
    moved = {}
    for name in ("projector", "infrared"):
        device = getattr(known, name)
        farther = tuple(1.01 * value for value in device.translation_mm)
        moved[name] = device.model_copy(update={"translation_mm": farther})
    return known.model_copy(update=moved)


def distortion(name: str) -> Callable[[Calibration], Calibration]:
    def change(known: Calibration) -> Calibration:
        device: Device = getattr(known, name)
        return known.model_copy(update={name: device.model_copy(update={"distortion": (0.1, 0.0, 0.0, 0.0, 0.0)})})

    return change


WRONG = {
    "camera focal length": focal("camera", 1.01),
    "projector focal length": focal("projector", 1.01),
    "baseline": baseline,
    "camera distortion": distortion("camera"),
    "projector distortion": distortion("projector"),
}


def plan_of(calibration: Calibration, response: str = "linear") -> qf.Plan:
    return qf.Plan(912, calibration=calibration, response=response)


def bad(found: list[Finding]) -> set[str]:
    for one in found:
        print(f"{one.grade:8s}{one.name}: {one.found} [{one.value}]")
    return {one.name for one in found if one.grade != "good"}


@pytest.mark.parametrize("noise", [0.01, 0.03])
def test_a_sound_bench_is_good(noise: float) -> None:
    shot, calibration = taken(noise=noise)
    found = examine_board(shot, plan_of(calibration), BOARD)
    assert bad(found) == set()
    assert found[0].name == "verdict"
    shot, calibration = taken(None, noise=noise)
    assert bad(examine_plane(shot, plan_of(calibration))) == set()


def test_the_points_of_a_sound_bench_are_those_of_the_board(sound: Taken) -> None:
    shot, calibration = sound
    plan = plan_of(calibration)
    found = measure_board(shot, qf.decode(shot, plan), plan, BOARD)
    assert found.points == len(BOARD.points_mm)
    hold("doctor.board_scale_percent", abs(found.scale_percent))
    hold("doctor.board_form_mm", found.form_mm)
    hold("doctor.board_reprojection_px", found.reprojection_px)
    hold("doctor.plane_bow_mm", found.plate.bow_mm)


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_calibration_is_named(name: str, sound: Taken) -> None:
    shot, calibration = sound
    names = bad(found := examine_board(shot, plan_of(WRONG[name](calibration)), BOARD))
    assert found[0].found.startswith("the calibration is at fault"), found[0].found
    assert names >= {"verdict"}
    assert not any(one.startswith("decoding") for one in names)
    assert found[0].fix


def test_the_scale_is_measured(sound: Taken) -> None:
    shot, calibration = sound
    plan = plan_of(baseline(calibration))
    found = measure_board(shot, qf.decode(shot, plan), plan, BOARD)
    hold("doctor.board_scale_percent", abs(found.scale_percent - 1.0))
    hold("doctor.board_scale_percent", abs(found.nearer_percent + 1.0))


@pytest.mark.parametrize("name", [name for name in WRONG if name != "baseline"])
def test_a_plane_shows_a_calibration_that_bends(name: str, sound_plane: Taken) -> None:
    shot, calibration = sound_plane
    assert bad(examine_plane(shot, plan_of(WRONG[name](calibration)))) == {"verdict", "calibration bow"}


@pytest.mark.parametrize("exponent", [1.3, 2.0])
def test_a_wrong_response_is_named_as_decoding(exponent: float) -> None:
    for board in (BOARD, None):
        shot, calibration = taken(board, exponent)
        plan = plan_of(calibration.model_copy(update={"response": None}))
        found = examine_plane(shot, plan) if board is None else examine_board(shot, plan, BOARD)
        names = bad(found)
        assert found[0].found.startswith("the decoding is at fault"), found[0].found
        assert "decoding waves" in names


def test_the_light_tells_a_wrong_response_before_the_calibration() -> None:
    shot, calibration = taken(exponent=1.3)
    unknown = baseline(calibration).model_copy(update={"response": None})
    bad(found := examine_board(shot, plan_of(unknown), BOARD))
    one = {each.name: each for each in found}
    assert found[0].found.startswith("the decoding is at fault: decoding response"), found[0].found
    assert found[0].fix == one["decoding response"].fix
    assert "quadfringe calibrate response" in found[0].fix
    assert one["calibration scale"].grade == "note"
    assert "examine again" in one["calibration scale"].fix
    bad(mended := examine_board(shot, plan_of(unknown, "auto"), BOARD))
    assert mended[0].found.startswith("the calibration is at fault: calibration scale"), mended[0].found


def with_wrong_orders(shape: qf.Shape, where: NDArray[np.bool_]) -> qf.Shape:
    """Move pixels along their rays as an order would, by 30 mm at 800 mm."""
    assert shape.xyz_mm is not None
    return replace(shape, xyz_mm=np.where(where[:, :, None], shape.xyz_mm * np.float32(1 + 30 / 800), shape.xyz_mm))


def test_few_wrong_orders_are_named_as_decoding(sound: Taken) -> None:
    shot, calibration = sound
    plan = plan_of(calibration)
    shape = qf.decode(shot, plan)
    strip, spots = np.zeros((2, *shape.phase_rad.shape), bool)
    strip[150:190, 200:330] = True
    spots[100:280, 150:360] = np.random.default_rng(0).random((180, 210)) < 0.05
    for where in (strip, spots):
        measured = measure_board(shot, with_wrong_orders(shape, where), plan, BOARD)
        assert bad(judged_board(measured)) == {"verdict", "decoding orders"}
        hold("doctor.wrong_orders_found_percent", 100 * measured.plate.displaced[where & shape.returned].mean())
        hold("doctor.wrong_orders_invented_percent", 100 * measured.plate.displaced[~where].mean())


def test_a_bow_is_measured_with_its_uncertainty(sound_plane: Taken) -> None:
    """A plate that is bent by a known sagitta, along one direction."""
    shot, calibration = sound_plane
    shape = qf.decode(shot, plan_of(calibration))
    assert shape.xyz_mm is not None
    columns = np.linspace(-1, 1, shape.phase_rad.shape[1], dtype=np.float32)
    ray = shape.xyz_mm / shape.xyz_mm[:, :, 2:]
    bent = replace(shape, xyz_mm=shape.xyz_mm + ray * (0.5 * columns**2)[None, :, None])
    found = flatness_of(bent)
    hold("doctor.bow_mm", abs(found.bow_mm - 0.5 * float(np.cos(0.2))))
    hold("doctor.bow_sd_share", found.bow_sd_mm / found.bow_mm)
    assert found.displaced_share == 0


def test_what_cannot_be_examined_is_said(sound: Taken, sound_plane: Taken) -> None:
    shot, calibration = sound
    with pytest.raises(InputError, match="name the calibration"):
        examine_board(shot, qf.Plan(912), BOARD)
    other = examine_board(shot, plan_of(calibration), ring_board())
    assert (other[0].name, other[0].grade) == ("board", "fault")
    missing = examine_board(sound_plane[0], plan_of(calibration), BOARD)
    assert (missing[0].name, missing[0].grade) == ("board", "fault")
    black = qf.Shot(*(np.zeros_like(image) for image in shot.channels.values()), shot.full_scale)
    dark = examine_plane(black, plan_of(calibration))
    assert (dark[0].grade, dark[0].name.startswith("decoding")) == ("fault", True)


def test_the_command_line_says_it(sound: Taken, tmp_path: Path) -> None:
    shot, calibration = sound
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        write_shot(tmp_path / name, shot)
    calibration.save(tmp_path / "right.json")
    baseline(calibration).save(tmp_path / "wrong.json")
    (tmp_path / "board.json").write_text(BOARD.model_dump_json(exclude_none=True))
    words = ["doctor", "--board", "--target", str(tmp_path / "board.json"), str(tmp_path / "a")]
    good = CliRunner().invoke(app, [*words, str(tmp_path / "right.json")])
    assert "ok      verdict: neither the calibration" in good.stdout, good.output
    assert good.exit_code == 0
    both = [*words, str(tmp_path / "b"), str(tmp_path / "wrong.json"), "--json", str(tmp_path / "d.json")]
    wrong = CliRunner().invoke(app, both)
    assert wrong.exit_code == 1
    told = {one["name"]: one for one in json.loads((tmp_path / "d.json").read_text())["findings"]}
    assert told["a calibration scale"]["grade"] == told["b calibration scale"]["grade"] == "fault"
    assert "FAULT   b verdict: the calibration is at fault: calibration scale" in wrong.stdout
    plane = CliRunner().invoke(app, ["doctor", "--plane", str(tmp_path / "a"), str(tmp_path / "right.json")])
    assert "calibration bow: the plate bows by" in plane.stdout, plane.output
    for arguments in (
        ["--board", str(tmp_path / "a")],
        ["--board", "--plane", str(tmp_path / "a"), str(tmp_path / "right.json")],
        ["--target", str(tmp_path / "board.json"), str(tmp_path / "a"), str(tmp_path / "right.json")],
        [str(tmp_path / "a"), str(tmp_path / "b")],
    ):
        assert CliRunner().invoke(app, ["doctor", *arguments]).exit_code == 2
