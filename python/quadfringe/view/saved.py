"""The page of saved shapes in the browser, which `quadfringe view` serves.

>>> from quadfringe.view.saved import SavedViewer
>>> with SavedViewer(["face.npz", "take.zarr"]) as viewer:  # doctest: +SKIP
...     input(f"{viewer.url}; Enter ends it")
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Sequence
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

from quadfringe.errors import InputError
from quadfringe.view._address import LOOPBACK
from quadfringe.view._controls import DRAWN, STRIDES, Drawn, check_choice, one_of, within
from quadfringe.view._files import Opened, open_file
from quadfringe.view._items import Item
from quadfringe.view._measuring_panel import MeasuringPanel, ray_of
from quadfringe.view._messages import LONGEST_TEXT
from quadfringe.view._scene import M_PER_MM, Scene
from quadfringe.view._server import serve_page
from quadfringe.view.colours import COLOURINGS, Colouring

__all__ = ["SavedViewer"]

FULL_POINTS = 400_000  # more are thinned at first: a browser draws them at once, and a click still finds every point


class SavedViewer:
    """Serves a page of saved shapes at `url` from background threads; close it, or use it in a `with` block.

    `paths` name shapes (.npz), series that `quadfringe batch` wrote (.zarr), points or meshes (.ply), and meshes
    (.glb, .obj, .stl). The page has controls for file, shot, colouring, and surface or points; clicks measure points,
    distances and sections, always in all points of the file. `host`, `port` and `allow_hosts` are those of `Viewer`.

    Raises `InputError` for a file that cannot be shown, for a host that is not of this machine and for values out of
    range, and `MissingExtraError` without the extra `view`.
    """

    def __init__(
        self,
        paths: Sequence[Path | str],
        host: str = LOOPBACK,
        port: int = 8080,
        *,
        colouring: Colouring = "texture",
        drawn: Drawn = "surface",
        allow_hosts: Iterable[str] = (),
    ) -> None:
        check_choice("colouring", colouring, COLOURINGS)
        check_choice("drawn", drawn, DRAWN)
        if not paths:
            raise InputError("paths: expected at least one file")
        self._files = [open_file(Path(path)) for path in paths]
        first = _first_item(self._files[0])
        page = serve_page(host, port, allow_hosts, f"quadfringe view: {Path(paths[0]).name}")
        self._server, self.url = page.server, page.url
        self._lock = threading.Lock()
        self._closed = False
        self._asked = 0
        self._item: Item | None = None
        self._place: tuple[int, int] | None = None
        self._scene = Scene(self._server)
        body = first.body("texture", 4, surface=False)
        self._scene.look_at(body.points_mm)
        self._first_step = "1" if first.count <= FULL_POINTS else "2"
        self._build(colouring, drawn)
        self._update()

    def _build(self, colouring: Colouring, drawn: Drawn) -> None:
        gui = self._server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
        gui.main_panel.dock_right()
        gui.set_panel_label("quadfringe view")
        self._names = [_label(place, file.path) for place, file in enumerate(self._files)]
        many = len(self._files) > 1
        self._file = gui.add_dropdown("File", self._names, initial_value=self._names[0], visible=many)
        self._shot = gui.add_slider("Shot", min=0, max=1, step=1, initial_value=0, visible=False)
        self._first_drawn, self._first_colouring = drawn, colouring
        self._drawn = gui.add_dropdown("Show", DRAWN, initial_value=drawn)
        self._colouring = gui.add_dropdown("Colour", COLOURINGS, initial_value=colouring)
        self._step = gui.add_dropdown("Every n-th point", STRIDES, initial_value=self._first_step)
        self._words = gui.add_markdown("")
        self._panel = MeasuringPanel(self._server, self._scene)
        for control in (self._file, self._shot, self._drawn, self._colouring, self._step):
            control.on_update(lambda _: self._update())
        self._panel.forget_button.on_click(lambda _: self._locked(self._panel.forget))
        self._server.scene.on_click()(self._click)

    def _locked(self, act: Callable[[], None]) -> None:
        """Act for a page, one after the other, and no more once the page is closed."""
        with self._lock:
            if not self._closed:
                act()

    def _update(self) -> None:
        """Draw what the controls say; of many changes at once, only the last."""
        self._asked += 1
        mine = self._asked
        self._locked(lambda: self._draw() if mine == self._asked else None)

    def _draw(self) -> None:
        place = self._names.index(one_of(self._names, self._file.value, self._names[0]))
        file = self._files[place]
        shot = self._shot_of(file)
        if (place, shot) != self._place:
            self._panel.forget()
            self._item, self._place = None, (place, shot)
        try:
            if self._item is None:
                self._item = file.item(shot)
        except InputError as error:
            self._scene.clear()
            self._words.content = f"**{_plain(str(error))}**"
            return
        asked = one_of(COLOURINGS, self._colouring.value, self._first_colouring)
        colouring = asked if asked in self._item.colourings else "texture"
        step = int(one_of(STRIDES, self._step.value, self._first_step))
        surface = one_of(DRAWN, self._drawn.value, self._first_drawn) == "surface"
        self._scene.draw(self._item.body(colouring, step, surface=surface))
        missing = "" if asked == colouring else f" · **no {asked} in this file**"
        which = f"shot {shot} (0 to {file.count - 1}): " if file.is_series else ""
        self._words.content = f"{_plain(file.path.name)} · {which}{self._item.words}{missing}"

    def _shot_of(self, file: Opened) -> int:
        """Give the shot that the slider asks for, and fit the slider to the file."""
        self._shot.visible = file.count > 1
        self._shot.max = max(1, file.count - 1)
        return int(within((0, file.count - 1), self._shot.value, 0.0))

    def _click(self, event: Any) -> None:
        ray = ray_of([part / M_PER_MM for part in event.ray_origin], event.ray_direction)
        if ray is not None:
            self._locked(lambda: self._panel.click(self._item, ray) if self._item is not None else None)

    def close(self) -> None:
        """Stop serving; further calls do nothing."""
        with self._lock:
            self._closed = True
        self._scene.close()
        with redirect_stdout(StringIO()):
            self._server.stop()

    def __enter__(self) -> SavedViewer:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def _first_item(file: Opened) -> Item:
    """Give the first item of a file that can be shown; raises the reason of the first one if none can."""
    reason: InputError | None = None
    for index in range(file.count):
        try:
            return file.item(index)
        except InputError as error:
            reason = reason or error
    assert reason is not None
    raise reason


def _label(place: int, path: Path) -> str:
    """Name a file in the list: a number makes names differ, and a page may send at most 64 letters."""
    name = f"{place + 1}: {path.name}"
    return name if len(name) < LONGEST_TEXT else f"{name[: LONGEST_TEXT - 10]}...{path.suffix}"


def _plain(text: str) -> str:
    """Escape what Markdown and HTML would not show as it is: names of files can hold anything."""
    return "".join(f"&#{ord(letter)};" if letter in "\\`*_{}[]()<>#+!|&~$" else letter for letter in text)
