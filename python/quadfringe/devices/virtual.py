"""A bench without hardware: a projector and a camera that share one simulated world."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import count as numbers
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.capture import VirtualConfig
from quadfringe.config import ChannelResponse, Fringes, Response, SceneConfig, SystemConfig
from quadfringe.data import AnyShot, BayerShot, Calibration, Shot, Stamp, Truth
from quadfringe.decoding import core_device, device_model
from quadfringe.devices import CameraStatistics, Devices, Keep
from quadfringe.errors import ConfigError, DecodeError, InputError
from quadfringe.export import read_npy

__all__ = ["PrintedBoard", "VirtualBench", "VirtualCamera", "VirtualProjector", "open_devices"]

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
        self._cast: tuple[float, _core.Cast] | None = None
        self._board: tuple[_core.Cast, NDArray[np.float32]] | None = None
        self._exposures = 0
        self.projected: Fringes | None = None

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
            response=Response(**dict(zip(CHANNELS, responses, strict=True))),
            crosstalk=scene.crosstalk,
            ir_registration=scene.infrared_from_visible,
        )

    def project(self, fringes: Fringes) -> None:
        """Light the scene with these fringes from now on."""
        _core.check_code(fringes.numbers, self._bench.visible.width)
        self.projected = fringes

    def place(self, board: PrintedBoard, T_camera_board: NDArray[np.float64]) -> None:  # noqa: N803
        """Put a board into the scene, alone, in a pose (4, 4); ValueError when that is no motion."""
        pose = {"rotation": T_camera_board[:3, :3].tolist(), "translation_mm": T_camera_board[:3, 3].tolist()}
        (left, top), half = board.corners_mm[0], 0.5 * board.texel_mm
        albedo = self._bench.printed(
            board.coverage,
            pitch_mm=board.texel_mm,
            origin_mm=(left + half, top + half),
            paper=board.paper,
            ink=board.ink,
            **pose,
        )
        self._board = self._bench.cast_plate(*board.corners_mm, **pose), albedo

    def expose_step(self, number: float, shift_rad: float, axis: str = "columns", beam: str | None = None) -> AnyShot:
        """Give the shot of one step: the same fringes in all channels, or in those of one projector.

        Every exposure has noise of its own; the same sequence of exposures has the same noise.
        """
        light = _light(self._scene) | {"seed": (self._scene.seed or 0) + self._exposures}
        if self._board is None:
            cast = self._look(self._scene.time_s or 0.0)
        else:
            cast, light["albedo"] = self._board
        self._exposures += 1
        return self._shot(self._bench.render_step(cast, number, shift_rad, axis=axis, beam=beam, **light), None)

    def expose(self, after_s: float = 0.0, exposure: int = 0) -> AnyShot:
        """Give the shot of the scene as it is lit now; raises `DecodeError` when nothing is projected.

        `after_s` is how long after the time of the scene it is taken; every exposure has noise of its own.
        """
        if self.projected is None:
            raise DecodeError("the projector shows nothing: call show(fringes) before snap()")
        time_s = (self._scene.time_s or 0.0) + after_s
        if self._cast is None or self._cast[0] != time_s:
            self._cast = time_s, self._look(time_s)
        cast = self._cast[1]
        light = _light(self._scene)
        if exposure:
            light["seed"] = (self._scene.seed or 0) + exposure
        images = self._bench.render(cast, self.projected.numbers, **light)
        return self._shot(images, self._truth(cast))

    def _shot(self, images: dict[str, NDArray[Any]], truth: Truth | None) -> AnyShot:
        full_scale = float(2**self._scene.bit_depth - 1)
        if "raw" in images and self._scene.bayer is not None:
            return BayerShot(images["raw"], self._scene.bayer, images["ir"], full_scale, truth)
        return Shot(images["red"], images["green"], images["blue"], images["ir"], full_scale, truth)

    def _look(self, time_s: float) -> _core.Cast:
        relief = self._scene.height_map
        if relief is None:
            return self._bench.cast(self._scene.surface, time_s=time_s)
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

    def __init__(self, bench: VirtualBench) -> None:
        self._bench = bench

    def show(self, fringes: Fringes) -> None:
        """Light the bench with these fringes; ValueError when they cannot number the field."""
        self._bench.project(fringes)

    def close(self) -> None:
        """Switch the light off."""
        self._bench.projected = None


class VirtualCamera:
    """The camera of the virtual bench; its shots know the truth.

    With a frame rate the scene goes on by one period from shot to shot, and every shot has noise of its own; a shot
    takes as long as its rendering, so that none is ever dropped.
    """

    name = "virtual bench"
    paced = False

    def __init__(self, bench: VirtualBench, settings: VirtualConfig | None = None) -> None:
        self._bench = bench
        self._rate_hz = (settings or VirtualConfig()).frame_rate_hz
        self._exposures = 0
        self._closed = False

    @property
    def calibration(self) -> Calibration:
        """What a perfect calibration of the bench would find."""
        return self._bench.calibration()

    def snap(self, timeout_s: float | None = None) -> AnyShot:  # noqa: ARG002 - a rendering ends
        """Render one shot of the bench."""
        return self._expose()

    def stream(self, count: int | None = None, *, keep: Keep = "latest") -> Iterator[AnyShot]:  # noqa: ARG002
        """Render one shot after the other."""
        self._check_open()
        for _ in numbers() if count is None else range(count):
            yield self._expose()

    def _expose(self) -> AnyShot:
        self._check_open()
        exposure = self._exposures if self._rate_hz else 0
        shot = self._bench.expose(exposure / self._rate_hz if self._rate_hz else 0.0, exposure)
        self._exposures += 1
        return replace(shot, stamp=Stamp(self._exposures, time.time_ns() // 1000, self.name))

    def _check_open(self) -> None:
        if self._closed:
            raise ValueError(f"the camera of the {self.name} is closed")

    def statistics(self) -> CameraStatistics:
        """Give the number of shots; none is ever lost."""
        return CameraStatistics(shots=self._exposures)

    def close(self) -> None:
        """Take no more shots."""
        self._closed = True

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def open_devices(config: SystemConfig) -> Devices:
    """Make a bench of these settings; raises `ConfigError` for projectors of a real one, which it cannot see."""
    if config.projectors is not None:
        raise ConfigError(
            "projectors: the camera of the virtual bench cannot see them; name a camera that can, such as "
            'capture = "aravis:AD-080GE", or show the fringes with `quadfringe projector show --system FILE`'
        )
    bench = VirtualBench(config)
    settings = config.capture if isinstance(config.capture, VirtualConfig) else None
    return Devices(VirtualCamera(bench, settings), VirtualProjector(bench), bench.resolved(config))
