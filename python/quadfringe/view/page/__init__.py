"""The report of a shape: one HTML file with a surface that can be turned, pictures and tables; it needs no network.

`write_page` writes it. `page.html`, `page.css` and `page.js` are its frame, its style and the program that turns the
surface; `figures` draws the pictures with the panels of `quadfringe.view.report`, `scene` packs the surface, and
`tables` writes the words. Texts of files are escaped, and a content security policy allows no program but `page.js`.

>>> from quadfringe.view.page import SUFFIXES, page_of, write_page
>>> import quadfringe as qf
>>> small = qf.Device(width_px=256, height_px=192, focal_px=(645, 645), centre_px=(127.5, 95.5))
>>> with qf.open(qf.SystemConfig(camera=small, scene=qf.SceneConfig(surface="sphere", noise=0.01))) as scanner:
...     shape = scanner.measure()
>>> "<html" in page_of(shape, "sphere"), SUFFIXES
(True, ('.html', '.htm'))
>>> write_page("sphere.html", shape, "sphere")  # doctest: +SKIP
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from string import Template

from quadfringe.data import Shape
from quadfringe.files import atomic, require_suffix
from quadfringe.view.page import figures, tables
from quadfringe.view.page.figures import Picture
from quadfringe.view.page.scene import packed
from quadfringe.view.page.tables import escaped

__all__ = ["SUFFIXES", "page_of", "write_page"]

SUFFIXES = (".html", ".htm")


def write_page(path: Path | str, shape: Shape, title: str) -> None:
    """Write the report of a shape as one HTML file, whole or not at all; needs matplotlib (extra `plot`).

    `title` names the shape, such as its file. Raises `InputError` unless the name ends in .html, and
    `MissingExtraError` without matplotlib.
    """
    path = Path(path)
    require_suffix(path, SUFFIXES)
    content = page_of(shape, title).encode("utf-8", "backslashreplace")  # file names may hold half a letter
    with atomic(path) as temporary:
        temporary.write_bytes(content)


def page_of(shape: Shape, title: str) -> str:
    """Give the report as HTML; see `write_page`."""
    here = files(__package__)
    style, program = (here.joinpath(name).read_text(encoding="utf-8") for name in ("page.css", "page.js"))
    return Template(here.joinpath("page.html").read_text(encoding="utf-8")).substitute(
        title=escaped(title),
        style=style,
        program=program,
        style_hash=_digest(style),
        program_hash=_digest(program),
        warnings=tables.warnings_of(shape),
        summary=tables.summary_of(shape),
        surface=_surface(shape),
        shares=tables.shares_of(shape),
        pictures=_pictures(figures.pictures_of(shape)),
        about=tables.about(shape),
    )


def _digest(text: str) -> str:
    """Give the digest by which the policy of the page knows a program or a style."""
    return f"sha256-{base64.b64encode(sha256(text.encode()).digest()).decode()}"


def _surface(shape: Shape) -> str:
    """Give the surface with its still picture; empty without points."""
    if (scene := packed(shape)) is None:
        return ""
    still = _image(Picture("shaded surface, seen by the camera", figures.relief(shape)))
    facts = json.dumps(scene.facts, allow_nan=False).replace("<", "\\u003c")
    choices = "".join(
        f'<button type="button" data-layer="{i}">{escaped(name)}</button>' for i, name in enumerate(scene.layers)
    )
    return (
        f'<section id="surface"><h2>Surface</h2><div id="stage">{still}<canvas id="view" tabindex="0" hidden '
        f'aria-label="surface that can be turned"></canvas></div><p id="controls" hidden>{choices}'
        '<button type="button" id="home">front</button><span>Drag turns, Shift and drag moves, the wheel zooms; '
        "arrow keys, + and - do so too.</span></p>"
        f'<p class="note">{escaped(scene.words)}</p>'
        f'<script type="application/json" id="facts">{facts}</script>'
        f'<script type="text/plain" id="data">{scene.data}</script></section>'
    )


def _pictures(pictures: Sequence[Picture]) -> str:
    return "".join(f"<figure>{_image(one)}</figure>" for one in pictures)


def _image(picture: Picture) -> str:
    data = base64.b64encode(picture.png).decode()
    return f'<img alt="{escaped(picture.name)}" src="data:image/png;base64,{data}">'
