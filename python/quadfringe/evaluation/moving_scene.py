"""Measure a moving scene shot by shot: raw recording, a PLY file per shot, and a movie."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from quadfringe.config import SceneConfig, SystemConfig
from quadfringe.config.cameras import AravisConfig, ChipConfig, ReplayConfig, VirtualConfig
from quadfringe.data import AnyShot, BayerShot, Shape, Truth
from quadfringe.decoding.compare import ShapeComparison, compare
from quadfringe.devices.emulator import Emulator
from quadfringe.files import folder_for
from quadfringe.recording import Recorder
from quadfringe.scanner import Scanner, open_system
from quadfringe.view.colours import Picture, channels_picture, texture
from quadfringe.view.movie import movie, solid_picture

__all__ = ["RATE_HZ", "SHOTS", "HandFilm", "MovingScene", "film_hand", "hand_system", "measure_scene"]

RATE_HZ = 10.0  # frame rate of the movie and of the virtual camera
SHOTS = 30  # three seconds: the fingers close and open once
PICTURE_PX = (640, 480)  # width and height of each half of the movie
HAND_MIDDLE_MM = (0.0, 10.0, 760.0)  # centre of the hand, about which the view rotates


@dataclass(frozen=True)
class MovingScene:
    """Files of a measured scene; numbers of shots, shapes and lost frames; errors of shots whose truth is known."""

    recording: Path
    movie: Path
    shots: int
    shapes: int
    lost: int
    depth_rms_mm: tuple[float, ...]
    wrong_order_percent: tuple[float, ...]


def hand_system() -> SystemConfig:
    """Return the virtual bench with the moving hand, skin-coloured, in front of a noisy camera with a Bayer chip."""
    scene = SceneConfig(surface="hand", albedo=(0.92, 0.70, 0.58, 0.85), noise=0.01, seed=1, bayer="rggb")
    return SystemConfig(capture=VirtualConfig(frame_rate_hz=RATE_HZ), scene=scene)


@dataclass(frozen=True)
class HandFilm:
    """The measured hand, and whether its frames came over GigE Vision."""

    made: MovingScene
    over_wire: bool


def film_hand(out: Path, shots: int = SHOTS, system: SystemConfig | None = None) -> HandFilm:
    """Measure the moving hand; write `out`/hand.h5, `out`/hand/shot_000000.ply and so on, and `out`/hand.mp4.

    The virtual bench renders the frames, and two emulated chips send them over GigE Vision on the loopback interface.
    The camera driver receives, matches, records and decodes them like those of a real camera. Without the extra
    `aravis`, they are replayed from a file.
    """
    with TemporaryDirectory(prefix="quadfringe-") as name:
        stage = _render(system or hand_system(), shots, Path(name))
        with ExitStack() as stack:
            scanner = _wired(stage, stack)
            over_wire = scanner is not None
            made = measure_scene(scanner or stack.enter_context(_replayed(stage)), out, "hand", shots, stage.truth_of)
    return HandFilm(made, over_wire)


@dataclass(frozen=True)
class _Stage:
    """Rendered frames, as a file for the emulated chips and as a recording, and the truth of each."""

    config: SystemConfig
    frames: Path
    recording: Path
    calibration: Path
    truths: dict[int, Truth]

    def truth_of(self, shot: AnyShot) -> Truth | None:
        """Return the truth of a shot by its pixels; None when a pixel was changed on the way."""
        return self.truths.get(_pixels(shot))


def _pixels(shot: AnyShot) -> int:
    return hash(tuple(image.tobytes() for image in shot.images.values()))


def _render(config: SystemConfig, shots: int, folder: Path) -> _Stage:
    stage = _Stage(config, folder / "frames.npz", folder / "recording.h5", folder / "calibration.json", {})
    visible, infrared = [], []
    with open_system(config) as scanner:
        scanner.projector.show(config.fringes)
        with Recorder(stage.recording, scanner.config, scanner.calibration) as recorder:
            for shot in scanner.camera.stream(shots, keep="all"):
                assert isinstance(shot, BayerShot), "the hand is seen by a Bayer chip"
                assert shot.ir is not None, "and by an infrared chip"
                assert shot.truth is not None, "the virtual bench knows the truth"
                visible.append(shot.raw)
                infrared.append(shot.ir)
                stage.truths[_pixels(shot)] = shot.truth
                recorder.write(shot)
        assert scanner.calibration is not None, "the virtual bench has a calibration"
        scanner.calibration.save(stage.calibration)
    np.savez(stage.frames, visible=np.stack(visible), infrared=np.stack(infrared))
    return stage


def _wired(stage: _Stage, stack: ExitStack) -> Scanner | None:
    """Open a system with an emulated camera on the loopback interface; None without the extra `aravis`."""
    if find_spec("gi") is None:
        return None
    emulator = stack.enter_context(Emulator(stage.frames))
    visible, infrared = emulator.addresses
    capture = AravisConfig(
        visible=ChipConfig(device=visible, pixel_format="BayerRG8"),
        infrared=ChipConfig(device=infrared, pixel_format="Mono8"),
    )
    config = stage.config.model_copy(update={"capture": capture, "calibration": stage.calibration})
    return stack.enter_context(open_system(config))


def _replayed(stage: _Stage) -> Scanner:
    return open_system(stage.config.model_copy(update={"capture": ReplayConfig(file=stage.recording, speed="full")}))


def measure_scene(
    scanner: Scanner, out: Path, name: str, shots: int, truth_of: Callable[[AnyShot], Truth | None] | None = None
) -> MovingScene:
    """Measure and record `shots` shots with any system; replaces earlier files of this name.

    Shots without a trustworthy shape get no PLY file and no picture.
    """
    folder = folder_for(out / name)
    for earlier in (*folder.glob("shot_*.ply"), out / f"{name}.h5"):
        earlier.unlink(missing_ok=True)
    found: list[ShapeComparison] = []
    shapes = 0
    with (
        Recorder(out / f"{name}.h5", scanner.config, scanner.calibration) as recorder,
        movie(out / f"{name}.mp4", RATE_HZ) as pictures,
        scanner.stream(shots, keep="all", taps={"record": recorder.write}) as stream,
    ):
        for measured in stream:
            shot, shape = measured.shot, measured.shape
            if shape is None:
                continue
            shape.save(folder / f"shot_{shapes:06d}.ply")
            pictures.add(_picture(shot, shape, shapes, shots))
            if truth_of is not None and (truth := truth_of(shot)) is not None:
                found.append(compare(shape, truth, causes=False))
            shapes += 1
        counted = stream.statistics()
    return MovingScene(
        out / f"{name}.h5",
        out / f"{name}.mp4",
        recorder.statistics().written,
        shapes,
        counted.camera.dropped + counted.camera.unpaired + sum(queue.dropped for queue in counted.queues.values()),
        tuple(comparison.overall.rms for comparison in found),
        tuple(comparison.wrong_order_percent for comparison in found),
    )


def _picture(shot: AnyShot, shape: Shape, number: int, shots: int) -> Picture:
    """Combine the camera image and a view of the shape from a viewpoint that swings from side to side."""
    swing = np.sin(2 * np.pi * number / max(shots, 1))
    solid = solid_picture(
        shape, texture(shot, shape), turn_deg=(25.0 * swing, -12.0), middle_mm=HAND_MIDDLE_MM, size_px=PICTURE_PX
    )
    seen = cv2.resize(channels_picture(shot, PICTURE_PX[0]), PICTURE_PX, interpolation=cv2.INTER_AREA)
    return np.hstack([seen.astype(np.uint8), solid])
