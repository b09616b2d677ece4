"""Scenes that resemble real objects, and figures of noise and resolution on them.

`scenes` names the scenes, `judging` compares a shape with the truth, `doubt` checks the stated probabilities of a wrong
order, and `resolution` measures the height that is left of small detail. A scene is drawn from its seed: colours,
places and photographs change with it. Numbers of a method are chosen on the seeds `TUNE` alone; figures are reported on
the seeds `REPORT`.
"""

from quadfringe.evaluation.world.doubt import Doubts
from quadfringe.evaluation.world.judging import Figures, judge
from quadfringe.evaluation.world.resolution import edge_width_px, half_height_period_px, height_ratios
from quadfringe.evaluation.world.scenes import REPORT, SCENES, TUNE, Take, World, expose, take

__all__ = [
    "REPORT",
    "SCENES",
    "TUNE",
    "Doubts",
    "Figures",
    "Take",
    "World",
    "edge_width_px",
    "expose",
    "half_height_period_px",
    "height_ratios",
    "judge",
    "take",
]
