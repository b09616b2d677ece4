"""Records as notebooks show them: a small picture and the figures that matter, as HTML, by NumPy and OpenCV alone.

>>> import quadfringe as qf
>>> from quadfringe.view.cards import shot_card
>>> with qf.open() as scanner:
...     card = shot_card(scanner.grab())
>>> len(card) < 60_000
True
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping
from html import escape

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.config import Device
from quadfringe.data import AnyShot, Calibration, Shape
from quadfringe.view.colours import Picture, coloured, limits_of
from quadfringe.view.overview import fringes_picture
from quadfringe.view.rig import Sight, sights
from quadfringe.view.shading import shaded

__all__ = ["calibration_card", "shape_card", "shot_card"]

WIDTH_PX = 300
LEVELS = 16  # different grey levels: noise in the lower bits would make the picture four times as large
SMALLER = (1.0, 0.7, 0.5)  # shares of the width that are tried until the picture is small enough; half always is
LARGEST_BYTES = 36_000  # of a picture; with it a card has less than 60,000 letters
RIG_PX = (300, 190)
PAPER = (250, 250, 250)
INK = {"camera": (60, 60, 60), "projector": (0, 114, 178), "infrared": (213, 94, 0)}
CARD = "display:flex;gap:14px;align-items:flex-start;font-family:sans-serif;font-size:13px"
CELL = "padding:1px 12px 1px 0;text-align:left;vertical-align:top;background:none;border:none"


def shape_card(shape: Shape) -> str:
    """Describe a shape: shaded surface, or phase without a calibration, and its figures."""
    height, width = shape.phase_rad.shape
    found = shape.figures()
    rows = {"size": f"{width} x {height} px", "returned": f"{found['returned_percent']:.1f} %"}
    depth_mm = shape.depth_mm
    if depth_mm is not None and np.isfinite(depth_mm).any():
        low, high = np.nanquantile(depth_mm, (0.01, 0.99))
        rows["depth"] = f"98 % at {low:.1f} to {high:.1f} mm"
    for unit in ("mm", "rad"):
        if (sigma := found.get(f"uncertainty_median_{unit}")) is not None:
            rows["uncertainty"] = f"median {sigma:.3g} {unit}"
    if (wrong := found.get("wrong_orders_expected")) is not None:
        rows["wrong orders"] = f"{wrong:.0f} pixels expected"
    method = shape.config.get("decode", {}).get("method")
    rows |= {"method": str(method)} if method else {}
    rows |= {"geometry": shape.geometry} if shape.geometry else {}
    rows |= {f"warning {number}": words for number, words in enumerate(shape.warnings, 1)}
    picture = shaded(shape, WIDTH_PX) if depth_mm is not None else _phase(shape)
    return _card("Shape", rows, picture)


def shot_card(shot: AnyShot) -> str:
    """Describe a shot: half of its colour image next to half of the infrared one, and how much is dark or saturated."""
    height, width = shot.first.shape
    rows = {"size": f"{width} x {height} px, {shot.first.dtype} up to {shot.full_scale_value:g}"}
    for name, image in shot.channels.items():
        low, high = (100 * float(value) / shot.full_scale_value for value in np.quantile(image[::4, ::4], (0.01, 0.99)))
        saturated = 100 * float((image >= shot.full_scale_value).mean())
        rows[name] = f"98 % at {low:.0f} to {high:.0f} % of full scale, {saturated:.2g} % saturated"
    if shot.stamp is not None:
        rows["taken"] = f"number {shot.stamp.id}, {shot.stamp.device}"
    if shot.truth is not None:
        rows["truth"] = "known, from the virtual bench"
    return _card(type(shot).__name__, rows, fringes_picture(shot, WIDTH_PX))


def calibration_card(calibration: Calibration) -> str:
    """Describe a calibration: the devices from above, their distances, and what is corrected."""
    seen = sights(calibration)
    rows = {}
    for sight in seen:
        distance = "" if sight.name == "camera" else f", {sight.baseline_mm:.0f} mm from the camera"
        rows[sight.name] = f"{_size(sight.device)}, {sight.device.focal_px[0]:.0f} px focal length{distance}"
    names = ("dark", "response", "crosstalk", "projector_response", "ir_registration")
    known = [name.replace("_", " ") for name in names if getattr(calibration, name) is not None]
    rows["corrected"] = ", ".join(known) or "nothing"
    if (record := calibration.record) is not None:
        rows["made"] = f"{record.made_utc}, rig {record.rig}"
        bad = [step.name for step in record.steps if not step.good]
        rows["steps"] = f"{len(record.steps)}, all good" if not bad else f"not good: {', '.join(bad)}"
    return _card("Calibration", rows, _rig(seen))


def _card(title: str, rows: Mapping[str, str], picture: Picture) -> str:
    lines = "".join(
        f'<tr><td style="{CELL};opacity:0.7">{escape(name)}</td><td style="{CELL}">{escape(value)}</td></tr>'
        for name, value in rows.items()
    )
    image = f'<img alt="{escape(title)}" width="{picture.shape[1]}" src="data:image/png;base64,{_png(picture)}">'
    table = f'<table style="border:none;margin:4px 0 0"><tbody>{lines}</tbody></table>'
    return f'<div style="{CARD}">{image}<div><b>quadfringe {escape(title)}</b>{table}</div></div>'


def _png(picture: Picture) -> str:
    step = 256 // LEVELS
    data = b""
    for share in SMALLER:
        smaller = picture if share == 1 else cv2.resize(picture, None, fx=share, fy=share, interpolation=cv2.INTER_AREA)
        levels = smaller // step * step + step // 2
        data = cv2.imencode(".png", levels[:, :, ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])[1].tobytes()
        if len(data) <= LARGEST_BYTES:
            break
    return b64encode(data).decode()


def _phase(shape: Shape) -> Picture:
    step = max(1, shape.phase_rad.shape[1] // WIDTH_PX)
    phase_rad = shape.phase_rad[::step, ::step]
    return coloured(phase_rad, limits_of(phase_rad))


def _size(device: Device) -> str:
    return f"{device.width_px} x {device.height_px} px"


def _rig(seen: list[Sight]) -> Picture:
    """Draw the devices from above: each at its place, with the borders of what it sees or lights."""
    places = np.concatenate([sight.outline_mm for sight in seen])[:, [0, 2]]
    low, high = places.min(axis=0), places.max(axis=0)
    width, height = RIG_PX
    scale = min((width - 24) / max(high[0] - low[0], 1.0), (height - 24) / max(high[1] - low[1], 1.0))
    offset = np.array(RIG_PX) / 2 - scale * (low + high) / 2

    def at(point_mm: NDArray[np.float64]) -> tuple[int, int]:
        x, z = scale * point_mm[[0, 2]] + offset
        return round(float(x)), round(float(height - z))

    picture = np.full((height, width, 3), PAPER, np.uint8)
    for sight in seen:
        eye, left, right = sight.outline_mm
        ink = INK[sight.name]
        cv2.polylines(picture, [np.array([at(eye), at(left), at(right)])], True, ink, 1, cv2.LINE_AA)
        cv2.circle(picture, at(eye), 4, ink, -1, cv2.LINE_AA)
        if sight.name != "infrared":
            x, y = at(eye)
            cv2.putText(picture, sight.name, (x + 8, y - 2), cv2.FONT_HERSHEY_SIMPLEX, 0.4, ink, 1, cv2.LINE_AA)
    return picture
