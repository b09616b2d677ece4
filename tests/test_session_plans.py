"""The session that a system needs, its exposures, and captures of a camera that a person exposes."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from support.screens import FakeWindow, screen, windows
from typer.testing import CliRunner

from quadfringe.calibration.session import FolderCaptures, Session, session_of, take_captures
from quadfringe.calibration.session.exposures import check_exposures, exposed
from quadfringe.calibration.session.outcome import record, worse
from quadfringe.calibration.session.planning import check_session
from quadfringe.calibration.targets import circle_grid
from quadfringe.cli.app import app
from quadfringe.config import (
    AravisConfig,
    ChipConfig,
    FilesConfig,
    Fringes,
    ProjectorsConfig,
    SceneConfig,
    SystemConfig,
    UvcConfig,
)
from quadfringe.devices import Camera
from quadfringe.errors import CalibrationError, ConfigError, InputError
from quadfringe.io.images import write_image

__all__ = ["windows"]

RGB = Fringes(encoding="rgb")
SHORTER = (0.25, 0.5)


def system(capture: object = None, **settings: object) -> SystemConfig:
    values: dict[str, object] = {"projectors": ProjectorsConfig(visible=screen(**settings)), "fringes": RGB}
    return SystemConfig(capture=UvcConfig(exposure_us=66_700) if capture is None else capture, **values)  # type: ignore[arg-type]


def test_a_session_is_planned_for_its_system() -> None:
    planned = session_of(system(UvcConfig(bayer="gbrg")), "bench 1", poses=9)
    assert (planned.projector_size_px, planned.fringes, planned.beams) == ((1280, 720), RGB, ("visible",))
    assert (planned.bayer, planned.bits, planned.poses) == ("gbrg", None, 9)
    deep = AravisConfig(visible=ChipConfig(pixel_format="BayerGR12Packed"))
    assert (session_of(system(deep), "b").bayer, session_of(system(deep), "b").bits) == ("grbg", 12)
    assert session_of(system(FilesConfig(folder=Path(), bits=14)), "b").bits == 14
    virtual = session_of(SystemConfig(scene=SceneConfig(bit_depth=10, bayer="rggb")), "b")
    assert (virtual, virtual.bits) == (Session(rig="b", bits=10, bayer="rggb"), 10)
    assert session_of(SystemConfig(capture=AravisConfig()), "b") == Session(rig="b")


def test_fringes_that_no_projector_shows_are_refused() -> None:
    four = system().model_copy(update={"fringes": Fringes()})
    for refused in (lambda: session_of(four, "b"), lambda: check_session(four, session_of(system(), "b"))):
        with pytest.raises(ConfigError, match=r'no infrared projector; add \[fringes\] with encoding = "rgb"'):
            refused()


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"projector_size_px": (912, 1140)}, "projector_size_px is"),
        ({"fringes": Fringes()}, "encoding is rgb-ir"),
        ({"fringes": Fringes(encoding="rgb", layout="diamond")}, "layout is diamond, and this system has regular"),
    ],
)
def test_a_session_of_other_projectors_is_refused(changes: dict[str, object], name: str) -> None:
    session = session_of(system(), "b")
    check_session(system(), session)
    with pytest.raises(InputError, match=f"{name}.*calibrate plan DIR --system FILE"):
        check_session(system(), session.model_copy(update=changes))


def test_shares_of_an_exposure_are_whole_frames() -> None:
    check_exposures(system(), (1.0, *SHORTER))
    check_exposures(system(UvcConfig(exposure_us=33_333)), (1.0, 0.5))
    check_exposures(SystemConfig(capture=UvcConfig(exposure_us=33_333)), SHORTER)  # the projector is not known
    with pytest.raises(ConfigError, match=r"at 25% it is 0\.50 frames .* set 66666\.7 us \(4 frames\) and lower gain"):
        check_exposures(system(UvcConfig(exposure_us=33_333)), SHORTER)
    # Two frames are matched; a quarter of them must not be rounded to one, which is a half.
    with pytest.raises(ConfigError, match=r"at 25% it is 0\.50 frames"):
        check_exposures(system(UvcConfig(exposure_us=33_000), match_exposure=True), SHORTER)
    with pytest.raises(ConfigError, match=r"not a whole number; set level_exposures = \[\] in session\.json"):
        check_exposures(system(), (0.333,))
    with pytest.raises(ConfigError, match=r"capture\.exposure_us: missing; set it"):
        check_exposures(system(UvcConfig()), SHORTER)


def test_a_share_is_that_of_the_matched_exposure() -> None:
    matched = exposed(system(UvcConfig(exposure_us=66_000), match_exposure=True), 0.25).capture
    assert isinstance(matched, UvcConfig)
    assert matched.exposure_us == 66_666.7 / 4


def test_the_plan_takes_system_and_board(tmp_path: Path) -> None:
    (tmp_path / "board.json").write_text(circle_grid(pitch_mm=12.0).model_dump_json(exclude_none=True))
    (tmp_path / "system.toml").write_text(
        'capture = "uvc:0"\n[projectors.visible]\nkind = "hdmi"\nsize_px = [1280, 720]\n[fringes]\nencoding = "rgb"\n'
    )
    words = ["--system", str(tmp_path / "system.toml"), "--target", str(tmp_path / "board.json")]
    done = CliRunner().invoke(app, ["calibrate", "plan", str(tmp_path / "s"), "--rig", "b", *words])
    assert done.exit_code == 0, done.output
    session = FolderCaptures(tmp_path / "s").session
    assert (session.target, session.projector_size_px) == (circle_grid(pitch_mm=12.0), (1280, 720))


# A camera whose program writes files, and whose exposure a person sets


@pytest.fixture
def photographer(tmp_path: Path, windows: list[FakeWindow]) -> Iterator[Callable[[float], None]]:
    """Write an image of the window into the folder again and again, at the exposure that the person sets."""
    folder, stop, share = tmp_path / "images", threading.Event(), [1.0]
    folder.mkdir()

    def photograph() -> None:
        number = 0
        while not stop.wait(0.02):
            if not windows:
                continue
            number += 1
            seen, exposure, part = windows[-1].image, share[0], folder / f".{number:05d}_rgb.png"
            write_image(part, (0.8 * exposure * seen[:24, :32].astype(float) + 2).astype(np.uint8))
            if windows[-1].image is seen and share[0] == exposure:  # no image of the light before
                part.rename(folder / f"{number:05d}_rgb.png")

    thread = threading.Thread(target=photograph)
    thread.start()
    yield lambda wanted: share.__setitem__(0, wanted)
    stop.set()
    thread.join()


def planned(folder: Path) -> tuple[SystemConfig, Path]:
    """Give a system whose camera writes files, and a session for it."""
    config = system(FilesConfig(folder=folder / "images", settle_s=0.0, infrared=False))
    session = session_of(config, "b").model_copy(update={"level_steps": 4})
    (folder / "session").mkdir()
    session.save(folder / "session" / "session.json")
    return config, folder / "session"


def nothing(_step: str, _name: str, _camera: Camera) -> None:
    """Everything is in place."""


def test_a_person_is_told_which_exposure_to_set(tmp_path: Path, photographer: Callable[[float], None]) -> None:
    config, folder = planned(tmp_path)
    told: list[float] = []

    def person(share: float) -> None:
        told.append(share)
        photographer(share)
        time.sleep(0.1)  # until an image of the exposure before is written

    take_captures(config, folder, nothing, ("levels",), expose=person)
    assert told == [0.25, 0.5, 1.0]
    captures = FolderCaptures(folder)
    means = [captures.shot("levels", f"r100_g100_b100_e{e}").images["red"].mean() for e in ("025", "050", "100")]
    assert means == [53, 104, 206]


def test_an_exposure_that_nobody_changed_is_found(tmp_path: Path, photographer: Callable[[float], None]) -> None:
    config, folder = planned(tmp_path)
    photographer(1.0)
    said: list[str] = []
    with pytest.raises(CalibrationError, match=r"r100_g100_b100_e025: the image has 100% of the brightness") as refused:
        take_captures(config, folder, nothing, ("levels",), said.append, expose=lambda _: None)
    assert refused.value.reason == "not_darker"
    assert sum("set the exposure of the camera to 25%; this is repeated" in words for words in said) == 2
    assert FolderCaptures(folder).missing("levels") == ["r100_g100_b100_e025", "r100_g100_b100_e050"]


def test_without_a_person_it_is_refused_before_anything_is_shown(tmp_path: Path, windows: list[FakeWindow]) -> None:
    (tmp_path / "images").mkdir()
    config, folder = planned(tmp_path)
    with pytest.raises(ConfigError, match=r"that of another program cannot be changed; .*level_exposures = \[\]"):
        take_captures(config, folder, nothing)
    assert windows == []


def test_a_session_without_shorter_exposures_needs_none() -> None:
    session = session_of(system(), "b", level_exposures=())
    assert [name[-4:] for name in session.level_plan.names] == ["e100"] * len(session.level_plan.names)


@pytest.mark.usefixtures("photographer")
def test_the_command_asks_for_the_exposure(tmp_path: Path) -> None:
    config, folder = planned(tmp_path)
    (tmp_path / "system.toml").write_text(
        '[capture]\nkind = "files"\nfolder = "images"\nsettle_s = 0.0\ninfrared = false\n[projectors.visible]\n'
        'kind = "hdmi"\nsize_px = [1280, 720]\nsettle_s = 0.0\n[fringes]\nencoding = "rgb"\n'
    )
    command = ["calibrate", "capture", str(folder), "--system", str(tmp_path / "system.toml"), "--step", "levels"]
    done = CliRunner().invoke(app, command, input="\n" * 9)
    assert "exposure of the camera: set it to 25% of the full one, in the program of the camera" in done.stdout, (
        done.output
    )
    assert done.exit_code == 1  # nobody did
    assert "the image has 100% of the brightness" in done.stderr
    assert config.capture.kind == "files"


def test_a_verdict_says_when_a_correction_made_things_worse() -> None:
    assert worse("crosstalk", before=0.3, after=0.2) == []
    remarks = worse("crosstalk", before=0.2, after=0.3)
    step = record("levels", (), {}, [], "crosstalk 0.20 % before, 0.30 % after", remarks=remarks)
    assert step.good
    assert step.verdict.startswith("crosstalk 0.20 % before, 0.30 % after; crosstalk is worse after the correction")
