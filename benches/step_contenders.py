"""The programs of `peers.py` that take the same twelve images: the reference measurement, plain NumPy, and Fringes."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
from contenders import Bench, Contender, Map, timed
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.evaluation.machine import usable_cores

STEPS = 4
IMAGES = "12, steps"


def step_stacks(bench: Bench) -> list[NDArray[np.uint8]]:
    """Give the images of 36, 35 and 30 fringes, one stack (steps, H, W) for each, with shifts 2 pi s / 4."""
    shifts_rad = [2 * np.pi * s / STEPS for s in range(STEPS)]
    numbers = bench.config.fringes.numbers
    return [np.stack(bench.steps(n, shifts_rad, seed=200 + STEPS * i)) for i, n in enumerate(numbers)]


def reference(bench: Bench, stacks: list[NDArray[np.uint8]]) -> list[Contender]:
    numbers, found = bench.config.fringes.numbers, []
    for threads in sorted({1, usable_cores()}):
        steps = [len(stack) for stack in stacks]
        width = bench.scene.projector_width
        core = _core.StepDecoder(stacks[0].shape[1:], numbers, steps, width, threads=threads)

        def run(core: _core.StepDecoder = core) -> Map:
            return core.decode(stacks)["phase_rad"]

        found.append(Contender(f"reference_{threads}_threads", IMAGES, "column", threads, timed(run), run))
    return found


def numpy_steps(bench: Bench, stacks: list[NDArray[np.uint8]]) -> Contender:
    """The same likelihood in plain NumPy, float32: least squares, all orders in turn, all phases by weight."""
    numbers, width = np.array(bench.config.fringes.numbers), bench.scene.projector_width
    turns_of_steps = np.exp(-2j * np.pi * np.arange(STEPS) / STEPS).astype(np.complex64)

    def run() -> Map:
        phasors = [np.tensordot(turns_of_steps, stack.astype(np.float32), 1) for stack in stacks]
        turns = [(np.angle(phasor) / (2 * np.pi)).astype(np.float32) for phasor in phasors]
        weights = [phasor.real**2 + phasor.imag**2 for phasor in phasors]
        spread = 1 / sum(w * n * n for w, n in zip(weights, numbers, strict=True))
        least, best = np.full(turns[0].shape, np.inf, np.float32), np.empty_like(turns[0])
        for order in range(-1, int(numbers[0]) + 1):
            column = (turns[0] + np.float32(order)) / np.float32(numbers[0])
            apart = [np.float32(n) * column - t for n, t in zip(numbers, turns, strict=True)]
            apart = [a - np.round(a) for a in apart]
            lean = sum(w * np.float32(n) * a for w, n, a in zip(weights, numbers, apart, strict=True))
            cost = sum(w * a * a for w, a in zip(weights, apart, strict=True)) - lean * lean * spread
            column = column - lean * spread
            outside = np.maximum(np.maximum(-0.5 / width - column, column - (width - 0.5) / width), 0)
            cost = cost + outside * outside / spread
            better = cost < least
            least, best = np.where(better, cost, least), np.where(better, column, best)
        return (2 * np.pi * numbers[0] * best).astype(np.float32)

    return Contender("numpy_steps", IMAGES, "column", 1, timed(run), run)


def fringes(bench: Bench, stacks: list[NDArray[np.uint8]]) -> list[Contender]:
    logging.disable(logging.WARNING)  # it announces its first compilation
    from fringes import Fringes

    numbers, width = bench.config.fringes.numbers, bench.scene.projector_width
    decoder = Fringes()
    # One by one: given to the constructor together, it puts them back to its defaults.
    decoder.X, decoder.Y, decoder.axes, decoder.K, decoder.N = width, bench.shot.red.shape[0], 1, len(numbers), STEPS
    decoder.v = numbers
    if width != decoder.X or list(decoder.v) != list(numbers) or list(decoder.N) != [STEPS] * len(numbers):
        raise SystemExit("fringes: this version does not take X, K, N, v as 2.1 does; --skip fringes")
    # It shifts its fringes the other way, from half a turn: pi, pi / 2, 0, -pi / 2.
    images: Any = np.concatenate([stack[[2, 1, 0, 3]] for stack in stacks])[..., None]

    def run() -> Map:
        column_px = np.asarray(decoder.decode(images).x).reshape(bench.shot.red.shape)
        return 2 * np.pi * numbers[0] / width * column_px

    return [Contender("fringes", IMAGES, "column", usable_cores(), timed(run), run)]
