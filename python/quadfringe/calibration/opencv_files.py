"""Export and import of calibrations as OpenCV FileStorage (.yml, .yaml, .xml, .json): intrinsics, distortion, poses.

Each device has `<name>_matrix` (3 x 3), `<name>_distortion` (1 x 5: k1, k2, p1, p2, k3), `<name>_size` (1 x 2: width,
height) and, except for the camera, `R_<name>_camera` (3 x 3) and `T_<name>_camera` (3 x 1, mm) with
P_device = R P_camera + T, as `cv2.stereoCalibrate` returns them.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import Device, checked
from quadfringe.data import Calibration
from quadfringe.errors import ConfigError, InputError
from quadfringe.files import atomic, read_bytes, require_suffix
from quadfringe.io.bounded import BoundedError, Helper, Limits

__all__ = ["SUFFIXES", "devices_from_opencv", "read_opencv", "read_opencv_by", "write_opencv"]

SUFFIXES = (".yml", ".yaml", ".xml", ".json")
DEVICES = ("camera", "projector", "infrared")
FILE_BYTES = 4 << 20  # a calibration has some 10 kB, and with the points of all its views some MB
DEPTH = 32  # lists and tables inside one another; OpenCV follows them until its stack is full
NODES = 100_000  # lists, tables and elements, begun or ended; a calibration with all its views has some 100
BRACKETS = re.compile(rb"[\[{\]}]|</|/>|<[A-Za-z_]")
CLOSING = (b"]", b"}", b"</", b"/>")
LIMITS = Limits(time_s=4.0, memory_bytes=2 << 30)  # of which OpenCV itself takes half a second and 0.4 GB
ROUNDING = 1e-6  # of matrix entries that a text file holds with fewer digits


def write_opencv(path: Path, calibration: Calibration) -> None:
    """Write the devices of a calibration for OpenCV; the suffix selects the format."""
    import cv2

    suffix = require_suffix(path, SUFFIXES)
    # In memory, here and in `_matrices_in`: OpenCV crashes on a path that is not valid UTF-8.
    storage = cv2.FileStorage(suffix, cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    for name in DEVICES:
        device = getattr(calibration, name)
        for key, matrix in ({} if device is None else _matrices(name, device)).items():
            storage.write(key, matrix)
    with atomic(path) as temporary:
        temporary.write_text(storage.releaseAndGetString())


def _matrices(name: str, device: Device) -> dict[str, NDArray[np.float64]]:
    (fx, fy), (cx, cy) = device.focal_px, device.centre_px
    found = {
        f"{name}_matrix": np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], float),
        f"{name}_distortion": np.array([device.distortion], float),
        f"{name}_size": np.array([[device.width_px, device.height_px]], float),
    }
    if name != "camera":
        found[f"R_{name}_camera"] = np.array(device.rotation, float)
        found[f"T_{name}_camera"] = np.array(device.translation_mm, float)[:, None]
    return found


def read_opencv(path: Path) -> Calibration:
    """Read the devices from a file of `write_opencv` or of another program; `infrared` may be absent.

    OpenCV reads the file in a helper process, because some damaged files crash it. Raises `InputError` naming the file
    and the matrix when one is missing, has another size or skew, or when the distortion has more coefficients than k3,
    which the kernel does not model; and for a file that OpenCV cannot read.
    """
    with Helper(LIMITS) as helper:
        return read_opencv_by(helper, path)


def read_opencv_by(helper: Helper, path: Path) -> Calibration:
    """Read as `read_opencv` does, with a helper process that reads several files."""
    require_suffix(path, SUFFIXES)
    data = read_bytes(path, FILE_BYTES)
    if found := _too_nested(data):
        raise InputError(f"{path}: expected at most {found}, got more")
    try:
        matrices = helper.run(_matrices_in, path, data.decode(errors="replace"))
    except BoundedError as error:
        words = f"{path}: expected an OpenCV FileStorage file; OpenCV {error} when it reads this one"
        raise InputError(words) from error
    return devices_from_opencv(matrices, str(path))


def _matrices_in(path: Path, text: str) -> dict[str, NDArray[np.float64]]:
    """Read every matrix of numbers in the text of a file; runs in the helper process."""
    import cv2

    try:
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        nodes = {key: storage.getNode(key).mat() for key in storage.root().keys()}  # noqa: SIM118 - no mapping
        storage.release()
    except (cv2.error, SystemError, UnicodeDecodeError) as error:
        words = str(error).strip().splitlines()[-1:]
        raise InputError(f"{path}: expected an OpenCV FileStorage file: {''.join(words)}") from None
    return {key: np.asarray(matrix, float) for key, matrix in nodes.items() if matrix is not None}


def _too_nested(text: bytes) -> str:
    """Say which limit of lists, tables and elements a text in JSON, YAML or XML exceeds; "" for none."""
    depth = 0
    for number, found in enumerate(BRACKETS.finditer(text)):
        depth += -1 if found[0] in CLOSING else 1
        if depth > DEPTH:
            return f"{DEPTH} lists and tables inside one another"
        if number >= NODES:
            return f"{NODES:,} beginnings and ends of lists and tables"
    return ""


def devices_from_opencv(matrices: dict[str, NDArray[np.float64]], source: str = "matrices") -> Calibration:
    """Build a calibration from matrices by name; the camera is the reference frame and needs no pose."""
    names = ("camera", "projector", *(("infrared",) if "infrared_matrix" in matrices else ()))
    devices: dict[str, Any] = {name: _device(name, matrices, source) for name in names}
    return Calibration(**devices)


def _device(name: str, matrices: dict[str, NDArray[np.float64]], source: str) -> Device:
    matrix = _matrix(f"{name}_matrix", (3, 3), matrices, source)
    skewed = max(abs(matrix[0, 1]), np.abs(matrix[2] - (0, 0, 1)).max(), abs(matrix[1, 0])) > ROUNDING
    if skewed:
        raise ConfigError(f"{source}: {name}_matrix: expected fx, 0, cx, 0, fy, cy, 0, 0, 1, got {matrix.tolist()}")
    size = _matrix(f"{name}_size", (1, 2), matrices, source)[0]
    distortion = matrices.get(f"{name}_distortion", np.zeros(5)).ravel()
    if distortion.size not in (4, 5):
        raise ConfigError(
            f"{source}: {name}_distortion: expected k1, k2, p1, p2 and k3, got {distortion.size} numbers; calibrate "
            "without the rational, thin prism and tilted lens models"
        )
    pose = {}
    if name != "camera":
        rotation = _matrix(f"R_{name}_camera", (3, 3), matrices, source)
        if not _is_rotation(rotation):
            raise ConfigError(f"{source}: R_{name}_camera: expected a rotation matrix, got {rotation.tolist()}")
        translation = _matrix(f"T_{name}_camera", (3, 1), matrices, source)[:, 0]
        pose = {"rotation": rotation.tolist(), "translation_mm": translation.tolist()}
    return checked(
        Device,
        {
            "width_px": round(size[0]),
            "height_px": round(size[1]),
            "focal_px": (matrix[0, 0], matrix[1, 1]),
            "centre_px": (matrix[0, 2], matrix[1, 2]),
            "distortion": np.pad(distortion, (0, 5 - distortion.size)).tolist(),
            **pose,
        },
        f"{source}, {name}",
    )


def _is_rotation(matrix: NDArray[np.float64]) -> bool:
    if np.abs(matrix).max() > 1 + ROUNDING:  # also numbers that would overflow
        return False
    return bool(np.abs(matrix @ matrix.T - np.eye(3)).max() <= ROUNDING and np.linalg.det(matrix) > 0)


def _matrix(
    key: str, shape: tuple[int, int], matrices: dict[str, NDArray[np.float64]], source: str
) -> NDArray[np.float64]:
    if key not in matrices:
        raise ConfigError(f"{source}: {key} is missing; the file has {', '.join(sorted(matrices)) or 'no matrices'}")
    if matrices[key].size != shape[0] * shape[1]:
        raise ConfigError(f"{source}: {key}: expected {shape[0]} x {shape[1]}, got {matrices[key].shape}")
    if not np.isfinite(matrices[key]).all():
        raise ConfigError(f"{source}: {key}: expected finite numbers, got {matrices[key].tolist()}")
    return matrices[key].reshape(shape)
