"""The words of a report, as HTML; every text that comes from a file is escaped here."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from html import escape
from typing import Any

import numpy as np

from quadfringe.data import Reason, Shape
from quadfringe.view.page._params import LETTERS_MAX, ORDER_DOUBTFUL, UNCERTAINTY_DOUBTFUL
from quadfringe.view.page.figures import COLOURS, known_uncertainty

__all__ = ["about", "doubtful_percent", "escaped", "shares_of", "summary_of", "warnings_of"]

CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")  # and changes of direction


def escaped(text: object) -> str:
    """Give a text that a page shows and does not obey: markup escaped, controls replaced."""
    return escape(CONTROL.sub("\ufffd", str(text)), quote=True)


def warnings_of(shape: Shape) -> str:
    """Give the warnings of a shape as a list; empty when there are none."""
    if not shape.warnings:
        return ""
    return f'<ul id="warnings">{"".join(f"<li>{escaped(one)}</li>" for one in shape.warnings)}</ul>'


def summary_of(shape: Shape) -> str:
    """Give the key figures as tiles."""
    figures = shape.figures()
    rows, columns = shape.phase_rad.shape
    tiles = [(f"{columns} x {rows}", "pixels"), (f"{figures['returned_percent']:.1f} %", "returned")]
    for unit in ("mm", "rad"):
        if (sigma := figures.get(f"uncertainty_median_{unit}")) is not None:
            tiles.append((f"{sigma:.3g} {unit}", "median uncertainty"))
    if (wrong := figures.get("wrong_orders_expected")) is not None:
        tiles.append((f"{wrong:.3g}", "pixels of wrong order, expected"))
    depth_mm = shape.depth_mm
    if depth_mm is not None and np.isfinite(depth_mm).any():
        low, high = np.nanquantile(depth_mm, (0.01, 0.99))
        tiles.append((f"{low:.1f} to {high:.1f} mm", "depth of 98 % of the points"))
    return "".join(f"<div><b>{escaped(value)}</b>{escaped(name)}</div>" for value, name in tiles)


def doubtful_percent(shape: Shape) -> dict[str, float]:
    """Give the shares of the pixels that are returned and doubtful, by what is doubtful, % of all pixels."""
    doubts = {}
    if shape.wrong_order_probability is not None:
        name = f"fringe order wrong with a probability of more than {ORDER_DOUBTFUL:.0%}"
        doubts[name] = shape.wrong_order_probability > ORDER_DOUBTFUL
    known = known_uncertainty(shape)
    if known is not None and np.isfinite(known.sigma).any():
        name = f"uncertainty above {UNCERTAINTY_DOUBTFUL:g} times the median"
        doubts[name] = known.sigma > UNCERTAINTY_DOUBTFUL * np.nanmedian(known.sigma)
    return {name: 100.0 * float((one & shape.returned).mean()) for name, one in doubts.items()}


def shares_of(shape: Shape) -> str:
    """Give the shares of returned, doubtful and missing pixels as a table, which is also the legend of the map."""
    returned = 100.0 * float(shape.returned.mean())
    found = [_share("returned", returned, COLOURS[Reason.RETURNED])]
    found += [_share(f"of these doubtful: {name}", share) for name, share in doubtful_percent(shape).items()]
    found.append(_share("missing", 100.0 - returned))
    if shape.reason is None:
        words = "the file does not say why pixels are missing; decode the shot again"
        return _table("Pixels", [*found, f'<tr><td colspan="2" class="note">{words}</td></tr>'])
    for reason, share in shape.reasons().items():
        if reason is not Reason.RETURNED and share > 0:
            found.append(_share(f"missing: {reason.words}", share, COLOURS[reason]))
    return _table("Pixels", found)


def _share(name: str, percent: float, colour: str | None = None) -> str:
    """Give a row with the share of a kind of pixel, and the colour that it has in the map."""
    box = ""
    if colour is not None:
        box = f'<svg class="box" viewBox="0 0 10 10" aria-hidden="true"><rect width="10" height="10" fill="{colour}"/>'
        box += "</svg>"
    return f'<tr><td>{box}{escaped(name)}</td><td class="number">{_percent(percent)} %</td></tr>'


def _percent(share: float) -> str:
    return "&lt; 0.01" if 0 < share < 0.005 else f"{share:.2f}"


def about(shape: Shape) -> str:
    """Give how the shape was made: method, fringes, response and calibration, and all settings."""
    decode = shape.config.get("decode", {})
    facts: dict[str, object] = {"method": decode.get("method", "not stated")}
    facts |= {"method version": decode["method_version"]} if "method_version" in decode else {}
    made = ("quadfringe_version", "projector_width_px", "fringes", "steps")
    names = (*made, "response_from", "response", "response_evidence", "geometry")
    facts |= {name.replace("_", " "): shape.config[name] for name in names if shape.config.get(name) is not None}
    settings = json.dumps(dict(shape.config), indent=1, ensure_ascii=False, default=str)
    return (
        _table("How it was made", _rows(facts))
        + _table("Calibration", _calibration(shape))
        + f"<details><summary>All settings</summary><pre>{escaped(settings)}</pre></details>"
    )


def _calibration(shape: Shape) -> Iterable[str]:
    calibration = shape.calibration
    if calibration is None:
        return _rows({"calibration": "none: the shape has phases and no points"})
    facts: dict[str, object] = {}
    for name, device in (("camera", calibration.camera), ("projector", calibration.projector)):
        if device is not None:
            focal = ", ".join(f"{value:.1f}" for value in device.focal_px)
            facts[name] = f"{device.width_px} x {device.height_px} px, focal lengths {focal} px"
    if (record := calibration.record) is None:
        return _rows(facts | {"record": "none: the file does not say how it was made"})
    facts |= {"bench": record.rig, "made": f"{record.made_utc}, quadfringe {record.quadfringe_version}"}
    steps = {f"step {one.name}": f"{'good' if one.good else 'NOT good'}: {one.verdict}" for one in record.steps}
    return _rows(facts | steps)


def _rows(facts: Mapping[str, object]) -> list[str]:
    return [f"<tr><td>{escaped(name)}</td><td>{escaped(_short(value))}</td></tr>" for name, value in facts.items()]


def _short(value: Any) -> str:
    text = _told(value)
    return text if len(text) <= LETTERS_MAX else text[:LETTERS_MAX] + " ..."


def _told(value: Any) -> str:
    """Write settings as a person would: no brackets, nothing that is absent."""
    if isinstance(value, Mapping):
        return "; ".join(f"{name} {_told(inner)}" for name, inner in value.items() if inner is not None)
    if isinstance(value, (list, tuple)):
        return ", ".join(_told(inner) for inner in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _table(title: str, rows: Iterable[str]) -> str:
    return f"<section><h2>{escaped(title)}</h2><table>{''.join(rows)}</table></section>"
