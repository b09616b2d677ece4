"""The published chain in plain NumPy and SciPy: the reference for times and results.

It is the method of "Single-shot 3D shape measurement of discontinuous objects based on a coaxial
fringe projection system" (Applied Optics, 2019), written as an experienced NumPy user would write it:
whole images at a time, no loops over pixels, default SciPy settings (one thread). `dtype` chooses
float32 (the default: the faster, so the harder to beat) or float64 (NumPy's default).
It is not slowed down on purpose. Equation numbers (S1) to (S8) refer to docs/method/equations.md.

Frames are (H, W); fringes are vertical or leaning, their phase grows along a row. No data is NaN.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage

Map = NDArray[np.floating[Any]]
Frame = NDArray[Any]  # u8, u16 or float 0..1
Matrix = NDArray[np.float64]

TAU = 2 * float(np.pi)
MODULATION_MIN = 0.02  # of full scale; darker fringes are no data


@dataclass(frozen=True)
class Result:
    """The result of one shot; every map is (H, W), NaN for no data."""

    phase_rad: Map  # absolute, of the first fringe number, 0 at projector column 0
    column_px: Map
    order: Map  # floor(phase_rad / 2 pi)
    modulation: Map  # of R and B, fraction of full scale
    quality: Map  # 0 = a rounding of the ladder was a coin toss, 1 = exact
    xyz_mm: Map | None  # (H, W, 3), camera frame


def unit_from_frame(frame: Frame, dtype: type[np.floating[Any]] = np.float32) -> Map:
    """Scale an integer frame to 0..1 of its full scale; a float frame is only cast."""
    unit: Map = frame.astype(dtype)
    if frame.dtype.kind == "u":
        unit *= 1.0 / float(np.iinfo(frame.dtype).max)
    return unit


def period_from_image(image: Map) -> float:
    """Mean fringe period along the rows (camera pixels): the peak of the mean row spectrum.

    Bins below 4 are background; every 8th row is enough for a peak.
    """
    spectrum = np.abs(fft.rfft(image[::8], axis=1)).mean(axis=0)
    spectrum[:4] = 0
    return float(image.shape[1] / int(spectrum.argmax()))


def envelope_mean_and_half(image: Map, period_px: float) -> tuple[Map, Map]:
    """Background and modulation from the mean envelope (S1, published way).

    The upper envelope runs through the fringe maxima, the lower through the minima: here a running
    maximum and minimum over a fifth more than one fringe (so that each window holds both), then a
    running mean over the same length to round the stairs. Half the sum of the two is the
    background a, half the difference the modulation b.
    """
    size = max(3, round(1.2 * period_px))
    upper = ndimage.maximum_filter1d(image, size, axis=1, mode="nearest")
    lower = ndimage.minimum_filter1d(image, size, axis=1, mode="nearest")
    mean = ndimage.uniform_filter1d(0.5 * (upper + lower), size, axis=1, mode="nearest")
    half = ndimage.uniform_filter1d(0.5 * (upper - lower), size, axis=1, mode="nearest")
    return mean, half


def two_step(red: Map, blue: Map, period_px: float) -> tuple[Map, Map]:
    """Give wrapped phase and modulation from two frames a quarter period apart (S2).

    Backgrounds are subtracted, signals divided by their modulations, which makes them equal; then
    R = cos(Phi), B = -sin(Phi), Phi = atan2(-B, R).
    """
    red_mean, red_half = envelope_mean_and_half(red, period_px)
    blue_mean, blue_half = envelope_mean_and_half(blue, period_px)
    tiny = 1e-6
    cosine = (red - red_mean) / np.maximum(red_half, tiny)
    sine = -(blue - blue_mean) / np.maximum(blue_half, tiny)
    return np.arctan2(sine, cosine), 0.5 * (red_half + blue_half)


def improved_ftp(image: Map, period_px: float) -> Map:
    """Give the wrapped phase of one frame by improved Fourier transform profilometry along rows (S3).

    With the background gone the band may reach from just above zero to twice the carrier.
    """
    mean, _ = envelope_mean_and_half(image, period_px)
    spectrum = fft.fft(image - mean, axis=1)
    carrier = round(image.shape[1] / period_px)
    spectrum[:, 0] = 0
    spectrum[:, 2 * carrier + 1 :] = 0
    phase: Map = np.angle(fft.ifft(spectrum, axis=1))
    return phase


def ladder(wrapped: tuple[Map, Map, Map], numbers: tuple[int, int, int]) -> tuple[Map, Map]:
    """Absolute phase of the first number and a quality 0..1: the ladder 1 -> s -> N, s^2 = N (S4).

    The beat of N and N - 1 is one fringe over the field and orders the beat of N and N - s
    (s fringes), which orders N. Each point stands alone; neighbours have no influence.
    """
    n = numbers[0]
    root = round(n**0.5)
    if root * root != n or numbers != (n, n - 1, n - root):
        raise ValueError(f"the ladder needs N, N - 1, N - sqrt(N); got {numbers}")
    first, second, third = wrapped
    one_fringe = np.mod(first - second, TAU)
    beat = np.mod(first - third, TAU)
    turns = (root * one_fringe - beat) / TAU
    whole = np.round(turns)
    doubt = np.abs(turns - whole)
    turns = (root * (beat + TAU * whole) - first) / TAU
    whole = np.round(turns)
    doubt = np.maximum(doubt, np.abs(turns - whole))
    return first + TAU * whole, 1 - 2 * doubt


@dataclass(frozen=True)
class Geometry:
    """Camera and projector without distortion: P_projector = rotation P_camera + translation_mm."""

    camera_k: Matrix
    projector_k: Matrix
    rotation: Matrix
    translation_mm: Matrix


def xyz_from_column(column_px: Map, geometry: Geometry) -> Map:
    """Triangulate: camera ray and projector column plane, no distortion (S7, S8).

    With d = K_c^-1 (x, y, 1), P = z d, and the projector frame P_p = R P + T:
    z = (u' T_z - T_x) / (R_x . d - u' R_z . d), where u' = (u - c_u) / f_u. (H, W, 3), mm.
    """
    height, width = column_px.shape
    kind = column_px.dtype
    camera_k, projector_k = geometry.camera_k, geometry.projector_k
    x = ((np.arange(width) - camera_k[0, 2]) / camera_k[0, 0]).astype(kind)[None, :]
    y = ((np.arange(height) - camera_k[1, 2]) / camera_k[1, 1]).astype(kind)[:, None]
    r, t = geometry.rotation.astype(kind), geometry.translation_mm.astype(kind)
    u = (column_px - float(projector_k[0, 2])) / float(projector_k[0, 0])
    x_part = r[0, 0] * x + r[0, 1] * y + r[0, 2]
    z_part = r[2, 0] * x + r[2, 1] * y + r[2, 2]
    z = (u * t[2] - t[0]) / (x_part - u * z_part)
    return np.stack([x * z, y * z, z], axis=-1)


def decode(
    red: Frame,
    green: Frame,
    blue: Frame,
    ir: Frame,
    *,
    numbers: tuple[int, int, int] = (36, 35, 30),
    projector_width: int = 912,
    geometry: Geometry | None = None,
    dtype: type[np.floating[Any]] = np.float32,
) -> Result:
    """One shot to absolute phase and, with a geometry, to X, Y, Z: the published chain."""
    r, g, b, i = (unit_from_frame(frame, dtype) for frame in (red, green, blue, ir))
    phase_n, modulation = two_step(r, b, period_from_image(r))
    phase_n1 = improved_ftp(g, period_from_image(g))
    phase_ns = improved_ftp(i, period_from_image(i))
    phase, quality = ladder((phase_n, phase_n1, phase_ns), numbers)

    column = phase * (projector_width / (TAU * numbers[0]))
    outside = (column < -0.5) | (column >= projector_width - 0.5)
    no_data = (modulation < MODULATION_MIN) | outside
    for values in (phase, column, quality):
        values[no_data] = np.nan
    xyz = None if geometry is None else xyz_from_column(column, geometry)
    return Result(phase, column, np.floor(phase / TAU), modulation, quality, xyz)
