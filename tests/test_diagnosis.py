"""Faults are named by a test of their cause; shapes that their calibration contradicts are refused or warned of."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.bars import hold
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.cli import app
from quadfringe.data import Calibration, CalibrationRecord, CalibrationStep
from quadfringe.data.shot_files import write_shot
from quadfringe.decoding import symptoms
from quadfringe.decoding.closures import closure_of
from quadfringe.decoding.plausibility import geometry_of
from quadfringe.doctor import examine_shot
from quadfringe.evaluation import broken

NAMES = ("red", "green", "blue", "ir")
# Causes and which of their three strengths; `python evaluation/diagnosis.py` has all thirty shots.
QUICK = {"infrared registration": 0, "fringe numbers": 0, "bits": 1, "blur": 2}


def changed(shot: qf.Shot, change: Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]]) -> qf.Shot:
    return qf.Shot(*(np.ascontiguousarray(change(image)) for image in shot.channels.values()))


def moved(calibration: Calibration, **fields: Any) -> Calibration:
    projector = calibration.projector.model_copy(update=fields)
    return calibration.model_copy(update={"projector": projector, "infrared": None})


def first(shot: qf.Shot, calibration: Calibration | None) -> str:
    found = [
        one for one in examine_shot(shot, qf.Plan(912, calibration=calibration)) if one.grade not in ("good", "note")
    ]
    return found[0].name if found else "nothing"


# Diagnosis


def test_the_cause_of_a_fault_is_named_first() -> None:
    right = []
    for case in (next(islice(broken.broken((cause,)), strength, None)) for cause, strength in QUICK.items()):
        found = [one for one in examine_shot(case.shot, qf.Plan(912)) if one.grade != "good"]
        told = found[0] if found else None
        right.append(told is not None and case.names(told.name, told.found) and bool(told.fix))
        print(f"{case.cause}, {case.strength}, {case.scene}: {told}")
    hold("diagnosis.quick_named_percent", 100 * np.mean(right))


def test_a_sound_painted_face_has_no_finding() -> None:
    (case,) = broken.sound({"painted_face": (4,)})
    with qf.open() as scanner:
        assert first(case.shot, scanner.calibration) == "nothing"


@pytest.mark.parametrize(("columns", "rows"), [(3, 0), (-4, 6)])
def test_the_shift_that_mends_infrared_is_told(columns: int, rows: int, bench: tuple[qf.Shot, Calibration]) -> None:
    shot, _ = bench
    ir = np.roll(shot.ir, (rows, columns), axis=(0, 1))
    closure = closure_of(qf.Shot(shot.red, shot.green, shot.blue, ir), qf.Plan(912))
    assert closure is not None
    match = symptoms.rows_match(qf.Shot(shot.red, shot.green, shot.blue, ir), qf.Plan(912), closure.shift_px)
    assert match is not None
    hold("diagnosis.shift_px", [abs(closure.shift_px - columns), abs(match.shift_px - rows)])


def test_other_fringe_numbers_are_told_with_those_that_fit(bench: tuple[qf.Shot, Calibration]) -> None:
    shot, _ = bench
    with pytest.raises(qf.DecodeError, match=r"which fits 36, 35, 30; give the numbers") as caught:
        qf.decode(shot, qf.Plan(912, fringes=(49, 48, 42)))
    assert caught.value.reason == "fringe numbers"
    assert "--fringes" in caught.value.fix


def test_twelve_bits_in_sixteen_are_told_and_mended_on_the_command_line(
    tmp_path: Path, bench: tuple[qf.Shot, Calibration]
) -> None:
    shot = changed(bench[0], lambda image: image.astype(np.uint16) * 16)
    assert symptoms.bits_in_use(shot) == symptoms.Bits(12, True, int(max(i.max() for i in shot.images.values())))
    assert symptoms.bits_in_use(qf.Shot(*shot.channels.values(), 4095.0)) is None
    write_shot(tmp_path, shot)
    told = CliRunner().invoke(app, ["doctor", str(tmp_path)])
    assert told.exit_code == 1
    assert told.stdout.startswith("FAULT   bits")
    assert "--bits 12" in told.stdout
    assert CliRunner().invoke(app, ["doctor", str(tmp_path), "--bits", "12"]).exit_code == 0


# Plausibility


@pytest.mark.parametrize("method", ["joint", "published"])
@pytest.mark.parametrize("flip", [lambda i: i[:, ::-1], lambda i: i[::-1, ::-1]], ids=["mirrored", "turned"])
def test_mirrored_and_turned_images_are_refused(flip: Any, method: str, bench: tuple[qf.Shot, Calibration]) -> None:
    shot, calibration = bench
    plan = qf.Plan(912, calibration=calibration, decode={"method": method})
    with pytest.raises(qf.DecodeError, match=r"fringes run backwards in .* mirrored left to right or turned") as caught:
        qf.decode(changed(shot, flip), plan)
    assert caught.value.reason == "mirrored or rotated"
    assert first(changed(shot, flip), calibration) == "mirrored or rotated"


def test_a_calibration_in_metres_is_refused(bench: tuple[qf.Shot, Calibration]) -> None:
    shot, calibration = bench
    metres = moved(calibration, translation_mm=tuple(0.001 * t for t in calibration.projector.translation_mm))
    with pytest.raises(qf.DecodeError, match="multiply it by 1000") as caught:
        qf.decode(shot, qf.Plan(912, calibration=metres))
    assert caught.value.reason == "calibration units"


def test_a_light_field_that_misses_the_points_is_refused(bench: tuple[qf.Shot, Calibration]) -> None:
    """Rows that moved by half the projector; with a tenth of them outside, the shape carries a warning."""
    shot, calibration = bench
    column, _ = calibration.projector.centre_px
    with pytest.raises(qf.DecodeError, match="above or below the image of the projector in"):
        qf.decode(shot, qf.Plan(912, calibration=moved(calibration, centre_px=(column, -100.0))))
    partly = moved(calibration, centre_px=(column, 990.0))
    with pytest.warns(qf.DecodeWarning, match="above or below the image of the projector"):
        shape = qf.decode(shot, qf.Plan(912, calibration=partly))
    assert len(shape.warnings) == 1


def test_a_calibration_of_another_bench_is_warned_of(tmp_path: Path, bench: tuple[qf.Shot, Calibration]) -> None:
    """The pose of the projector inverted, and boards that stood at half the depth of the object."""
    shot, calibration = bench
    turn = np.array(calibration.projector.rotation)
    centre = -turn.T @ np.array(calibration.projector.translation_mm)
    inverted = moved(calibration, rotation=tuple(map(tuple, turn.T.tolist())), translation_mm=tuple(centre.tolist()))
    settings = {"pose_1": {"T_camera_board": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 400], [0, 0, 0, 1]]}}
    step = CalibrationStep(name="poses", good=True, verdict="good", settings=settings)
    record = CalibrationRecord(made_utc="2026-01-01T00:00:00+00:00", quadfringe_version="0", rig="r", steps=(step,))
    for wrong in (inverted, calibration.model_copy(update={"record": record})):
        with pytest.warns(qf.DecodeWarning, match=r"another bench|calibration was made at 400 to 400 mm"):
            shape = qf.decode(shot, qf.Plan(912, calibration=wrong))
        shape.save(tmp_path / "shape.npz")
        assert qf.Shape.load(tmp_path / "shape.npz").warnings == shape.warnings != ()


@pytest.mark.parametrize("method", ["joint", "published"])
def test_depths_outside_the_stated_range_are_no_data(method: str, bench: tuple[qf.Shot, Calibration]) -> None:
    shot, calibration = bench
    whole = qf.decode(shot, qf.Plan(912, calibration=calibration, decode={"method": method}))
    near_mm = float(np.nanquantile(whole.depth_mm, 0.2))
    settings = {"method": method, "depth_range_mm": (near_mm, 2000.0)}
    shape = qf.decode(shot, qf.Plan(912, calibration=calibration, decode=settings))
    kept = whole.returned & (whole.depth_mm >= near_mm) & (whole.depth_mm <= 2000.0)
    np.testing.assert_array_equal(shape.returned, kept)
    for name, values in shape.maps.items():
        if name == "reason":  # tests/test_reasons.py
            continue
        expected = (
            whole.maps[name] if name in ("quality", "modulation") else np.where(kept.T, whole.maps[name].T, np.nan).T
        )
        np.testing.assert_array_equal(values, expected, name)
    with pytest.warns(qf.DecodeWarning, match="outside the stated depths of 100 to 200 mm"):
        empty = qf.decode(shot, qf.Plan(912, calibration=calibration, decode=settings | {"depth_range_mm": (100, 200)}))
    assert not empty.returned.any()
    with pytest.raises(qf.InputError, match="needs a calibration"):
        qf.Decoder(shot, qf.Plan(912, decode=settings))


def test_the_command_line_warns_on_standard_error(tmp_path: Path, bench: tuple[qf.Shot, Calibration]) -> None:
    shot, calibration = bench
    write_shot(tmp_path, shot)
    calibration.save(tmp_path / "c.json")
    words = [
        "decode",
        str(tmp_path),
        "--fringes",
        "36",
        "35",
        "30",
        "--projector-width",
        "912",
        "--calibration",
        str(tmp_path / "c.json"),
    ]
    words += ["--out", str(tmp_path / "s.npz"), "--json", str(tmp_path / "f.json"), "--depth-range-mm", "100", "200"]
    run = CliRunner().invoke(app, words)
    assert run.exit_code == 0, run.output
    assert run.stderr.startswith("warning: 100% of the points lie outside the stated depths")
    assert '"warnings": [\n    "100% of the points' in (tmp_path / "f.json").read_text()


def test_a_sound_shape_agrees_with_its_calibration(bench: tuple[qf.Shot, Calibration]) -> None:
    shot, calibration = bench
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        shape = qf.decode(shot, qf.Plan(912, calibration=calibration))
    assert shape.warnings == ()
    found = geometry_of(shape)
    assert found is not None
    assert (found.backwards < found.nowhere + 0.01, found.nowhere, found.outside) == (True, 0.0, 0.0)
