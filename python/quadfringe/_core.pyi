"""The compiled kernel, as Python sees it. Private: use the names of `quadfringe`.

Every array is (H, W) or (H, W, C); NaN is no data. A value that cannot be used is a ValueError, an array of the
wrong type a TypeError; both say what was expected and what came. The GIL is released while the kernel works.
"""

from collections.abc import Sequence
from typing import Any, Final, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Bench",
    "Cast",
    "Decoder",
    "Device",
    "__version__",
    "background",
    "carrier",
    "check_code",
    "estimate_response",
    "fourier",
    "linear_light",
    "linear_light_bayer",
    "n_step",
    "optimum",
    "pattern",
    "two_step",
    "unwrap",
]

__version__: Final[str]

_Vector2 = tuple[float, float]
_Vector3 = tuple[float, float, float]
_Vector5 = tuple[float, float, float, float, float]
_Matrix3 = tuple[_Vector3, _Vector3, _Vector3]

@final
class Device:
    """A camera or a projector: pinhole, OpenCV distortion, and the pose P_device = rotation P_camera + translation_mm.

    Raises ValueError for a size of zero, a focal length that is not positive, numbers that are not finite, and a
    rotation that is none within 1e-6.
    """

    def __new__(
        cls,
        width: int,
        height: int,
        focal_px: _Vector2,
        centre_px: _Vector2,
        *,
        distortion: _Vector5 = ...,
        rotation: _Matrix3 = ...,
        translation_mm: _Vector3 = ...,
    ) -> Device: ...
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def focal_px(self) -> _Vector2: ...
    @property
    def centre_px(self) -> _Vector2: ...
    @property
    def distortion(self) -> _Vector5: ...
    @property
    def rotation(self) -> _Matrix3: ...
    @property
    def translation_mm(self) -> _Vector3: ...
    def project(self, point_mm: _Vector3) -> _Vector2 | None:
        """Give the pixel (column, row) at which a point of the camera frame is seen; None when not in front."""

    def ray(self, pixel: _Vector2) -> tuple[_Vector3, _Vector3]:
        """Give origin (mm) and unit direction, in the camera frame, of the ray of a pixel (column, row)."""

@final
class Bench:
    """The virtual bench: a camera and two projectors. What is absent is the published geometry."""

    def __new__(
        cls,
        *,
        camera: Device | None = None,
        visible: Device | None = None,
        infrared: Device | None = None,
        layout: str = "regular",
    ) -> Bench: ...
    @property
    def camera(self) -> Device: ...
    @property
    def visible(self) -> Device: ...
    @property
    def infrared(self) -> Device: ...
    def cast(self, surface: str, *, time_s: float = 0.0) -> Cast:
        """Send one ray through each pixel of the scene with this name; ValueError lists the names."""

    def cast_peaks(self, *, z_mm: float, scale_mm: float) -> Cast:
        """Send one ray through each pixel of the peaks function times `scale_mm` over the plane z."""

    def cast_height_map(
        self, heights_mm: NDArray[np.float64], *, pitch_mm: _Vector2, origin_mm: _Vector2, z_mm: float
    ) -> Cast:
        """Send one ray through each pixel of a relief over the plane z, (rows, columns) float64 mm."""

    def render(self, cast: Cast, fringe_numbers: _Vector3, **options: Any) -> dict[str, NDArray[Any]]:
        """Give red, green, blue, ir of a shot, (H, W) uint8 or uint16 by `bit_depth`; raw and ir with `bayer`.

        Options are those of `quadfringe.SceneConfig`; an option that is not known is a TypeError.
        """

    def render_step(
        self, cast: Cast, fringe_number: float, shift_rad: float, **options: Any
    ) -> dict[str, NDArray[Any]]:
        """Give the images with the same fringes in each channel: one step of an N-step capture."""

@final
class Cast:
    """A scene as the bench sees it, and the truth to judge by."""

    def xyz_mm(self) -> NDArray[np.float32]:
        """Give the points in the camera frame, (H, W, 3) mm, NaN where nothing is seen."""

    def column_px(self) -> NDArray[np.float32]:
        """Give the column of the visible projector that lights each pixel, (H, W), NaN in the dark."""

    def shadow(self) -> NDArray[np.bool_]:
        """Tell where a surface is seen that a projector does not light, (H, W)."""

    def edge_distance_px(self) -> NDArray[np.float32]:
        """Give the distance to the nearest edge of depth, light or surface, (H, W) pixels."""

@final
class Decoder:
    """Decodes shots of one size; planned and checked when made.

    What is absent takes the kernel's default. Raises ValueError when the fringe numbers do not cover the projector
    or a setting is out of range.
    """

    def __new__(
        cls,
        shape: tuple[int, int],
        fringe_numbers: _Vector3,
        projector_width: int,
        *,
        full_scale: float | None = None,
        method: str | None = None,
        modulation_min: float | None = None,
        quality_min: float | None = None,
        period_px: float | None = None,
        threads: int | None = None,
        dark: Sequence[float] | None = None,
        response: Sequence[_Vector3] | None = None,
        crosstalk: Sequence[Sequence[float]] | None = None,
        ir_registration: Sequence[Sequence[float]] | None = None,
        camera: Device | None = None,
        projector: Device | None = None,
    ) -> Decoder: ...
    def settings(self) -> dict[str, str | float | None]:
        """Give method, modulation_min, quality_min and period_px (None: from every shot), defaults included."""

    def decode(
        self, red: NDArray[Any], green: NDArray[Any], blue: NDArray[Any], ir: NDArray[Any]
    ) -> dict[str, NDArray[np.float32]]:
        """Give phase_rad, column_px, order, modulation, quality, and xyz_mm (H, W, 3) when devices are known.

        The images are (H, W) uint8, uint16 or float32, all of one type; strided views are welcome, nothing is
        copied. Raises TypeError for another type, ValueError for another size or values that are not finite.
        """

    def decode_bayer(self, raw: NDArray[Any], bayer: str, ir: NDArray[Any]) -> dict[str, NDArray[np.float32]]:
        """Give the same maps from the raw mosaic of a Bayer chip (rggb, grbg, gbrg or bggr) and an infrared image.

        Images and errors as those of `decode`; ValueError for another pattern.
        """

def optimum(n: int, projector_width: int) -> _Vector3:
    """Give the fringe numbers N, N - 1, N - sqrt(N); ValueError unless N is a perfect square that fits."""

def check_code(fringe_numbers: _Vector3, projector_width: int) -> float:
    """Give the ambiguity margin in rad; ValueError when the joint range does not cover the projector."""

def pattern(
    channel: str, fringe_numbers: _Vector3, width: int, height: int, *, layout: str = "regular"
) -> NDArray[np.float32]:
    """Give the ideal image of channel R, G, B or IR, (height, width), linear light from 0 to 1."""

def linear_light(
    red: NDArray[Any],
    green: NDArray[Any],
    blue: NDArray[Any],
    ir: NDArray[Any],
    *,
    full_scale: float | None = None,
    dark: Sequence[float] | None = None,
    response: Sequence[_Vector3] | None = None,
    crosstalk: Sequence[Sequence[float]] | None = None,
    ir_registration: Sequence[Sequence[float]] | None = None,
) -> dict[str, NDArray[np.float32]]:
    """Give red, green, blue, ir as linear light, fractions of full scale; NaN where the infrared chip sees nothing.

    Images and errors as those of `Decoder.decode`.
    """

def linear_light_bayer(
    raw: NDArray[Any],
    bayer: str,
    ir: NDArray[Any],
    *,
    full_scale: float | None = None,
    dark: Sequence[float] | None = None,
    response: Sequence[_Vector3] | None = None,
    crosstalk: Sequence[Sequence[float]] | None = None,
    ir_registration: Sequence[Sequence[float]] | None = None,
) -> dict[str, NDArray[np.float32]]:
    """Give the same of a raw mosaic: each colour at every pixel, interpolated from its own samples.

    Images and errors as those of `Decoder.decode_bayer`.
    """

def background(image: NDArray[np.float32], period_px: float, *, kind: str | None = None) -> NDArray[np.float32]:
    """Give the background of every row; `kind` is mean_envelope (as published) or moving_mean."""

def carrier(image: NDArray[np.float32]) -> _Vector2:
    """Give the fringe period in camera pixels along rows and along columns; infinite where there is none."""

def two_step(red: NDArray[np.float32], blue: NDArray[np.float32]) -> NDArray[np.float32]:
    """Give the wrapped phase in rad of red and blue without their backgrounds, of equal modulation (S2)."""

def fourier(
    image: NDArray[np.float32], period_px: float, *, band: str | None = None, kind: str | None = None
) -> NDArray[np.float32]:
    """Give the wrapped phase in rad of fringes along the rows (S3); `band` is traditional or improved."""

def n_step(
    stack: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Give wrapped phase in rad, background and modulation of equal steps over one period, (steps, H, W)."""

def unwrap(
    first: NDArray[np.float32],
    second: NDArray[np.float32],
    third: NDArray[np.float32],
    fringe_numbers: _Vector3,
    projector_width: int,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Give absolute phase in rad and order margin in [0, 1] from three wrapped phases, point by point (S4)."""

def estimate_response(stacks: Sequence[NDArray[np.float32]]) -> dict[str, float]:
    """Give offset, exponent, knee, two_step_rms_before_rad, two_step_rms_after_rad and pixels of N-step stacks.

    Each stack is (steps, H, W) in fractions of full scale. ValueError when a stack is out of order, too dark,
    saturated or without fringes.
    """
