"""The simulated world of the virtual bench: the scene in front of the camera, and its light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config import Fringes, Response, Row4, SystemConfig, Triple
from quadfringe.config.memory import require_memory
from quadfringe.data import AnyShot, BayerShot, Calibration, Shot, Truth, core_device, device_from_core
from quadfringe.devices.light import Levels, Light, Step, eight_bit, predeformation
from quadfringe.devices.virtual._seen import Seen
from quadfringe.errors import DecodeError, InputError
from quadfringe.io.arrays import read_npy

__all__ = ["PrintedBoard", "VirtualBench"]

# Fields of `SceneConfig` that describe the scene and not its light.
NOT_LIGHT = {"surface", "height_map", "time_s", "infrared_from_visible"}


@dataclass(frozen=True)
class PrintedBoard:
    """A flat board with a printed pattern.

    `coverage` (rows, columns) float32 is the share of each texel that is covered with ink, 0 to 1. `corners_mm` are the
    upper left and the lower right corner (x, y) in the frame of the board. `paper` and `ink` are the albedos in R, G, B
    and IR.
    """

    coverage: NDArray[np.float32]
    texel_mm: float
    corners_mm: tuple[tuple[float, float], tuple[float, float]]
    paper: tuple[float, float, float, float]
    ink: tuple[float, float, float, float]


class _Placed(NamedTuple):
    """An object that replaces the scene: albedo map (H, W, 4) of a printed board, point and normal of a plane."""

    seen: Seen
    albedo: NDArray[np.float32] | None = None
    plane: tuple[float, ...] | None = None


# Peak memory of a rendered shot, and of a projected pattern, bytes per pixel (`pytest tests/test_size_limits.py`).
BYTES_PER_PX = {"camera": 110, "visible": 16, "infrared": 16}


class VirtualBench:
    """A simulated bench: one scene, one camera and two projectors, as `config` describes them.

    Every method that renders is deterministic: the same settings and seed give the same images.
    """

    def __init__(self, config: SystemConfig) -> None:
        given = {"camera": config.camera, "visible": config.projector, "infrared": config.infrared}
        for name, model in given.items():
            if model is not None:
                require_memory(f"{name} of the virtual bench", (model.height_px, model.width_px), BYTES_PER_PX[name])
        devices = {name: core_device(model) for name, model in given.items() if model is not None}
        self._bench = _core.Bench(
            **devices, layout=config.fringes.layout, infrared_from_visible=config.scene.infrared_from_visible
        )
        self._scene = config.scene
        self._scene_seen: tuple[float, Seen] | None = None  # time in s, and the scene at that time
        self._placed: _Placed | None = None
        self._exposures = 0
        self._infrared = config.fringes.infrared  # a bench for three colours has no infrared chip
        self.projected: Light | None = None
        self.capped = False  # whether the lens is covered
        self._infrared_image: NDArray[np.float32] | None = None

    @property
    def camera_size_px(self) -> tuple[int, int]:
        """Width and height of the images of the camera."""
        return self._bench.camera.width, self._bench.camera.height

    @property
    def projector_size_px(self) -> tuple[int, int]:
        """Width and height of the visible projector."""
        return self._bench.visible.width, self._bench.visible.height

    def resolved(self, config: SystemConfig) -> SystemConfig:
        """Return the config with every device written out."""
        devices = {"camera": self._bench.camera, "projector": self._bench.visible, "infrared": self._bench.infrared}
        return config.model_copy(update={name: device_from_core(device) for name, device in devices.items()})

    def calibration(self) -> Calibration:
        """Return the exact calibration of this bench."""
        scene = self._scene
        offsets, camera, projector = (
            scene.camera_offset or (0.0,) * 4,
            scene.camera_exponent or (1.0,) * 4,
            scene.projector_exponent or (1.0,) * 4,
        )
        # With crosstalk in between, one response cannot undo both the camera and the projector response.
        separate = scene.crosstalk is not None
        combined = [seen if separate else seen / sent for seen, sent in zip(camera, projector, strict=True)]
        return Calibration(
            camera=device_from_core(self._bench.camera),
            projector=device_from_core(self._bench.visible),
            infrared=device_from_core(self._bench.infrared) if self._infrared else None,
            response=Response.from_powers(offsets, combined),
            crosstalk=scene.crosstalk,
            projector_response=Response.from_powers((0.0,) * 4, [1 / sent for sent in projector]) if separate else None,
            ir_registration=scene.infrared_from_visible if self._infrared else None,
        )

    def project(self, fringes: Fringes, calibration: Calibration | None = None) -> None:
        """Project these fringes; a pre-deformation uses `calibration`, or the exact one when it is None."""
        _core.check_code(fringes.code, self._bench.visible.width, columns_px=fringes.columns_px)
        deformed = predeformation(fringes, calibration or self.calibration())
        self._infrared_image = None
        if deformed is not None:
            shown = eight_bit(deformed.light(fringes.numbers[2], fringes.layout))
            self._infrared_image = shown.astype(np.float32) / np.float32(255)
        self.projected = fringes

    def project_levels(self, levels: Row4) -> None:
        """Project uniform light, one level from 0 to 1 for each channel (R, G, B, IR)."""
        self.projected = Levels(levels)

    def project_step(self, step: Step) -> None:
        """Project one step of an N-step capture."""
        self.projected = step

    def place_plane(self, point_mm: Triple, normal: Triple) -> None:
        """Replace the scene by a plane through a point; its normal points to the camera."""
        plane = (*map(float, point_mm), *map(float, normal))
        # Captures of a calibration session show a plane many times.
        if self._placed is None or self._placed.plane != plane:
            seen = Seen(lambda: self._bench.cast_plane(point_mm=point_mm, normal=normal))
            self._place(_Placed(seen, plane=plane))

    def place_scene(self, surface: str) -> None:
        """Replace the scene by a built-in surface; raises ValueError for an unknown name."""
        self._place(_Placed(Seen(lambda: self._bench.cast(surface))))

    def place(self, board: PrintedBoard, T_camera_board: NDArray[np.float64]) -> None:  # noqa: N803
        """Replace the scene by a board in a pose (4, 4); raises ValueError unless the pose is a rigid motion."""
        pose = {"rotation": T_camera_board[:3, :3].tolist(), "translation_mm": T_camera_board[:3, 3].tolist()}
        (left, top), half = board.corners_mm[0], 0.5 * board.texel_mm
        seen = Seen(lambda: self._bench.cast_plate(*board.corners_mm, **pose))
        albedo = self._bench.printed(
            board.coverage,
            pitch_mm=board.texel_mm,
            origin_mm=(left + half, top + half),
            paper=board.paper,
            ink=board.ink,
            **pose,
        )
        self._place(_Placed(seen, albedo))

    def _place(self, placed: _Placed) -> None:
        if self._placed is not None:
            self._placed.seen.forget()
        self._placed = placed

    def seed(self, exposure: int) -> int:
        """Return the noise seed of exposure number `exposure`; exposure 0 has the seed of the scene."""
        return (self._scene.seed or 0) + exposure

    def expose_step(self, number: float, shift_rad: float, axis: str = "columns", beam: str | None = None) -> AnyShot:
        """Render one step of an N-step capture: the same fringes in all channels, or in those of one projector.

        Each call draws new noise; the same sequence of calls gives the same noise.
        """
        light = self._light(self.seed(self._exposures))
        self._exposures += 1
        return self._shot(
            self._bench.render_step(self._seen_at().cast, number, shift_rad, axis=axis, beam=beam, **light), None
        )

    def expose(
        self, after_s: float = 0.0, *, seed: int | None = None, exposure: float = 1.0, capped: bool = False
    ) -> AnyShot:
        """Render a shot of the scene under the projected light; raises `DecodeError` when nothing is projected.

        `after_s` advances the scene by this time, `seed` replaces the noise seed of the scene, `exposure` is relative
        to the exposure of the scene, and `capped` covers the lens.
        """
        if self.projected is None:
            raise DecodeError("the projector shows nothing; call projector.show(fringes) before camera.snap()")
        seen, light = self._seen_at(after_s), self._light(seed, 0.0 if capped or self.capped else exposure)
        cast = seen.cast
        if isinstance(self.projected, Fringes):
            light |= {"infrared_image": self._infrared_image, "columns_px": self.projected.columns_px}
            return self._shot(self._bench.render(cast, self.projected.code, **light), seen.truth)
        if isinstance(self.projected, Levels):
            return self._shot(self._bench.render_levels(cast, self.projected.levels, **light), None)
        step = self.projected
        images = self._bench.render_step(cast, step.number, step.shift_rad, axis=step.axis, beam=step.beam, **light)
        return self._shot(images, None)

    def _seen_at(self, after_s: float = 0.0) -> Seen:
        """Return the placed object, or the scene at its time plus `after_s`."""
        if self._placed is not None:
            return self._placed.seen
        time_s = (self._scene.time_s or 0.0) + after_s
        if self._scene_seen is None or self._scene_seen[0] != time_s:
            if self._scene_seen is not None:
                self._scene_seen[1].forget()
            self._scene_seen = time_s, Seen(lambda: self._cast_scene(time_s))
        return self._scene_seen[1]

    def _shot(self, images: dict[str, NDArray[Any]], truth: Truth | None) -> AnyShot:
        full_scale, infrared = float(2**self._scene.bit_depth - 1), images["ir"] if self._infrared else None
        if "raw" in images and self._scene.bayer is not None:
            return BayerShot(images["raw"], self._scene.bayer, infrared, full_scale, truth)
        return Shot(images["red"], images["green"], images["blue"], infrared, full_scale, truth)

    def _light(self, seed: int | None, exposure: float = 1.0) -> dict[str, Any]:
        """Return the light and camera settings that are present, by the names of the kernel."""
        light = self._scene.model_dump(exclude_none=True, exclude=NOT_LIGHT)
        if exposure != 1.0:
            light["gain"] = tuple(exposure * gain for gain in self._scene.gain or (1.0,) * 4)
        if self._placed is not None and self._placed.albedo is not None:
            light["albedo"] = self._placed.albedo
        return light if seed is None else light | {"seed": seed}

    def _cast_scene(self, time_s: float) -> _core.Cast:
        relief = self._scene.height_map
        if relief is None:
            return self._bench.cast(self._scene.surface, time_s=time_s)
        heights_mm = read_npy(relief.file)
        if heights_mm.ndim != 2 or heights_mm.dtype.kind not in "fiu":
            got = f"{heights_mm.dtype} {heights_mm.shape}"
            raise InputError(f"{relief.file}: expected a height map (rows, columns) of numbers, got {got}")
        place = relief.model_dump(exclude={"file"})
        return self._bench.cast_height_map(heights_mm.astype("float64"), **place)
