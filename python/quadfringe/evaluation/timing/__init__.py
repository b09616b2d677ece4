"""How long a decode takes and how much memory a decoder holds, measured on shots of the virtual bench."""

from quadfringe.evaluation.timing._measure import METHODS, NOISE, SCALING_SIZES, memory, scaling, time_decoding
from quadfringe.evaluation.timing._worker import warm
from quadfringe.evaluation.timing.records import Case, Cost, Memory, Timing, cost_of

__all__ = [
    "METHODS",
    "NOISE",
    "SCALING_SIZES",
    "Case",
    "Cost",
    "Memory",
    "Timing",
    "cost_of",
    "memory",
    "scaling",
    "time_decoding",
    "warm",
]
