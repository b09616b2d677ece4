"""A wrong calibration, or images read otherwise than they were written, never give millimetres without a word."""

from __future__ import annotations

import json
import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.cli import app
from quadfringe.config import Device
from quadfringe.data import Calibration, CalibrationRecord, CalibrationStep
from quadfringe.data.shot_files import write_shot
from quadfringe.decoding import symptoms
from quadfringe.decoding.plausibility import implausible
from quadfringe.doctor import examine_calibration

Values = dict[str, Any]


def changed(calibration: Calibration, device: str, **fields: Any) -> Calibration:
    """Change a device, and the infrared projector with the visible one, so that the pair is no evidence."""
    values = calibration.model_dump()
    for name in ("projector", "infrared") if device == "projector" else (device,):
        values[name] |= fields
    return Calibration.model_validate(values)


def told(shot: qf.Shot, calibration: Calibration) -> str:
    """Decode, and give the refusal or the warnings of the shape."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", qf.DecodeWarning)
            plan = qf.Plan(912, calibration=calibration, decode={"method": "published"})
            return "; ".join(qf.decode(shot, plan).warnings)
    except (qf.DecodeError, ValueError) as error:
        return f"refused: {error}"


def scaled(factor: float) -> Callable[[Calibration], Calibration]:
    def change(known: Calibration) -> Calibration:
        return changed(known, "projector", translation_mm=[factor * t for t in known.projector.translation_mm])

    return change


def turned(*signs: int) -> Callable[[Calibration], Calibration]:
    def change(known: Calibration) -> Calibration:
        moved = [sign * t for sign, t in zip(signs, known.projector.translation_mm, strict=True)]
        return changed(known, "projector", translation_mm=moved)

    return change


WRONG: dict[str, tuple[Callable[[Calibration], Calibration], str]] = {
    "opposite translation": (turned(-1, -1, -1), "refused: no shape: rays of camera and projector do not meet"),
    "opposite x": (turned(-1, 1, 1), "refused: no shape: rays of camera and projector do not meet"),
    "opposite z": (turned(1, 1, -1), "the surface as a whole is seen at 51 degrees from its normal"),
    "metres": (scaled(0.001), "refused: no shape: the calibration puts the projector 0.283 mm from the camera"),
    "centimetres": (scaled(0.1), "puts the projector 28.3 mm from the camera, nearer than most lenses allow"),
    "inches": (scaled(1 / 25.4), "puts the projector 11.2 mm from the camera, nearer than most lenses allow"),
    "micrometres": (scaled(1000.0), "refused: no shape: .* 2.83e.05 mm from the camera, farther than any bench"),
    "no baseline": (scaled(0.0), "refused: .*expected a baseline"),
    "tiny focal length": (lambda c: changed(c, "camera", focal_px=(1e-300,) * 2), "refused: no shape: camera.focal_px"),
    "tiny focal length of the projector": (
        lambda c: changed(c, "projector", focal_px=(1e-300,) * 2),
        "refused: no shape: projector.focal_px",
    ),
    "focal length in mm": (lambda c: changed(c, "camera", focal_px=(16.0, 16.0)), "camera.focal_px is 16, 16; lenses"),
    "large focal length": (lambda c: changed(c, "camera", focal_px=(1e300,) * 2), "refused: no shape: camera.focal_px"),
    "one digit too many": (
        lambda c: changed(c, "camera", focal_px=(1290.0, 12900.0)),
        "refused: no shape: camera.focal_px is 1290 along x and 12900 along y",
    ),
    "camera distortion": (
        lambda c: changed(c, "camera", distortion=(1e6, 0, 0, 0, 0)),
        "refused: no shape: camera.distortion .* folds over, or more than doubles, 100% of the image",
    ),
    "projector distortion": (
        lambda c: changed(c, "projector", distortion=(-1e6, 0, 0, 0, 0)),
        "refused: no shape: projector.distortion",
    ),
    "distortion beyond a fisheye lens": (
        lambda c: changed(c, "camera", distortion=(-3, 0, 0, 0, 0)),
        "camera.distortion .* bends 80% of the image more than a fisheye lens",
    ),
    "exchanged principal point": (
        lambda c: changed(c, "camera", centre_px=c.camera.centre_px[::-1]),
        "camera.centre_px is 191.5, 255.5; 255.5, 191.5 would be in the middle of the 512 columns: x and y seem",
    ),
    "exchanged principal point of the projector": (
        lambda c: changed(c, "projector", centre_px=c.projector.centre_px[::-1]),
        "projector.centre_px is 569.5, 455.5; 455.5, 569.5 would be in the middle of the 912 columns: x and y seem",
    ),
    "half of the focal length": (
        lambda c: changed(c, "projector", focal_px=[f / 2 for f in c.projector.focal_px]),
        "the surface as a whole is seen at 70 degrees|of the points are farther than 3 times the median depth",
    ),
    "principal point": (lambda c: changed(c, "camera", centre_px=(1e9, 0)), "refused: no shape: camera.centre_px"),
}


@pytest.mark.parametrize("case", WRONG)
def test_numbers_that_no_bench_has_are_told(case: str, bench: tuple[qf.Shot, Calibration]) -> None:
    shot, calibration = bench
    change, words = WRONG[case]
    wrong = change(calibration)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        found = told(shot, wrong)
        examine_calibration(wrong)
    assert re.search(words, found), found


def test_a_sound_calibration_is_not_doubted(bench: tuple[qf.Shot, Calibration]) -> None:
    shot, calibration = bench
    assert told(shot, calibration) == ""


def test_errors_of_print_and_noise_are_no_tilt() -> None:
    scene = qf.SceneConfig(surface="face", noise=0.05, patch_mm=20.0)
    with qf.open(qf.SystemConfig(scene=scene)) as bench:
        assert told(bench.grab(), bench.calibration) == ""


@pytest.mark.parametrize("distortion", [(-0.33, 0.1, 0, 0, 0), (-0.2, 0.1, 1e-3, -1e-3, -0.02), (0.3, 0, 0, 0, 0)])
def test_lenses_that_exist_are_not_doubted(distortion: tuple[float, ...], bench: tuple[qf.Shot, Calibration]) -> None:
    wide = Device.model_validate(
        {"width_px": 1280, "height_px": 1024, "focal_px": (700, 702), "centre_px": (650, 500), "distortion": distortion}
    )
    known = bench[1].model_copy(update={"camera": wide})
    assert [one.found for one in examine_calibration(known) if one.name.startswith("calibration")] == []


def test_a_pair_that_is_apart_contradicts_orders_of_a_coaxial_one(bench: tuple[qf.Shot, Calibration]) -> None:
    shot, calibration = bench
    moved = [t + 100.0 for t in calibration.projector.translation_mm]
    wrong = changed(calibration, "infrared", translation_mm=moved)
    assert "puts the infrared projector 173 mm and 0 degrees away from the visible one" in told(shot, wrong)


def test_the_record_settles_the_unit_of_a_small_bench(bench: tuple[qf.Shot, Calibration]) -> None:
    shot, calibration = bench
    small = scaled(0.1)(calibration)
    pose = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 80], [0, 0, 0, 1]]
    step = CalibrationStep(name="poses", good=True, verdict="good", settings={"pose_1": {"T_camera_board": pose}})
    record = CalibrationRecord(made_utc="2026-01-01T00:00:00+00:00", quadfringe_version="0", rig="r", steps=(step,))
    assert told(shot, small.model_copy(update={"record": record})) == ""


@pytest.mark.parametrize(
    "pose", ["cow", [[1]], [[1, 2, 3, "x"]] * 4, [[float("nan")] * 4] * 4, [[10**400] * 4] * 4, None]
)
def test_a_record_of_another_program_may_hold_anything(pose: Any, bench: tuple[qf.Shot, Calibration]) -> None:
    shot, calibration = bench
    step = CalibrationStep(name="poses", good=True, verdict="good", settings={"pose_1": {"T_camera_board": pose}})
    record = CalibrationRecord(made_utc="yesterday", quadfringe_version="0", rig="r", steps=(step,))
    known = calibration.model_copy(update={"record": record})
    assert told(shot, known) == ""
    assert "expected a time" in next(one.found for one in examine_calibration(known) if one.name == "age")


@pytest.mark.parametrize("when", ["2026-01-01", "2026-01-01T00:00:00"])
def test_a_time_without_a_zone_is_utc(when: str, bench: tuple[qf.Shot, Calibration]) -> None:
    record = CalibrationRecord(made_utc=when, quadfringe_version="0", rig="r")
    known = bench[1].model_copy(update={"record": record})
    assert next(one.value for one in examine_calibration(known) if one.name == "age") is not None


def test_the_doctor_writes_json_of_a_calibration_that_is_infinitely_wrong(
    tmp_path: Path, bench: tuple[qf.Shot, Calibration]
) -> None:
    bench[1].model_copy(update={"crosstalk": ((0.0,) * 4,) * 4}).save(tmp_path / "c.json")
    run = CliRunner().invoke(app, ["doctor", str(tmp_path / "c.json"), "--json", str(tmp_path / "d.json")])
    assert (run.exit_code, run.stderr) == (1, "")
    first, *_ = json.loads((tmp_path / "d.json").read_text())["findings"]
    assert (first["name"], first["grade"]) == ("crosstalk", "fault")


@pytest.mark.parametrize("centre", [(255.5, 191.5), (270.0, 180.0), (240.0, 383.0), (255.5, 255.5)])
def test_principal_points_that_exist_are_not_doubted(
    centre: tuple[float, float], bench: tuple[qf.Shot, Calibration]
) -> None:
    known = changed(bench[1], "camera", centre_px=centre)
    assert [one.found for one in examine_calibration(known) if one.name.startswith("calibration")] == []


def test_points_of_wrong_orders_far_behind_the_object_are_told(bench: tuple[qf.Shot, Calibration]) -> None:
    shot, calibration = bench
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", qf.DecodeWarning)
        shape = qf.decode(shot, qf.Plan(912, calibration=calibration, decode={"method": "published"}))
    assert shape.xyz_mm is not None
    assert implausible(shape, []) == []
    shape.xyz_mm[:, :64] *= 4
    (cause,) = implausible(shape, [])
    assert (cause.name, cause.fatal) == ("far points", False)
    assert re.match(r"1[234]% of the points are farther than 3 times the median depth of 800 mm", cause.found)


# Images


def flipped(shot: qf.Shot, *axes: int) -> qf.Shot:
    return qf.Shot(*(np.ascontiguousarray(np.flip(image, axes)) for image in shot.channels.values()))


@pytest.mark.parametrize("method", ["joint", "published"])
@pytest.mark.parametrize("axes", [(1,), (0, 1)])
@pytest.mark.parametrize("surface", ["plane", "steps"])
def test_mirrored_and_turned_images_are_refused(axes: tuple[int, ...], method: str, surface: str) -> None:
    """The published method hides the direction of mirrored columns behind wrong orders, which have no whole turns."""
    small = Device(width_px=512, height_px=384, focal_px=(1290.0, 1290.0), centre_px=(259.0, 180.0))
    with qf.open(qf.SystemConfig(camera=small, scene=qf.SceneConfig(surface=surface, noise=0.01))) as scanner:
        shot, calibration = scanner.grab(), scanner.calibration
    assert isinstance(shot, qf.Shot)
    plan = qf.Plan(912, calibration=calibration, decode={"method": method})
    with pytest.raises(qf.DecodeError, match=r"fringes run backwards in (9\d|100)% of the image"):
        qf.decode(flipped(shot, *axes), plan)


def test_rows_that_are_flipped_cannot_be_seen_on_a_symmetric_bench(bench: tuple[qf.Shot, Calibration]) -> None:
    """They are the image of a scene that is flipped itself: every depth is that of the flipped scene."""
    projector = bench[1].projector
    turn, _ = cv2.Rodrigues(np.array([0.0, 0.32, 0.0]))
    pose = {"rotation": turn.tolist(), "translation_mm": (-252.6, 0.0, -126.1)}
    level = Device.model_validate(projector.model_dump() | pose)
    small = Device(width_px=512, height_px=384, focal_px=(1290.0, 1290.0), centre_px=(255.5, 191.5))
    system = qf.SystemConfig(camera=small, projector=level, scene=qf.SceneConfig(surface="face", noise=0.01))
    with qf.open(system) as scanner:
        shot, calibration = scanner.grab(), scanner.calibration
    assert isinstance(shot, qf.Shot)
    plan = qf.Plan(912, calibration=calibration)
    upright, upside_down = qf.decode(shot, plan), qf.decode(flipped(shot, 0), plan)
    assert (upright.warnings, upside_down.warnings) == ((), ())
    assert upright.depth_mm is not None
    assert upside_down.depth_mm is not None
    apart_mm = np.abs(upright.depth_mm - upside_down.depth_mm[::-1])
    both, sigma_mm = np.isfinite(apart_mm), upright.uncertainty_mm
    assert sigma_mm is not None
    assert np.median(apart_mm[both]) < np.median(sigma_mm[both])
    assert np.quantile(apart_mm[both], 0.95) < np.quantile(sigma_mm[both], 0.95)


def test_fourteen_bits_are_told_by_clipped_pixels(bench: tuple[qf.Shot, Calibration]) -> None:
    light = [image.astype(np.float64) / 255 for image in bench[0].channels.values()]
    clipped = qf.Shot(*(np.minimum(1.3 * 16383 * image, 16383).astype(np.uint16) for image in light))
    dim = qf.Shot(*(np.minimum(16383 * image, 16000).astype(np.uint16) for image in light))
    # A quarter of the light of 16 bits looks the same.
    found = symptoms.bits_in_use(clipped), symptoms.bits_in_use(dim)
    assert found == (symptoms.Bits(14, True, 16383), symptoms.Bits(14, False, 16000))


@pytest.mark.parametrize("version", ["classic", "big"])
def test_a_tiff_of_several_pages_is_refused(version: str, tmp_path: Path) -> None:
    import tifffile

    image = np.arange(300, dtype=np.uint16).reshape(15, 20)
    path = tmp_path / "ir.tif"
    tifffile.imwrite(path, image, bigtiff=version == "big")
    np.testing.assert_array_equal(qf.io.read_image(path), image)
    tifffile.imwrite(path, np.stack([image, image]), bigtiff=version == "big", photometric="minisblack")
    with pytest.raises(qf.InputError, match=r"ir.tif: holds several pages; expected one image"):
        qf.io.read_image(path)


def test_a_big_endian_tiff_of_one_page_is_read(tmp_path: Path) -> None:
    import tifffile

    image = np.arange(300, dtype=np.uint16).reshape(15, 20)
    tifffile.imwrite(tmp_path / "x.tif", image, byteorder=">")
    np.testing.assert_array_equal(qf.io.read_image(tmp_path / "x.tif"), image)
    assert cv2.imwritemulti(str(tmp_path / "two.tif"), [image, image])
    with pytest.raises(qf.InputError, match="several pages"):
        qf.io.read_image(tmp_path / "two.tif")


def test_twelve_bits_without_bits_are_warned_of(tmp_path: Path, bench: tuple[qf.Shot, Calibration]) -> None:
    shot = qf.Shot(*(image.astype(np.uint16) * 16 for image in bench[0].channels.values()))
    write_shot(tmp_path, shot)
    words = ["decode", str(tmp_path), "--fringes", "36", "35", "30", "--projector-width", "912"]
    run = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "x.npz")])
    assert "read them with bits=12" in run.stderr
