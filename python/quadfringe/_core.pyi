"""The compiled kernel, as Python sees it. Private: use the names of `quadfringe`.

Every array is (H, W) or (H, W, C); NaN is no data. A value that cannot be used raises ValueError, an array of the
wrong type TypeError; both name the expected and the actual value. The kernel works without the GIL.
"""

from collections.abc import Sequence
from typing import Any, Final, Self, TypedDict, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "REASONS",
    "THREADS_MAX",
    "Bench",
    "Cast",
    "Decoder",
    "Device",
    "LightCrafter",
    "PairTable",
    "Pattern",
    "PatternSequence",
    "PatternWindow",
    "PolynomialHeight",
    "StepDecoder",
    "__profile__",
    "__version__",
    "background",
    "block_means",
    "block_size",
    "carrier",
    "check_code",
    "columns_from_phase",
    "crc32",
    "discard_invalid",
    "estimate_response",
    "estimate_response_of_shot",
    "exposure_in_frame_us",
    "fill_gaps",
    "fourier",
    "fourier_pair",
    "fringe_offsets",
    "lightcrafters",
    "linear_light",
    "linear_light_bayer",
    "mesh_from_points",
    "modulation_ratio",
    "n_step",
    "nearest_turn",
    "normals_from_points",
    "optimum",
    "outputs",
    "pack_flash",
    "pattern",
    "power_on_drive",
    "predeform",
    "row_period",
    "shared_brightness",
    "step_pattern",
    "two_step",
    "udev_rule",
    "unwrap",
    "wrong_order_probability",
    "xyz_from_column",
]

__profile__: Final[str]
THREADS_MAX: Final[int]
REASONS: Final[list[str]]
__version__: Final[str]

_Vector2 = tuple[float, float]
_Vector3 = tuple[float, float, float]
_Vector4 = tuple[float, float, float, float]
_Vector5 = tuple[float, float, float, float, float]
_Numbers = Sequence[float]  # of R with B, of G, and of IR if there is any
_Matrix3 = tuple[_Vector3, _Vector3, _Vector3]
_Bytes3 = tuple[int, int, int]

class _Status(TypedDict):
    initialised: bool
    memory_passed: bool
    parked: bool
    running: bool
    frozen: bool
    gamma: bool
    power: str
    mode: str
    run: str
    input: str
    video_locked: bool
    video: str
    faults: list[str]

class _Triggers(TypedDict):
    out_1_inverted: bool
    out_1_rising_us: float
    out_1_falling_us: float
    out_2_inverted: bool
    out_2_rising_us: float
    in_1_delay_us: float
    in_2_falling: bool

@final
class Device:
    """A camera or a projector: pinhole, OpenCV distortion, and the pose P_device = rotation P_camera + translation_mm.

    Raises ValueError for a size of zero, a focal length that is not positive, numbers that are not finite, and a
    matrix that is not a rotation within 1e-6.
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

    def through_plane(self, position: _Vector2, other: Device, z_mm: float) -> _Vector2 | None:
        """Map a position to `other` through the point of the plane z that it sees or lights; None if there is none."""

@final
class Bench:
    """The virtual bench: a camera and two projectors. An argument that is absent is that of the published geometry."""

    def __new__(
        cls,
        *,
        camera: Device | None = None,
        visible: Device | None = None,
        infrared: Device | None = None,
        layout: str = "regular",
        infrared_from_visible: Sequence[Sequence[float]] | None = None,
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

    def cast_plane(self, *, point_mm: _Vector3, normal: _Vector3) -> Cast:
        """Send one ray through each pixel of a plane through a point; its normal points to the camera."""

    def cast_plate(self, low_mm: _Vector2, high_mm: _Vector2, rotation: _Matrix3, translation_mm: _Vector3) -> Cast:
        """Send one ray through each pixel of a plate between two corners (x, y), on z = 0 of a posed board.

        The pose is T_camera_board, row by row and in mm; the face looks towards negative z of the board.
        """

    def printed(
        self,
        coverage: NDArray[np.float32],
        *,
        pitch_mm: float,
        origin_mm: _Vector2,
        paper: Sequence[float],
        ink: Sequence[float],
        rotation: _Matrix3,
        translation_mm: _Vector3,
    ) -> NDArray[np.float32]:
        """Give the albedo that the camera sees of a print: the option `albedo` of `render`.

        `coverage` is (rows, columns) float32, 1 where there is ink; `origin_mm` is the centre of its first texel on
        z = 0 of the board, in the pose of `cast_plate`; `paper` and `ink` are albedos of R, G, B, IR. It is (H, W, 4),
        or (H, W, 8) when the infrared chip is registered apart; its albedos are then the last four.
        """

    def render(
        self,
        cast: Cast,
        fringe_numbers: _Numbers,
        *,
        columns_px: _Vector2 | None = None,
        infrared_image: NDArray[np.float32] | None = None,
        **options: Any,
    ) -> dict[str, NDArray[Any]]:
        """Give red, green, blue, ir of a shot, (H, W) uint8 or uint16 by `bit_depth`; raw and ir with `bayer`.

        The infrared projector shows its fringes, or `infrared_image` (rows, columns), linear light from 0 to 1. With
        the fringe numbers of three colours it is dark. `columns_px` are the first and the last column that can light
        the scene. Options are those of `quadfringe.SceneConfig`; `albedo` may be an image (H, W, 4) float32 too. An
        unknown option raises TypeError.
        """

    def render_step(
        self,
        cast: Cast,
        fringe_number: float,
        shift_rad: float,
        *,
        axis: str = "columns",
        beam: str | None = None,
        **options: Any,
    ) -> dict[str, NDArray[Any]]:
        """Give the images with the same fringes in each channel: one step of an N-step capture.

        Fringes count over "columns" or "rows"; with a `beam`, visible or infrared, the other projector is dark.
        """

    def render_levels(self, cast: Cast, levels: _Vector4, **options: Any) -> dict[str, NDArray[Any]]:
        """Give the images with each channel (R, G, B, IR) lit evenly at its level, 0 to 1."""

@final
class Cast:
    """A scene as the bench sees it, and the truth to judge by."""

    def xyz_mm(self) -> NDArray[np.float32]:
        """Give the points in the camera frame, (H, W, 3) mm, NaN where nothing is seen."""

    def column_px(self, *, infrared: bool = False) -> NDArray[np.float32]:
        """Give the column of the visible (or infrared) projector that lights each pixel, (H, W), NaN in the dark."""

    def shadow(self) -> NDArray[np.bool_]:
        """Give the mask of visible surface that at least one projector does not light, (H, W)."""

    def is_near_edge(self, reach_px: float) -> NDArray[np.bool_]:
        """Give the mask of pixels less than `reach_px` from an edge of depth, light or surface, (H, W)."""

    def edge_distance_px(self) -> NDArray[np.float32]:
        """Give the distance to the nearest edge of depth, light or surface, (H, W) pixels."""

@final
class Decoder:
    """Decodes shots of one size and one encoding; planned and checked when made.

    Three fringe numbers are those of R with B, of G and of IR, two those of R with B and of G without infrared, and
    three and 0 those of R, G and B with a number each. With `columns_px`, the first and the last column that can light
    the scene, only these must differ in their phases.
    An argument that is absent takes the kernel's default. `method` is "joint" ("best" is read as "joint") or
    "published". With `camera`, `projector` and `infrared` the infrared fringes are known along the camera rays, of an
    image plain or pre-deformed, for a range of depths or all of them; the published method searches orders in it alone;
    `channel_instants_us` and `detail` are options of the joint method. Raises ValueError when the fringe numbers do not
    cover the projector, a setting is out of range, or an option is not one of the method.
    """

    def __new__(
        cls,
        shape: tuple[int, int],
        fringe_numbers: _Numbers,
        projector_width: int,
        *,
        columns_px: _Vector2 | None = None,
        full_scale: float | None = None,
        method: str | None = None,
        modulation_min: float | None = None,
        quality_min: float | None = None,
        period_px: float | _Vector2 | None = None,
        channel_instants_us: Sequence[float] | None = None,
        albedo: bool | None = None,
        detail: float | None = None,
        threads: int | None = None,
        dark: Sequence[float] | None = None,
        response: Sequence[_Vector3] | None = None,
        crosstalk: Sequence[Sequence[float]] | None = None,
        projector_response: Sequence[_Vector3] | None = None,
        ir_registration: Sequence[Sequence[float]] | None = None,
        camera: Device | None = None,
        projector: Device | None = None,
        infrared: Device | None = None,
        predeformed_z_mm: float | None = None,
        depth_range_mm: _Vector2 | None = None,
    ) -> Decoder: ...
    def settings(self) -> dict[str, str | float | list[float] | None]:
        """Give every setting in force, defaults included, and `method_version`, for saved results.

        With `period_px` None the fringe period is estimated from every shot. A pair states the shortest and longest.
        """

    def decode(
        self, red: NDArray[Any], green: NDArray[Any], blue: NDArray[Any], ir: NDArray[Any] | None = None
    ) -> dict[str, NDArray[Any]]:
        """Give maps (H, W) by name, float32 but for reason (uint8).

        phase_rad, column_px, modulation, quality, wrong_order_probability and uncertainty_rad (of the phase);
        when devices are known uncertainty_mm (of the depth) in place of the last, and xyz_mm (H, W, 3); with method
        joint, unless `albedo` is False, albedo (H, W, 4), the light of R, G, B, IR without fringes, where IR is NaN
        without that channel; and reason, why
        there is no data, a value of `quadfringe.Reason`.

        The images are (H, W) uint8, uint16 or float32, all of one type; strided views are welcome, nothing is
        copied. Raises TypeError for another type, ValueError for another size, values that are not finite, and
        channels that are not those of the encoding.
        """

    def decode_bayer(self, raw: NDArray[Any], bayer: str, ir: NDArray[Any] | None = None) -> dict[str, NDArray[Any]]:
        """Give the same maps from the raw mosaic of a Bayer chip (rggb, grbg, gbrg or bggr) and an infrared image.

        Images and errors as those of `decode`; ValueError for another pattern.
        """

@final
class StepDecoder:
    """Decodes N-step images of one size at several fringe numbers; planned and checked when made.

    `steps` holds the number of steps of each fringe number, 3 or more; `columns_px` the first and the last projector
    column that can be seen. An argument that is absent takes the kernel's default. Raises ValueError when the fringe
    numbers do not distinguish these columns, or a setting is out of range.
    """

    def __new__(
        cls,
        shape: tuple[int, int],
        fringe_numbers: Sequence[float],
        steps: Sequence[int],
        projector_width: int,
        *,
        full_scale: float | None = None,
        modulation_min: float | None = None,
        saturation: float | None = None,
        response: _Vector3 | None = None,
        columns_px: _Vector2 | None = None,
        threads: int | None = None,
        camera: Device | None = None,
        projector: Device | None = None,
    ) -> StepDecoder: ...
    def settings(self) -> dict[str, str | float | list[float] | None]:
        """Give every setting in force, defaults included, and `method_version`, for saved results."""

    def decode(self, stacks: Sequence[NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Give maps (H, W) by name, as `Decoder.decode`, from one stack (steps, H, W) for each fringe number.

        The stacks are uint8, uint16 or float32, all of one type; nothing is copied. Raises TypeError for another type,
        ValueError for other numbers of steps, another size or values that are not finite.
        """

def optimum(n: int, projector_width: int) -> _Vector3:
    """Give the fringe numbers N, N - 1, N - sqrt(N); ValueError unless N is a perfect square that fits."""

def check_code(fringe_numbers: _Numbers, projector_width: int, *, columns_px: _Vector2 | None = None) -> float:
    """Give the ambiguity margin in rad; ValueError when the joint range does not cover the columns that light."""

def pattern(
    channel: str,
    fringe_numbers: _Numbers,
    width: int,
    height: int,
    *,
    layout: str = "regular",
    columns_px: _Vector2 | None = None,
) -> NDArray[np.float32]:
    """Give the ideal image of channel R, G, B or IR, (height, width), linear light from 0 to 1."""

def predeform(
    visible: Device, infrared: Device, fringe_number: float, *, z_mm: float, layout: str = "regular"
) -> NDArray[np.float32]:
    """Give the image with which the infrared projector lights the plane z as the visible one would (S11).

    (height, width) of the infrared projector, linear light from 0 to 1, 0 where a mirror misses the plane. Both lens
    distortions and the layout of the mirrors are taken into account.
    """

@final
class PairTable:
    """The infrared phase along every camera ray, for calibrated projectors wherever they stand; planned once.

    Raises ValueError when the devices cannot triangulate, when the fringes do not cover the visible projector, and for
    a `depth_range_mm` that does not grow.
    """

    def __new__(
        cls,
        camera: Device,
        visible: Device,
        infrared: Device,
        fringe_numbers: _Numbers,
        *,
        predeformed_z_mm: float | None = None,
        depth_range_mm: _Vector2 | None = None,
    ) -> PairTable: ...
    def infrared_rad(self, phase_rad: NDArray[np.float32]) -> NDArray[np.float32]:
        """Give the infrared phase, not wrapped, where the first absolute phase is known, both (H, W) rad."""

    def unwrap(
        self,
        first: NDArray[np.float32],
        second: NDArray[np.float32],
        third: NDArray[np.float32],
        *,
        rows: int = 1,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Give absolute phase in rad and margin in [0, 1], as `unwrap` does, but searched along the camera rays.

        With `rows`, the maps hold one row for each block of so many rows of the camera image.
        """

def step_pattern(
    fringe_number: float, shift_rad: float, width: int, height: int, *, axis: str = "columns", layout: str = "regular"
) -> NDArray[np.float32]:
    """Give the ideal image of one step of an N-step capture, (height, width), linear light from 0 to 1.

    Fringes count over the "columns" or the "rows" of mirrors in the layout.
    """

def mesh_from_points(
    xyz_mm: NDArray[np.float32],
    uncertainty_mm: NDArray[np.float32] | None = None,
    *,
    step: int | None = None,
    holes_px: int | None = None,
) -> dict[str, NDArray[Any]]:
    """Triangulate points (H, W, 3) on the grid of pixels, with the standard deviation of their depth (H, W).

    Gives pixels (M, 2) uint32, points_mm and normals (M, 3) float32, normal_uncertainty_rad (M,) float32 and filled
    (M,) bool of the vertices, and faces (F, 3) uint32. Raises ValueError for maps of unequal size and numbers out of
    range.
    """

def normals_from_points(
    xyz_mm: NDArray[np.float32], uncertainty_mm: NDArray[np.float32] | None = None
) -> dict[str, NDArray[np.float32]]:
    """Give the normals (H, W, 3) of points, and their uncertainty_rad (H, W); errors as `mesh_from_points`."""

def linear_light(
    red: NDArray[Any],
    green: NDArray[Any],
    blue: NDArray[Any],
    ir: NDArray[Any] | None = None,
    *,
    full_scale: float | None = None,
    dark: Sequence[float] | None = None,
    response: Sequence[_Vector3] | None = None,
    crosstalk: Sequence[Sequence[float]] | None = None,
    projector_response: Sequence[_Vector3] | None = None,
    ir_registration: Sequence[Sequence[float]] | None = None,
) -> dict[str, NDArray[np.float32]]:
    """Give red, green, blue, ir as linear light, fractions of full scale; NaN where the infrared chip sees nothing.

    Without `ir` there are three.
    Images and errors as those of `Decoder.decode`.
    """

def linear_light_bayer(
    raw: NDArray[Any],
    bayer: str,
    ir: NDArray[Any] | None = None,
    *,
    full_scale: float | None = None,
    dark: Sequence[float] | None = None,
    response: Sequence[_Vector3] | None = None,
    crosstalk: Sequence[Sequence[float]] | None = None,
    projector_response: Sequence[_Vector3] | None = None,
    ir_registration: Sequence[Sequence[float]] | None = None,
) -> dict[str, NDArray[np.float32]]:
    """Give the same of a raw mosaic: each colour at every pixel, interpolated from samples of that colour alone.

    Images and errors as those of `Decoder.decode_bayer`.
    """

def crc32(image: NDArray[np.uint8]) -> int:
    """Give the CRC-32 of the bytes of an image, as zlib's but faster."""

def background(image: NDArray[np.float32], period_px: float, *, kind: str | None = None) -> NDArray[np.float32]:
    """Give the background of every row; `kind` is mean_envelope (as published) or moving_mean."""

def carrier(image: NDArray[np.float32]) -> _Vector2:
    """Give the fringe period in camera pixels along rows and along columns; infinite where there is none."""

def row_period(image: NDArray[np.float32]) -> float:
    """Give the fringe period along the rows in camera pixels, as the published decoder estimates it from red light.

    It lies between 3 and the width of the image, which it is when no carrier stands out.
    """

def block_size(green_period_px: float, infrared_period_px: float, width: int) -> tuple[int, int]:
    """Give rows and columns of the blocks whose means the published decoder works on, from the fringe periods."""

def block_means(image: NDArray[np.float32], rows: int, columns: int) -> NDArray[np.float32]:
    """Give the means over blocks of pixels, (ceil(H / rows), W // columns).

    ValueError unless `columns` is a power of two.
    """

def fill_gaps(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """Give the image with each NaN replaced by the last value to its left, or the first one to its right."""

def modulation_ratio(red: NDArray[np.float32], blue: NDArray[np.float32]) -> NDArray[np.float32]:
    """Give the modulation of red over that of blue for each row, (H,), both without their backgrounds."""

def two_step(red: NDArray[np.float32], blue: NDArray[np.float32], *, coarse: bool = False) -> NDArray[np.float32]:
    """Give the wrapped phase in rad of red and blue without their backgrounds, of equal modulation (S2).

    The error of the arctangent is at most 4e-7 rad, with `coarse` 1.3e-5 rad, which is enough to select fringe orders.
    """

def fourier_pair(
    first: NDArray[np.float32],
    second: NDArray[np.float32],
    periods: tuple[float, float],
    columns: int,
    width: int,
) -> tuple[
    tuple[NDArray[np.float32], NDArray[np.float32]],
    tuple[NDArray[np.float32], NDArray[np.float32]],
]:
    """Give phase in rad and modulation, (B, width), of two sets of fringes without background (S3).

    Both are means over blocks `columns` wide, (B, width // columns), whose `periods` are in samples. They share one
    Fourier transform.
    """

def nearest_turn(wrapped_rad: NDArray[np.float32], estimate_rad: NDArray[np.float32]) -> NDArray[np.float32]:
    """Give the wrapped phase with the turns that bring it nearest to an estimate of the absolute phase, in rad."""

def discard_invalid(
    phase_rad: NDArray[np.float32],
    margin: NDArray[np.float32],
    modulation: NDArray[np.float32],
    *,
    modulation_min: float,
    quality_min: float,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Give phase and quality: NaN where the modulation is too low, the phase also where the margin is too low."""

def columns_from_phase(
    phase_rad: NDArray[np.float32], fringe_numbers: _Numbers, projector_width: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Give absolute phase in rad and projector column, both NaN where no column of the projector lights the pixel."""

def wrong_order_probability(quality: NDArray[np.float32]) -> NDArray[np.float32]:
    """Give the probability in [0, 1] that the order of each pixel is wrong, from the margins of a whole shot."""

def fourier(
    image: NDArray[np.float32], period_px: float, *, band: str | None = None, kind: str | None = None
) -> NDArray[np.float32]:
    """Give the wrapped phase in rad of fringes along the rows (S3); `band` is traditional or improved."""

def fringe_offsets(
    light: NDArray[np.float32], phase_rad: NDArray[np.float32], brightness: NDArray[np.float32] | None = None
) -> NDArray[np.float64]:
    """Give the angle in rad, (T,), by which fringes lie off a phase, in linear light and phase of tiles, (T, N).

    A tile has one albedo, or that of `brightness`, (T, N), up to a factor, whichever explains its light better. NaN
    does not count; a tile without light gives 0. ValueError when the shapes differ.
    """

def shared_brightness(
    red: NDArray[np.float32], blue: NDArray[np.float32], phase_rad: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Give the albedo of the pixels of tiles, (T, N), up to a factor, from R and B in quadrature, linear light.

    0 for a pixel that is NaN in one of them. ValueError when the shapes differ.
    """

def n_step(
    stack: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Give wrapped phase in rad, background and modulation of equal steps over one period, (steps, H, W)."""

def unwrap(
    first: NDArray[np.float32],
    second: NDArray[np.float32],
    third: NDArray[np.float32],
    fringe_numbers: _Numbers,
    projector_width: int,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Give absolute phase in rad and order margin in [0, 1] from three wrapped phases, point by point (S4).

    With two fringe numbers the third phase is not read; with three and 0 it is that of B.
    """

def estimate_response(stacks: Sequence[NDArray[np.float32]]) -> dict[str, float]:
    """Give offset, exponent, knee and figures of their quality, from N-step stacks.

    `two_step_rms_before_rad` and `two_step_rms_after_rad` are those of two steps, without and with the correction,
    `second_harmonic_before` and `second_harmonic_after` the second harmonic over the first one, of the sign of a gamma
    above 1; `exponent_sd` is the standard error of the exponent, and `pixels` counts the pixels.
    Each stack is (steps, H, W) in fractions of full scale. ValueError when a stack is out of order, too dark,
    saturated or without fringes.
    """

def estimate_response_of_shot(
    red: NDArray[np.float32],
    green: NDArray[np.float32],
    blue: NDArray[np.float32],
    ir: NDArray[np.float32] | None,
    phase_rad: NDArray[np.float32],
    fringe_numbers: _Numbers,
    projector_width: int,
    *,
    columns_px: _Vector2 | None = None,
) -> dict[str, dict[str, float]]:
    """Give the figures of `estimate_response` by channel, from one captured shot and its decoded phase.

    A channel whose response does not differ from a straight line beyond doubt, or with too few fringes, is left out.
    `pixels` counts tiles.
    """

@final
class PolynomialHeight:
    """Height as a polynomial of the phase difference to a reference plane, for each pixel (S6).

    Made by `fit`, or from `reference_rad` and `coefficients` of an earlier one.
    """

    def __new__(cls, reference_rad: NDArray[np.float32], coefficients: NDArray[np.float64]) -> Self: ...
    @staticmethod
    def fit(
        reference_rad: NDArray[np.float32],
        heights_mm: Sequence[float],
        phases_rad: Sequence[NDArray[np.float32]],
        degree: int,
    ) -> PolynomialHeight:
        """Fit planes at known heights, with one absolute phase map (H, W) float32 for each.

        ValueError when there are fewer different heights than degree + 1, or a map has another size.
        """

    def reference_rad(self) -> NDArray[np.float32]:
        """Give the phase of the reference plane, (H, W)."""

    def coefficients(self) -> NDArray[np.float64]:
        """Give the coefficients, (H, W, degree + 1) in mm / rad^n; NaN where a pixel has none."""

    def height_from_phase(self, phase_rad: NDArray[np.float32]) -> NDArray[np.float32]:
        """Give heights in mm, (H, W); NaN where phase or coefficients have no data."""

def xyz_from_column(column_px: NDArray[np.float32], camera: Device, projector: Device) -> NDArray[np.float32]:
    """Triangulate a map of projector columns (S7): points in the camera frame, (H, W, 3) mm, NaN for no data."""

@final
class LightCrafter:
    """A LightCrafter 4500 on USB, named by bus and port path ("1-2"), by serial number, or as the only one.

    One command is in flight at a time, and every wait has a bound: 2 s for a reply, 10 s for a change of state. A wrong
    argument raises ValueError, a failure of the device OSError: FileNotFoundError when it is absent, PermissionError
    with the udev rule, TimeoutError, ConnectionError when it was unplugged. Opening sends nothing to the device.

    `light` is the light engine of TI's evaluation module ("evm") or another ("external"), whose `drive_limit` must be
    given before a drive is set. With `current_inverted` its register is 0 at full current, as in TI's engine.
    """

    def __new__(
        cls,
        port: str | None = None,
        *,
        serial: str | None = None,
        light: str = "evm",
        drive_limit: _Bytes3 | None = None,
        current_inverted: bool | None = None,
        trigger_invert_byte: int | None = None,
    ) -> Self: ...
    @property
    def port(self) -> str: ...
    def close(self) -> None:
        """Release the device, which keeps its current display; closing twice is allowed."""

    def __enter__(self) -> Self: ...
    def __exit__(self, *_exception: object) -> None: ...
    def status(self) -> _Status:
        """Give all status registers of the projector; `faults` lists the faults that they report."""

    def versions(self) -> dict[str, str]:
        """Give the versions of application, api, software and sequencer."""

    def firmware_tag(self) -> str:
        """Give the name of the firmware image."""

    def flash_image_count(self) -> int:
        """Give the number of images of 24 bit in flash."""

    def check_flash(self, images: int, tag: str | None = None) -> None:
        """Compare the number and tag of the flash images with the expected ones; ValueError names the difference."""

    def measure_image_load_ms(self, first: int, count: int) -> float:
        """Measure how long flash images take to load."""

    def wake(self) -> None:
        """Leave standby and wait for it."""

    def sleep(self) -> None:
        """Go to standby and wait for it."""

    def show_video(self) -> None:
        """Show the video input in linear light; OSError when it is not locked."""

    def show_test_pattern(self, name: str, *, foreground: _Bytes3 = ..., background: _Bytes3 = ...) -> None:
        """Show a picture of the generator; colours are red, green, blue from 0 to 1023."""

    def show_flash_image(self, image: int) -> None:
        """Show an image of flash as a still picture, in linear light."""

    def load(self, sequence: PatternSequence) -> list[str]:
        """Send a sequence and let the projector validate it; returns warnings, OSError names a refused sequence."""

    def play(self, sequence: PatternSequence) -> list[str]:
        """Load and start."""

    def start(self) -> None:
        """Start the loaded sequence, or go on after a pause."""

    def pause(self) -> None:
        """Hold the current pattern."""

    def stop(self) -> None:
        """Stop, and wait until nothing runs."""

    def set_timing(self, exposure_us: int, period_us: int | None = None) -> None:
        """Change exposure and period of the loaded sequence."""

    def led_drive(self) -> _Bytes3:
        """Give the brightness of red, green, blue: 0 is off, 255 full current."""

    def set_led_drive(self, drive: _Bytes3) -> None:
        """Set the brightness of red, green, blue; ValueError beyond the limit of the light engine."""

    def set_leds(self, leds: str | None) -> None:
        """Switch LEDs by hand ("rb"), or leave the choice to the patterns (None)."""

    def set_led_delays_us(self, rising_us: _Vector3, falling_us: _Vector3) -> None:
        """Delay switching on and off of red, green, blue."""

    def set_triggers(
        self,
        *,
        out_1_inverted: bool = False,
        out_1_rising_us: float = 0.0,
        out_1_falling_us: float = 0.0,
        out_2_inverted: bool = False,
        out_2_rising_us: float = 0.0,
        in_1_delay_us: float = 0.0,
        in_2_falling: bool = False,
    ) -> None:
        """Set all triggers; an argument that is absent is reset to its default."""

    def triggers(self) -> _Triggers:
        """Give the triggers to the nearest step."""

    def flips(self) -> tuple[bool, bool]:
        """Give two flags: the image is mirrored along the long axis, along the short axis."""

    def set_flips(self, long_axis: bool, short_axis: bool) -> None:
        """Mirror the image; in pattern mode from the next image on."""

    def set_gamma(self, table: int | None) -> None:
        """Bend video by table 0 or 1; None is linear light."""

    def set_inverted(self, inverted: bool) -> None:
        """Exchange dark and bright in all patterns."""

    def set_frozen(self, frozen: bool) -> None:
        """Hold the current image; new video frames are ignored."""

@final
class Pattern:
    """One pattern of a sequence: its number among those of its bit depth, and its LEDs (letters of "rgb").

    Raises ValueError for unknown letters or trigger ("internal", "rising", "falling", "continue").
    """

    def __new__(
        cls,
        number: int,
        bit_depth: int,
        leds: str,
        *,
        trigger: str = "internal",
        invert: bool = False,
        black_after: bool = False,
        next_image: bool = False,
        shares_exposure: bool = False,
    ) -> Self: ...

@final
class PatternSequence:
    """Patterns with their exposures and their trigger; ValueError names the rule that a sequence breaks.

    `timings_us` has exposure and period for all patterns, or one pair for each. The source is video (`frame_rate_hz`)
    or flash (`images` in the order of use).
    """

    def __new__(
        cls,
        patterns: Sequence[Pattern],
        timings_us: Sequence[tuple[int, int]],
        *,
        trigger_mode: str,
        frame_rate_hz: float | None = None,
        images: Sequence[int] | None = None,
        load_us: int | None = None,
        repeat: bool = True,
    ) -> Self: ...
    @staticmethod
    def from_video(patterns: Sequence[Pattern], frame_rate_hz: float, exposure_us: int) -> PatternSequence:
        """Give a sequence that shows the patterns in every video frame."""

    @staticmethod
    def from_flash(image: int, patterns: Sequence[Pattern], exposure_us: int) -> PatternSequence:
        """Give a sequence that shows the patterns of one flash image again and again."""

@final
class PatternWindow:
    """A borderless window that covers an output of `size_px` (W, H); without a name, the only one of this size.

    Without a size, that of a LightCrafter 4500, 912 x 1140.

    Raises ValueError when the output is absent, of another size or scaled; OSError without a display.
    """

    def __new__(cls, output: str | None = None, size_px: tuple[int, int] | None = None) -> Self: ...
    @property
    def output(self) -> str: ...
    @property
    def size_px(self) -> tuple[int, int]: ...
    @property
    def frame_rate_hz(self) -> float | None: ...
    def show(self, image: NDArray[np.uint8]) -> None:
        """Show red, green, blue, (H, W, 3) uint8, until the next image."""

    def close(self) -> None:
        """Close the window; closing twice is allowed."""

    def __enter__(self) -> Self: ...
    def __exit__(self, *_exception: object) -> None: ...

def lightcrafters() -> list[tuple[str, int, str | None]]:
    """Give port, address and serial number (None without permission) of every projector on the bus."""

def udev_rule() -> tuple[str, str]:
    """Give the file and the line that let every user open a projector on Linux."""

def power_on_drive() -> _Bytes3:
    """Give the LED drive after power-on, which is also the limit of TI's light engine."""

def exposure_in_frame_us(count: int, bit_depth: int, frame_rate_hz: float) -> int:
    """Give the exposure of each of `count` patterns that share a frame; ValueError when they do not fit."""

def pack_flash(patterns: Sequence[tuple[NDArray[np.uint8], int]]) -> tuple[list[bytes], list[tuple[int, int, int]]]:
    """Pack patterns, (1140, 912) uint8 with their bit depths, into BMP files of 24 bit for TI's program.

    Returns the files, and image, number and bit depth of each pattern.
    """

def outputs(size_px: tuple[int, int] | None = None) -> list[tuple[str, int, int, float | None, str | None]]:
    """Give name, width, height, frame rate in Hz, and why it cannot show this size (W, H), of every active output.

    Without a size, that of a LightCrafter 4500, 912 x 1140.
    """
