"""Captures of a session rendered by the virtual bench: the guided calibration without hardware."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration.projector import ProjectorMap
from quadfringe.calibration.rehearsal import INK, PAPER, TEXEL_MM, board_poses
from quadfringe.calibration.session.captures import light_of, pose_light, pose_maps
from quadfringe.calibration.session.settings import FILE, STEP_NAMES, Session
from quadfringe.calibration.targets import raster
from quadfringe.config import SystemConfig
from quadfringe.data import AnyShot
from quadfringe.data.shot_files import write_shot
from quadfringe.devices import Camera
from quadfringe.devices.virtual import PrintedBoard, VirtualBench, VirtualCamera, VirtualProjector
from quadfringe.errors import InputError
from quadfringe.files import folder_for
from quadfringe.io.images import write_image

__all__ = ["VirtualCaptures", "virtual_session"]

BOARD_MM = 800.0  # depth of the white board: the reference plane of the published bench
LEVEL = (0.0, 0.0, -1.0)  # normal of a plane that faces the camera
TILTED = (0.2588, 0.0, -0.9659)  # normal of the plane of the acceptance test, tilted by 15 degrees


def virtual_session(config: SystemConfig, poses: int = 12) -> Session:
    """Return the session settings of a virtual bench."""
    bench = VirtualBench(config).resolved(config)
    assert bench.projector is not None
    size = (bench.projector.width_px, bench.projector.height_px)
    return Session(rig="virtual bench", fringes=config.fringes, projector_size_px=size, poses=poses)


class VirtualCaptures:
    """Renders each capture on demand; the same name always gives the same image, noise included.

    `config` describes devices, light and camera; each step puts its object in front of the camera.
    """

    def __init__(self, config: SystemConfig, session: Session | None = None) -> None:
        if config.scene.bayer is not None and config.scene.demosaic is None:
            raise InputError("scene.bayer: a rehearsed calibration needs full colour planes; set scene.demosaic too")
        bits = None if config.scene.bit_depth == 8 else config.scene.bit_depth
        self.session = (session or virtual_session(config)).model_copy(update={"bits": bits})
        self._config = config
        self._bench = VirtualBench(config)
        self._poses = dict(
            zip(self.session.captures("poses"), board_poses(self.session.target, self.session.poses), strict=True)
        )
        target = self.session.target
        self._board = PrintedBoard(raster(target, TEXEL_MM), TEXEL_MM, target.area_mm, PAPER, INK)

    def missing(self, step: str) -> list[str]:
        """Return no names: every capture can be rendered."""
        self.session.captures(step)
        return []

    def shot(self, step: str, name: str) -> AnyShot:
        """Render one shot."""
        exposure = self._arrange(step, name)
        seed = crc32(f"{self._config.scene.seed or 0}/{step}/{name}".encode())
        return self._bench.expose(seed=seed, exposure=exposure)

    def pose(self, name: str) -> dict[str, ProjectorMap]:
        """Render the fringe images of one pose of the board, and decode them like those of a folder."""
        self._place(self._bench, "poses", name)
        return pose_maps(self.session, lambda image: np.asarray(self._fringes(image) / self._full_scale, np.float32))

    def write(
        self,
        folder: Path,
        steps: Iterable[str] = STEP_NAMES,
        done: Callable[[str, str], None] = lambda _step, _name: None,
    ) -> list[Path]:
        """Write session.json and the captures of these steps as image files; return the folders of the captures.

        `done` is called with step and name after each capture.
        """
        self.session.save(folder_for(folder) / FILE)
        written = []
        for step in steps:
            for name in self.session.captures(step):
                place = folder_for(folder / step / name)
                if step == "poses":
                    self._write_pose(place, name)
                else:
                    write_shot(place, self.shot(step, name))
                written.append(place)
                done(step, name)
        return written

    def _write_pose(self, folder: Path, name: str) -> None:
        self._place(self._bench, "poses", name)
        for beam in self.session.beams:
            folder_for(folder / beam)
        for image in self.session.pose_images():
            write_image(folder / f"{image}.png", self._fringes(image))

    def _fringes(self, image: str) -> NDArray[Any]:
        """Render one fringe image of the current pose; the green channel represents the visible ones."""
        light = pose_light(self.session, image)
        beam = light.beam
        shot = self._bench.expose_step(light.number, light.shift_rad, light.axis, beam)
        return shot.channels["green" if beam == "visible" else "ir"]

    @property
    def _full_scale(self) -> float:
        return float(2**self._config.scene.bit_depth - 1)

    def _arrange(self, step: str, name: str) -> float:
        """Set up object and light of a capture; return its relative exposure."""
        self._place(self._bench, step, name)
        light, exposure = light_of(self.session, step, name)
        VirtualProjector(self._bench).show(light)
        return exposure

    def _place(self, bench: VirtualBench, step: str, name: str) -> None:
        """Put the object of a capture in front of the camera of a bench."""
        bench.capped = step == "dark"
        if step == "poses":
            bench.place(self._board, self._poses[name])
        elif name == "plane_1":
            bench.place_plane((0.0, 0.0, BOARD_MM), TILTED)
        elif name in ("sphere_1", "steps_1"):
            bench.place_scene(name.removesuffix("_1"))
        else:
            height_mm = self.session.heights_mm[self.session.captures(step).index(name)] if step == "planes" else 0.0
            bench.place_plane((0.0, 0.0, BOARD_MM - height_mm), LEVEL)

    def hands(self, step: str, name: str, camera: Camera) -> None:
        """Place the objects for `take_captures` on a virtual bench, in place of a person."""
        assert isinstance(camera, VirtualCamera)
        self._place(camera.bench, step, name)
