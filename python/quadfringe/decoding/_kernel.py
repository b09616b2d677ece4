"""The kernel's decoder, planned for one response: buffers for every thread, and a description of its settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from quadfringe import _core
from quadfringe.config import SIZE_MAX, Response, brief
from quadfringe.config.decode import instants_of_four
from quadfringe.config.memory import require_memory
from quadfringe.data import AnyShot, BayerShot, Calibration, Shape, Shot, conditioning, core_device
from quadfringe.decoding.plan import Plan
from quadfringe.errors import InputError

__all__ = [
    "KernelDecoder",
    "Size",
    "check_channels",
    "check_shot",
    "rounded",
    "rows_of_calibration",
    "size_of",
]

Size = tuple[int, int]
# Peak memory of a decoder with two shapes, bytes per pixel, at fringes of 24 px (`pytest tests/test_size_limits.py`
# holds it). Finer fringes need more: the estimate is to refuse what cannot fit by far, not to promise what does.
BYTES_PER_PX = {"joint": 150, "published": 75}
PAIR_BYTES_PER_PX = 50  # of the rays of a pair of projectors, in addition


class KernelDecoder:
    """Decodes without a verdict, with a response that is known; several threads may do so at once."""

    def __init__(
        self,
        size: Size,
        full_scale: float | None,
        plan: Plan,
        source: str | None = None,
        idle: list[_core.Decoder] | None = None,
        evidence: Mapping[str, Any] = MappingProxyType({}),
    ) -> None:
        _check_size(size, plan)
        self._size, self._full_scale, self.plan = size, full_scale, plan
        self._idle = idle or [self._planned()]
        self._described = (
            plan.described
            | self._response_described(source)
            | dict(evidence)
            | {"decode": rounded(self._idle[0].settings()) | _stated(plan)}
        )

    @property
    def response(self) -> Response | Literal["linear"]:
        """The response of the camera that is corrected; "linear" for none."""
        if self.plan.response != "auto":
            return self.plan.response
        calibration = self.plan.calibration
        return "linear" if calibration is None or calibration.response is None else calibration.response

    @property
    def evidence(self) -> Mapping[str, Any]:
        """What told a response that was estimated from shots; empty for any other."""
        return {name: self._described[name] for name in ("response_evidence",) if name in self._described}

    @property
    def settings(self) -> dict[str, Any]:
        """Settings in force, with the defaults of the kernel."""
        return dict(self._described["decode"])

    def with_response(
        self, response: Response | Literal["linear"], evidence: Mapping[str, Any] = MappingProxyType({})
    ) -> KernelDecoder:
        """Give a decoder of the same plan with a response that was estimated from shots, and what told it."""
        plan = replace(self.plan, response=response)
        same = conditioning(plan.calibration, response) == conditioning(plan.calibration, self.plan.response)
        return KernelDecoder(self._size, self._full_scale, plan, "shots", self._idle if same else None, evidence)

    def with_plan(self, plan: Plan) -> KernelDecoder:
        """Give a decoder of images of the same size and full scale."""
        return KernelDecoder(self._size, self._full_scale, plan)

    def with_method(self, method: str) -> KernelDecoder:
        """Give a decoder of the same plan by another method."""
        decode = self.plan.decode.model_copy(update={"method": method})
        return self.with_plan(replace(self.plan, decode=decode))

    def keeping_doubtful(self) -> KernelDecoder:
        """Give a decoder of the same plan that returns doubtful orders too."""
        return self.with_plan(replace(self.plan, decode=self.plan.decode.model_copy(update={"quality_min": 0.0})))

    def with_numbers(self, numbers: tuple[float, ...]) -> KernelDecoder:
        """Give a decoder of the same plan for other fringe numbers."""
        fringes = self.plan.fringes.model_copy(update={"numbers": numbers})
        return KernelDecoder(self._size, self._full_scale, replace(self.plan, fringes=fringes))

    def for_rows(self, first: int, count: int) -> KernelDecoder:
        """Give a decoder of the same plan for some rows of the images."""
        calibration = self.plan.calibration
        known = calibration if calibration is None else rows_of_calibration(calibration, first, count)
        return KernelDecoder((count, self._size[1]), self._full_scale, replace(self.plan, calibration=known))

    def shape(self, shot: AnyShot) -> Shape:
        """Give the shape of a shot of this size; raises `InputError` for one with other channels."""
        check_channels(shot, self.plan)
        try:
            core = self._idle.pop()
        except IndexError:
            core = self._planned()
        try:
            if isinstance(shot, BayerShot):
                maps = core.decode_bayer(shot.raw, shot.bayer, shot.ir)
            else:
                maps = core.decode(shot.red, shot.green, shot.blue, shot.ir)
        finally:
            self._idle.append(core)
        return Shape(**maps, config=self._described, calibration=self.plan.calibration)

    def _planned(self) -> _core.Decoder:
        plan = self.plan
        # Only the search along rays takes the range; else depths outside become no data after decoding.
        after = set() if plan.decode.unwrapping == "pair" else {"depth_range_mm"}
        settings = plan.decode.model_dump(exclude_none=True, exclude={"unwrapping", "response", *after})
        if plan.decode.channel_instants_us is not None:
            settings["channel_instants_us"] = instants_of_four(plan.decode.channel_instants_us)
        try:
            return _core.Decoder(
                self._size,
                plan.fringes.code,
                plan.projector_width_px,
                columns_px=plan.fringes.columns_px,
                full_scale=self._full_scale,
                **conditioning(plan.calibration, plan.response),
                **_geometry(plan),
                **settings,
            )
        except ValueError as error:  # images too small, fringes that do not cover the field
            raise InputError(str(error)) from error

    def _response_described(self, source: str | None) -> dict[str, Any]:
        """Tell which response is corrected, None for none, and whether plan, calibration or shots gave it."""
        response = self.response
        given = "calibration" if self.plan.response == "auto" else "plan"
        return {
            "response": None if response == "linear" else response.model_dump(include=set(Response.model_fields)),
            "response_from": source or given,
        }


def rounded(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Give the settings with the shortest decimals of the kernel's float32: 0.02 in place of 0.0199999995529..."""
    return {
        name: float(str(np.float32(value))) if isinstance(value, float) and float(np.float32(value)) == value else value
        for name, value in settings.items()
    }


def check_shot(shot: object) -> None:
    """Raise `InputError` unless this is a shot, and say how to get one."""
    if isinstance(shot, (str, Path)):
        raise InputError(f"expected a shot, got the path {str(shot)!r}; read it with qf.read_shot")
    if not isinstance(shot, (Shot, BayerShot)):
        raise InputError(f"expected a shot, got {brief(shot)}; make one with qf.read_shot, qf.Shot or Scanner.grab")


def check_channels(shot: AnyShot, plan: Plan) -> None:
    """Raise `InputError` unless the shot has the channels of the encoding, and say which to give."""
    if (shot.ir is not None) == plan.fringes.infrared:
        return
    expected, got = ", ".join(plan.fringes.channels), ", ".join(shot.images)
    if plan.fringes.infrared:
        advice = 'give the infrared image ir, or, if none was projected, fringes with encoding = "rgb"'
    else:
        advice = 'leave ir out, or give fringes with encoding = "rgb-ir" and three numbers'
    words = f'the fringes have encoding = "{plan.fringes.encoding}", of {expected}, and the shot has {got}: {advice}'
    raise InputError(f"{words} (--encoding and --fringes on the command line)")


def size_of(like: AnyShot | Size, full_scale: float | None) -> tuple[Size, float | None]:
    """Give rows and columns, and the full scale if it is known."""
    if isinstance(like, (Shot, BayerShot)):
        rows, columns = like.first.shape
        return (rows, columns), like.full_scale_value if full_scale is None else full_scale
    try:
        rows, columns = (int(length) for length in like)
    except (TypeError, ValueError):
        advice = "; read it with qf.read_shot" if isinstance(like, (str, Path)) else ""
        raise InputError(f"expected a shot or a size (rows, columns), got {brief(like)}{advice}") from None
    if not all(1 <= length <= SIZE_MAX for length in (rows, columns)):
        raise InputError(f"expected a size (rows, columns) from 1 to {SIZE_MAX} px, got {brief(like)}")
    return (rows, columns), full_scale


def _check_size(size: Size, plan: Plan) -> None:
    rays = PAIR_BYTES_PER_PX if plan.decode.unwrapping == "pair" else 0
    require_memory("decoding", size, BYTES_PER_PX[plan.decode.method or "joint"] + rays)
    period_px = plan.decode.period_px
    longest_px = max(period_px) if isinstance(period_px, tuple) else period_px
    if longest_px is not None and longest_px > max(size):
        raise InputError(
            f"period_px: expected at most {max(size)} px, the longer side of the images, got {longest_px:g}; the "
            "period is that of the fringes in the image of the camera"
        )
    if plan.calibration is None:
        return
    camera, projector = plan.calibration.camera, plan.calibration.projector
    if size != (camera.height_px, camera.width_px):
        raise InputError(
            f"the calibration is for images of {camera.width_px} x {camera.height_px} pixels, "
            f"the shot has {size[1]} x {size[0]}; calibrate at the size in use"
        )
    if projector.width_px != plan.projector_width_px:
        raise InputError(
            f"the calibration's projector has {projector.width_px} columns, "
            f"projector_width_px is {plan.projector_width_px}; the two must agree"
        )


def rows_of_calibration(calibration: Calibration, first: int, count: int) -> Calibration:
    """Give the calibration of a camera that sees some rows only: its rows count from the first of them."""
    column, row = calibration.camera.centre_px
    camera = calibration.camera.model_copy(update={"height_px": count, "centre_px": (column, row - first)})
    registration = calibration.ir_registration
    if registration is not None:
        (xx, xy, x), (yx, yy, y) = registration
        registration = ((xx, xy, x + xy * first), (yx, yy, y + (yy - 1) * first))
    return calibration.model_copy(update={"camera": camera, "ir_registration": registration})


def _stated(plan: Plan) -> dict[str, Any]:
    """Give the settings that stand in a file as they were stated, not as the kernel was given them."""
    stated = {name: getattr(plan.decode, name) for name in ("depth_range_mm", "channel_instants_us", "period_px")}
    return {name: list(value) for name, value in stated.items() if isinstance(value, tuple)}


def _geometry(plan: Plan) -> dict[str, Any]:
    calibration = plan.calibration
    searched = plan.decode.unwrapping == "pair"
    if searched and (calibration is None or calibration.infrared is None):
        raise InputError(
            'unwrapping = "pair" needs a calibration with both projectors: one that has an `infrared` device'
        )
    if calibration is None:
        if plan.decode.depth_range_mm is not None:
            raise InputError("depth_range_mm needs a calibration: without one, a shape has no depths")
        return {}
    known = {"camera": core_device(calibration.camera), "projector": core_device(calibration.projector)}
    if not searched or calibration.infrared is None:
        return known
    return known | {
        "infrared": core_device(calibration.infrared),
        "predeformed_z_mm": plan.fringes.predeformed_z_mm,
    }
