"""A virtual bench with the defects of a real one, on which `evaluation/calibration.py` calibrates both projectors."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.calibration.bundle import RigCalibration
from quadfringe.calibration.channels import fit_channels
from quadfringe.calibration.detect import View
from quadfringe.calibration.levels import dark_level, mean_levels
from quadfringe.calibration.projector import StepPlan
from quadfringe.calibration.rehearsal import board_poses, rehearse
from quadfringe.calibration.session.virtual import VirtualCaptures
from quadfringe.calibration.targets import Target, ring_board
from quadfringe.config import Device, Fringes, SceneConfig, SystemConfig
from quadfringe.data import core_device

DEVIATION_DEG, DEVIATION_MM = (1.0, 1.0, 1.0), (0.5, 0.5, 0.5)
SEEDS_APART = 100_003  # every exposure takes the next seed
CROSSTALK = ((1.0, 0.15, 0.0, 0.02), (0.15, 1.0, 0.15, 0.0), (0.0, 0.15, 1.0, 0.02), (0.15, 0.0, 0.02, 1.0))
# Figures of `measured` that have a bar, `calibration.NAME`.
FIGURES = (
    "ring_centre_rms_px",
    "camera_mean_px",
    "visible_mean_px",
    "infrared_mean_px",
    "focal_error_percent",
    "centre_error_px",
    "pair_rotation_error_deg",
    "pair_translation_error_mm",
    "outside_their_interval",
)


def bench_system(layout: str = "regular", camera_scale: float = 1.0, seed: int = 0) -> SystemConfig:
    """Give the bench; `camera_scale` 0.5 halves the pixels along each side and keeps the field of view."""
    camera = Device(
        width_px=round(1024 * camera_scale),
        height_px=round(768 * camera_scale),
        focal_px=(2590.0 * camera_scale, 2588.0 * camera_scale),
        centre_px=(505.0 * camera_scale, 390.0 * camera_scale),
        distortion=(-0.1, 0.08, 3e-4, -2e-4, 0.0),
    )
    scene = SceneConfig(
        shading=True,
        projector_exponent=(2.2, 2.2, 2.2, 2.0),
        crosstalk=CROSSTALK,
        gain=(0.8, 0.75, 0.8, 0.95),
        blur_px=0.8 * camera_scale,
        infrared_from_visible=((1.001, 0.002, 0.7), (-0.002, 0.999, -1.3)),
        noise=0.01,
        seed=1 + SEEDS_APART * seed,
    )
    visible, infrared = _projectors(layout)
    fringes = Fringes.model_validate({"layout": layout})
    return SystemConfig(camera=camera, projector=visible, infrared=infrared, fringes=fringes, scene=scene)


def _projectors(layout: str) -> tuple[Device, Device]:
    """Give both projectors: unlike the published ones in focal length, centre and lens, 1 degree and 0.5 mm apart."""
    published = _core.Bench(layout=layout).visible
    turn = cv2.Rodrigues(np.radians(DEVIATION_DEG))[0]
    rotation = turn @ np.array(published.rotation)
    translation_mm = turn @ np.array(published.translation_mm) + DEVIATION_MM
    fx, fy = published.focal_px
    visible = Device(
        width_px=912,
        height_px=1140,
        focal_px=(1.002 * fx, 1.001 * fy),
        centre_px=(458.0, 573.0),
        distortion=(-0.06, 0.03, -2e-4, 4e-4, 0.0),
        rotation=published.rotation,
        translation_mm=published.translation_mm,
    )
    infrared = Device(
        width_px=912,
        height_px=1140,
        focal_px=(0.998 * fx, 0.999 * fy),
        centre_px=(452.0, 566.0),
        distortion=(-0.055, 0.02, 2e-4, 1e-4, 0.0),
        rotation=rotation.tolist(),
        translation_mm=translation_mm.tolist(),
    )
    return visible, infrared


def centre_errors_px(
    views: tuple[View, ...], config: SystemConfig, target: Target, poses: NDArray[Any]
) -> NDArray[Any]:
    """Give the found minus the true positions of the points in all views, (n, 2), px."""
    assert config.camera is not None
    camera = core_device(config.camera)
    errors = []
    for view, pose in zip(views, poses, strict=True):
        points = target.points_mm[view.ids] @ pose[:3, :3].T + pose[:3, 3]
        errors.append(view.points_px - [camera.project(tuple(p)) for p in points.tolist()])
    return np.concatenate(errors)


def figures_of(found: RigCalibration, config: SystemConfig) -> dict[str, float]:
    """Give errors of a calibration of the bench."""
    figures: dict[str, float] = {}
    focal, centre, outside = 0.0, 0.0, 0
    for name, model in (("camera", config.camera), ("visible", config.projector), ("infrared", config.infrared)):
        assert model is not None
        fit = getattr(found, name)
        figures[f"{name}_mean_px"] = fit.mean_px
        missed = np.subtract(fit.device.focal_px, model.focal_px)
        focal = max(focal, float(np.abs(missed / model.focal_px).max()))
        off = np.subtract(fit.device.centre_px, model.centre_px)
        centre = max(centre, float(np.hypot(*off)))
        figures[f"{name}_focal_sd_px"] = max(fit.sd.focal_px)
    figures |= {"focal_error_percent": 100 * focal, "centre_error_px": centre}
    assert found.pair is not None
    truth = np.array([*DEVIATION_DEG, *DEVIATION_MM])
    error = np.array([*found.pair.rotation_deg, *found.pair.translation_mm]) - truth
    low, high = found.pair.interval(0.95).T
    outside = int(((truth < low) | (truth > high)).sum())
    figures["pair_rotation_error_deg"] = float(np.linalg.norm(error[:3]))
    figures["pair_translation_error_mm"] = float(np.linalg.norm(error[3:]))
    figures["pair_rotation_sd_deg"] = float(found.pair.sd[:3].max())
    figures["pair_translation_sd_mm"] = float(found.pair.sd[3:].max())
    figures["pair_mean_square_in_sd"] = float(np.square(error / found.pair.sd).mean())
    figures["pair_largest_error_in_sd"] = float(np.abs(error / found.pair.sd).max())
    figures["outside_their_interval"] = float(outside)
    return figures


def measured(config: SystemConfig, poses: int, steps: int, seed: int = 0) -> dict[str, float]:
    """Rehearse the calibration and give its figures."""
    target = ring_board()
    places = board_poses(target, poses, seed=seed)
    done = rehearse(config, target, places, StepPlan(config.fringes, steps))
    missed = centre_errors_px(done.views, config, target, places)
    rms = float(np.sqrt(np.square(missed).sum(axis=1).mean()))
    return {"ring_centre_rms_px": rms} | figures_of(done.calibration, config)


def light_figures() -> dict[str, float]:
    """Calibrate responses and crosstalk of a bench with gamma 2.2 and 15 % each way, and give the remaining errors."""
    mixed = tuple(tuple(1.0 if i == j else 0.15 for j in range(4)) for i in range(4))
    light = {"crosstalk": mixed, "projector_exponent": 2.2, "noise": 0.01, "gain": 0.6, "ambient": 0.01, "seed": 1}
    captures = VirtualCaptures(SystemConfig(scene=SceneConfig.model_validate(light | {"camera_offset": 0.02})))
    dark = dark_level([captures.shot("dark", name) for name in captures.session.captures("dark")]).level
    plan = captures.session.level_plan
    seen = np.array([mean_levels(captures.shot("levels", name)) for name in plan.names])
    return fit_channels(plan, seen, dark).figures
