"""The scene of a page: one body as points or as a shaded surface, lights, and the viewpoint.

The page uses metres, which suit the near and far planes of its camera.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.io.glb import glb_bytes
from quadfringe.view._bodies import Body

if TYPE_CHECKING:
    import viser

__all__ = ["M_PER_MM", "Scene"]

M_PER_MM = 1e-3
# The page reads a new surface for some frames and would show nothing meanwhile, so the old one stays until the next
# comes, at most for this time. A page without a graphics card needs up to half a second for 50,000 points.
EXCHANGE_S = 0.5
UP = (0.0, -1.0, 0.0)
# From the upper left as in drawings, weaker from the right, and some from everywhere: relief shows, white stays white.
LIGHTS = {"key": ((-0.7, -0.9, -0.8), 2.6), "fill": ((0.9, 0.1, -0.6), 0.6)}
AMBIENT = 0.4
POINT_SHARE = 0.7  # of the distance of neighbours: viser 1.1 draws points of twice the size
TINY = Body(np.zeros((3, 3), np.float32), np.array([[0, 1, 2]], np.uint32), np.zeros((3, 3), np.uint8), 1e-3)
MARK_COLOUR = (224, 49, 49)
LINE_PX = 3.0
MARK_SHARE = 0.012  # radius of a mark, of that of the body
VIEW = np.array([-0.30, -0.22, -0.80])  # from the middle of a body to the eye: nearly where its camera stood
VIEW_RADII = 1.4  # from the middle to the eye: the body fills most of the picture
INNER = 0.7  # share of the points whose size is taken
CLOSEST = 0.5  # of the distance to the camera of the scanner


class Scene:
    """Draws into a server of viser. Threads may call it at the same time: viser fails when two of them replace a node.

    The lights shine from the side of the camera of the scanner, whose frame is that of the scene.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self.lock = threading.RLock()
        self._surface: Any = None
        self._next: Any = None
        self._timer: threading.Timer | None = None
        self._marks: list[Any] = []
        self._mark = MARK_SHARE
        self._count = 0
        self._points_are_shown = False
        self._light()
        # The page makes a new material for each body and drops the compiled shader with the last one. Invisible ones
        # keep the shaders; otherwise a browser without a graphics card would compile them for every body.
        self._add_points("/shader", TINY)
        self._add_surface("/shader-surface", TINY)

    def _light(self) -> None:
        scene = self._server.scene
        scene.set_up_direction("-y")
        scene.configure_default_lights(enabled=False, cast_shadow=False)
        scene.configure_environment_map(None)
        scene.add_light_ambient("/light", intensity=AMBIENT)
        for name, (position, intensity) in LIGHTS.items():
            scene.add_light_directional(f"/light/{name}", position=position, intensity=intensity)

    def draw(self, body: Body) -> None:
        """Draw a body in place of the last one: its triangles, or its points if it has none."""
        with self.lock:
            self._exchange()
            if len(body.faces):
                self._draw_surface(body)
            else:
                self._add_points("/shape", body)
                self._remove_surface()
                self._points_are_shown = True

    def clear(self) -> None:
        """Draw nothing."""
        with self.lock:
            self._exchange()
            self._remove_surface()
            self._remove_points()

    def _draw_surface(self, body: Body) -> None:
        self._count += 1
        name = f"/surface-{self._count % 2}"
        if self._surface is None:
            self._surface = self._add_surface(name, body)
            self._remove_points()
            return
        self._next = self._add_surface(name, body, visible=False)
        self._timer = threading.Timer(EXCHANGE_S, self._exchange, (self._count,))
        self._timer.daemon = True
        self._timer.start()

    def _exchange(self, count: int | None = None) -> None:
        """Show the surface that waits in place of the last one; with a `count`, only if that one still waits."""
        with self.lock:
            if self._next is None or count not in (None, self._count):
                return
            self._cancel()
            old, self._surface, self._next = self._surface, self._next, None
            with self._server.atomic():
                self._surface.visible = True
                old.remove()

    def _cancel(self) -> None:
        if self._timer is not None:
            self._timer.cancel()

    def _remove_surface(self) -> None:
        if self._surface is not None:
            self._surface.remove()
            self._surface = None

    def _remove_points(self) -> None:
        if self._points_are_shown:
            self._server.scene.remove_by_name("/shape")
            self._points_are_shown = False

    def _add_points(self, name: str, body: Body) -> None:
        self._server.scene.add_point_cloud(
            name,
            points=body.points_mm,
            colors=body.colour,
            point_size=POINT_SHARE * body.size_mm,  # the scale applies to it
            point_shape="square",
            point_shading="flat",
            precision="float32",
            scale=M_PER_MM,
        )

    def _add_surface(self, name: str, body: Body, *, visible: bool = True) -> Any:
        # No shadows: they cost a pass for each light. The page finds the normals itself.
        content = glb_bytes(body.points_mm, body.faces, body.colour)
        return self._server.scene.add_glb(
            name, content, scale=M_PER_MM, visible=visible, cast_shadow=False, receive_shadow=False
        )

    def mark(self, places_mm: Sequence[tuple[float, float, float]]) -> None:
        """Mark at most two places with A and B, and the line between; these marks replace the last ones."""
        scene = self._server.scene
        places = M_PER_MM * np.asarray(places_mm, np.float64).reshape(-1, 3)
        with self.lock, self._server.atomic():
            for handle in self._marks:
                handle.remove()
            self._marks = []
            for name, place in zip("AB", places, strict=False):
                ball = scene.add_icosphere(f"/mark-{name}", self._mark, MARK_COLOUR, position=place, cast_shadow=False)
                scene.add_label(f"/mark-{name}/label", name, anchor="bottom-left")  # goes with the ball
                self._marks.append(ball)
            if len(places) > 1:
                line = places[None, :2]
                handle = scene.add_line_segments(
                    "/mark-line", line, MARK_COLOUR, thickness=LINE_PX, thickness_units="screen"
                )
                self._marks.append(handle)

    def look_at(self, points_mm: NDArray[np.float32]) -> None:
        """Set the viewpoint of all pages: near the camera of the scanner, slightly from the side."""
        sample = points_mm[:: max(1, len(points_mm) // 5000)]
        # Points of wrong orders lie far behind and before, so that a part of them is left out.
        low, middle, high = M_PER_MM * np.quantile(sample, (0.5 - INNER / 2, 0.5, 0.5 + INNER / 2), axis=0)
        radius = float(np.linalg.norm(high - low)) / (2 * INNER)
        away = VIEW_RADII * max(radius, 1e-4)
        self._mark = MARK_SHARE * max(radius, 1e-4)
        if middle[2] > radius:  # a scan: not farther than its camera
            away = min(away, CLOSEST * float(middle[2]))
        eye = middle + away * VIEW / np.linalg.norm(VIEW)
        view = self._server.initial_camera
        view.position, view.look_at, view.up = tuple(eye), tuple(middle), UP
        for client in self._server.get_clients().values():
            client.camera.up_direction = UP
            client.camera.position, client.camera.look_at = tuple(eye), tuple(middle)

    def close(self) -> None:
        """Draw no more."""
        with self.lock:
            self._cancel()
            self._next = None
