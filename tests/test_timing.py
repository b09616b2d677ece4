"""`quadfringe bench`: consistent figures, in a form that scripts can read."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from quadfringe.cli import app
from quadfringe.config import SceneConfig
from quadfringe.errors import DecodeError, InputError
from quadfringe.evaluation import machine, timing

SIZE = (320, 240)
PRINT = ["--patch-mm", "20"]
PLANE = SceneConfig(surface="plane", noise=timing.NOISE)
CASE_KEYS = {"width_px", "height_px", "method", "threads"}
TIMING_KEYS = CASE_KEYS | {
    "repeats",
    "median_ms",
    "minimum_ms",
    "verdict_ms",
    "busy_cores",
    "returned_percent",
    "shots_per_s",
    "ns_per_pixel",
}


@pytest.fixture(scope="module")
def measured() -> dict[str, Any]:
    """The JSON of one small run, from standard output."""
    options = ["--size", "320x240", "--method", "published", "--threads", "1", "--threads", "2", "--repeats", "3"]
    result = CliRunner().invoke(app, ["bench", *options, "--json", "-"])
    assert result.exit_code == 0, result.output
    record: dict[str, Any] = json.loads(result.stdout)
    return record


def test_the_record_has_its_keys(measured: dict[str, Any]) -> None:
    assert set(measured) == {
        "schema_version",
        "machine",
        "surface",
        "patch_mm",
        "noise",
        "timings",
        "memory",
        "scaling",
        "cost",
        "figures",
    }
    assert set(measured["machine"]) == {"cpu", "cores", "os", "python", "quadfringe", "commit"}
    assert measured["scaling"] == measured["cost"] == []
    assert [(t["method"], t["threads"], t["repeats"]) for t in measured["timings"]] == [
        ("published", 1, 3),
        ("published", 2, 3),
    ]
    for found in measured["timings"]:
        assert set(found) == TIMING_KEYS
    assert list(measured["figures"].values()) == [t["median_ms"] for t in measured["timings"]]
    assert all(name.startswith("published_320x240_") for name in measured["figures"])


def test_times_are_consistent(measured: dict[str, Any]) -> None:
    for found in measured["timings"]:
        assert 0 < found["verdict_ms"] < found["median_ms"]
        assert 0 < found["minimum_ms"] <= found["median_ms"]
        assert found["shots_per_s"] == pytest.approx(1e3 / found["median_ms"])
        assert found["ns_per_pixel"] == pytest.approx(1e6 * found["median_ms"] / (320 * 240))
        assert found["returned_percent"] > 80


def timed(width_px: int, median_ms: float, method: str = "joint") -> timing.Timing:
    case = timing.Case(width_px, 100, method, 1)
    return timing.Timing(case, 3, median_ms, median_ms, 0.0, 1.0, 100.0)


def test_cost_is_a_line_with_what_every_shot_costs() -> None:
    cost = timing.cost_of([timed(width, 0.5 + 0.01 * width) for width in (100, 200, 400)])
    assert cost.method == "joint"
    assert cost.fixed_ms == pytest.approx(0.5)
    assert cost.ns_per_pixel == pytest.approx(100.0)
    assert cost.off_percent == pytest.approx(0.0, abs=1e-6)
    assert cost.spread_percent == pytest.approx(100 * (1.5 / 100) / (4.5 / 400) - 100)


def test_a_time_off_the_line_shows() -> None:
    cost = timing.cost_of([timed(100, 1.0), timed(400, 5.0), timed(200, 2.0)])
    assert cost.spread_percent == pytest.approx(25.0)
    assert 5.0 < cost.off_percent < 25.0


@pytest.mark.parametrize(
    "timings", [[], [timed(100, 1.0)], [timed(100, 1.0)] * 2, [timed(100, 1.0), timed(200, 2.0, "published")]]
)
def test_a_line_needs_two_sizes_of_one_method(timings: list[timing.Timing]) -> None:
    with pytest.raises(InputError, match="two sizes or more"):
        timing.cost_of(timings)


def test_a_process_keeps_to_its_threads(measured: dict[str, Any]) -> None:
    for found in measured["timings"]:
        assert found["busy_cores"] <= found["threads"] + 0.1


@pytest.mark.skipif(machine.resident_bytes() is None, reason="this system does not tell what is resident")
def test_a_decoder_weighs_its_results_and_some_maps() -> None:
    published, joint = timing.memory(SIZE, timing.METHODS, 1, scene=PLANE)
    map_mb = 4 * SIZE[0] * SIZE[1] / 2**20
    for found in (published, joint):
        assert 8 * map_mb < found.held_mb < 100 * map_mb  # the results alone are eight maps
    assert set(published.record()) == CASE_KEYS | {"held_mb"}


def test_a_shot_that_cannot_be_decoded_is_told() -> None:
    with pytest.raises(DecodeError, match="published at 16 x 16 pixels: "):
        timing.time_decoding((16, 16), ["published"], [1], repeats=3, scene=PLANE)


def test_a_print_is_timed_too() -> None:
    options = ["--size", "320x240", "--method", "joint", "--threads", "1", "--repeats", "3", "--json", "-"]
    records = [json.loads(CliRunner().invoke(app, ["bench", *options, *more]).stdout) for more in ([], PRINT)]
    assert [record["patch_mm"] for record in records] == [None, 20.0]


def test_squares_have_a_side() -> None:
    result = CliRunner().invoke(app, ["bench", "--patch-mm", "0"])
    assert result.exit_code == 2
    assert "patch-mm" in result.stderr


def test_a_surface_that_nobody_knows_is_named() -> None:
    result = CliRunner().invoke(app, ["bench", "--surface", "unicorn"])
    assert result.exit_code == 2
    assert "unicorn" in result.stderr


def test_resident_memory_follows_what_is_held() -> None:
    code = (
        "import numpy as np; from quadfringe.evaluation.machine import resident_bytes as r\n"
        "before = r(); held = np.ones(2**25, np.uint8); assert before is None or 2**24 < r() - before < 2**26"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_machine_is_described(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    found = machine.described()
    assert found["cpu"]
    assert 1 <= machine.usable_cores() <= (os.cpu_count() or 1)
    monkeypatch.setenv("PATH", str(tmp_path))  # no git here
    assert machine.described() == found | {"commit": None}
