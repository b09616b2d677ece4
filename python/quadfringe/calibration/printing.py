"""Calibration boards as files for a printer: PDF and SVG in millimetres, and PNG at a stated resolution."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from quadfringe.calibration.targets import Disc, Target, drawing
from quadfringe.errors import InputError, require
from quadfringe.files import atomic, require_suffix

__all__ = ["PAGES_MM", "write_target"]

PAGES_MM = {"a4": (297.0, 210.0), "a3": (420.0, 297.0), "a2": (594.0, 420.0), "letter": (279.4, 215.9)}
MM_PER_INCH = 25.4
BAR_MM = 100.0
UNPRINTABLE_MM = 4.0  # border that common printers leave white
CAPTION_MM = 3.0


def write_target(path: Path, target: Target, page: str = "fit", dpi: int = 600) -> tuple[float, float]:
    """Draw the board to scale and return the size of the page (width, height) in mm.

    `page` is a4, a3, a2 or letter, lying, or "fit" for a page of the size of the board. A bar of 100 mm and what the
    board is stand below it, on the white border of a page that has room for them. `dpi` matters to PNG alone. Needs
    matplotlib (extra `plot`). Raises `InputError` for a board larger than its page.
    """
    suffix = require_suffix(path, (".pdf", ".svg", ".png"))
    require("matplotlib", "plot")
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    width, height = _page(target, page)
    figure = Figure(figsize=(width / MM_PER_INCH, height / MM_PER_INCH), facecolor="white")
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, width), ylim=(height, 0), frameon=False, xticks=[], yticks=[])
    (left, top), _ = target.area_mm
    board_width, board_height = target.size_mm
    shift = (0.5 * (width - board_width) - left, 0.5 * (height - board_height) - top)
    for item in drawing(target):
        axes.add_patch(_patch(item, shift))
    room_mm = 0.5 * (height - board_height) + (target.points_mm[:, 1].min() - top) - 0.5 * (target.diameter_mm or 0)
    if page != "fit" and room_mm > UNPRINTABLE_MM + 3 * CAPTION_MM:
        _caption(axes, target, width, height)
    plain = {"Creator": "quadfringe"} | ({"CreationDate": None} if suffix == ".pdf" else {"Date": None})
    with atomic(path) as temporary, rc_context({"svg.hashsalt": "quadfringe", "svg.fonttype": "none"}):
        figure.savefig(temporary, format=suffix[1:], dpi=dpi, metadata=None if suffix == ".png" else plain)
    return width, height


def _page(target: Target, page: str) -> tuple[float, float]:
    if page == "fit":
        return target.size_mm
    if page not in PAGES_MM:
        raise InputError(f"page: expected fit, {', '.join(PAGES_MM)}, got {page!r}")
    width, height = PAGES_MM[page]
    across, down = target.size_mm
    if across > width or down > height:
        raise InputError(
            f"the board is {across:g} x {down:g} mm with its white border, a page {page} {width:g} x {height:g} mm; "
            "take a smaller --pitch, fewer --rows and --columns, or a larger --page"
        )
    return width, height


def _patch(item: Any, shift: tuple[float, float]) -> Any:
    """Give a shape of matplotlib; snapping would move edges of a PNG to whole pixels."""
    from matplotlib.patches import Circle, Rectangle

    look: dict[str, Any] = {
        "facecolor": "black" if item.ink else "white",
        "edgecolor": "none",
        "linewidth": 0,
        "snap": False,
    }
    place = (item.x_mm + shift[0], item.y_mm + shift[1])
    if isinstance(item, Disc):
        return Circle(place, 0.5 * item.diameter_mm, **look)
    return Rectangle(place, item.width_mm, item.height_mm, **look)


def _caption(axes: Any, target: Target, width: float, height: float) -> None:
    """Draw a bar of 100 mm to hold a ruler against, and a line that says what this is."""
    from matplotlib.patches import Rectangle

    bottom = height - UNPRINTABLE_MM - CAPTION_MM
    left = 0.5 * width - BAR_MM
    axes.add_patch(Rectangle((left, bottom), BAR_MM, 0.5, facecolor="black", edgecolor="none"))
    for x in (left, left + BAR_MM - 0.3):
        axes.add_patch(Rectangle((x, bottom - 1.5), 0.3, 3.0, facecolor="black", edgecolor="none"))
    text = f"bar {BAR_MM:g} mm - print at 100 % - {_described(target)}"
    axes.text(left + BAR_MM + 4, bottom + 1.0, text, fontsize=7, family="sans-serif")


def _described(target: Target) -> str:
    sizes = {
        "pitch": target.pitch_mm,
        "diameter": target.diameter_mm,
        "hole": target.hole_mm,
        "marker": target.marker_mm,
    }
    named = ", ".join(f"{name} {size:g}" for name, size in sizes.items() if size is not None)
    return f"{target.kind} {target.rows} x {target.columns}, {named} mm"
