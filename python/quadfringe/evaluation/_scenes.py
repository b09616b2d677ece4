"""Stored captures and renders with known truth, shots of the virtual bench as scenes, and decoders for both."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.evaluation.scoring import Image, Scene

if TYPE_CHECKING:
    from quadfringe import Calibration, Plan, Shape, Shot, SystemConfig
    from quadfringe.config import ResponseChoice
    from quadfringe.data import ResponseCalibration

ROOT = Path(__file__).resolve().parents[3]  # the checkout
CAPTURES = ("plate", "bottle")
RENDERS = ("plane", "peaks")
STEPS = 12


def data_folder() -> Path:
    """Give the folder of captures and renders: QUADFRINGE_DATA, or shared/data next to the checkout."""
    default = ROOT.parent / "shared" / "data"
    return Path(os.environ.get("QUADFRINGE_DATA", default))


def capture(data: Path, name: str) -> Scene:
    """Read a real single shot; its object pixels are scored, and those of the strict mask of the data are sure."""
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
            sure=stored["object_mask"] & stored["mask_strict"],
        )


def step_files(data: Path, name: str, frequency: int = 0) -> list[Path]:
    """List the 12 images of one frequency of a capture's N-step stack, in step order."""
    files = sorted((data / name / "raw").glob("*h.bmp"))
    return files[STEPS * frequency : STEPS * (frequency + 1)]


def response_of(data: Path, name: str) -> ResponseCalibration:
    """Estimate the response of a capture from its images of the first frequency."""
    from quadfringe.calibration.response import estimate_from_files

    return estimate_from_files(step_files(data, name), STEPS).calibration


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


def calibration_of(devices: dict[str, Any]) -> Calibration:
    """Make a `Calibration` from the values that `rig` read."""
    from quadfringe import Calibration, Device

    def model(device: dict[str, Any]) -> Device:
        k = device["K"]
        return Device(
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
    response: ResponseChoice = "auto",
    **settings: Any,
) -> tuple[Shot, Plan]:
    """Give the shot of a scene and its plan; `settings` are those of `DecodeConfig`."""
    from quadfringe import DecodeConfig, Plan, Shot

    plan = Plan(
        projector_width_px=scene.projector_width,
        fringes=scene.fringe_numbers,
        calibration=calibration,
        response=response,
        decode=DecodeConfig(**settings),
    )
    return Shot(scene.red, scene.green, scene.blue, scene.ir), plan


def shape_of(scene: Scene, **how: Any) -> Shape:
    """Decode a scene; `how` as in `plan_of`."""
    from quadfringe import decode

    return decode(*plan_of(scene, **how))


def scene_from(shot: Shot, config: SystemConfig, projector_width_px: int) -> Scene:
    """Give a shot of the virtual bench as a scene; pixels at edges and in shadow are not scored."""
    assert shot.truth is not None
    numbers = config.fringes.code
    return Scene(
        name=config.scene.surface,
        red=shot.red,
        green=shot.green,
        blue=shot.blue,
        ir=shot.ir,
        fringe_numbers=numbers,
        projector_width=projector_width_px,
        phase_rad=2 * np.pi * numbers[0] * shot.truth.column_px.astype(np.float64) / projector_width_px,
        scored=np.isfinite(shot.truth.column_px) & ~shot.truth.edge & ~shot.truth.shadow,
        depth_mm=shot.truth.depth_mm,
        shadow=shot.truth.shadow,
    )
