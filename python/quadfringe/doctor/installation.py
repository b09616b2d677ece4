"""Checks of the installation: build of the kernel, OpenCV, extras, access to the projectors."""

from __future__ import annotations

from importlib.metadata import distributions
from importlib.util import find_spec

from quadfringe import _core
from quadfringe.doctor.finding import Finding
from quadfringe.evaluation.machine import described

__all__ = ["examine_installation"]

OPENCV = (
    "opencv-python",
    "opencv-python-headless",
    "opencv-contrib-python",
    "opencv-contrib-python-headless",
)
EXTRAS = {"matplotlib": "plot", "trimesh": "export", "tifffile": "export"}


def examine_installation() -> list[Finding]:
    """Check what the commands need."""
    return [_machine(), _build(), *_opencv(), *_extras(), *_projectors()]


def _machine() -> Finding:
    facts = described()
    words = f"quadfringe {facts['quadfringe']}, Python {facts['python']}, {facts['cores']} cores, {facts['os']}"
    return Finding("machine", "good", words)


def _build() -> Finding:
    if _core.__profile__ == "release":
        return Finding("kernel", "good", "compiled with optimisation")
    return Finding(
        "kernel",
        "fault",
        f"compiled as {_core.__profile__}: ten to fifty times slower",
        "build it with optimisation: maturin develop --release",
    )


def _opencv() -> list[Finding]:
    names = sorted({(found.metadata["Name"] or "").lower() for found in distributions()} & set(OPENCV))
    if len(names) != 1:
        words = f"{' and '.join(names)} are installed and overwrite each other" if names else "OpenCV is not installed"
        fix = f"pip uninstall -y {' '.join(names)}; pip install " if names else "pip install "
        return [Finding("opencv", "fault", words, f'{fix}"{OPENCV[-1]}>=4.10.0.84,<6"')]
    import cv2

    wanted = ("findCirclesGrid", "aruco", "FileStorage")
    if missing := [name for name in wanted if not hasattr(cv2, name)]:
        words = f"{names[0]} {cv2.__version__} has no {', '.join(missing)}"
        return [Finding("opencv", "fault", words, f'pip install --force-reinstall "{OPENCV[-1]}>=4.10.0.84,<6"')]
    if names[0] != OPENCV[-1]:
        words = f"{names[0]} {cv2.__version__} in place of {OPENCV[-1]}"
        fix = f"pip uninstall -y {names[0]}; pip install {OPENCV[-1]}"
        return [Finding("opencv", "warning", words, fix)]
    return [Finding("opencv", "good", f"{names[0]} {cv2.__version__}, alone")]


def _extras() -> list[Finding]:
    missing = sorted({extra for module, extra in EXTRAS.items() if find_spec(module) is None})
    if not missing:
        return [Finding("extras", "good", "plot (pictures) and export (PLY, TIFF) are installed")]
    names = ",".join(missing)
    return [Finding("extras", "warning", f"not installed: {names}", f'pip install "quadfringe[{names}]"')]


def _projectors() -> list[Finding]:
    try:
        found = _core.lightcrafters()
    except OSError as error:
        return [Finding("projectors", "warning", str(error), "connect the projectors, or use the virtual bench")]
    if not found:
        return [Finding("projectors", "good", "no LightCrafter 4500 is connected; the virtual bench needs none")]
    closed = [port for port, _, serial in found if serial is None]
    if closed:
        file, rule = _core.udev_rule()
        fix = f"as root, write into {file}: {rule} ; then run udevadm control --reload, and reconnect the USB cable"
        return [Finding("projectors", "fault", f"no permission to open port {', '.join(closed)}", fix)]
    ports = ", ".join(port for port, _, _ in found)
    return [Finding("projectors", "good", f"ports {ports} can be opened; for details run quadfringe projector doctor")]
