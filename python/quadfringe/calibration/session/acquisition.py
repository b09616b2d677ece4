"""Take the captures of a session with the camera and the projectors of a system, into its folder."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration.detect import find_target
from quadfringe.calibration.session.captures import FolderCaptures, light_of, pose_light
from quadfringe.calibration.session.settings import FILE, STEP_NAMES, Session, step_named
from quadfringe.config import SystemConfig
from quadfringe.config.cameras import AravisConfig, FilesConfig, ReplayConfig, UvcConfig, VirtualConfig
from quadfringe.data import AnyShot, BayerShot
from quadfringe.data.shot_files import write_shot
from quadfringe.decoding import stages
from quadfringe.devices import Camera
from quadfringe.devices.light import Light
from quadfringe.errors import CalibrationError, ConfigError, InputError
from quadfringe.files import folder_for
from quadfringe.io.images import write_image
from quadfringe.scanner import Scanner, open_system

__all__ = ["Hands", "take_captures"]

# Called with step, name and camera: puts the object of a capture in place, and returns when it is still.
Hands = Callable[[str, str, Camera], None]
TRIES = 3  # attempts at a pose in which the board is not found
SETTLED_S = 0.1  # six frames at 60 Hz: a display shows an image up to a few frames after it was drawn


def take_captures(
    config: SystemConfig,
    folder: Path,
    hands: Hands,
    steps: Iterable[str] = STEP_NAMES,
    say: Callable[[str], None] = lambda _: None,
) -> list[Path]:
    """Take the missing captures of these steps for the session in `folder`; returns the folders written.

    `hands(step, name, camera)` puts the object of a capture in front of the camera and returns when it is still: a
    prompt to a person, or the virtual bench. A pose in which the board is not found is reported and repeated. Existing
    captures are kept, so that the call continues an interrupted session; a capture is complete or does not exist.
    Raises `ConfigError` when the system cannot project or expose what the session needs, `InputError` when bit depth or
    mosaic of the camera differ from the session, and `CalibrationError` when a board is not found three times.

    >>> from quadfringe.calibration.session.acquisition import take_captures
    >>> take_captures(load_system(Path("system.toml")), Path("session"), hands)  # doctest: +SKIP
    """
    captures = FolderCaptures(folder)
    taken = []
    for step in steps:
        wanted = [name for name in captures.session.captures(step_named(step).name) if _lacks(captures, step, name)]
        by_exposure: dict[float, list[str]] = {}
        for name in wanted:
            by_exposure.setdefault(light_of(captures.session, step, name).share, []).append(name)
        for exposure, names in by_exposure.items():
            with open_system(exposed(config, exposure)) as scanner:
                for name in names:
                    say(f"{step}/{name}")
                    taken.append(_taken(captures, step, name, scanner, hands, say))
    return taken


def exposed(config: SystemConfig, share: float) -> SystemConfig:
    """Return the system at a share of its exposure; raises `ConfigError` when that cannot be set."""
    capture = config.capture
    if isinstance(capture, ReplayConfig):
        raise ConfigError("capture: a recording cannot be taken again under other light; name a camera")
    changes: dict[str, Any] = {"calibration": None}  # it does not exist yet
    if isinstance(capture, VirtualConfig):
        gain = tuple(share * one for one in config.scene.gain or (1.0,) * 4)
        changes["scene"] = config.scene.model_copy(update={"gain": gain})
        # A frame rate gives each shot new noise.
        changes["capture"] = capture.model_copy(update={"frame_rate_hz": capture.frame_rate_hz or 1.0})
    elif isinstance(capture, FilesConfig):
        if share != 1:
            raise ConfigError(
                "capture: this step changes the exposure, and that of another program cannot be changed; name a camera "
                "that this program drives, or leave the step out"
            )
    elif share != 1:
        changes["capture"] = _shorter(capture, share)
    return config.model_copy(update=changes)


def _shorter(capture: AravisConfig | UvcConfig, share: float) -> AravisConfig | UvcConfig:
    def times(exposure_us: float | None) -> float | None:
        return None if exposure_us is None else share * exposure_us

    names = ("visible", "infrared") if isinstance(capture, AravisConfig) else ()
    chips = {name: getattr(capture, name) for name in names}
    each = [chip.exposure_us for chip in chips.values()] or [None]
    if capture.exposure_us is None and None in each:
        raise ConfigError(
            "capture.exposure_us: missing; set it, because a calibration takes some levels at a fraction of the "
            "exposure"
        )
    chips_changed = {
        name: chip.model_copy(update={"exposure_us": times(chip.exposure_us)}) for name, chip in chips.items()
    }
    return capture.model_copy(update={"exposure_us": times(capture.exposure_us), **chips_changed})


def _lacks(captures: FolderCaptures, step: str, name: str) -> bool:
    return bool(captures.lacking_images(name)) if step == "poses" else name in captures.missing(step)


def _taken(
    captures: FolderCaptures, step: str, name: str, scanner: Scanner, hands: Hands, say: Callable[[str], None]
) -> Path:
    """Take one capture in a temporary folder; move it to its place when it is complete and good."""
    place = folder_for(captures.folder / step) / name
    part = place.with_name(f"{name}.part")
    for left in reversed(range(TRIES)):
        shutil.rmtree(part, ignore_errors=True)
        hands(step, name, scanner.camera)
        if step != "poses":
            shot = _shown(scanner, light_of(captures.session, step, name).light)
            _check_shot(captures.session, shot)
            write_shot(folder_for(part), shot)
            break
        for image in captures.session.pose_images():
            light = pose_light(captures.session, image)
            shot = _shown(scanner, light)
            _check_shot(captures.session, shot)
            grey = _grey(shot, light.beam)
            folder_for((part / image).parent)
            write_image(part / f"{image}.png", grey)
        try:
            find_target(captures.pose(part.name)["visible"].background, captures.session.target)
            break
        except CalibrationError as error:
            if not left:
                raise CalibrationError(error.reason, f"pose {name}: {error}") from error
            say(f"  the board was not found: {error}; place it again for another attempt")
    shutil.rmtree(place, ignore_errors=True)
    part.replace(place)
    return place


def _shown(scanner: Scanner, light: Light) -> AnyShot:
    scanner.projector.show(light)
    if not isinstance(scanner.config.capture, VirtualConfig):
        time.sleep(SETTLED_S)
    return scanner.camera.snap()


def _check_shot(session: Session, shot: AnyShot) -> None:
    """Raise `InputError` for a shot that the settings of the session would misread."""
    pattern = shot.bayer if isinstance(shot, BayerShot) else None
    bits = round(np.log2(shot.full_scale_value + 1))
    meant = session.bits or (16 if shot.first.dtype == np.uint16 else bits)
    if (pattern, bits) != (session.bayer, meant):
        raise InputError(
            f"{FILE}: bits is {session.bits or 'absent'} and bayer {session.bayer or 'absent'}, but the camera "
            "delivers "
            f"{bits} bits and {pattern or 'full colour planes'}; set them to what the camera delivers"
        )


def _grey(shot: AnyShot, beam: str) -> NDArray[Any]:
    """Return the image of a chip in one step; all colours show the same fringes, so green represents them."""
    if beam == "infrared":
        return shot.images["ir"]
    if isinstance(shot, BayerShot):
        green = stages.linear_light(shot)["green"] * shot.full_scale_value
        return np.asarray(np.rint(green).clip(0, shot.full_scale_value), shot.raw.dtype)
    return shot.green
