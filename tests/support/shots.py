"""What tests ask of shots of any camera."""

from __future__ import annotations

from quadfringe.data import AnyShot


def sees_no_infrared(shot: AnyShot) -> bool:
    """Say whether a shot comes from a camera without an infrared chip."""
    return "ir" not in shot.images


def first_values(shot: AnyShot) -> dict[str, int]:
    """Give the first pixel of each image, by name."""
    return {name: int(image[0, 0]) for name, image in shot.images.items()}
