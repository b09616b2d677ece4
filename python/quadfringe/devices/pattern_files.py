"""Write the images that projectors show to files."""

from __future__ import annotations

from pathlib import Path

from quadfringe.devices.light import Predeformation, projector_images
from quadfringe.files import folder_for
from quadfringe.io.images import write_image

__all__ = ["write_patterns"]


def write_patterns(
    folder: Path,
    fringes: tuple[float, float, float],
    size_px: tuple[int, int],
    layout: str,
    deformed: Predeformation | None = None,
) -> list[Path]:
    """Write visible.png and infrared.png into `folder` and return their paths; `deformed` pre-deforms the latter."""
    visible, infrared = projector_images(fringes, size_px, layout, deformed)
    folder_for(folder)
    paths = [folder / "visible.png", folder / "infrared.png"]
    for path, image in zip(paths, (visible, infrared), strict=True):
        write_image(path, image)
    return paths
