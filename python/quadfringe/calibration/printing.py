"""Calibration boards as files for a printer: PDF and SVG in millimetres, and PNG at a stated resolution.

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> from quadfringe.calibration import ring_board
>>> with TemporaryDirectory() as folder:
...     size = write_target(Path(folder) / "board.pdf", ring_board(), page="a4")
>>> isinstance(size, PageSize), size == PAGES_MM["a4"]
(True, True)
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from quadfringe.calibration.targets import Disc, Target, drawing
from quadfringe.errors import InputError, require
from quadfringe.files import atomic, require_suffix

__all__ = ["PAGES_MM", "PageSize", "write_target"]


class PageSize(NamedTuple):
    """Width and height of a page, mm."""

    width_mm: float
    height_mm: float


# ISO 216 and ANSI sizes in landscape orientation.
PAGES_MM = {
    "a4": PageSize(297.0, 210.0),
    "a3": PageSize(420.0, 297.0),
    "a2": PageSize(594.0, 420.0),
    "letter": PageSize(279.4, 215.9),
}
MM_PER_INCH = 25.4
BAR_MM = 100.0  # length of the scale bar: a ruler reads it to 0.2 %
UNPRINTABLE_MM = 4.0  # border that common printers leave white
CAPTION_MM = 3.0  # height of the caption line


def write_target(path: Path, target: Target, page: str = "fit", dpi: int = 600) -> PageSize:
    """Draw the board to scale as PDF, SVG or PNG, and return the size of the page.

    `page` is a4, a3, a2 or letter in landscape orientation, or "fit" for a page of the size of the board. Where the
    border of the page has room, a scale bar of 100 mm and a description of the board are printed below it. `dpi`
    applies to PNG only. Needs matplotlib (extra `plot`). Raises `InputError` for a board larger than its page.
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
    return PageSize(width, height)


def _page(target: Target, page: str) -> PageSize:
    if page == "fit":
        return PageSize(*target.size_mm)
    if page not in PAGES_MM:
        raise InputError(f"page: expected fit, {', '.join(PAGES_MM)}, got {page!r}")
    size = PAGES_MM[page]
    across, down = target.size_mm
    if across > size.width_mm or down > size.height_mm:
        raise InputError(
            f"the board is {across:g} x {down:g} mm with its white border, but a page {page} is {size.width_mm:g} x "
            f"{size.height_mm:g} mm; choose a smaller --pitch, fewer --rows and --columns, or a larger --page"
        )
    return size


def _patch(item: Any, shift: tuple[float, float]) -> Any:
    """Return the matplotlib shape of an item; snapping is off, because it would move edges to whole pixels."""
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
    """Draw the scale bar, and a line that describes the board."""
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
