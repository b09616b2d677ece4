"""The adjustment problem: parameters by name, residuals, and their sparse Jacobian.

The camera observes a board point, and each projector lights it as an inverse camera (S8). A camera residual is the
predicted minus the observed image point. A projector pixel was read at the observed camera point, so an error of that
point enters it too, multiplied by the slope of the map between the two. This part is subtracted; the remaining
residuals are independent between devices, which the confidence intervals of the pair need.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["DEVICES", "LENS", "Adjustment", "Sight"]

Array = NDArray[np.float64]
DEVICES = ("camera", "visible", "infrared")
LENS = ("focal_x_px", "focal_y_px", "centre_x_px", "centre_y_px", "k1", "k2", "p1", "p2", "k3")
MOTION = (
    "rotation_x_rad",
    "rotation_y_rad",
    "rotation_z_rad",
    "translation_x_mm",
    "translation_y_mm",
    "translation_z_mm",
)


@dataclass(frozen=True)
class Sight:
    """The points of one pose as one device observes them.

    `board_mm` (n, 3) and `points_px` (n, 2) correspond. A projector also has `slope` (n, 2, 2), the change of its pixel
    per camera pixel, and `camera_rows` (n,), the indices of its points among those of the camera in this pose.
    """

    device: str
    pose: int
    board_mm: Array
    points_px: Array
    slope: Array | None = None
    camera_rows: NDArray[np.intp] | None = None


class Adjustment:
    """Residuals and Jacobian over all sights, for `scipy.optimize.least_squares`, with parameters by name.

    With `radial3` false, the third radial coefficient stays 0. `sd_px` maps each device to the standard deviations (2,)
    along x and y that divide its residuals; they differ because mirror pitch and fringe period differ between columns
    and rows. `kept` marks the points (n,) of each sight that are used; without it, all are.
    """

    def __init__(
        self,
        sights: Sequence[Sight],
        poses: int,
        radial3: bool,
        sd_px: Mapping[str, Array],
        kept: Sequence[NDArray[np.bool_]] | None = None,
    ) -> None:
        self.sights, self.poses, self.sd_px = sights, poses, dict(sd_px)
        self.kept = [np.ones(len(s.points_px), bool) for s in sights] if kept is None else list(kept)
        self.devices = [name for name in DEVICES if any(s.device == name for s in sights)]
        lens = LENS if radial3 else LENS[:-1]
        names: list[str] = []
        self.places: dict[tuple[str, str], slice] = {}
        for device in self.devices:
            self._add(names, device, "lens", lens)
            if device != "camera":
                self._add(names, device, "motion", MOTION)
        for pose in range(poses):
            self._add(names, f"pose_{pose + 1}", "motion", MOTION)
        self.names = tuple(names)
        ends = np.cumsum([0, *(2 * len(s.points_px) for s in sights)])
        self.rows = [slice(int(a), int(b)) for a, b in pairwise(ends)]
        self.count = int(ends[-1])
        self._at: tuple[NDArray[np.intp], ...] | None = None

    def _add(self, names: list[str], owner: str, part: str, fields: Sequence[str]) -> None:
        self.places[owner, part] = slice(len(names), len(names) + len(fields))
        names.extend(f"{owner}.{field}" for field in fields)

    def part(self, values: Array, owner: str, part: str) -> Array:
        """Return the "lens" or the "motion" parameters of an owner ("camera", "pose_3")."""
        return values[self.places[owner, part]]

    def raw(self, values: Array) -> list[Array]:
        """Return the residuals (n, 2), px, of each sight: predicted minus observed."""
        return [self._predicted(values, sight)[0] - sight.points_px for sight in self.sights]

    def residuals(self, values: Array) -> Array:
        """Return independent residuals of unit variance as one vector; 0 for points that are not kept."""
        scaled = self.independent(values)
        return np.concatenate([(r * k[:, None]).ravel() for r, k in zip(scaled, self.kept, strict=True)])

    def independent(self, values: Array) -> list[Array]:
        """Return the residuals (n, 2) of each sight without the part of the camera, in standard deviations."""
        raw = self.raw(values)
        camera = {s.pose: r for s, r in zip(self.sights, raw, strict=True) if s.device == "camera"}
        out = []
        for sight, residual in zip(self.sights, raw, strict=True):
            remaining = residual
            if sight.slope is not None:
                remaining = residual - (sight.slope @ camera[sight.pose][sight.camera_rows][:, :, None])[:, :, 0]
            out.append(remaining / self.sd_px[sight.device])
        return out

    def jacobian(self, values: Array) -> Any:
        """Return the Jacobian of `residuals` as a sparse matrix."""
        from scipy import sparse

        blocks: list[tuple[slice, slice, Array]] = []
        camera: dict[int, list[tuple[slice, Array]]] = {}
        for sight, rows, kept in zip(self.sights, self.rows, self.kept, strict=True):
            slopes = self._predicted(values, sight)[1]
            if sight.device == "camera":
                camera[sight.pose] = slopes
            elif sight.slope is not None:
                slopes = slopes + [
                    (columns, -(sight.slope @ part[sight.camera_rows])) for columns, part in camera[sight.pose]
                ]
            weight = (kept[:, None] / self.sd_px[sight.device])[:, :, None]
            blocks += [(rows, columns, (part * weight).reshape(-1, part.shape[2])) for columns, part in slopes]
        if self._at is None:  # the sparsity pattern never changes
            index = [np.mgrid[r, c] for r, c, _ in blocks]
            self._at = tuple(np.concatenate([i[k].ravel() for i in index]) for k in (0, 1))
        data = np.concatenate([part.ravel() for *_, part in blocks])
        return sparse.coo_matrix((data, self._at), shape=(self.count, len(self.names))).tocsr()

    def _predicted(self, values: Array, sight: Sight) -> tuple[Array, list[tuple[slice, Array]]]:
        """Return the predicted pixels (n, 2), and their derivatives (n, 2, k) by parameter slice."""
        import cv2

        pose, board = (
            self.places[f"pose_{sight.pose + 1}", "motion"],
            values[self.places[f"pose_{sight.pose + 1}", "motion"]],
        )
        motion, chains = board, [(pose, np.eye(6))]
        if sight.device != "camera":
            device = self.places[sight.device, "motion"]
            projector = values[device]
            found = cv2.composeRT(board[:3], board[3:], projector[:3], projector[3:])
            motion = np.concatenate([found[0].ravel(), found[1].ravel()])
            by = [np.hstack([np.asarray(d) for d in row]) for row in (found[2:6], found[6:10])]
            both = np.vstack(by)  # rows: rotation and translation; columns: six of the board, then six of the projector
            chains = [(pose, both[:, :6]), (device, both[:, 6:])]
        lens = self.places[sight.device, "lens"]
        fx, fy, cx, cy, *distortion = values[lens]
        matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
        coefficients = np.array([*distortion, 0.0][:5])
        seen, slope = cv2.projectPoints(sight.board_mm, motion[:3], motion[3:], matrix, coefficients)
        slope = slope.reshape(len(sight.board_mm), 2, -1)
        moved, optics = slope[:, :, :6], slope[:, :, 6 : 6 + lens.stop - lens.start]
        return seen.reshape(-1, 2), [(lens, optics), *((place, moved @ chain) for place, chain in chains)]
