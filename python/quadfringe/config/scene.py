"""Settings of the virtual bench: the table `[scene]` of a system file.

>>> from quadfringe.config import SceneConfig
>>> SceneConfig(surface="steps", noise=0.03)
SceneConfig(surface='steps', noise=0.03)
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from quadfringe.config._base import Finite, Model, NotNegative, Positive
from quadfringe.config.decode import Row4
from quadfringe.config.devices import Triple

__all__ = ["Affine", "BayerPattern", "HeightMapConfig", "Matrix4", "SceneConfig", "Surface"]

Matrix4 = tuple[Row4, Row4, Row4, Row4]
PerChannel = Annotated[Row4, BeforeValidator(lambda v: (v,) * 4 if isinstance(v, (int, float)) else v)]
Affine = tuple[Triple, Triple]
BayerPattern = Literal["rggb", "grbg", "gbrg", "bggr"]
BLUR_MAX_PX = 100.0  # a wider one takes minutes, and no fringe is left of it
SEED_MAX = 2**63 - 1  # the largest whole number of a TOML file; the kernel's is twice as large, so that shots can count
Surface = Literal["plane", "peaks", "steps", "sphere", "face", "hand"]  # as the kernel names them, tested


class HeightMapConfig(Model):
    """A relief from a file, over a plane that faces the camera."""

    file: Path = Field(description="NPY file of heights in mm towards the camera, (rows, columns), rows along y.")
    pitch_mm: tuple[Positive, Positive] = Field(description="Distance between samples along x and along y, in mm.")
    origin_mm: tuple[Finite, Finite] = Field(description="x and y of the first sample, in mm.")
    z_mm: Positive = Field(default=800.0, description="Depth of the plane, in mm.")


class SceneConfig(Model):
    """The scene on the virtual bench, and the defects of its light and camera.

    Intensities are fractions of full scale. A setting with one value for each channel (R, G, B, IR) may be one number
    for all four. An absent setting is ideal, or takes the kernel's default.
    """

    surface: Surface = Field(
        default="face", description="plane, peaks, steps, sphere, face, or hand, which moves with time."
    )
    height_map: HeightMapConfig | None = Field(default=None, description="A relief in place of `surface`.")
    time_s: Finite | None = Field(default=None, description="Time of the scene in s, for surfaces that move.")
    albedo: PerChannel | None = Field(default=None, description="Share of the light that the surface reflects.")
    patch_mm: Positive | None = Field(
        default=None, description="Side in mm of coloured squares printed on the surface. Absent: no texture."
    )
    ambient: PerChannel | None = Field(
        default=None, description="Room light, as a share of the brightest projected light."
    )
    shading: bool | None = Field(default=None, description="Light falls off with the slope of the surface (Lambert).")
    projector_exponent: PerChannel | None = Field(
        default=None, description="Response (gamma) of the projectors: light = level ^ exponent."
    )
    crosstalk: Matrix4 | None = Field(
        default=None, description="Rows: captured R, G, B, IR; columns: projected R, G, B, IR."
    )
    gain: PerChannel | None = Field(default=None, description="Captured intensity for light 1 from albedo 1.")
    blur_px: Annotated[NotNegative, Field(le=BLUR_MAX_PX)] | None = Field(
        default=None, description="Blur of the lens: standard deviation of a Gaussian, in px, at most 100."
    )
    infrared_from_visible: Affine | None = Field(
        default=None,
        description="Affine map from pixels of the visible to pixels of the infrared chip, two rows of three.",
    )
    noise: NotNegative | None = Field(
        default=None, description="Standard deviation of Gaussian sensor noise; 0.03 is the paper's 3 %."
    )
    camera_offset: PerChannel | None = Field(default=None, description="Dark level of the camera.")
    camera_exponent: PerChannel | None = Field(
        default=None, description="Response of the camera: captured = offset + linear ^ (1 / exponent)."
    )
    bayer: BayerPattern | None = Field(
        default=None, description="Colours of the first 2 x 2 pixels of a Bayer chip, which delivers a raw mosaic."
    )
    demosaic: Literal["bilinear"] | None = Field(
        default=None, description="The camera interpolates three colour planes from the mosaic, as most cameras do."
    )
    bit_depth: Literal[8, 10, 12, 16] = Field(default=8, description="Bits of the images.")
    seed: Annotated[int, Field(ge=0, le=SEED_MAX)] | None = Field(
        default=None, description="Seed of the noise of the first shot; later shots count up from it."
    )
