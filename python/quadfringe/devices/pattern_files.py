"""Write the images that projectors show to files."""

from __future__ import annotations

from pathlib import Path

from quadfringe.config import Fringes
from quadfringe.devices.light import Predeformation, light_images
from quadfringe.files import folder_for
from quadfringe.io.images import write_image

__all__ = ["write_patterns"]


def write_patterns(
    folder: Path,
    fringes: Fringes,
    size_px: tuple[int, int],
    deformed: Predeformation | None = None,
) -> list[Path]:
    """Write visible.png and infrared.png into `folder` and return their paths; `deformed` pre-deforms the latter.

    Fringes without infrared have no infrared.png.
    """
    visible, infrared = light_images(fringes, size_px, deformed)
    folder_for(folder)
    images = {folder / "visible.png": visible} | ({folder / "infrared.png": infrared} if fringes.infrared else {})
    for path, image in images.items():
        write_image(path, image)
    return list(images)
