"""The guided calibration on the virtual bench and from a folder, and its messages when captures are missing."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from support.bars import hold, tolerance
from support.lit_scene import CAMERA
from typer.testing import CliRunner, Result

from quadfringe.calibration.session import FolderCaptures, Guided, Session, guide, take_captures
from quadfringe.calibration.session.exposures import exposed
from quadfringe.calibration.session.pictures import write_pictures
from quadfringe.calibration.session.virtual import VirtualCaptures
from quadfringe.cli import app
from quadfringe.config import SceneConfig, SystemConfig
from quadfringe.config.cameras import AravisConfig, ReplayConfig
from quadfringe.data import Calibration
from quadfringe.devices import Camera, ExternalLight
from quadfringe.devices.light import Levels, Step, light_images
from quadfringe.devices.virtual import VirtualCamera
from quadfringe.doctor import examine_calibration
from quadfringe.errors import CalibrationError, ConfigError, InputError
from quadfringe.io.images import write_image

MIXED = tuple(tuple(1.0 if i == j else 0.05 for j in range(4)) for i in range(4))
CHIPS = ((1.001, 0.002, 1.2), (-0.002, 1.001, -0.8))
CONFIG = SystemConfig(
    camera=CAMERA,
    scene=SceneConfig.model_validate(
        {
            "noise": 0.002,  # with a quarter of the pixels, 1 % fails the acceptance
            "bit_depth": 12,
            "gain": 0.75,
            "blur_px": 0.5,
            "crosstalk": MIXED,
            "projector_exponent": 1.2,
            "ambient": 0.01,
            "infrared_from_visible": CHIPS,
        }
    ),
)
SESSION = Session(
    rig="virtual bench", poses=6, phase_steps=4, level_steps=4, heights_mm=(-40.0, -20.0, 0.0, 20.0, 40.0)
)


@pytest.fixture(scope="module")
def told() -> list[str]:
    return []


@pytest.fixture(scope="module")
def guided(told: list[str]) -> Guided:
    return guide(VirtualCaptures(CONFIG, SESSION), told.append)


def test_every_step_is_good(guided: Guided, told: list[str]) -> None:
    assert {one.step.name: one.step.verdict for one in guided.outcomes if not one.step.good} == {}
    names = ["dark", "levels", "flat", "registration", "poses", "planes", "acceptance"]
    assert [one.step.name for one in guided.outcomes] == names
    assert guided.good
    assert not guided.missing
    assert sum("good:" in words for words in told) == len(names)


def test_the_bench_is_found_again(guided: Guided) -> None:
    found = guided.calibration
    assert found is not None
    assert found.camera.focal_px == pytest.approx(CAMERA.focal_px, rel=tolerance("calibration.session_focal_relative"))
    assert found.camera.centre_px == pytest.approx(CAMERA.centre_px, abs=tolerance("calibration.centre_error_px"))
    assert np.array(found.ir_registration) == pytest.approx(
        np.array(CHIPS), abs=tolerance("calibration.session_registration")
    )
    assert np.array(found.crosstalk) == pytest.approx(
        np.array(MIXED), abs=tolerance("calibration.session_crosstalk_error")
    )
    figures = {one.step.name: one.step.figures for one in guided.outcomes}
    hold("calibration.camera_mean_px", figures["poses"]["camera_mean_px"])
    hold("calibration.visible_mean_px", figures["poses"]["projector_mean_px"])
    hold("calibration.level_rms_after_percent", figures["levels"]["level_rms_after_percent"])
    hold("heights.session_agreement_rms_mm", figures["planes"]["agreement_rms_mm"])


def test_the_file_keeps_inputs_and_residuals(guided: Guided, tmp_path: Path) -> None:
    assert guided.calibration is not None
    guided.calibration.save(tmp_path / "c.json")
    again = Calibration.load(tmp_path / "c.json")
    assert again == guided.calibration
    assert again.record is not None
    assert again.record.good
    poses = next(step for step in again.record.steps if step.name == "poses")
    assert poses.inputs == SESSION.captures("poses")
    assert np.array(poses.settings["pose_1"]["camera_px"]).shape == (108, 2)
    assert [one for one in examine_calibration(again) if one.grade == "fault"] == []


def test_the_pictures_are_drawn(guided: Guided, tmp_path: Path) -> None:
    written = write_pictures(tmp_path / "pictures", guided)
    names = {"levels.png", "flat.png", "registration.png", "poses.png", "planes.png", "acceptance.png"}
    assert {path.name for path in written} == names
    assert all(path.stat().st_size > 10_000 for path in written)


def test_the_covered_share_is_that_of_the_outlines(guided: Guided) -> None:
    poses = guided.outcome("poses")
    assert poses is not None
    seen = poses.details["seen"]
    assert poses.step.figures["covered_percent"] == pytest.approx(100 * seen.mean(), rel=1e-5)
    points = np.round(np.concatenate([pose.view.points_px for pose in poses.details["observed"]])).astype(int)
    assert seen[points[:, 1], points[:, 0]].all()
    (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0) + 1
    assert seen.sum() == seen[y0:y1, x0:x1].sum() < seen.size  # the borders, where no point was, do not count


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Dark shots and levels of the bench as files, and no more."""
    place = tmp_path_factory.mktemp("session") / "captures"
    VirtualCaptures(CONFIG, SESSION).write(place, ("dark", "levels"))
    return place


def run(*words: object) -> Result:
    return CliRunner().invoke(app, ["calibrate", *map(str, words)])


def test_a_folder_gives_what_the_bench_gave(folder: Path, guided: Guided) -> None:
    found = guide(FolderCaptures(folder))
    for name in ("dark", "levels"):
        first, second = found.outcome(name), guided.outcome(name)
        assert first is not None
        assert second is not None
        assert first.step == second.step
    assert found.calibration is None
    assert found.missing["poses"] == SESSION.captures("poses")


def test_pose_images_of_a_folder_give_what_the_bench_gave(tmp_path: Path) -> None:
    session = SESSION.model_copy(update={"poses": 4, "phase_steps": 4})
    captures = VirtualCaptures(CONFIG, session)
    captures.session.save(tmp_path / "session.json")
    (tmp_path / "poses" / "01").mkdir(parents=True)
    captures._write_pose(tmp_path / "poses" / "01", "01")
    maps = FolderCaptures(tmp_path).pose("01")
    expected = VirtualCaptures(CONFIG, session).pose("01")
    for beam in ("visible", "infrared"):
        np.testing.assert_allclose(maps[beam].column_px, expected[beam].column_px, atol=1e-4)
    missing = FolderCaptures(tmp_path).missing("poses")
    assert missing == ["02", "03", "04"]


def test_what_is_missing_is_said_and_nothing_written(folder: Path, tmp_path: Path) -> None:
    done = run("run", "--captures", folder, "--out", tmp_path / "c.json")
    assert done.exit_code == 1
    assert "missing (needed): 01, 02, 03, 04, 05, 06" in done.stdout
    assert "Tilt it to all four sides" in done.stdout
    assert list(tmp_path.iterdir()) == []
    listed = run("check", folder)
    assert listed.exit_code == 1
    assert "levels: 23 of 23" in listed.stdout.replace("  ", " ")
    assert str(folder / "poses" / "01") in listed.stdout


def test_steps_have_their_pictures_also_when_a_later_one_fails(folder: Path, tmp_path: Path) -> None:
    broken = shutil.copytree(folder, tmp_path / "broken")
    for name in SESSION.captures("flat"):
        shutil.copytree(folder / "dark" / "01", broken / "flat" / name)
    write_image(broken / "flat" / "02" / "red.png", np.zeros((10, 12), np.uint16))
    failed = run("run", "--captures", broken, "--out", tmp_path / "c.json", "--pictures", tmp_path / "p")
    assert (failed.exit_code, "got red 12 x 10" in failed.stderr) == (2, True), failed.output
    assert [path.name for path in (tmp_path / "p").iterdir()] == ["levels.png"]


def test_folders_at_fault_are_explained(folder: Path, tmp_path: Path) -> None:
    out = ("--out", tmp_path / "c.json")
    assert "no session.json; create it" in run("run", "--captures", tmp_path, *out).stderr
    other = run("run", "--captures", folder, "--rig", "bench 2", *out)
    assert (other.exit_code, "captures of 'virtual bench', not of 'bench 2'" in other.stderr) == (2, True)
    mixed = tmp_path / "mixed"
    shutil.copytree(folder, mixed)
    for name in ("red", "green", "blue", "ir"):
        write_image(mixed / "dark" / "02" / f"{name}.png", np.zeros((10, 12), np.uint16))
    refused = run("run", "--captures", mixed, *out)
    assert (refused.exit_code, "12 x 10 pixels, the captures before it have 512 x 384" in refused.stderr) == (2, True)
    (mixed / "levels" / "r000_g000_b000_ir000_e100" / "ir.png").unlink()
    shutil.rmtree(mixed / "dark")
    lacking = run("run", "--captures", mixed, *out)
    assert (lacking.exit_code, "no image for ir" in lacking.stderr) == (2, True)
    assert not (tmp_path / "c.json").exists()


def test_a_plan_is_written_once(tmp_path: Path) -> None:
    planned = run("plan", tmp_path / "s", "--rig", "bench 1", "--poses", 9)
    assert planned.exit_code == 0
    assert "Cover the lens" in planned.stdout
    assert json.loads((tmp_path / "s" / "session.json").read_text())["rig"] == "bench 1"
    assert run("plan", tmp_path / "s", "--rig", "bench 1").exit_code == 2
    with pytest.raises(InputError, match="expected one of dark, levels"):
        Session(rig="r").captures("light")


# Captures by camera and projectors


def planned(folder: Path, **changes: object) -> tuple[Path, VirtualCaptures]:
    captures = VirtualCaptures(CONFIG, SESSION.model_copy(update=changes))
    folder.mkdir()
    captures.session.save(folder / "session.json")
    return folder, captures


def test_camera_and_projectors_fill_a_session(tmp_path: Path, guided: Guided) -> None:
    folder, bench = planned(tmp_path / "s")
    taken = take_captures(CONFIG, folder, bench.hands, ("dark", "levels"))
    assert len(taken) == SESSION.dark_shots + len(SESSION.level_plan.names)
    assert take_captures(CONFIG, folder, bench.hands, ("dark", "levels")) == []
    found, known = guide(FolderCaptures(folder)).outcome("levels"), guided.outcome("levels")
    assert found is not None
    assert known is not None
    assert found.step.good, found.step.verdict
    assert np.array(found.fields["crosstalk"]) == pytest.approx(
        np.array(known.fields["crosstalk"]), abs=tolerance("calibration.crosstalk_error")
    )


def test_a_pose_is_taken_until_the_board_is_seen_and_the_rest_later(tmp_path: Path) -> None:
    folder, bench = planned(tmp_path / "s", poses=4)
    said: list[str] = []
    asked: list[str] = []

    def person(step: str, name: str, camera: Camera) -> None:
        asked.append(name)
        if name == "02":
            raise KeyboardInterrupt
        bench.hands(step, name, camera)
        if len(asked) == 1:  # the board was forgotten
            assert isinstance(camera, VirtualCamera)
            camera.bench.place_plane((0.0, 0.0, 800.0), (0.0, 0.0, -1.0))

    with pytest.raises(KeyboardInterrupt):
        take_captures(CONFIG, folder, person, ("poses",), said.append)
    assert asked == ["01", "01", "02"]
    assert "the board was not found" in said[1]
    seen = FolderCaptures(folder)
    assert seen.missing("poses") == ["02", "03", "04"]
    for beam, expected in bench.pose("01").items():
        off = np.abs(seen.pose("01")[beam].column_px - expected.column_px)
        hold("calibration.session_columns_px", np.nanmedian(off))


def test_a_board_that_is_never_seen_is_an_error(tmp_path: Path) -> None:
    folder, bench = planned(tmp_path / "s", poses=4, phase_steps=4)
    asked: list[str] = []

    def nobody(_: str, name: str, camera: Camera) -> None:
        asked.append(name)
        bench.hands("dark", "01", camera)

    with pytest.raises(CalibrationError, match="pose 01: the board was not found: the image is dark"):
        take_captures(CONFIG, folder, nobody, ("poses",))
    assert asked == ["01"] * 3
    assert FolderCaptures(folder).missing("poses") == ["01", "02", "03", "04"]


def test_what_a_system_cannot_show_or_expose_is_said() -> None:
    camera = SystemConfig(capture=AravisConfig(exposure_us=8000))
    shorter = exposed(camera, 0.25).capture
    assert isinstance(shorter, AravisConfig)
    assert shorter.exposure_us == 2000
    assert exposed(SystemConfig(capture=AravisConfig()), 1.0).capture == AravisConfig()
    with pytest.raises(ConfigError, match=r"capture\.exposure_us: missing; set it"):
        exposed(SystemConfig(capture=AravisConfig()), 0.25)
    with pytest.raises(ConfigError, match="a recording cannot be taken again under other light"):
        exposed(SystemConfig(capture=ReplayConfig(file=Path("take.h5"))), 1.0)
    with pytest.raises(ConfigError, match="name both under"):
        ExternalLight().show(Levels((0.0,) * 4))
    with pytest.raises(ValueError, match="from 0 to 1"):
        light_images(Levels((2.0, 0.0, 0.0, 0.0)), (912, 1140))
    visible, infrared = light_images(Step(36, 0.0, "rows", "infrared"), (912, 1140))
    assert (int(visible.max()), int(infrared[0, 0]), np.ptp(infrared, axis=1).max()) == (0, 255, 0)


def test_capture_from_the_command_line(tmp_path: Path) -> None:
    assert run("plan", tmp_path / "s", "--rig", "bench 1", "--poses", 4).exit_code == 0
    system = tmp_path / "system.toml"
    system.write_text(
        "schema_version = 1\n[camera]\nwidth_px = 96\nheight_px = 72\nfocal_px = [240, 240]\ncentre_px = [47.5, 35.5]\n"
    )
    taken = run("capture", tmp_path / "s", "--system", system, "--step", "dark")
    assert (taken.exit_code, "captures taken" in taken.stdout) == (0, True), taken.output
    assert "dark: 4 of 4" in run("check", tmp_path / "s").stdout.replace("  ", " ")
    assert run("capture", tmp_path / "s", "--system", system, "--step", "nothing").exit_code == 2
    system.write_text('schema_version = 1\ncapture = "aravis:none"\n')
    refused = run("run", "--system", system, "--out", tmp_path / "c.json")
    assert (refused.exit_code, "quadfringe calibrate capture" in refused.stderr) == (2, True)
