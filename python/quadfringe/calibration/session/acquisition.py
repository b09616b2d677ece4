"""Take the captures of a session with the camera and the projectors of a system, into its folder."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration.detect import find_target
from quadfringe.calibration.session.captures import FolderCaptures, light_of, pose_light
from quadfringe.calibration.session.exposures import check_exposures, exposed, shares_of
from quadfringe.calibration.session.planning import check_session
from quadfringe.calibration.session.settings import FILE, STEP_NAMES, Session, step_named
from quadfringe.config import FilesConfig, SystemConfig
from quadfringe.config.cameras import AravisConfig
from quadfringe.data import AnyShot, BayerShot
from quadfringe.data.shot_files import write_shot
from quadfringe.decoding import stages
from quadfringe.devices import Camera
from quadfringe.devices.light import Light
from quadfringe.errors import CalibrationError, ConfigError, InputError
from quadfringe.files import folder_for
from quadfringe.io.images import write_image
from quadfringe.scanner import Scanner, open_system

__all__ = ["Exposes", "Hands", "keep_region", "take_captures"]

# Called with step, name and camera: puts the object of a capture in place, and returns when it is still.
Hands = Callable[[str, str, Camera], None]
# Called with a share of the full exposure: returns when a person has set it in the program of the camera.
Exposes = Callable[[float], None]
TRIES = 3  # attempts at a pose in which the board is not found, or at a shot that is not darker than it must be
SETTLED_S = 0.1  # six frames at 60 Hz: a display shows an image up to a few frames after it was drawn
# Share of the mean of a shot at full exposure that one at half or less may have. Linear light gives at most 0.5, the
# tone curve of a camera, of exponent 2.2, 0.73.
DARKER = 0.85


def take_captures(
    config: SystemConfig,
    folder: Path,
    hands: Hands,
    steps: Iterable[str] = STEP_NAMES,
    say: Callable[[str], None] = lambda _: None,
    expose: Exposes | None = None,
) -> list[Path]:
    """Take the missing captures of these steps for the session in `folder`; returns the folders written.

    `hands(step, name, camera)` puts the object of a capture in front of the camera and returns when it is still: a
    prompt to a person, or the virtual bench. A pose in which the board is not found is reported and repeated. Existing
    captures are kept, so that the call continues an interrupted session; a capture is complete or does not exist.

    A camera of kind files is exposed by a person: `expose(share)` is called before the first shot at another share of
    the full exposure, and with 1 at the end; shots that are not darker then are repeated.

    Everything is checked before anything is shown. Raises `ConfigError` when the system cannot project or expose what
    the session needs, `InputError` when projectors, bit depth or mosaic differ from the session, and `CalibrationError`
    when a board is not found, or a shot is not darker, three times.

    >>> from quadfringe.calibration.session.acquisition import take_captures
    >>> take_captures(load_system(Path("system.toml")), Path("session"), hands)  # doctest: +SKIP
    """
    captures = FolderCaptures(folder)
    wanted = {step: shares_of(captures.session, step, _lacking(captures, step)) for step in steps}
    by_person = isinstance(config.capture, FilesConfig)
    _check(config, captures.session, [share for shares in wanted.values() for share in shares], expose)
    taking = _Taking(captures, hands, say, expose if by_person else None)
    taken = []
    for step, by_share in wanted.items():
        for share, names in by_share.items():
            taking.set_exposure(share)
            with open_system(exposed(config, share)) as scanner:
                keep_region(captures, scanner.config)
                taken += [taking.taken(step, name, scanner) for name in names]
    taking.set_exposure(1.0)
    return taken


def _check(config: SystemConfig, session: Session, shares: list[float], expose: Exposes | None) -> None:
    """Raise the errors of `take_captures` that need no capture."""
    check_session(config, session)
    if isinstance(config.capture, FilesConfig) and expose is None and any(share != 1 for share in shares):
        raise ConfigError(
            "capture: this session changes the exposure, and that of another program cannot be changed; name a camera "
            f"that this program drives, give expose, or set level_exposures = [] in {FILE}"
        )
    check_exposures(config, shares)


def keep_region(captures: FolderCaptures, config: SystemConfig) -> None:
    """Note in the session which region of the chip is sent; raise `InputError` if it has changed since then."""
    offset_px = config.capture.visible.offset_px if isinstance(config.capture, AravisConfig) else None
    if offset_px is None or captures.session.offset_px == offset_px:
        return
    if captures.session.offset_px is not None:
        raise InputError(
            f"camera: its images begin at column and row {list(offset_px)} of the chip, those of the earlier captures "
            f"at {list(captures.session.offset_px)}; set offset_px under [capture.visible] to that, or use a new folder"
        )
    captures.session = captures.session.model_copy(update={"offset_px": offset_px})
    captures.session.save(captures.folder / FILE)


def _lacking(captures: FolderCaptures, step: str) -> list[str]:
    names = captures.session.captures(step_named(step).name)
    return [name for name in names if _lacks(captures, step, name)]


def _lacks(captures: FolderCaptures, step: str, name: str) -> bool:
    return bool(captures.lacking_images(name)) if step == "poses" else name in captures.missing(step)


@dataclass
class _Taking:
    """Takes one capture after another into the folder of a session; `expose` is of a camera that a person exposes."""

    captures: FolderCaptures
    hands: Hands
    say: Callable[[str], None]
    expose: Exposes | None
    share: float = 1.0

    def set_exposure(self, share: float) -> None:
        """Let a person set the exposure, if it is another one."""
        if self.expose is not None and share != self.share:
            self.expose(share)
        self.share = share

    def taken(self, step: str, name: str, scanner: Scanner) -> Path:
        """Take one capture in a temporary folder; move it to its place when it is complete and good."""
        self.say(f"{step}/{name}")
        place = folder_for(self.captures.folder / step) / name
        part = place.with_name(f"{name}.part")
        for left in reversed(range(TRIES)):
            shutil.rmtree(part, ignore_errors=True)
            self.hands(step, name, scanner.camera)
            try:
                if step == "poses":
                    self._pose(part, scanner)
                else:
                    self._shot(step, name, part, scanner)
                break
            except CalibrationError as error:
                if not left:
                    raise CalibrationError(error.reason, f"{_words(step, name)}: {error}") from error
                self.say(f"  {error}; this is repeated")
        shutil.rmtree(place, ignore_errors=True)
        part.replace(place)
        return place

    def _shot(self, step: str, name: str, part: Path, scanner: Scanner) -> None:
        light, share = light_of(self.captures.session, step, name)
        shot = _shown(scanner, light)
        _check_shot(self.captures.session, shot)
        full = f"{name.rpartition('_e')[0]}_e100"
        if isinstance(scanner.config.capture, FilesConfig) and share <= 0.5 and full not in self.captures.missing(step):
            _check_darker(shot, self.captures.shot(step, full), share)
        write_shot(folder_for(part), shot)

    def _pose(self, part: Path, scanner: Scanner) -> None:
        session = self.captures.session
        images = session.pose_images()
        for number, image in enumerate(images, 1):
            if isinstance(scanner.config.capture, FilesConfig):
                self.say(f"  image {number} of {len(images)}")
            light = pose_light(session, image)
            shot = _shown(scanner, light)
            _check_shot(session, shot)
            folder_for((part / image).parent)
            write_image(part / f"{image}.png", _grey(shot, light.beam))
        try:
            find_target(self.captures.pose(part.name)["visible"].background, session.target)
        except CalibrationError as error:
            words = f"the board was not found: {error}; place it again"
            raise CalibrationError(error.reason, words) from error


def _words(step: str, name: str) -> str:
    return f"pose {name}" if step == "poses" else f"{step}/{name}"


def _check_darker(shot: AnyShot, full: AnyShot, share: float) -> None:
    """Raise `CalibrationError` when a shot is as bright as the one at full exposure, because nobody changed it."""
    means = [float(np.mean([np.mean(image) for image in one.images.values()])) for one in (shot, full)]
    if means[0] > DARKER * means[1]:
        raise CalibrationError(
            "not_darker",
            f"the image has {means[0] / max(means[1], 1e-9):.0%} of the brightness of that at full exposure; set the "
            f"exposure of the camera to {share:.0%}",
        )


def _shown(scanner: Scanner, light: Light) -> AnyShot:
    scanner.projector.show(light)
    if not _waits(scanner.config):
        time.sleep(SETTLED_S)
    return scanner.camera.snap()


def _waits(config: SystemConfig) -> bool:
    """Say whether the projector returns only when its light is on the surface."""
    return config.capture.kind == "virtual" if config.projectors is None else config.projectors.lightcrafters is None


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
