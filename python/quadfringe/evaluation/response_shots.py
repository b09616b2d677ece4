"""Shots of scenes that resemble real objects, through a projector whose light is a power of its level.

>>> from quadfringe.evaluation.response_shots import *
>>> (one,) = estimates(("photographs_face",), (1.8,), (1,))
>>> one.response is not None and abs(one.error) < 5 * one.sd
True
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from quadfringe import _core
from quadfringe.config import Device, Response
from quadfringe.data import core_device
from quadfringe.decoding import Plan
from quadfringe.decoding._kernel import KernelDecoder, size_of
from quadfringe.decoding.response import decode_straightened
from quadfringe.evaluation import world
from quadfringe.evaluation._isolated import repeated

__all__ = ["BLOCKS_PX", "GAMMAS", "SCENES", "Estimate", "estimates"]

CAMERA = Device(width_px=512, height_px=384, focal_px=(1290.325, 1290.325), centre_px=(255.5, 191.5))
BLOCKS_PX = {f"blocks_{side_px}": side_px for side_px in (4, 8, 16)}  # sides of the blocks of texture
SCENES = (
    "photographs_face",
    "photographs_peaks",
    "photographs_steps",
    "painted_face",
    "face",
    "face_patches_12",
    *BLOCKS_PX,
)
GAMMAS = (1.4, 2.0)
NOISE = 0.02


@dataclass(frozen=True)
class Estimate:
    """The response that a shot shows, None for linear light, and what is known of it.

    `error` is that of the exponent of red, `sd` its stated standard error, `before` and `left` the second harmonic over
    the first one without and with the correction.
    """

    scene: str
    gamma: float
    seed: int
    response: Response | None
    error: float = float("nan")
    sd: float = float("nan")
    before: float = float("nan")
    left: float = float("nan")


def estimates(scenes: Iterable[str], gammas: Iterable[float], seeds: Iterable[int]) -> Iterator[Estimate]:
    """Estimate the response from a shot of every scene, gamma and seed."""
    gammas, seeds = tuple(gammas), tuple(seeds)
    for scene in scenes:
        for gamma in gammas:
            for seed in seeds:
                yield _estimated(scene, gamma, seed)


def _drawn(scene: str, bench: _core.Bench, random: np.random.Generator) -> world.World:
    if scene not in BLOCKS_PX:
        return world.SCENES[scene](bench, random)
    cast, side_px = bench.cast("face"), BLOCKS_PX[scene]
    rows, columns = cast.shadow().shape
    cells = random.uniform(0.1, 0.9, (-(-rows // side_px), -(-columns // side_px), 4))
    return world.World(cast, repeated(cells, side_px, (rows, columns)))


def _estimated(scene: str, gamma: float, seed: int) -> Estimate:
    bench = _core.Bench(camera=core_device(CAMERA))
    drawn = _drawn(scene, bench, np.random.default_rng([seed, 77]))
    # Room light changes the exponent that makes fringes sinusoidal: without it the right one is 1 / gamma.
    light = {"projector_exponent": (gamma,) * 4, "ambient": (0.0,) * 4}
    bent = replace(drawn, options=(drawn.options or {}) | light)
    shot = world.expose(bench, bent, seed, NOISE).shot
    kernel = decode_straightened(KernelDecoder(*size_of(shot, None), Plan(912)), shot)[0]
    if kernel.response == "linear":
        return Estimate(scene, gamma, seed, None)
    red = kernel.evidence["response_evidence"].get("red")
    if red is None:
        return Estimate(scene, gamma, seed, None)
    return Estimate(
        scene,
        gamma,
        seed,
        kernel.response,
        kernel.response.red.exponent - 1 / gamma,
        red["exponent_sd"],
        red["second_harmonic_before"],
        red["second_harmonic_after"],
    )
