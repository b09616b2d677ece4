"""Dark surfaces in front of a camera of 12 bits: scenes of the virtual bench with a share of their albedo."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from quadfringe import _core
from quadfringe.data import Shot
from quadfringe.evaluation.world import SCENES, Take, expose

__all__ = ["BITS", "dark"]

BITS = 12


def dark(name: str, share: float, noise: float, seed: int) -> Take:
    """Expose a scene of `world.SCENES` with this share of its albedo; `noise` is a share of full scale."""
    bench, top = _core.Bench(), 2**BITS - 1
    world = SCENES[name](bench, np.random.default_rng([seed, 77]))
    whole = np.ones((*world.cast.shadow().shape, 4), np.float32)
    albedo = np.float32(share) * (whole if world.albedo is None else world.albedo)
    images = bench.render(world.cast, world.fringe_numbers, noise=0.0, bit_depth=16, albedo=albedo)
    random = np.random.default_rng([seed, 12])
    light = {channel: image / 65535 + random.normal(0, noise, image.shape) for channel, image in images.items()}
    steps = {channel: np.clip(np.round(top * plane), 0, top).astype(np.uint16) for channel, plane in light.items()}
    return replace(expose(bench, world, seed), shot=Shot(**steps, full_scale=top))
