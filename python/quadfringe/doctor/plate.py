"""Checks of a shot of a board or of a flat plate, which tell a fault of the calibration from one of the decoding.

A wrong calibration bends and scales the whole field smoothly and leaves points where they repeat; wrong decoding
scatters points, in waves along the fringes or by whole orders. A wrong response may bend the field as well. The light
of the shot tells it, whatever form was measured, and what it may have bent is judged once the response is right.
"""

from __future__ import annotations

import warnings
from dataclasses import replace

from quadfringe.calibration.detect import TargetNotFoundError
from quadfringe.calibration.targets import Target, ring_board
from quadfringe.data import AnyShot, Shape
from quadfringe.decoding import Decoder, Plan
from quadfringe.decoding.response import response_left
from quadfringe.doctor import _params as limits
from quadfringe.doctor.board import BoardPoints, measure_board
from quadfringe.doctor.finding import Finding, graded
from quadfringe.doctor.flatness import Flatness, flatness_of
from quadfringe.doctor.shot import judged_linearity
from quadfringe.errors import DecodeError, DecodeWarning, InputError

__all__ = ["examine_board", "examine_plane", "judged_board", "judged_plate"]

CALIBRATE = "calibrate again: quadfringe calibrate, with tilted poses over the whole field"
FLAT = "if the {} itself is flat to that"
BENT = "calibration scale", "calibration form", "calibration bow"  # what a wrong response changes too


def examine_board(shot: AnyShot, plan: Plan, target: Target | None = None) -> list[Finding]:
    """Check calibration and decoding by a shot of a board, by default the ring board of `quadfringe target`.

    The first finding, "verdict", says which of the two is at fault. Raises `InputError` without a calibration.

    >>> import quadfringe as qf
    >>> from quadfringe.data import read_shot
    >>> plan = qf.Plan(912, calibration="calibration.json")              # doctest: +SKIP
    >>> examine_board(read_shot("shot"), plan)[0].found                 # doctest: +SKIP
    'neither the calibration nor the decoding is at fault'
    """
    decoded = _decoded(shot, plan)
    if isinstance(decoded, Finding):
        return [decoded]
    try:
        board = measure_board(shot, decoded, plan, target or ring_board())
        return judged_board(board, _response(shot, decoded, plan))
    except TargetNotFoundError as error:
        return [
            Finding("board", "fault", str(error), "name another board with --target FILE.json if it is another one")
        ]
    except InputError as error:
        return [Finding("board", "fault", str(error), "examine the shot without --board first")]


def examine_plane(shot: AnyShot, plan: Plan) -> list[Finding]:
    """Check calibration and decoding by a shot of a flat plate that fills most of the image, as `examine_board`."""
    decoded = _decoded(shot, plan)
    if isinstance(decoded, Finding):
        return [decoded]
    try:
        return _with_verdict(judged_plate(flatness_of(decoded), "plate"), _response(shot, decoded, plan))
    except InputError as error:
        return [Finding("plate", "fault", str(error), "examine the shot without --plane first")]


def _decoded(shot: AnyShot, plan: Plan) -> Shape | Finding:
    if plan.calibration is None:
        raise InputError("a board or a plane is compared in mm: name the calibration, .json, as well")
    try:
        with warnings.catch_warnings():  # told by examine_shot
            warnings.simplefilter("ignore", DecodeWarning)
            return Decoder(shot, plan).decode(shot)
    except DecodeError as error:
        return Finding(f"decoding {error.reason or 'fringe orders'}", "fault", str(error), error.fix)


def _response(shot: AnyShot, shape: Shape, plan: Plan) -> Finding:
    """Judge the response by the light of a decoded shot; one that the shot does not show for sure is good."""
    harmonics = {name: one["second_harmonic_before"] for name, one in response_left(shot, shape, plan).evidence.items()}
    if not harmonics:
        return Finding("decoding response", "good", "the light shows no response that is not corrected")
    worst = max(harmonics, key=lambda name: abs(harmonics[name]))
    return judged_linearity("decoding response", worst, abs(harmonics[worst]), plan)


def judged_board(board: BoardPoints, response: Finding | None = None) -> list[Finding]:
    """Judge a measured board, with the finding on the response of its shot if known; the verdict comes first."""
    words = f"the {board.points} points lie {board.reprojection_px:.2f} px (RMS) from those of the board in the image"
    fix = f"{CALIBRATE}; check that the board is the one that was measured, and flat"
    camera = graded("calibration camera", board.reprojection_px, limits.REPROJECTION_PX, words, fix)
    return _with_verdict([camera, _scale(board), _form(board), *judged_plate(board.plate, "board")], response)


def _scale(board: BoardPoints) -> Finding:
    words = f"decoded lengths are {board.scale_percent:+.3f} % off (+- {board.scale_sd_percent:.3f} %), and points "
    words += f"{board.nearer_percent:+.3f} % nearer than the camera alone puts them"
    error = abs(board.scale_percent)
    certain = error > limits.SCALE_SDS * board.scale_sd_percent
    fix = f"measure the pitch of the board with a calliper; if it is right, {CALIBRATE}"
    return graded("calibration scale", error if certain else 0.0, limits.SCALE_PERCENT, words, fix)


def _form(board: BoardPoints) -> Finding:
    words = f"the decoded points are bent by {board.form_mm:.3f} mm (RMS; chance alone gives {board.form_sd_mm:.3f} mm)"
    share = board.form_mm / board.plate.size_mm
    certain = board.form_mm > limits.FORM_SDS * board.form_sd_mm
    fix = f"{CALIBRATE}, {FLAT.format('board')}"
    return graded("calibration form", share if certain else 0.0, limits.FORM_SHARE, words, fix)


def judged_plate(plate: Flatness, what: str) -> list[Finding]:
    """Judge a flat plate, or a board, as it was measured."""
    words = f"the {what} bows by {plate.bow_mm:.3f} mm (+- {plate.bow_sd_mm:.3f} mm) over {plate.size_mm:.0f} mm"
    certain = plate.bow_mm > limits.BOW_SDS * plate.bow_sd_mm
    share = plate.bow_mm / plate.size_mm if certain else 0.0
    fix = f"{CALIBRATE}, {FLAT.format(what)}"
    return [
        graded("calibration bow", share, limits.BOW_SHARE, words, fix),
        _scatter(plate),
        _waves(plate),
        _orders(plate),
    ]


def _scatter(plate: Flatness) -> Finding:
    words = f"points scatter by {plate.noise_mm:.3f} mm"
    if not plate.stated_mm > 0:
        return Finding("decoding scatter", "good", f"{words}; the shape states no uncertainty")
    words += f", the shape states {plate.stated_mm:.3f} mm"
    fix = (
        "look at the waves and orders below, and examine the shot without a board: something not noise scatters points"
    )
    return graded("decoding scatter", plate.noise_mm / plate.stated_mm, limits.SCATTER_RATIO, words, fix)


def _waves(plate: Flatness) -> Finding:
    times = "once" if plate.wave_harmonic == 1 else f"{plate.wave_harmonic} times"
    words = f"waves of {plate.wave_rad:.3f} rad follow the fringes, {times} per fringe"
    fix = "calibrate response and crosstalk again: quadfringe calibrate, step levels; or decode with --response auto"
    return graded("decoding waves", plate.wave_rad, limits.WAVE_RAD, words, fix)


def _orders(plate: Flatness) -> Finding:
    words = f"{plate.displaced_share:.2%} of the pixels lie a quarter of a fringe order or more away from the surface"
    fix = "raise the light, correct the response, and examine the shot without a board for the cause of wrong orders"
    return graded("decoding orders", plate.displaced_share, limits.WRONG_ORDERS, words, fix)


def _with_verdict(found: list[Finding], response: Finding | None = None) -> list[Finding]:
    """Put in front which of the two is at fault, by the gravest finding of each, and the response, if known."""
    if response is not None:
        found = [response, *(map(_after_response, found) if response.grade == "fault" else found)]
    at_fault = [what for what in ("calibration", "decoding") if any(_is_bad(one, what) for one in found)]
    if not at_fault:
        return [Finding("verdict", "good", "neither the calibration nor the decoding is at fault"), *found]
    grave = "fault" if any(one.grade == "fault" for one in found) else "warning"
    names = ", ".join(one.name for one in found if _is_bad(one))
    words = f"the {' and the '.join(at_fault)} {'is' if len(at_fault) == 1 else 'are'} at fault: {names}"
    fix = next(one.fix for one in found if one.grade == grave)
    return [Finding("verdict", "fault" if grave == "fault" else "warning", words, fix), *found]


def _after_response(one: Finding) -> Finding:
    """Put off what a wrong response changes too: it shows nothing of the calibration until the response is right."""
    if one.name not in BENT or not _is_bad(one):
        return one
    return replace(one, grade="note", fix="correct the response, which changes this too, and examine again")


def _is_bad(one: Finding, what: str = "") -> bool:
    return one.grade not in ("good", "note") and one.name.startswith(what)
