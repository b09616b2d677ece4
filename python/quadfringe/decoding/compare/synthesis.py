"""What a fault of the light does to a shape: shots with and without it, made from a sound shape and decoded alike.

A fault of a channel moves the phase in a way that depends on the decoder: how it weighs the channels, and how far it
smooths. So the decoder itself is asked. From the columns of a sound shape follows the light of every channel without
any fault (D3); with a little of a fault added, the decoder gives columns that differ by the pattern of that fault.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape, Shot
from quadfringe.decoding.compare import params
from quadfringe.decoding.decoder import Decoder
from quadfringe.decoding.plan import Plan

__all__ = ["CHANNELS", "GAMMAS", "STRAYS", "Faults", "Maker", "Member", "recipe_of"]

CHANNELS = ("red", "green", "blue", "infrared")
Map = NDArray[np.float64]
FULL = 65535
# A gamma concerns the channels of its member, a crosstalk the channel that sees and the one that is seen. Gammas are of
# all channels, and of one projector: single ones contradict one another, and the decoder then weighs them anew.
Member = tuple[int, ...]
GAMMAS: tuple[Member, ...] = ((0, 1, 2, 3), (0, 1, 2))
STRAYS: tuple[Member, ...] = tuple(permutations(range(4), 2))


@dataclass(frozen=True)
class Faults:
    """Faults of the light: exponents (4,) of the channels, and what each channel (rows) sees of others, (4, 4).

    Without any, the exponents are 1 and the matrix is 0.
    """

    exponents: Map
    strays: Map

    @classmethod
    def from_sizes(cls, name: str, members: tuple[Member, ...], sizes: Map) -> Faults:
        """Give the faults of one family with these sizes: differences of exponents, or shares of foreign light."""
        exponents, strays = np.ones(4), np.zeros((4, 4))
        for member, size in zip(members, sizes, strict=True):
            if name == "gamma":
                exponents[list(member)] += size
            else:
                strays[member[0], member[1]] += size
        return cls(np.clip(exponents, *params.EXPONENTS), strays)


class Maker:
    """Makes shots of a surface and decodes them. The noise is the same in all, so that faults make the difference."""

    def __init__(self, column_px: Map, modulation: Map, plan: Plan) -> None:
        self._light = _light(column_px, plan)
        self._level = np.clip(2 * np.nan_to_num(modulation), 0, 1)[..., None]
        self._decoder = Decoder(_shot(self._light * self._level), plan)
        self._base = self._decoded(self._light)

    def columns_off_px(self, faults: Faults) -> Map:
        """Give the columns that the faults add, (H, W) px, NaN where one of the two shots has none."""
        count = self._light.shape[-1]
        exponents, strays = faults.exponents[:count], faults.strays[:count, :count]
        bent = self._light ** exponents.astype(np.float32)
        mixed = (bent + bent @ strays.T.astype(np.float32)) / (1 + strays.sum(axis=1)).clip(0.1)
        return self._decoded(mixed.astype(np.float32)) - self._base

    def patterns(self, name: str, members: tuple[Member, ...]) -> Map:
        """Give the columns for a whole unit of each fault, (H, W, N), from a small one."""
        step = params.GAMMA_STEP if name == "gamma" else params.STRAY_STEP
        faults = (Faults.from_sizes(name, (member,), np.array([step])) for member in members)
        return np.stack([self.columns_off_px(one) / step for one in faults], axis=-1)

    def _decoded(self, light: Map) -> Map:
        return self._decoder.decode_without_verdict(_shot(light * self._level)).column_px.astype(np.float64)


def recipe_of(shape: Shape) -> Plan | None:
    """Give the plan that decodes linear light as the shape was decoded; None for a shape that no single shot made."""
    config = shape.config
    decode: Mapping[str, Any] = config.get("decode", {})
    fringes, width = config.get("fringes"), config.get("projector_width_px")
    if not isinstance(fringes, Mapping) or width is None or decode.get("method") not in ("joint", "published"):
        return None
    kept = {name: decode[name] for name in ("method", "modulation_min", "quality_min") if name in decode}
    numbers = () if fringes.get("numbers") is None else fringes["numbers"]
    alone = fringes.get("encoding") == "rgb" and len(numbers) == len(CHANNELS) - 1
    return Plan(width, (*numbers, 0.0) if alone else numbers, response="linear", decode=kept)


def _light(column_px: Map, plan: Plan) -> Map:
    """Give the light of the channels, (H, W, 4), or 3 without infrared, 0 to 1; 0 where there is no surface."""
    turns = 2 * np.pi * np.nan_to_num(column_px) / plan.projector_width_px
    waves = [np.cos(number * turns) for number in plan.fringes.channel_numbers]
    if plan.fringes.quadrature:
        waves[2] = -np.sin(plan.fringes.numbers[0] * turns)
    lit = np.isfinite(column_px)
    return np.where(lit[..., None], 0.5 + 0.5 * np.stack(waves, axis=-1), 0.0)


def _shot(light: Map) -> Shot:
    noise = params.SYNTHETIC_NOISE * np.random.default_rng(0).standard_normal(light.shape, np.float32)
    images = np.round(FULL * np.clip(light + noise, 0, 1)).astype(np.uint16)
    red, green, blue, *others = (np.ascontiguousarray(images[..., channel]) for channel in range(light.shape[-1]))
    return Shot(red, green, blue, others[0] if others else None)
