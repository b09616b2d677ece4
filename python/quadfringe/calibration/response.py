"""The response (gamma) of a channel, from images of one fringe pattern in equal steps of phase."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config import ChannelResponse, Response
from quadfringe.data import ResponseCalibration
from quadfringe.errors import InputError
from quadfringe.io.images import full_scale, read_grey

__all__ = ["EstimatedResponse", "estimate_from_files"]


@dataclass(frozen=True)
class EstimatedResponse:
    """A response, and the kernel's figures of it by name: the numbers, and the error before and after."""

    calibration: ResponseCalibration
    figures: Mapping[str, float]


def estimate_from_files(
    files: Sequence[Path],
    steps: int,
    channels: Sequence[str] | None = None,
    base: ResponseCalibration | None = None,
) -> EstimatedResponse:
    """Estimate the response of `channels` (all when None) from stacks of `steps` images that follow one another.

    The other channels come from `base`, linear when None. Raises `InputError` when the number of files is
    not a multiple of `steps` or the images differ; ValueError when the stacks show no fringes, are out of order,
    too dark or saturated.
    """
    if not files or len(files) % steps:
        raise InputError(
            f"{len(files)} files are no whole number of stacks of {steps} steps; give the images of each "
            "stack in the order of their shifts, and no others"
        )
    images = _read_alike(files)
    figures = _core.estimate_response([np.stack(images[i : i + steps]) for i in range(0, len(files), steps)])
    response = ChannelResponse(**{name: figures[name] for name in ChannelResponse.model_fields})
    known = {name: getattr(base or Response(), name) for name in Response.model_fields}
    calibration = ResponseCalibration(
        **{**known, **dict.fromkeys(channels or known, response)},
        steps=steps,
        inputs=tuple(path.name for path in files),
    )
    return EstimatedResponse(calibration, figures)


def _read_alike(files: Sequence[Path]) -> list[NDArray[np.float32]]:
    """Read images as fractions of full scale; all must have one size and type."""
    first = read_grey(files[0])
    found = []
    for path in files:
        image = read_grey(path)
        if (image.shape, image.dtype) != (first.shape, first.dtype):
            raise InputError(
                f"{path}: {image.shape} {image.dtype}, but {files[0]} is {first.shape} {first.dtype}; "
                "all images of a capture must be alike"
            )
        found.append(image.astype(np.float32) / full_scale(image))
    return found
