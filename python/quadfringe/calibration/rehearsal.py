"""A calibration rehearsed on the virtual bench: a board in many poses under N-step fringes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration.bundle import Pose, RigCalibration, calibrate_rig
from quadfringe.calibration.detect import View, find_target
from quadfringe.calibration.projector import (
    AXES,
    ProjectorMap,
    ProjectorPoints,
    StepPlan,
    joined,
    position_map,
    projector_points,
)
from quadfringe.calibration.registration import register_views
from quadfringe.calibration.targets import Target, raster
from quadfringe.config import SystemConfig
from quadfringe.data import AnyShot, BayerShot
from quadfringe.decoding import stages
from quadfringe.devices.virtual import PrintedBoard, VirtualBench

__all__ = ["PoseMaps", "Rehearsal", "VirtualBoard", "board_poses", "rehearse"]

# Albedos in R, G, B, IR of office paper and of carbon black, which also absorbs infrared light.
PAPER = (0.85, 0.85, 0.85, 0.8)
INK = (0.06, 0.06, 0.06, 0.12)
TEXEL_MM = 0.1  # side of a texel of the print: a third of a camera pixel at 800 mm


@dataclass(frozen=True)
class Rehearsal:
    """A calibration of the virtual bench, the views it was made from, and the true poses `T_camera_board` (P, 4, 4)."""

    calibration: RigCalibration
    views: tuple[View, ...]
    T_camera_board: NDArray[np.float64]


class PoseMaps(NamedTuple):
    """The maps of the visible and of the infrared projector in one pose."""

    visible: ProjectorMap
    infrared: ProjectorMap


class VirtualBoard:
    """A printed board in front of the virtual bench; its captures have all the defects that `config` describes."""

    def __init__(
        self,
        config: SystemConfig,
        target: Target,
        paper: tuple[float, float, float, float] = PAPER,
        ink: tuple[float, float, float, float] = INK,
    ) -> None:
        self._bench = VirtualBench(config)
        self._board = PrintedBoard(raster(target, TEXEL_MM), TEXEL_MM, target.area_mm, paper, ink)
        self.config = self._bench.resolved(config)
        self.target = target

    def photograph(self, T_camera_board: NDArray[np.float64]) -> NDArray[np.float32]:  # noqa: N803
        """Render the board in a pose under white light: (H, W) float32, the mean of R, G and B, share of full scale."""
        self._bench.place(self._board, T_camera_board)
        return _planes(self._bench.expose_step(0.0, 0.0))[0]

    def capture(self, T_camera_board: NDArray[np.float64], plan: StepPlan) -> PoseMaps:  # noqa: N803
        """Render and decode a pose: the maps of the visible and of the infrared projector.

        The projectors show their fringes one after the other, so crosstalk between them has no effect; crosstalk
        between the colours has none either, because all colours show the same fringes.
        """
        self._bench.place(self._board, T_camera_board)
        visible, infrared = (self._map(plan, beam, i) for i, beam in enumerate(("visible", "infrared")))
        return PoseMaps(visible, infrared)

    def _map(self, plan: StepPlan, beam: str, chip: int) -> ProjectorMap:
        found = []
        for axis in AXES:
            stacks = (
                np.stack(
                    [
                        _planes(self._bench.expose_step(number, plan.shift_rad(step), axis, beam))[chip]
                        for step in range(plan.steps)
                    ]
                )
                for number in plan.fringes.numbers
            )
            found.append(position_map(list(stacks), plan, axis))
        return joined(found[0], found[1], plan)


def _planes(shot: AnyShot) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the images of the visible and of the infrared chip, (H, W), share of full scale."""
    if isinstance(shot, BayerShot):
        light = stages.linear_light(shot)
        return np.mean([light[name] for name in ("red", "green", "blue")], axis=0, dtype=np.float32), light["ir"]
    scale = np.float32(1 / shot.full_scale_value)
    grey = (shot.red.astype(np.float32) + shot.green + shot.blue) * (scale / 3)
    assert shot.ir is not None, "the bench of a rehearsal has infrared"
    return grey.astype(np.float32), shot.ir.astype(np.float32) * scale


def board_poses(
    target: Target,
    count: int = 12,
    distance_mm: float = 810.0,
    range_mm: float = 140.0,
    tilt_deg: float = 30.0,
    seed: int = 0,
) -> NDArray[np.float64]:
    """Return T_camera_board (count, 4, 4): boards tilted to all sides in turn, with distances spread over the range."""
    import cv2

    random = np.random.default_rng(seed)
    middle = target.points_mm.mean(axis=0)
    poses = np.tile(np.eye(4), (count, 1, 1))
    for i, pose in enumerate(poses):
        side, tilt = 2 * np.pi * i / count, np.radians(tilt_deg) * (0.6 + 0.2 * (i % 3))
        turn = np.array([np.cos(side) * tilt, np.sin(side) * tilt, random.uniform(-0.15, 0.15)])
        depth = distance_mm + range_mm * ((5 * i % count) / max(count - 1, 1) - 0.5)
        pose[:3, :3] = cv2.Rodrigues(turn)[0]
        pose[:3, 3] = (random.uniform(-12, 12), random.uniform(-8, 8), depth) - pose[:3, :3] @ middle
    return poses


def rehearse(
    config: SystemConfig,
    target: Target,
    poses: NDArray[np.float64] | None = None,
    plan: StepPlan | None = None,
    progress: Iterable[int] | None = None,
) -> Rehearsal:
    """Capture the board in every pose (P, 4, 4), detect it, and calibrate the camera and both projectors.

    The boards that both chips see register the infrared chip. Raises the errors of detection and calibration.
    """
    board = VirtualBoard(config, target)
    poses = board_poses(target) if poses is None else poses
    plan = StepPlan(config.fringes) if plan is None else plan
    views: list[View] = []
    infrared_views: list[View] = []
    lit: list[ProjectorPoints] = []
    infrared_maps: list[ProjectorMap] = []
    for i in range(len(poses)) if progress is None else progress:
        visible, infrared = board.capture(poses[i], plan)
        views.append(find_target(visible.background, target))
        infrared_views.append(find_target(infrared.background, target))
        lit.append(projector_points(visible, views[-1]))
        infrared_maps.append(infrared)
    chips = register_views(views, infrared_views)
    seen = [
        Pose(view, points, projector_points(infrared, view, ir_registration=chips.ir_registration))
        for view, points, infrared in zip(views, lit, infrared_maps, strict=True)
    ]
    return Rehearsal(calibrate_rig(seen, target), tuple(views), poses)
