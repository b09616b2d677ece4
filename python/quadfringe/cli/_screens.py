"""What commands say about the screens of the computer, and about projectors that are screens."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from quadfringe.cli._output import say

if TYPE_CHECKING:
    from quadfringe.devices import Projector

__all__ = ["say_outputs", "say_picture_modes"]


def say_outputs() -> bool:
    """Print which video outputs can carry patterns, of which projector; return whether there is a display."""
    from quadfringe.devices.lightcrafter import outputs

    try:
        rows = outputs()
    except OSError as error:
        say(f"outputs: {error}")
        return False
    for name, width, height, rate_hz, unfit in rows:
        rate = "" if rate_hz is None else f" at {rate_hz:.2f} Hz"
        scaled = next((row[-1] for row in outputs((width, height)) if row[0] == name), None)
        other = f'; fit for kind = "hdmi" with size_px = [{width}, {height}]' if scaled is None else ""
        say(f"output {name}: {width} x {height}{rate}, {'fit for patterns' if unfit is None else unfit}{other}")
    return True


def say_picture_modes(projector: Projector | None = None, tell: Callable[[str], None] = say) -> None:
    """Print what to check with a projector of kind hdmi, because no program can read it; nothing for others.

    Without a projector there is one of kind hdmi, which need not be opened.
    """
    from quadfringe.devices.hdmi import PICTURE_MODES, HdmiProjectors

    if projector is None or isinstance(projector, HdmiProjectors):
        tell("\n".join(["check by hand:", *(f"  {words}" for words in PICTURE_MODES)]))
