"""The doctor finds planted faults, names the fix, and reports no fault on a sound bench."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.bars import tolerance
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.cli import app
from quadfringe.config import IDENTITY, Device, SceneConfig, SystemConfig
from quadfringe.data import Calibration, CalibrationRecord, CalibrationStep
from quadfringe.data.shot_files import write_shot
from quadfringe.doctor import Finding, examine_calibration, examine_installation, examine_shot
from quadfringe.doctor import installation as installed

SMALL = Device(width_px=512, height_px=384, focal_px=(1290.0, 1290.0), centre_px=(255.5, 191.5))
PLAN = qf.Plan(912)


def shot_of(surface: str = "peaks", **light: Any) -> tuple[qf.Shot, Calibration]:
    scene = SceneConfig.model_validate({"surface": surface, "noise": 0.01} | light)
    with qf.open(SystemConfig(camera=SMALL, scene=scene)) as scanner:
        shot = scanner.grab()
        assert isinstance(shot, qf.Shot)
        return shot, scanner.calibration


def by_name(found: list[Finding]) -> dict[str, Finding]:
    return {one.name: one for one in found}


@pytest.mark.parametrize("surface", ["plane", "peaks", "face", "steps"])
def test_a_sound_shot_has_nothing_wrong(surface: str) -> None:
    shot, calibration = shot_of(surface)
    found = examine_shot(shot, qf.Plan(912, calibration=calibration))
    assert {one.name: one.grade for one in found if one.grade != "good"} == {"geometry along y": "note"}


def test_a_response_that_is_not_linear_is_told() -> None:
    shot, calibration = shot_of(projector_exponent=1.5)
    assert by_name(examine_shot(shot, PLAN))["response"].grade == "fault"
    assert by_name(examine_shot(shot, qf.Plan(912, calibration=calibration)))["response"].grade == "good"


def test_crosstalk_is_told_with_its_channels() -> None:
    matrix = np.eye(4)
    matrix[1, 3] = 0.2
    shot, calibration = shot_of(crosstalk=tuple(map(tuple, matrix)), gain=0.8)
    told = by_name(examine_shot(shot, PLAN))["crosstalk"]
    assert told.grade == "fault"
    assert told.found.startswith("green sees")
    assert "of the fringes of ir" in told.found
    assert told.value == pytest.approx(0.2, abs=tolerance("doctor.value"))
    assert by_name(examine_shot(shot, qf.Plan(912, calibration=calibration)))["crosstalk"].grade == "good"


def test_saturation_and_weak_fringes_are_told() -> None:
    bright, _ = shot_of(gain=(1.3, 1.0, 1.0, 1.0))
    assert by_name(examine_shot(bright, PLAN))["saturation red"].grade == "fault"
    weak, _ = shot_of(gain=(0.9, 0.9, 0.9, 0.15), noise=0.0)
    found = by_name(examine_shot(weak, PLAN))
    assert found["modulation ir"].grade == "warning"
    assert "increase the ir light" in found["modulation ir"].fix


def test_exchanged_channels_are_told() -> None:
    shot, _ = shot_of()
    swapped = qf.Shot(shot.blue, shot.green, shot.red, shot.ir, shot.full_scale)
    told = by_name(examine_shot(swapped, PLAN))["fringe orders"]
    assert (told.grade, "red and blue seem to be swapped" in told.found) == ("fault", True)


def test_a_pair_that_has_drifted_is_told() -> None:
    """Half a millimetre is reported; at one and a half all orders are wrong, and the shot is refused."""
    with qf.open(SystemConfig(camera=SMALL, scene=SceneConfig(surface="peaks", noise=0.01))) as scanner:
        config = scanner.config
    assert config.projector is not None
    told = {}
    for shift_mm in (0.5, 1.5):
        shifted = tuple(float(v) for v in np.add(config.projector.translation_mm, (shift_mm, 0, 0)))
        moved = config.projector.model_copy(update={"translation_mm": shifted})
        with qf.open(config.model_copy(update={"infrared": moved})) as scanner:
            shot, calibration = scanner.grab(), scanner.calibration
        plans = [qf.Plan(912, calibration=calibration.model_copy(update={"infrared": pair})) for pair in (None, moved)]
        told[shift_mm] = [by_name(examine_shot(shot, plan)) for plan in plans]
    assert [one["coaxial pair"].grade for one in told[0.5]] == ["warning", "good"]
    assert [one["infrared registration"].grade for one in told[0.5]] == ["warning", "warning"]
    for one in told[1.5]:
        assert one["infrared registration"].grade == "fault"
        assert "the infrared projector has moved" in one["infrared registration"].fix


def test_a_calibration_tells_what_is_wrong_with_it() -> None:
    _, calibration = shot_of()
    assert by_name(examine_calibration(calibration))["record"].grade == "warning"
    bad = CalibrationStep(name="levels", good=False, verdict="channels still see 3 % of one another's light")
    record = CalibrationRecord(made_utc="2020-01-01T00:00:00+00:00", quadfringe_version="0.1.0", rig="r", steps=(bad,))
    flat = calibration.projector.model_copy(update={"translation_mm": (-10.0, 0.0, 0.0), "rotation": IDENTITY})
    singular = [[1.0 if i == j else 0.95 for j in range(4)] for i in range(4)]
    values = calibration.model_dump() | {
        "record": record.model_dump(),
        "projector": flat.model_dump(),
        "crosstalk": singular,
    }
    found = by_name(examine_calibration(Calibration.model_validate(values)))
    names = ("age", "step levels", "triangulation angle", "crosstalk")
    assert [found[name].grade for name in names] == ["fault", "fault", "fault", "fault"]
    assert all(found[name].fix for name in names)


def test_the_installation_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    found = by_name(examine_installation())
    assert found["kernel"].grade == "good"
    assert found["opencv"].grade == "good"

    class Clash:
        def __init__(self, name: str) -> None:
            self.metadata = {"Name": name}

    monkeypatch.setattr(installed, "distributions", lambda: [Clash("opencv-python"), Clash(installed.OPENCV[-1])])
    monkeypatch.setattr(installed._core, "lightcrafters", lambda: [("1-2", 4, None)])
    monkeypatch.setattr(installed._core, "__profile__", "debug")
    broken = by_name(examine_installation())
    assert "overwrite each other" in broken["opencv"].found
    assert "udevadm" in broken["projectors"].fix
    assert "maturin develop --release" in broken["kernel"].fix


def test_the_command_line_says_it(tmp_path: Path) -> None:
    shot, calibration = shot_of(projector_exponent=2.0)
    write_shot(tmp_path, shot)
    calibration.save(tmp_path / "c.json")
    run = CliRunner().invoke(app, ["doctor", str(tmp_path), "--json", str(tmp_path / "d.json")])
    assert run.exit_code == 1
    assert "FAULT   response" in run.stdout
    assert "quadfringe calibrate response" in run.stdout
    told = {one["name"]: one for one in json.loads((tmp_path / "d.json").read_text())["findings"]}
    assert told["response"]["grade"] == "fault"
    # Under room light the exponent alone does not make the light linear, even if it is exact.
    lit = CliRunner().invoke(app, ["doctor", str(tmp_path), str(tmp_path / "c.json")])
    assert "estimate it again" in lit.stdout
    dark, _ = shot_of(projector_exponent=2.0, ambient=(0.0,) * 4)
    (tmp_path / "dark").mkdir()
    write_shot(tmp_path / "dark", dark)
    known = CliRunner().invoke(app, ["doctor", str(tmp_path / "dark"), str(tmp_path / "c.json")])
    assert known.exit_code == 0, known.output
    assert CliRunner().invoke(app, ["doctor", str(tmp_path / "none")]).exit_code == 2
    empty = tmp_path / "empty"
    empty.mkdir()
    missing = CliRunner().invoke(app, ["doctor", str(empty)])
    assert (missing.exit_code, "no image of a shot in it; expected red.png" in missing.stderr) == (2, True)


def test_the_period_that_a_refusal_asks_for_is_taken(tmp_path: Path) -> None:
    write_shot(tmp_path, shot_of()[0])
    run = CliRunner().invoke(app, ["doctor", str(tmp_path), "--period-px", "15", "30"])
    assert run.exit_code == 0, run.output
    wrong = CliRunner().invoke(app, ["doctor", str(tmp_path), "--period-px", "30", "15"])
    assert (wrong.exit_code, "--period-px" in wrong.stderr) == (2, True)


def test_the_fault_of_a_shot_comes_before_the_warnings_of_its_calibration(tmp_path: Path) -> None:
    shot, calibration = shot_of()
    write_shot(tmp_path, qf.Shot(shot.blue, shot.green, shot.red, shot.ir, shot.full_scale))
    calibration.model_copy(update={"record": None}).save(tmp_path / "c.json")
    run = CliRunner().invoke(
        app, ["doctor", str(tmp_path), str(tmp_path / "c.json"), "--json", str(tmp_path / "d.json")]
    )
    assert run.exit_code == 1
    assert run.stdout.startswith("FAULT   fringe orders")
    grades = [one["grade"] for one in json.loads((tmp_path / "d.json").read_text())["findings"]]
    assert "warning" in grades
    assert grades == sorted(grades, key=["fault", "warning", "note", "good"].index)
