"""A bench without hardware: a projector and a camera that share one simulated world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config import ChannelResponse, Fringes, Response, SceneConfig, SystemConfig
from quadfringe.data import AnyShot, BayerShot, Calibration, Shot, Truth
from quadfringe.decoding import core_device, device_model
from quadfringe.errors import DecodeError, InputError
from quadfringe.export import read_npy
from quadfringe.projection import eight_bit, predeformation

__all__ = ["PrintedBoard", "VirtualBench", "VirtualCamera", "VirtualProjector"]

EDGE_PX = 2.0  # pixels nearer to an edge than this belong to it: lens and pixel mix both sides
CHANNELS = ("red", "green", "blue", "ir")


@dataclass(frozen=True)
class PrintedBoard:
    """A flat board with a print on it: inked share (rows, columns) float32 of texels, and its corners in its frame.

    `paper` and `ink` are albedos of R, G, B, IR.
    """

    coverage: NDArray[np.float32]
    texel_mm: float
    corners_mm: tuple[tuple[float, float], tuple[float, float]]
    paper: tuple[float, float, float, float]
    ink: tuple[float, float, float, float]


class VirtualBench:
    """The world of one system file: what stands there, who lights it, who looks at it."""

    def __init__(self, config: SystemConfig) -> None:
        given = {"camera": config.camera, "visible": config.projector, "infrared": config.infrared}
        devices = {name: core_device(model) for name, model in given.items() if model is not None}
        self._bench = _core.Bench(**devices, layout=config.fringes.layout)
        self._scene = config.scene
        self._cast: _core.Cast | None = None
        self._albedo: NDArray[np.float32] | None = None
        self._exposures = 0
        self.projected: Fringes | None = None
        self._infrared_image: NDArray[np.float32] | None = None

    def resolved(self, config: SystemConfig) -> SystemConfig:
        """Give the config with every device written out."""
        devices = {"camera": self._bench.camera, "projector": self._bench.visible, "infrared": self._bench.infrared}
        return config.model_copy(update={name: device_model(device) for name, device in devices.items()})

    def calibration(self) -> Calibration:
        """Give what a perfect calibration of this bench would find."""
        scene = self._scene
        pairs = zip(
            scene.camera_offset or (0.0,) * 4,
            scene.camera_exponent or (1.0,) * 4,
            scene.projector_exponent or (1.0,) * 4,
            strict=True,
        )
        responses = [ChannelResponse(offset=o, exponent=camera / projector) for o, camera, projector in pairs]
        return Calibration(
            camera=device_model(self._bench.camera),
            projector=device_model(self._bench.visible),
            infrared=device_model(self._bench.infrared),
            response=Response(**dict(zip(CHANNELS, responses, strict=True))),
            crosstalk=scene.crosstalk,
            ir_registration=scene.infrared_from_visible,
        )

    def project(self, fringes: Fringes, calibration: Calibration | None = None) -> None:
        """Light the scene with these fringes from now on; pre-deformed by the calibration, or else by the truth."""
        _core.check_code(fringes.numbers, self._bench.visible.width)
        deformed = predeformation(fringes, calibration or self.calibration())
        self._infrared_image = None
        if deformed is not None:
            shown = eight_bit(deformed.light(fringes.numbers[2], fringes.layout))
            self._infrared_image = shown.astype(np.float32) / np.float32(255)
        self.projected = fringes

    def place(self, board: PrintedBoard, T_camera_board: NDArray[np.float64]) -> None:  # noqa: N803
        """Put a board into the scene, alone, in a pose (4, 4); ValueError when that is no motion."""
        pose = {"rotation": T_camera_board[:3, :3].tolist(), "translation_mm": T_camera_board[:3, 3].tolist()}
        (left, top), half = board.corners_mm[0], 0.5 * board.texel_mm
        self._cast = self._bench.cast_plate(*board.corners_mm, **pose)
        self._albedo = self._bench.printed(
            board.coverage,
            pitch_mm=board.texel_mm,
            origin_mm=(left + half, top + half),
            paper=board.paper,
            ink=board.ink,
            **pose,
        )

    def expose_step(self, number: float, shift_rad: float, axis: str = "columns", beam: str | None = None) -> AnyShot:
        """Give the shot of one step: the same fringes in all channels, or in those of one projector.

        Every exposure has noise of its own; the same sequence of exposures has the same noise.
        """
        if self._cast is None:
            self._cast = self._look()
        light = _light(self._scene) | {"seed": (self._scene.seed or 0) + self._exposures}
        if self._albedo is not None:
            light["albedo"] = self._albedo
        self._exposures += 1
        return self._shot(self._bench.render_step(self._cast, number, shift_rad, axis=axis, beam=beam, **light), None)

    def expose(self) -> AnyShot:
        """Give the shot of the scene as it is lit now; raises `DecodeError` when nothing is projected."""
        if self.projected is None:
            raise DecodeError("the projector shows nothing: call show(fringes) before grab()")
        if self._cast is None:
            self._cast = self._look()
        infrared = self._infrared_image
        images = self._bench.render(self._cast, self.projected.numbers, infrared_image=infrared, **_light(self._scene))
        return self._shot(images, self._truth(self._cast))

    def _shot(self, images: dict[str, NDArray[Any]], truth: Truth | None) -> AnyShot:
        full_scale = float(2**self._scene.bit_depth - 1)
        if "raw" in images and self._scene.bayer is not None:
            return BayerShot(images["raw"], self._scene.bayer, images["ir"], full_scale, truth)
        return Shot(**images, full_scale=full_scale, truth=truth)

    def _look(self) -> _core.Cast:
        relief = self._scene.height_map
        if relief is None:
            return self._bench.cast(self._scene.surface, time_s=self._scene.time_s or 0.0)
        heights_mm = read_npy(relief.file)
        if heights_mm.ndim != 2:
            raise InputError(f"{relief.file}: expected heights (rows, columns), got shape {heights_mm.shape}")
        place = relief.model_dump(exclude={"file"})
        return self._bench.cast_height_map(heights_mm.astype("float64"), **place)

    def _truth(self, cast: _core.Cast) -> Truth:
        return Truth(
            column_px=cast.column_px(),
            xyz_mm=cast.xyz_mm(),
            shadow=cast.shadow(),
            edge=cast.edge_distance_px() < EDGE_PX,
        )


def _light(scene: SceneConfig) -> dict[str, Any]:
    """Give the settings of light and camera that are present, as the kernel names them."""
    return scene.model_dump(exclude_none=True, exclude={"surface", "height_map", "time_s"})


class VirtualProjector:
    """The projectors of the virtual bench."""

    def __init__(self, bench: VirtualBench, calibration: Calibration | None = None) -> None:
        self._bench = bench
        self._calibration = calibration

    def show(self, fringes: Fringes) -> None:
        """Light the bench with these fringes; ValueError when they cannot number the field."""
        self._bench.project(fringes, self._calibration)

    def close(self) -> None:
        """Switch the light off."""
        self._bench.projected = None


class VirtualCamera:
    """The camera of the virtual bench; its shots know the truth."""

    def __init__(self, bench: VirtualBench) -> None:
        self._bench = bench

    def grab(self) -> AnyShot:
        """Render one shot of the bench."""
        return self._bench.expose()

    def close(self) -> None:
        """Nothing to release."""
