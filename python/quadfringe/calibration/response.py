"""The response (gamma) of a channel, estimated from images of one fringe pattern at equal phase steps."""

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
    """An estimated response, and figures by name: its parameters, and the harmonic error before and after."""

    calibration: ResponseCalibration
    figures: Mapping[str, float]


def estimate_from_files(
    files: Sequence[Path],
    steps: int,
    channels: Sequence[str] | None = None,
    base: ResponseCalibration | None = None,
) -> EstimatedResponse:
    """Estimate the response of `channels` (default: all) from consecutive stacks of `steps` images.

    The other channels are taken from `base` (default: linear). Raises `InputError` when the number of files is not a
    multiple of `steps` or when the images differ in size or type, and ValueError when the stacks show no fringes, are
    out of order, too dark or saturated.
    """
    if not files or len(files) % steps:
        raise InputError(
            f"expected a multiple of {steps} files (steps of a stack), got {len(files)}; give the images of each stack "
            "in the order of their shifts, and no others"
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
    """Read images, share of full scale; raises `InputError` unless all have one size and type."""
    first = read_grey(files[0])
    found = []
    for path in files:
        image = read_grey(path)
        if (image.shape, image.dtype) != (first.shape, first.dtype):
            raise InputError(
                f"{path}: {image.shape} {image.dtype}, but {files[0]} is {first.shape} {first.dtype}; "
                "all images of a capture must have one size and type"
            )
        found.append(image.astype(np.float32) / full_scale(image))
    return found
