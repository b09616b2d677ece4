"""Shots of the virtual bench with one planted fault each, and sound shots: the cases that a diagnosis is judged by."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config import Device
from quadfringe.data import Calibration, Shot, core_device
from quadfringe.evaluation import world
from quadfringe.evaluation._isolated import outline

__all__ = [
    "CAUSES",
    "GOOD",
    "Case",
    "Change",
    "Fault",
    "broken",
    "calibrated",
    "cut_out",
    "exchanged",
    "exposed",
    "shifted",
    "sound",
    "stray",
]

NOISE = 0.02  # standard deviation, share of full scale
# Sound scenes and their seeds. Reliefs take long to cast, so that they have fewer seeds and a camera of half the size.
GOOD = {
    **dict.fromkeys(("plane", "steps", "sphere", "face", "face_patches_20", "painted_face"), (1, 2, 3, 4)),
    **dict.fromkeys(("clutter", "rods"), (1, 2, 4)),
}
RELIEFS = ("clutter", "rods")
HALF = Device(width_px=512, height_px=384, focal_px=(1290.325, 1290.325), centre_px=(255.5, 191.5))
SCENES = ("face", "steps", "painted_face")  # of the three strengths of a cause
CHANNELS = ("red", "green", "blue", "ir")

# How a finding that names the cause begins.
NAMES = {
    "exchanged channels": "fringe orders",
    "fringe numbers": "fringe numbers",
    "response": "response",
    "crosstalk": "crosstalk",
    "infrared registration": "infrared registration",
    "blur": "blur",
    "too dark": "brightness",
    "saturated": "saturation",
    "mirrored or rotated": "mirrored or rotated",
    "bits": "bits",
}

Images = dict[str, NDArray[Any]]
Change = Callable[[Images], Images]


@dataclass(frozen=True)
class Case:
    """A shot with the cause of its fault, empty for none, the strength in words, and the name of its scene."""

    cause: str
    strength: str
    scene: str
    shot: Shot

    def names(self, name: str, words: str) -> bool:
        """Tell whether a finding with this name and these words names the cause."""
        return name.startswith(NAMES[self.cause]) and (self.cause != "exchanged channels" or "swapped" in words)


@dataclass(frozen=True)
class Fault:
    """How a fault is planted: other options of the exposure, other fringe numbers, or a change of the images."""

    strength: str
    options: dict[str, Any] | None = None
    numbers: tuple[float, ...] | None = None
    change: Change | None = None


def exchanged(first: str, second: str) -> Change:
    """Give the change that exchanges two channels."""
    return lambda i: {**i, first: i[second], second: i[first]}


def shifted(columns: float, rows: float) -> Change:
    """Give the change that moves infrared, in px; its border is repeated."""

    def change(images: Images) -> Images:
        moved = np.array([[1, 0, columns], [0, 1, rows]], np.float64)
        ir = images["ir"]
        size = ir.shape[1], ir.shape[0]
        return {**images, "ir": cv2.warpAffine(ir, moved, size, borderMode=cv2.BORDER_REPLICATE)}

    return change


def _all(function: Callable[[NDArray[Any]], NDArray[Any]]) -> Change:
    return lambda images: {name: np.ascontiguousarray(function(image)) for name, image in images.items()}


def stray(pairs: dict[tuple[int, int], float]) -> dict[str, Any]:
    """Give a crosstalk matrix with these entries, (captured, projected), and a gain that clips no crest."""
    matrix = np.eye(4)
    for place, share in pairs.items():
        matrix[place] = share
    return {"crosstalk": matrix.tolist(), "gain": (float(1 / matrix.sum(axis=1).max()),) * 4}


CAUSES: dict[str, tuple[Fault, Fault, Fault]] = {
    "exchanged channels": (
        Fault("red, blue", change=exchanged("red", "blue")),
        Fault("green, ir", change=exchanged("green", "ir")),
        Fault("red, green", change=exchanged("red", "green")),
    ),
    "fringe numbers": (
        Fault("49 48 42", numbers=(49.0, 48.0, 42.0)),
        Fault("64 63 56", numbers=(64.0, 63.0, 56.0)),
        Fault("25 24 20", numbers=(25.0, 24.0, 20.0)),
    ),
    "response": tuple(Fault(f"{g:g}", {"projector_exponent": (g,) * 4}) for g in (1.4, 1.8, 2.4)),  # type: ignore[dict-item]
    "crosstalk": (
        Fault("0.1 green in red", stray({(0, 1): 0.1})),
        Fault("0.2 ir in green", stray({(1, 3): 0.2})),
        Fault("0.3 all visible", stray({(0, 1): 0.3, (1, 0): 0.3, (1, 2): 0.3, (2, 1): 0.3})),
    ),
    "infrared registration": (
        Fault("3, 0 px", change=shifted(3, 0)),
        Fault("-7, 4 px", change=shifted(-7, 4)),
        Fault("12, 6 px", change=shifted(12, 6)),
    ),
    "blur": tuple(Fault(f"{s:g} px", {"blur_px": s}) for s in (4.0, 6.0, 9.0)),  # type: ignore[dict-item]
    "too dark": tuple(Fault(f"gain {g:g}", {"gain": (g,) * 4}) for g in (0.2, 0.1, 0.03)),  # type: ignore[dict-item]
    "saturated": tuple(Fault(f"gain {g:g}", {"gain": (g,) * 4}) for g in (1.4, 2.0, 4.0)),  # type: ignore[dict-item]
    "mirrored or rotated": (
        Fault("left and right", change=_all(lambda image: image[:, ::-1])),
        Fault("180 degrees", change=_all(lambda image: image[::-1, ::-1])),
        Fault("up and down", change=_all(lambda image: image[::-1])),
    ),
    "bits": (
        Fault("12 as 16", {"bit_depth": 12}),
        Fault("12 as 16, dim", {"bit_depth": 12, "gain": (0.5,) * 4}),
        Fault("10 as 16", {"bit_depth": 10}),
    ),
}


def broken(causes: tuple[str, ...] = tuple(CAUSES), seed: int = 2) -> Iterator[Case]:
    """Give the shots with one fault each: three strengths of every cause, each on another scene."""
    for cause in causes:
        number = list(CAUSES).index(cause)
        for strength, fault in enumerate(CAUSES[cause]):
            scene = SCENES[(strength + number) % len(SCENES)]
            yield Case(cause, fault.strength, scene, exposed(scene, seed, fault))


def sound(scenes: Mapping[str, tuple[int, ...]] = MappingProxyType(GOOD)) -> Iterator[Case]:
    """Give shots without a fault: scenes with their seeds."""
    for scene, seeds in scenes.items():
        for seed in seeds:
            yield Case("", f"seed {seed}", scene, exposed(scene, seed, Fault("")))


def calibrated(case: Case, calibration: Calibration) -> Calibration:
    """Give the calibration of the bench for the size of the images of a case."""
    half = case.shot.first.shape == (HALF.height_px, HALF.width_px)
    return calibration.model_copy(update={"camera": HALF}) if half else calibration


def cut_out(shot: Shot, fill: float, seed: int) -> Shot:
    """Leave an object that fills a share of the frame, on black with the noise of its sensor."""
    inside, noise = outline(shot.first.shape, fill, seed), np.random.default_rng(seed)
    black = np.clip(np.round(noise.normal(1, 2, (4, *inside.shape))), 0, 255)
    images = zip(shot.channels.values(), black, strict=True)
    red, green, blue, ir = (np.where(inside, image, dark).astype(np.uint8) for image, dark in images)
    return Shot(red, green, blue, ir)


def exposed(scene: str, seed: int, fault: Fault, *, half: bool | None = None) -> Shot:
    """Expose a scene with a fault, reliefs at half the size unless it is stated."""
    small = scene in RELIEFS if half is None else half
    bench = _core.Bench(camera=core_device(HALF)) if small else _core.Bench()
    drawn = world.SCENES[scene](bench, np.random.default_rng([seed, 77]))
    options = (drawn.options or {}) | (fault.options or {})
    drawn = replace(drawn, options=options, fringe_numbers=fault.numbers or drawn.fringe_numbers)
    shot = world.expose(bench, drawn, seed, NOISE).shot
    if fault.change is None:
        return shot
    images = fault.change(shot.channels)
    return Shot(images["red"], images["green"], images["blue"], images.get("ir"))
