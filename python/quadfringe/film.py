"""A scene that moves, measured shot by shot: the raw recording, a PLY of every instant, and a movie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from quadfringe.capture import VirtualConfig
from quadfringe.colours import Picture, channels_picture, texture
from quadfringe.config import SceneConfig, SystemConfig
from quadfringe.data import AnyShot, Shape
from quadfringe.files import folder_for
from quadfringe.movie import movie, solid_picture
from quadfringe.recording import Recorder
from quadfringe.scanner import Scanner, open_system
from quadfringe.streaming import Measured
from quadfringe.truth import compare

__all__ = ["Film", "film", "hand", "hand_system"]

RATE_HZ = 10.0
SHOTS = 40  # four seconds: the hand has come nearer and gone back once
PICTURE_PX = (640, 480)
HAND_MIDDLE_MM = (0.0, 10.0, 760.0)


@dataclass(frozen=True)
class Film:
    """What filming gave: files, and what was lost on the way."""

    recording: Path
    movie: Path
    shots: int
    shapes: int
    lost: int
    depth_rms_mm: tuple[float, ...]
    wrong_order_percent: tuple[float, ...]


def hand_system(rate_hz: float = RATE_HZ) -> SystemConfig:
    """Give the virtual bench with the moving hand before it, lightly coloured, with noise."""
    scene = SceneConfig(surface="hand", albedo=(0.92, 0.70, 0.58, 0.85), noise=0.01, seed=1)
    return SystemConfig(capture=VirtualConfig(frame_rate_hz=rate_hz), scene=scene)


def hand(out: Path, shots: int = SHOTS) -> tuple[dict[str, float], Path]:
    """Film the moving hand of the virtual bench: `out`/hand.h5, `out`/hand/shot_000000.ply ..., `out`/hand.mp4."""
    with open_system(hand_system()) as scanner:
        made = film(scanner, out, "hand", shots, RATE_HZ)
    figures: dict[str, float] = {"hand_shots": made.shots, "hand_shapes": made.shapes, "hand_lost": made.lost}
    if made.depth_rms_mm:
        figures["hand_depth_rms_mm_median"] = float(np.median(made.depth_rms_mm))
        figures["hand_depth_rms_mm_worst"] = max(made.depth_rms_mm)
        figures["hand_wrong_order_percent_worst"] = max(made.wrong_order_percent)
    return figures, made.movie


def film(scanner: Scanner, out: Path, name: str, shots: int, rate_hz: float) -> Film:
    """Measure `shots` with any system while recording them; an earlier film of this name is replaced.

    Shots whose shape cannot be trusted have no PLY and no picture; where the truth is known errors are counted.
    """
    folder = folder_for(out / name)
    for earlier in (*folder.glob("shot_*.ply"), *out.glob(f"{name}*.h5")):
        earlier.unlink()
    errors: list[tuple[float, float]] = []
    shapes = 0
    columns = scanner.calibration.projector.width_px if scanner.calibration else 912
    with (
        Recorder(out / f"{name}.h5", scanner.config, scanner.calibration) as recorder,
        movie(out / f"{name}.mp4", rate_hz) as pictures,
        scanner.stream(shots, keep="all", taps={"record": recorder.write}) as stream,
    ):
        for measured in stream:
            if measured.error is not None:
                continue
            _save(folder, shapes, measured)
            pictures.add(_picture(measured.shot, measured.shape, shapes, shots))
            errors += _errors(measured, columns / scanner.config.fringes.numbers[0])
            shapes += 1
        lost = stream.statistics().camera.dropped + sum(q.dropped for q in stream.statistics().queues.values())
    rms, wrong = zip(*errors, strict=True) if errors else ((), ())
    written = recorder.statistics().written
    return Film(out / f"{name}.h5", out / f"{name}.mp4", written, shapes, lost, rms, wrong)


def _save(folder: Path, number: int, measured: Measured) -> None:
    measured.shape.save(folder / f"shot_{number:06d}.ply")


def _errors(measured: Measured, fringe_period_px: float) -> Sequence[tuple[float, float]]:
    truth = measured.shot.truth
    if truth is None:
        return ()
    found = compare(measured.shape, truth, fringe_period_px)
    return ((found.depth_rms_mm, found.wrong_order_percent),)


def _picture(shot: AnyShot, shape: Shape, number: int, shots: int) -> Picture:
    """Put what the camera saw beside the shape, seen from an eye that goes to and fro."""
    swing = np.sin(2 * np.pi * number / max(shots, 1))
    solid = solid_picture(
        shape, texture(shot, shape), turn_deg=(25.0 * swing, -12.0), middle_mm=HAND_MIDDLE_MM, size_px=PICTURE_PX
    )
    seen = channels_picture(shot, PICTURE_PX[0])
    seen = cv2.resize(seen, PICTURE_PX, interpolation=cv2.INTER_AREA).astype(np.uint8)
    return np.hstack([seen, solid])
