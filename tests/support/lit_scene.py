"""A scene that one projector lights with whatever its window shows, and a webcam that looks at it.

The image is made pixel by pixel from the geometry of the bench: which point of the projector lights the surface there,
what the window shows at that point, and what the camera makes of the light. Nothing of the fringes is known here, so
that a walk through the commands is tested as with devices.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.config import Device, Fringes, SystemConfig
from quadfringe.data import Truth
from quadfringe.devices.virtual import VirtualBench
from support.screens import FakeWindow
from support.videos import FakeCapture

CAMERA = Device(
    width_px=512,
    height_px=384,
    focal_px=(1290.0, 1291.0),
    centre_px=(257.0, 189.0),
    distortion=(-0.05, 0.02, 2e-4, -3e-4, 0.0),
)
TURN = (np.cos(0.322), np.sin(0.322))
# A projector of 1280 x 720 pixels, 270 mm from the camera, turned to the scene at 800 mm.
PROJECTOR = Device(
    width_px=1280,
    height_px=720,
    focal_px=(1850.0, 1847.0),
    centre_px=(640.0, 362.0),
    distortion=(-0.03, 0.01, 0.0, 0.0, 0.0),
    rotation=((TURN[0], 0.0, TURN[1]), (0.0, 1.0, 0.0), (-TURN[1], 0.0, TURN[0])),
    translation_mm=(-252.6, 6.0, -126.1),
)
GAMMA = (2.2, 2.1, 2.3)
# Rows: captured R, G, B; columns: projected R, G, B.
CROSSTALK = ((1.0, 0.12, 0.02), (0.10, 1.0, 0.14), (0.01, 0.08, 1.0))
AMBIENT, GAIN, NOISE = 0.01, 0.84, 0.006
FULL_EXPOSURE = 667.0  # four frames at 60 Hz, in units of 100 us


class LitScene:
    """The scene; `bench` places objects in it, as hands do."""

    def __init__(self) -> None:
        self.config = SystemConfig(camera=CAMERA, projector=PROJECTOR, fringes=Fringes(encoding="rgb"))
        self.bench = VirtualBench(self.config)
        self._seen: tuple[object, NDArray[np.float32], NDArray[np.float32]] | None = None
        self._noise = np.random.default_rng(3).normal(0, NOISE, (400, 520, 3)).astype(np.float32)
        self._random = np.random.default_rng(4)

    @property
    def truth(self) -> Truth:
        """The true points of what is in front of the camera."""
        return self.bench._seen_at().truth

    def photograph(self, window: NDArray[np.uint8], exposure: float) -> NDArray[np.uint8]:
        """Give what the webcam sees of the scene under this image (rows, columns, RGB): blue, green, red of 8 bit."""
        pixels, albedo = self._geometry()
        sent = (window.astype(np.float32) / 255) ** np.float32(GAMMA)
        lit = cv2.remap(sent, pixels, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        light = 0.0 if self.bench.capped else albedo * (lit @ np.float32(CROSSTALK).T + np.float32(AMBIENT))
        image = cv2.GaussianBlur(np.float32(exposure * GAIN * light) * np.ones_like(lit), (0, 0), 0.5)
        y, x = self._random.integers(0, (16, 8))
        height, width = image.shape[:2]
        image += self._noise[y : y + height, x : x + width] * self._random.choice([-1, 1])
        return np.clip(np.rint(255 * (image + 0.008)), 0, 255).astype(np.uint8)[:, :, ::-1]

    def _geometry(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Give the projector pixel (H, W, 2) that lights each pixel, outside the image in shadow, and its albedo."""
        placed = self.bench._placed
        if self._seen is None or self._seen[0] is not placed:
            cast = self.bench._seen_at().cast
            points = cast.xyz_mm().astype(np.float64)
            lost = np.isnan(points).any(axis=2) | cast.shadow()
            matrix = np.array([[PROJECTOR.focal_px[0], 0, PROJECTOR.centre_px[0]], [0, 0, 0], [0, 0, 1.0]])
            matrix[1] = (0, PROJECTOR.focal_px[1], PROJECTOR.centre_px[1])
            turn = cv2.Rodrigues(np.array(PROJECTOR.rotation))[0]
            flat = np.nan_to_num(points.reshape(-1, 1, 3), nan=800.0)
            shift = np.array(PROJECTOR.translation_mm)
            pixels = cv2.projectPoints(flat, turn, shift, matrix, np.array(PROJECTOR.distortion))[0]
            pixels = pixels.reshape(*points.shape[:2], 2).astype(np.float32)
            pixels[lost] = -10
            flat_white = np.full((*points.shape[:2], 3), 0.85, np.float32)
            printed = None if placed is None or placed.albedo is None else placed.albedo[:, :, :3]
            self._seen = placed, pixels, flat_white if printed is None else printed
        return self._seen[1], self._seen[2]


class Webcam(FakeCapture):
    """A webcam that OpenCV opens, which looks at the scene that the first window lights."""

    def __init__(self, scene: LitScene, windows: list[FakeWindow]) -> None:
        super().__init__(("YUYV",))
        self._scene, self._windows = scene, windows
        self.controls |= {
            cv2.CAP_PROP_FRAME_WIDTH: CAMERA.width_px,
            cv2.CAP_PROP_FRAME_HEIGHT: CAMERA.height_px,
            cv2.CAP_PROP_EXPOSURE: FULL_EXPOSURE,
            cv2.CAP_PROP_GAMMA: 100,
        }

    def grab(self) -> bool:
        self.grabbed += 1
        return True

    def retrieve(self) -> tuple[bool, NDArray[np.uint8]]:
        exposure = self.controls[cv2.CAP_PROP_EXPOSURE] / FULL_EXPOSURE
        return True, self._scene.photograph(self._windows[-1].image, exposure)
