"""A bench without hardware: a projector and a camera that share one simulated world."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count as numbers
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config import ChannelResponse, Fringes, Response, Row4, SystemConfig, Triple
from quadfringe.config.cameras import VirtualConfig
from quadfringe.data import AnyShot, BayerShot, Calibration, Shot, Stamp, Truth, core_device, device_model
from quadfringe.devices import CameraStatistics, Devices, Keep
from quadfringe.devices.light import Levels, Light, Step, eight_bit, predeformation
from quadfringe.errors import ConfigError, DecodeError, InputError
from quadfringe.io.export import read_npy

__all__ = ["PrintedBoard", "VirtualBench", "VirtualCamera", "VirtualProjector", "open_devices"]

EDGE_PX = 2.0  # pixels nearer to an edge than this belong to it: lens and pixel mix both sides
NOT_LIGHT = {"surface", "height_map", "time_s", "infrared_from_visible"}
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
        self._bench = _core.Bench(
            **devices, layout=config.fringes.layout, infrared_from_visible=config.scene.infrared_from_visible
        )
        self._scene = config.scene
        self._cast: tuple[float, _core.Cast] | None = None
        self._placed: tuple[_core.Cast, NDArray[np.float32] | None] | None = None
        self._exposures = 0
        self.projected: Light | None = None
        self.capped = False  # whether the lens is covered
        self._infrared_image: NDArray[np.float32] | None = None

    def resolved(self, config: SystemConfig) -> SystemConfig:
        """Give the config with every device written out."""
        devices = {"camera": self._bench.camera, "projector": self._bench.visible, "infrared": self._bench.infrared}
        return config.model_copy(update={name: device_model(device) for name, device in devices.items()})

    def calibration(self) -> Calibration:
        """Give what a perfect calibration of this bench would find."""
        scene = self._scene
        offsets, camera, projector = (
            scene.camera_offset or (0.0,) * 4,
            scene.camera_exponent or (1.0,) * 4,
            scene.projector_exponent or (1.0,) * 4,
        )
        # Seen through crosstalk, what camera and projector bend cannot be undone in one go.
        parted = scene.crosstalk is not None
        together = [seen if parted else seen / sent for seen, sent in zip(camera, projector, strict=True)]
        return Calibration(
            camera=device_model(self._bench.camera),
            projector=device_model(self._bench.visible),
            infrared=device_model(self._bench.infrared),
            response=_responses(offsets, together),
            crosstalk=scene.crosstalk,
            projector_response=_responses((0.0,) * 4, [1 / sent for sent in projector]) if parted else None,
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

    def project_levels(self, levels: Row4) -> None:
        """Light the scene evenly from now on, each channel (R, G, B, IR) at a level of its own from 0 to 1."""
        self.projected = Levels(levels)

    def project_step(self, step: Step) -> None:
        """Light the scene with one step of an N-step capture from now on."""
        self.projected = step

    def place_plane(self, point_mm: Triple, normal: Triple) -> None:
        """Put a plane through a point before the camera, in place of the scene; its normal points to the camera."""
        self._placed = self._bench.cast_plane(point_mm=point_mm, normal=normal), None

    def place_scene(self, surface: str) -> None:
        """Put a ready scene before the camera; ValueError when there is none of that name."""
        self._placed = self._bench.cast(surface), None

    def place(self, board: PrintedBoard, T_camera_board: NDArray[np.float64]) -> None:  # noqa: N803
        """Put a board into the scene, alone, in a pose (4, 4); ValueError when that is no motion."""
        pose = {"rotation": T_camera_board[:3, :3].tolist(), "translation_mm": T_camera_board[:3, 3].tolist()}
        (left, top), half = board.corners_mm[0], 0.5 * board.texel_mm
        cast = self._bench.cast_plate(*board.corners_mm, **pose)
        albedo = self._bench.printed(
            board.coverage,
            pitch_mm=board.texel_mm,
            origin_mm=(left + half, top + half),
            paper=board.paper,
            ink=board.ink,
            **pose,
        )
        self._placed = cast, albedo

    def seed(self, exposure: int) -> int:
        """Give the seed of the noise of an exposure by its number; the first has that of the scene."""
        return (self._scene.seed or 0) + exposure

    def expose_step(self, number: float, shift_rad: float, axis: str = "columns", beam: str | None = None) -> AnyShot:
        """Give the shot of one step: the same fringes in all channels, or in those of one projector.

        Every exposure has noise of its own; the same sequence of exposures has the same noise.
        """
        light = self._light(self.seed(self._exposures))
        self._exposures += 1
        return self._shot(
            self._bench.render_step(self._before_camera(), number, shift_rad, axis=axis, beam=beam, **light), None
        )

    def expose(
        self, after_s: float = 0.0, *, seed: int | None = None, exposure: float = 1.0, capped: bool = False
    ) -> AnyShot:
        """Give the shot of the scene as it is lit now; raises `DecodeError` when nothing is projected.

        `after_s` is how long after the time of the scene it is taken, `seed` draws other noise than that of the scene,
        `exposure` is relative to that of the scene, and `capped` keeps all light out.
        """
        if self.projected is None:
            raise DecodeError("the projector shows nothing: call show(fringes) before snap()")
        cast, light = self._before_camera(after_s), self._light(seed, 0.0 if capped or self.capped else exposure)
        if isinstance(self.projected, Fringes):
            light["infrared_image"] = self._infrared_image
            return self._shot(self._bench.render(cast, self.projected.numbers, **light), self._truth(cast))
        if isinstance(self.projected, Levels):
            return self._shot(self._bench.render_levels(cast, self.projected.levels, **light), None)
        step = self.projected
        images = self._bench.render_step(cast, step.number, step.shift_rad, axis=step.axis, beam=step.beam, **light)
        return self._shot(images, None)

    def _before_camera(self, after_s: float = 0.0) -> _core.Cast:
        """Give what the camera looks at: what was placed there, else the scene."""
        if self._placed is not None:
            return self._placed[0]
        time_s = (self._scene.time_s or 0.0) + after_s
        if self._cast is None or self._cast[0] != time_s:
            self._cast = time_s, self._look(time_s)
        return self._cast[1]

    def _shot(self, images: dict[str, NDArray[Any]], truth: Truth | None) -> AnyShot:
        full_scale = float(2**self._scene.bit_depth - 1)
        if "raw" in images and self._scene.bayer is not None:
            return BayerShot(images["raw"], self._scene.bayer, images["ir"], full_scale, truth)
        return Shot(images["red"], images["green"], images["blue"], images["ir"], full_scale, truth)

    def _light(self, seed: int | None, exposure: float = 1.0) -> dict[str, Any]:
        """Give the settings of light and camera that are present, as the kernel names them."""
        light = self._scene.model_dump(exclude_none=True, exclude=NOT_LIGHT)
        if exposure != 1.0:
            light["gain"] = tuple(exposure * gain for gain in self._scene.gain or (1.0,) * 4)
        if self._placed is not None and self._placed[1] is not None:
            light["albedo"] = self._placed[1]
        return light if seed is None else light | {"seed": seed}

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


def _responses(offsets: Sequence[float], exponents: Sequence[float]) -> Response:
    pairs = zip(CHANNELS, offsets, exponents, strict=True)
    return Response(**{name: ChannelResponse(offset=offset, exponent=exponent) for name, offset, exponent in pairs})


class VirtualProjector:
    """The projectors of the virtual bench."""

    def __init__(self, bench: VirtualBench, calibration: Calibration | None = None) -> None:
        self._bench = bench
        self._calibration = calibration

    def show(self, light: Light) -> None:
        """Light the bench; ValueError for fringes that cannot number the field."""
        if isinstance(light, Fringes):
            self._bench.project(light, self._calibration)
        elif isinstance(light, Levels):
            self._bench.project_levels(light.levels)
        else:
            self._bench.project_step(light)

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
    def bench(self) -> VirtualBench:
        """The world that this camera looks at."""
        return self._bench

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
        shot = self._bench.expose(exposure / self._rate_hz if self._rate_hz else 0.0, seed=self._bench.seed(exposure))
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

    def __exit__(self, *_exception: object) -> None:
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
    known = None if config.calibration is None else Calibration.load(config.calibration)
    return Devices(VirtualCamera(bench, settings), VirtualProjector(bench, known), bench.resolved(config))
