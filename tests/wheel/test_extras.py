"""Each extra installed alone, and what it is for."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from environments import Environment

ROOT = Path(__file__).resolve().parents[2]
LARGE = ("open3d",)  # 900 MB, which every run cannot afford
# `test` and `docs` are for this checkout. PyGObject is compiled where it is installed; `make test-camera` does so and
# uses it.
ELSEWHERE = ("test", "docs", "aravis")

SHAPE = """
import quadfringe as qf
small = qf.Device(width_px=256, height_px=192, focal_px=(645.0, 645.0), centre_px=(127.5, 95.5))
system = qf.SystemConfig(camera=small, scene=qf.SceneConfig(surface="peaks"))
with qf.open(system) as scanner:
    shape = scanner.measure()
shape.save("peaks.npz")
"""

USES = {
    "batch": """
from pathlib import Path
from quadfringe.recording import Recorder
from quadfringe.recording.batch import decode_recordings
import zarr
with qf.open(system) as scanner, Recorder("take.h5", scanner.config, scanner.calibration) as recorder:
    for _ in range(2):
        recorder.write(scanner.grab())
if __name__ == "__main__":
    Path("results").mkdir()
    outcomes = list(decode_recordings([Path("take.h5")], Path("results"), workers=1, ply=True))
    assert [outcome.error for outcome in outcomes] == [None, None], outcomes
    assert zarr.open("results/take.zarr")["phase_rad"].shape == (2, 192, 256)
""",
    "e57": 'shape.save("peaks.e57")',
    "export": """
for name in ("peaks.ply", "peaks.tif", "peaks.stl", "peaks.obj"):
    shape.save(name)
assert len(shape.to_trimesh().vertices) > 40_000
""",
    "open3d": "assert len(shape.to_open3d().points) > 40_000",
    "plot": """
from quadfringe.view.page import write_page
write_page("peaks.html", shape, "peaks")
""",
    "view": """
import socket
from urllib.request import urlopen
from quadfringe.view.saved import SavedViewer
with socket.socket() as free:
    free.bind(("127.0.0.1", 0))
    port = free.getsockname()[1]
with SavedViewer(["peaks.npz"], port=port) as viewer, urlopen(viewer.url) as answer:
    assert b"<html" in answer.read()
""",
    "xarray": 'assert shape.to_xarray()["phase_rad"].sizes == {"row": 192, "column": 256}',
}

TRIED = [name for name in USES if name not in LARGE or os.environ["QUADFRINGE_WHEEL"] == "all"]


def test_every_extra_is_tried() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert sorted(extras) == sorted([*USES, *ELSEWHERE])


@pytest.mark.parametrize("extra", TRIED)
def test_an_extra_works_alone(installed: Callable[..., Environment], extra: str) -> None:
    installed(extra).run(SHAPE + USES[extra])
