"""`Plan`: the fringes, calibration, response and settings from which a decoder is made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import index
from pathlib import Path
from typing import Any, Literal

from quadfringe import _core
from quadfringe.config import SIZE_MAX, DecodeConfig, Fringes, Response, ResponseChoice, brief, checked, shortened
from quadfringe.config.fringes import is_code
from quadfringe.data import Calibration, ResponseCalibration
from quadfringe.errors import InputError

__all__ = ["Plan", "calibration_of", "check_plan", "response_of", "stated_response"]


@dataclass(frozen=True, init=False, repr=False)
class Plan:
    """The fringes, the calibration, the response and the settings of the method from which a decoder is made.

    `projector_width_px` is the number of projector columns that the fringes cover. `calibration` is a `Calibration` or
    the path of its file; without one, shapes hold phase only. `response` is "auto", "linear", a `Response`, or the
    path of a response file, with the meaning of `DecodeConfig.response`; it may be given here or in `decode`,
    and is kept here. `fringes` may be given as three numbers, or two without infrared, or as `Fringes.code`, and
    `decode` as a mapping of its keys.

    Raises `InputError` (`ConfigError` for settings) that names the argument at fault.

    >>> import quadfringe as qf
    >>> plan = qf.Plan(912, fringes=(36, 35, 30), decode={"method": "published", "response": "linear"})
    >>> plan.response, plan.decode.method
    ('linear', 'published')
    """

    projector_width_px: int
    fringes: Fringes
    calibration: Calibration | None
    response: ResponseChoice
    decode: DecodeConfig

    def __init__(
        self,
        projector_width_px: int,
        fringes: Fringes | Sequence[float] = Fringes(),
        calibration: Calibration | Path | str | None = None,
        response: Response | Literal["auto", "linear"] | Path | str = "auto",
        decode: DecodeConfig | Mapping[str, Any] = DecodeConfig(),
    ) -> None:
        settings = decode if isinstance(decode, DecodeConfig) else checked(DecodeConfig, decode, "decode")
        columns = _columns(projector_width_px)
        known, undone = calibration_of(calibration), response_of(response, settings.response)
        shown = _fringes(fringes, columns)
        _check_undone_once(undone, known)
        _check_instants(settings.channel_instants_us, shown)
        fields = {
            "projector_width_px": columns,
            "fringes": shown,
            "calibration": known,
            "response": undone,
            "decode": settings.model_copy(update={"response": "auto"}),
        }
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        words = [f"{self.projector_width_px}", f"fringes={self.fringes.numbers}", f"calibration={self.calibration}"]
        words += [f"response={self.response!r}", f"decode={self.decode}"]
        return shortened(f"Plan({', '.join(words)})")

    @property
    def described(self) -> dict[str, Any]:
        """What is decoded, as plain data for a saved file; the decoder adds response and settings in force."""
        return {
            "quadfringe_version": _core.__version__,
            "projector_width_px": self.projector_width_px,
            "fringes": self.fringes.model_dump(
                mode="json", exclude={"columns_px"} if self.fringes.columns_px is None else None
            ),
        }


def check_plan(plan: object) -> None:
    """Raise `InputError` unless this is a plan, and say how to make one of what was given."""
    if isinstance(plan, Plan):
        return
    given = "912"
    if isinstance(plan, int):
        given = f"{plan}"
    for kinds, name in (((str, Path, Calibration), "calibration"), (Fringes, "fringes"), (DecodeConfig, "decode")):
        if isinstance(plan, kinds):
            given = f"912, {name}={brief(plan)}"
    raise InputError(f"plan: expected a Plan, such as qf.Plan({given}), got {brief(plan)}")


def _columns(width: Any) -> int:
    wanted = "projector_width_px: expected a number of columns, such as 912"
    try:
        columns = index(width)
    except TypeError:
        raise InputError(f"{wanted}, got {width!r}") from None
    if not 2 <= columns <= SIZE_MAX:
        raise InputError(f"{wanted}, from 2 to {SIZE_MAX}, got {columns}")
    return columns


def _fringes(fringes: Fringes | Sequence[float], columns: int) -> Fringes:
    found = fringes if isinstance(fringes, Fringes) else fringes_of(fringes)
    try:
        _core.check_code(found.code, columns, columns_px=found.columns_px)
    except ValueError as error:
        raise InputError(str(error)) from None
    return found


def fringes_of(numbers: Any) -> Fringes:
    """Give the fringes of three numbers, or of two without infrared, or of a `Fringes.code`.

    Raises `ConfigError` for anything else.
    """
    if is_code(numbers):
        return checked(Fringes, {"numbers": numbers[:3], "encoding": "rgb"}, "fringes")
    colours = isinstance(numbers, Sequence) and not isinstance(numbers, str) and len(numbers) == 2
    values = {"numbers": numbers, "encoding": "rgb" if colours else "rgb-ir"}
    return checked(Fringes, values, "fringes")


def calibration_of(calibration: Any) -> Calibration | None:
    """Give a calibration, read from its file when a path is given; raise `InputError` for anything else but None."""
    if calibration is None or isinstance(calibration, Calibration):
        return calibration
    if isinstance(calibration, (str, Path)):
        return Calibration.load(calibration)
    raise InputError(f"calibration: expected a Calibration or the path of its file, got {type(calibration).__name__}")


def response_of(given: Any, setting: Any = "auto") -> ResponseChoice:
    """Give the response that argument and setting agree on, read from its file when a path was given.

    Raises `InputError` when they differ or are no response.
    """
    if given is None:
        raise InputError('response: expected "auto", "linear", a Response, or a response file (.json), got None')
    if given != "auto" and setting not in ("auto", given):
        raise InputError(f"response: given as {given!r}, and as {setting!r} among the settings; give it once")
    found = checked(DecodeConfig, {"response": setting if given == "auto" else given}, "response").response
    return ResponseCalibration.load(found) if isinstance(found, Path) else found


def _check_undone_once(response: ResponseChoice, known: Calibration | None) -> None:
    """Raise `InputError` when the response of the projector would be undone twice, which shifts every depth."""
    if not isinstance(response, ResponseCalibration) or known is None or known.projector_response is None:
        return
    if known.projector_response != Response():
        raise InputError(
            "response: a response file undoes camera and projector together, and this calibration holds a response of "
            "the projector too; leave the response out"
        )


def _check_instants(instants: tuple[float, ...] | None, fringes: Fringes) -> None:
    """Raise `InputError` unless there is one time for each channel of the encoding."""
    if instants is not None and len(instants) != len(fringes.channels):
        raise InputError(
            f"channel_instants_us: expected {len(fringes.channels)} times, of {', '.join(fringes.channels)}, got "
            f"{len(instants)}: {brief(instants)}"
        )


def stated_response(response: ResponseChoice, known: Calibration | None) -> ResponseChoice:
    """Give the response that a choice and a calibration state; "auto" when neither states one.

    A calibration with crosstalk, or with a response of the projector, and without a response states linear light.
    """
    if response != "auto":
        return response
    if known is None or (known.response or known.crosstalk or known.projector_response) is None:
        return "auto"
    return "linear" if known.response is None else known.response
