"""What pages may send: the viewpoint, values of controls, and clicks into the scene. Everything else is dropped.

viser takes every message type from every page and sets any attribute that a message names. The pages send three types
only, so that nothing is lost by reading each message before viser does.
"""

from __future__ import annotations

from math import isfinite
from typing import Any

from quadfringe.errors import require

__all__ = ["LARGEST_MESSAGE_BYTES", "acceptable"]

LARGEST_MESSAGE_BYTES = 16_384  # a viewpoint has 300
LONGEST_TEXT = 64
LONGEST_VECTOR = 4
FARTHEST_M = 1e6  # from the middle of the scene to the eye; the page draws to 1000 m
CLICK = {"type", "event_type", "ray_origin", "ray_direction", "screen_pos", "modifier"}


def acceptable(message: object) -> bool:
    """Tell whether a message of a page is a viewpoint, the value of a control or a click, made of finite numbers.

    >>> acceptable(b"no message"), acceptable("text")
    (False, False)
    """
    msgspec: Any = require("msgspec", "view")
    if not isinstance(message, bytes):
        return False
    try:
        content = msgspec.msgpack.decode(message)
    except (msgspec.MsgspecError, RecursionError, ValueError):
        return False
    return isinstance(content, dict) and (_is_value(content) or _is_viewpoint(content) or _is_click(content))


def _is_value(content: dict[Any, Any]) -> bool:
    updates = content.get("updates")
    return (
        content.keys() == {"type", "uuid", "updates"}
        and content["type"] == "GuiUpdateMessage"
        and isinstance(content["uuid"], str)
        and isinstance(updates, dict)
        and updates.keys() == {"value"}
        and _is_plain(updates["value"])
    )


def _is_viewpoint(content: dict[Any, Any]) -> bool:
    vectors = [value for value in content.values() if isinstance(value, list)]
    numbers = [value for name, value in content.items() if name != "type" and not isinstance(value, list)]
    return (
        content.get("type") == "ViewerCameraMessage"
        and all(len(vector) <= LONGEST_VECTOR for vector in vectors)
        and all(_is_number(value) for value in (*numbers, *(part for vector in vectors for part in vector)))
    )


def _is_click(content: dict[Any, Any]) -> bool:
    """Tell whether this is a click without keys; viser would also take rectangles, and clicks that name objects."""
    return (
        content.keys() == CLICK
        and (content["type"], content["event_type"], content["modifier"]) == ("ScenePointerMessage", "click", None)
        and _is_vector(content["ray_origin"], 3, FARTHEST_M)
        and _is_vector(content["ray_direction"], 3, 1.001)
        and isinstance(content["screen_pos"], list)
        and len(content["screen_pos"]) == 1
        and _is_vector(content["screen_pos"][0], 2, 2.0)
    )


def _is_vector(value: object, length: int, most: float) -> bool:
    return isinstance(value, list) and len(value) == length and all(_is_number(v) and abs(v) <= most for v in value)


def _is_plain(value: object) -> bool:
    return isinstance(value, bool) or _is_number(value) or (isinstance(value, str) and len(value) <= LONGEST_TEXT)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e12 and isfinite(value)
