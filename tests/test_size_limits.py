"""Limits on sizes, threads and numbers: one error in place of a process that hangs or is killed."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe import _core
from quadfringe.cli import app
from quadfringe.config import memory
from quadfringe.config.cameras import VirtualConfig
from quadfringe.decoding._kernel import BYTES_PER_PX
from quadfringe.devices.light import BYTES_PER_PX as IMAGES_BYTES_PER_PX
from quadfringe.devices.light import Levels, light_images
from quadfringe.devices.virtual._bench import BYTES_PER_PX as BENCH_BYTES_PER_PX
from quadfringe.errors import ConfigError, InputError

GB = 10**9


@pytest.fixture
def small_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine with 2 GB."""
    monkeypatch.setattr(memory, "memory_bytes", lambda: 2 * GB)


@pytest.mark.parametrize("size", [(10**8, 16), (16, 10**8), (10**30, 16), (-16, 16), (0, 16), (65537, 65537)])
def test_impossible_sizes_are_refused(size: tuple[int, int]) -> None:
    with pytest.raises(InputError, match="from 1 to 65536 px, got"):
        qf.Decoder(size, qf.Plan(912))


@pytest.mark.parametrize("method", ["joint", "published"])
@pytest.mark.usefixtures("small_machine")
def test_a_decoder_that_does_not_fit_is_refused(method: str) -> None:
    plan = qf.Plan(912, decode=qf.DecodeConfig(method=method))
    with pytest.raises(InputError, match=r"decoding: 65536 x 65536 pixels need about \d+ GB of memory, .* has 2 GB"):
        qf.Decoder((65536, 65536), plan)
    assert repr(qf.Decoder((64, 912), plan))


@pytest.mark.usefixtures("small_machine")
def test_a_bench_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    large = {"width_px": 65536, "height_px": 65536, "focal_px": (1e5, 1e5), "centre_px": (3e4, 3e4)}
    with pytest.raises(InputError, match="camera of the virtual bench: 65536 x 65536 pixels need about 472 GB"):
        qf.open(qf.SystemConfig(capture=VirtualConfig(), camera=large))
    with pytest.raises(InputError, match="visible of the virtual bench: 65536 x 65536"):
        qf.open(qf.SystemConfig(capture=VirtualConfig(), projector=large))
    (tmp_path / "system.toml").write_text(
        "[camera]\nwidth_px = 65536\nheight_px = 65536\nfocal_px = [1e5, 1e5]\ncentre_px = [3e4, 3e4]\n"
    )
    result = CliRunner().invoke(app, ["measure", str(tmp_path / "system.toml"), "--out", str(tmp_path / "out.npz")])
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert result.stderr.startswith("error: camera of the virtual bench:")


@pytest.mark.usefixtures("small_machine")
def test_images_that_do_not_fit_are_refused() -> None:
    huge = 65536, 65536
    with pytest.raises(InputError, match=r"pattern: 65536 x 65536 pixels need about 17 GB of memory, .* has 2 GB"):
        qf.pattern("red", (36, 35, 30), *huge)
    for light in (qf.Fringes(), Levels((1.0, 1.0, 1.0, 1.0))):
        with pytest.raises(InputError, match="projector images: 65536 x 65536 pixels need about"):
            light_images(light, huge)


@pytest.mark.parametrize("height", [2**32, 10**30])
def test_a_projector_of_impossible_size_is_refused(height: int, tmp_path: Path) -> None:
    for side in ("--width", "--height"):
        result = CliRunner().invoke(app, ["pattern", "--out", str(tmp_path), side, str(height)])
        assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
        assert result.stderr == f"error: {side[2:]}: expected a number from 1 to 65536, got {height}\n"


def test_a_machine_that_does_not_tell_refuses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "memory_bytes", lambda: None)
    memory.require_memory("decoding", (65536, 65536), 160)


WRONG: list[tuple[Callable[..., Any], dict[str, Any], str]] = [
    (qf.DecodeConfig, {"threads": 100_000}, "threads"),
    (qf.DecodeConfig, {"threads": 10**30}, "threads"),
    (qf.DecodeConfig, {"period_px": 1e300}, "period_px"),
    (qf.DecodeConfig, {"period_px": 65537.0}, "period_px"),
    (qf.SceneConfig, {"blur_px": 101.0}, "blur_px"),
    (qf.SceneConfig, {"blur_px": 1e300}, "blur_px"),
    (qf.SceneConfig, {"seed": 2**63}, "seed"),
]


@pytest.mark.parametrize(("model", "values", "name"), WRONG, ids=str)
def test_numbers_out_of_bounds_are_named(model: Callable[..., Any], values: dict[str, Any], name: str) -> None:
    with pytest.raises(ConfigError, match=f"{name}: expected .*(at most|<=|less than or equal)"):
        model(**values)


def test_the_largest_numbers_work() -> None:
    assert qf.DecodeConfig(threads=_core.THREADS_MAX).threads == 1024
    scene = qf.SceneConfig(seed=2**63 - 1, noise=0.01)
    with qf.open(qf.SystemConfig(capture=VirtualConfig(frame_rate_hz=10.0), scene=scene)) as scanner:
        assert not np.array_equal(scanner.grab().ir, scanner.grab().ir)


@pytest.mark.parametrize("threads", [0, 1025, 2**40])
def test_the_kernel_refuses_too_many_threads(threads: int) -> None:
    with pytest.raises(ValueError, match=f"threads: expected 1 to 1024, got {threads}"):
        _core.Decoder((64, 912), (36.0, 35.0, 30.0), 912, threads=threads)


def test_a_period_beyond_the_image_is_refused() -> None:
    plan = qf.Plan(912, decode=qf.DecodeConfig(period_px=101.0))
    with pytest.raises(InputError, match="period_px: expected at most 100 px, the longer side of the images, got 101"):
        qf.Decoder((64, 100), plan)


PEAK = """
import re, sys
from pathlib import Path
import numpy as np
import quadfringe as qf
from quadfringe import _core
from quadfringe.devices.light import projector_images

def used():  # getrusage would also count what the parent used
    return int(re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1]) * 1024

work, rows, columns = sys.argv[1], 2000, 1824
before = used()
if work == "pattern":
    projector_images((36.0, 35.0, 30.0), (columns, rows), "regular")
elif work == "render":
    focal_px = 3000.0
    camera = {"width_px": columns, "height_px": rows, "focal_px": (focal_px,) * 2, "centre_px": (911.5, 999.5)}
    with qf.open(qf.SystemConfig(camera=camera)) as scanner:
        scanner.grab()
else:
    code = ((36.0, 35.0, 30.0), columns)
    shot = qf.Shot(*(np.float32(0.1 + 0.8 * _core.pattern(name, *code, rows)) for name in ("R", "G", "B", "IR")))
    before = used()
    plan = qf.Plan(columns, decode=qf.DecodeConfig(method=work, response="linear"))
    decoder = qf.Decoder(shot, plan)
    shapes = [decoder.decode_without_verdict(shot) for _ in range(2)]
print((used() - before) / (rows * columns))
"""


@pytest.mark.parametrize("work", ["render", "pattern", *BYTES_PER_PX])
def test_the_estimates_of_memory_hold(work: str) -> None:
    done = subprocess.run([sys.executable, "-c", PEAK, work], capture_output=True, text=True, check=True)
    others = {"render": BENCH_BYTES_PER_PX["camera"], "pattern": IMAGES_BYTES_PER_PX}
    estimate = (BYTES_PER_PX | others)[work]
    assert 0.5 * estimate < float(done.stdout) < 1.2 * estimate
