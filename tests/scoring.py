"""Captures and renders with known truth, and the figures a decoded map gets against it.

Used by the tests and the benches. Reading and judging need NumPy only, nothing of the product;
`shape_of` at the end hands a scene to it.

A pixel has the right order when |phase - truth| < pi. Comparing floor(phase / 2 pi) instead would
call a phase of -0.01 rad wrong where the truth says +0.01 rad: at an order boundary the integer
jumps, the phase does not.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from quadfringe import Calibration, Plan, Shape, Shot
    from quadfringe.config import Response

Image = NDArray[Any]
Map = NDArray[np.floating[Any]]
Mask = NDArray[np.bool_]

ROOT = Path(__file__).resolve().parents[1]
CAPTURES = ("plate", "bottle")
RENDERS = ("plane", "peaks")
STEPS = 12


@dataclass(frozen=True)
class Scene:
    """One shot (four (H, W) images of one dtype), its fringes, and what is known to be true."""

    name: str
    red: Image
    green: Image
    blue: Image
    ir: Image
    fringe_numbers: tuple[float, float, float]
    projector_width: int
    phase_rad: Map  # truth, absolute, first fringe number
    scored: Mask  # pixels that count
    depth_mm: Map | None = None
    shadow: Mask | None = None

    @property
    def channels(self) -> dict[str, Image]:
        return {"red": self.red, "green": self.green, "blue": self.blue, "ir": self.ir}


def data_folder() -> Path:
    """Where the captures and renders lie: QUADFRINGE_DATA, else shared/data beside the checkout."""
    beside = ROOT.parent / "shared" / "data"
    return Path(os.environ.get("QUADFRINGE_DATA", beside))


def capture(data: Path, name: str) -> Scene:
    """Read a real single shot; its object pixels are scored."""
    with np.load(data / name / "single_shot.npz") as stored:
        a, b, c = (float(n) for n in stored["fringe_numbers"])
        return Scene(
            name=name,
            red=stored["R"],
            green=stored["G"],
            blue=stored["B"],
            ir=stored["IR"],
            fringe_numbers=(a, b, c),
            projector_width=int(stored["projector_width"]),
            phase_rad=stored["phase_abs"],
            scored=stored["object_mask"] & stored["mask"],
        )


def step_files(data: Path, name: str, frequency: int = 0) -> list[Path]:
    """List the 12 images of one frequency of a capture's N-step stack, in step order."""
    files = sorted((data / name / "raw").glob("*h.bmp"))
    return files[STEPS * frequency : STEPS * (frequency + 1)]


def noisy_8bit(image: Image, sigma: float, seed: int) -> NDArray[np.uint8]:
    """Add Gaussian noise (sigma as a fraction of full scale), clip, round to 8 bit."""
    rng = np.random.default_rng(seed)
    light = image / np.iinfo(image.dtype).max + sigma * rng.standard_normal(image.shape)
    return np.round(np.clip(light, 0, 1) * 255).astype(np.uint8)


def render(data: Path, name: str, sigma: float | None = None, seed: int = 0) -> Scene:
    """Read an independent render: 16 bit as it is, or 8 bit with noise when `sigma` is given."""
    with np.load(data / "renders" / f"{name}.npz") as stored:
        images = [stored[key] for key in ("R", "G", "B", "IR")]
        if sigma is not None:
            images = [noisy_8bit(image, sigma, seed + i) for i, image in enumerate(images)]
        red, green, blue, ir = images
        column_px = stored["u_proj"].astype(np.float64)
        return Scene(
            name=name,
            red=red,
            green=green,
            blue=blue,
            ir=ir,
            fringe_numbers=(36.0, 35.0, 30.0),
            projector_width=912,
            phase_rad=2 * np.pi * 36 * column_px / 912,
            scored=stored["valid"] & ~stored["edge"],
            depth_mm=stored["depth_mm"],
            shadow=stored["shadow"],
        )


def rig(data: Path) -> dict[str, Any]:
    """Camera and projector of the renders: K, R, T and size, OpenCV's convention, mm."""
    stored: dict[str, Any] = json.loads((data / "renders" / "rig.json").read_text())
    return {name: stored[name] for name in ("camera", "projector")}


def inside(mask: Mask, margin_px: int) -> Mask:
    """Pixels whose whole square neighbourhood of `margin_px` lies in the mask and in the image."""
    for axis in (0, 1):
        padded = np.pad(mask, [(margin_px, margin_px) if a == axis else (0, 0) for a in (0, 1)])
        total = np.cumsum(np.insert(padded.astype(np.int32), 0, 0, axis=axis), axis=axis)
        size, length = 2 * margin_px + 1, mask.shape[axis]
        upper = np.take(total, np.arange(size, size + length), axis=axis)
        mask = upper - np.take(total, np.arange(length), axis=axis) == size
    return mask


def fringe_px(scene: Scene) -> int:
    """Widest fringe of the scene along rows (camera pixels), from the truth, rounded up."""
    slope = np.abs(np.diff(scene.phase_rad, axis=1))[:, ::8]
    return int(np.ceil(2 * np.pi / np.quantile(slope, 0.05)))


def rms(values: Map) -> float:
    """Root of the mean square; 0 of nothing is NaN."""
    return float(np.sqrt(np.mean(np.square(values, dtype=np.float64)))) if values.size else np.nan


@dataclass(frozen=True)
class Score:
    """Figures of one map against the truth, over the scored pixels unless a name says otherwise."""

    right_percent: float  # right order; a missing pixel counts as wrong
    right_of_returned_percent: float
    returned_percent: float
    wrong_pixels: int  # returned with a wrong order
    phase_rms_rad: float  # wrapped difference of all returned pixels
    right_phase_rms_rad: float  # plain difference of the pixels with the right order
    depth_rms_mm: float | None = None  # of the pixels with the right order
    depth_rms_all_mm: float | None = None  # of all returned pixels: one wrong order is some 30 mm
    in_shadow_pixels: int | None = None  # returned where no light falls

    def as_figures(self) -> dict[str, float]:
        """Numbers by name with unit; what does not apply is left out."""
        return {name: value for name, value in vars(self).items() if value is not None}


def score(scene: Scene, phase_rad: Map, xyz_mm: Map | None = None, mask: Mask | None = None) -> Score:
    """Judge an absolute phase map, and the depth of its points where both are known."""
    scored = scene.scored if mask is None else mask
    error = phase_rad.astype(np.float64) - scene.phase_rad
    returned = np.isfinite(phase_rad) & scored
    right = returned & (np.abs(error) < np.pi)
    pixels, count, good = (int(np.count_nonzero(m)) for m in (scored, returned, right))
    figures: dict[str, Any] = {}
    if xyz_mm is not None and scene.depth_mm is not None:
        depth_error = xyz_mm[:, :, 2] - scene.depth_mm
        figures["depth_rms_mm"] = rms(depth_error[right])
        figures["depth_rms_all_mm"] = rms(depth_error[returned])
    if scene.shadow is not None:
        in_shadow = np.isfinite(phase_rad) & scene.shadow
        figures["in_shadow_pixels"] = int(np.count_nonzero(in_shadow))
    return Score(
        right_percent=100 * good / pixels,
        right_of_returned_percent=100 * good / max(1, count),
        returned_percent=100 * count / pixels,
        wrong_pixels=count - good,
        phase_rms_rad=rms(np.angle(np.exp(1j * error[returned]))),
        right_phase_rms_rad=rms(error[right]),
        **figures,
    )


def calibration_of(devices: dict[str, Any]) -> Calibration:
    """Make the product's calibration from what `rig` read."""
    from quadfringe import Calibration, DeviceModel

    def model(device: dict[str, Any]) -> DeviceModel:
        k = device["K"]
        return DeviceModel(
            width_px=device["width"],
            height_px=device["height"],
            focal_px=(k[0][0], k[1][1]),
            centre_px=(k[0][2], k[1][2]),
            distortion=device["dist"],
            rotation=device["R"],
            translation_mm=device["T"],
        )

    return Calibration(camera=model(devices["camera"]), projector=model(devices["projector"]))


def plan_of(
    scene: Scene,
    *,
    calibration: Calibration | None = None,
    response: Response | None = None,
    **settings: Any,
) -> tuple[Shot, Plan]:
    """Give the product's shot and plan for a scene; `settings` are those of `DecodeConfig`."""
    from quadfringe import DecodeConfig, Fringes, Plan, Shot

    plan = Plan(
        projector_width_px=scene.projector_width,
        fringes=Fringes(numbers=scene.fringe_numbers),
        calibration=calibration,
        response=response,
        settings=DecodeConfig(**settings),
    )
    return Shot(scene.red, scene.green, scene.blue, scene.ir), plan


def shape_of(scene: Scene, **how: Any) -> Shape:
    """Decode a scene with the product; `how` as in `plan_of`."""
    from quadfringe import decode

    return decode(*plan_of(scene, **how))
