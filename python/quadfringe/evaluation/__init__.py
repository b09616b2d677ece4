"""Evaluation: demonstration, timing, scoring against known truth, and published results computed again.

The modules are imported one by one, because some need optional libraries or start processes.
"""

__all__ = [
    "demo",
    "efficiency",
    "machine",
    "moving_scene",
    "numpy_chain",
    "reproduce",
    "reproduction",
    "scoring",
    "simulate",
    "timing",
]
