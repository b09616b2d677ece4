"""The ledger of accuracy bars is complete: it holds every limit of a test, and tests use every entry."""

from __future__ import annotations

import ast
import re
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from support.bar_scan import keys_used, literal_bars, rust_bars
from support.bars import bar, hold

from quadfringe.evaluation import _ledger as ledger

ROOT = Path(__file__).resolve().parents[1]
HERE = {Path(__file__).name, "bar_scan.py", "bars.py"}
TESTS = [path for path in sorted((ROOT / "tests").rglob("*.py")) if path.name not in HERE]
USERS = [*TESTS, *sorted((ROOT / "evaluation").glob("*.py"))]
RUST_TESTS = sorted((ROOT / "crates" / "quadfringe" / "tests").rglob("*.rs"))

# Comparisons of figures with numbers that limit no accuracy: by file and text, with the reason.
NOT_BARS = {
    (
        "test_batch.py",
        "np.isfinite(group['phase_rad'][0]).mean() > 0.3",
    ): "enough is decoded to compare files",
    ("test_captures.py", "np.abs(maps['order'][returned] - order) <= 1"): "orders are whole numbers",
    ("test_cli.py", "20 < json.loads(result.stdout)['figures']['returned_percent'] <= 100"): "a percentage is printed",
    ("test_cli.py", "atol=0.001"): "two maps of one decode, float32",
    ("test_evaluation.py", "phase_errors(phase_rad[seen], truth_rad[seen], 'wrapped')['phase_rms_rad'] < 0.08"): (
        "the noise of four steps; checks the score"
    ),
    ("test_evaluation.py", "rel=0.05"): "a planted wave; checks the score",
    ("test_mesh.py", "atol=0.001"): "a plane is exact, its points are float32",
    ("test_mesh.py", "atol=0.02"): "a slope that is nearly a plane, where a plane would be exact",
    ("test_shape_files.py", "atol=1"): "one grey level, by which files round colours",
    ("test_stages.py", "np.isfinite(shape.phase_rad).mean() > 0.1"): "enough pixels to compare",
    ("test_targets.py", "rel=0.001"): "area of a drawing",
    ("test_timing.py", "5.0 < cost.off_percent < 25.0"): "planted times",
    ("test_timing.py", "found['returned_percent'] > 80"): "the timed shots are decoded at all",
    ("test_measuring.py", "atol=0.1"): "a ball made of triangles is smaller than the ball",
    ("test_measuring.py", "rel=0.03"): "the spread of planted points",
    ("test_variants.py", "atol=0.01"): "OpenCV rounds places of a rotated image",
    ("test_variants.py", "atol=0.3"): "change of the truth over one pixel",
    ("test_variants.py", "rtol=0.2"): "the noise of the truth of two data sets",
    ("test_view.py", "atol=0.01"): "a ray meets triangles of float32 between their corners",
    ("test_view.py", "np.isfinite(section.height_mm).mean() > 0.99"): "the section has no holes",
    ("test_view.py", "rel=0.03"): "a fourth of the points, but for the rims",
    ("test_viewer.py", "np.abs(seen['quality'] - seen['uncertainty']).max() > 20"): "two colourings differ",
    ("test_lightcrafter.py", "abs=0.06"): "resolution of a register",
    (
        "test_trusted.py",
        "sum(decoded) < 3 * CAMERA.width_px * CAMERA.height_px",
    ): "decodes to name a cause",
    ("test_world.py", "abs=0.02"): "the truth as a shape; checks the measure of heights",
    ("test_world.py", "world.edge_width_px(shape_of, seed=1) < 3"): "the truth as a shape; checks the measure of edges",
    ("test_world.py", "periods_px[0] < 10"): "fringes of a scene",
    ("test_world.py", "periods_px[-1] > 75"): "fringes of a scene",
}
RUST_NOT_BARS = {
    ("stages.rs", "returned > 1000"): "enough pixels to compare",
}


@pytest.mark.parametrize("path", TESTS, ids=lambda path: path.name)
def test_python_tests_hold_no_bar_of_their_own(path: Path) -> None:
    found = {text: line for line, text in literal_bars(path.read_text()) if (path.name, text) not in NOT_BARS}
    assert not found, "put the limit into evaluation/bars.toml and use tests/support/bars.py"


def test_exceptions_are_needed() -> None:
    found = {(path.name, text) for path in TESTS for _, text in literal_bars(path.read_text())}
    found |= {(path.name, condition) for path in RUST_TESTS for condition in rust_bars(path.read_text())}
    unneeded = (NOT_BARS.keys() | RUST_NOT_BARS.keys()) - found
    assert not unneeded, sorted(unneeded)


def test_every_entry_is_used() -> None:
    used = [pattern for path in USERS for pattern in keys_used(path.read_text())]
    unused = [key for key in ledger.bars() if not any(pattern.fullmatch(key) for pattern in used)]
    assert not unused


@pytest.mark.parametrize("path", RUST_TESTS, ids=lambda path: path.name)
def test_bars_of_the_kernel_are_those_of_the_ledger(path: Path) -> None:
    found = {condition for condition in rust_bars(path.read_text()) if (path.name, condition) not in RUST_NOT_BARS}
    assert found == set(ledger.rust_bars().get(path.name, {}))


def test_kernel_entries_are_dated_and_name_files() -> None:
    assert ledger.rust_bars().keys() <= {path.name for path in RUST_TESTS}
    reasons = [reason for entries in ledger.rust_bars().values() for reason in entries.values()]
    assert all(re.fullmatch(r"\d{4}-\d\d-\d\d, .{5,}", reason) for reason in reasons)


def test_commands_exist() -> None:
    for found in ledger.bars().values():
        scripts = [word for word in found.command.split() if word.endswith(".py")]
        assert all((ROOT / script).is_file() for script in scripts), found.command
        assert scripts or found.command.startswith("quadfringe "), found.command
        assert isinstance(found.since, date), found.key
        assert len(found.moved) >= 5, found.key


# The helper and the scanner, on planted faults


def test_values_outside_a_bar_fail() -> None:
    both = bar("pair.interval_95")
    for value in (both.lower, both.upper):
        hold(both.key, value)
    for value in (0.9, 1.0, np.nan, [0.95, 0.9]):
        with pytest.raises(AssertionError, match=r"pair\.interval_95: poses of a pair .* bar 0\.92 to 0\.995"):
            hold(both.key, value)
    with pytest.raises(AssertionError, match=r"has no bar 'pair\.unknown'"):
        hold("pair.unknown", 0.0)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("assert score.depth_rms_mm <= 0.1", ["score.depth_rms_mm <= 0.1"]),
        ("BAR = 0.1\nassert all(f['phase_rms_rad'] < 1.5 * BAR for f in x)", ["f['phase_rms_rad'] < 1.5 * BAR"]),
        ("assert wrong[sure].mean() < (0.97 if known else 0.96)", ["wrong[sure].mean() < (0.97 if known else 0.96)"]),
        ("assert a.error == pytest.approx(1, rel=0.05)", ["rel=0.05"]),
        ("np.testing.assert_allclose(a, b, atol=2e-3)", ["atol=0.002"]),
        ("assert found.phase_rms_rad < 1e-6", []),
        ("assert a.phase_rms_rad < b.phase_rms_rad", []),
        ("assert len(names) > 3", []),
        ("assert rows[0].error_mm < rows[1].error_mm", []),
    ],
)
def test_literal_bars_are_found(text: str, expected: list[str]) -> None:
    assert [ast.unparse(ast.parse(found)) if "=" not in found else found for _, found in literal_bars(text)] == expected


def test_kernel_bars_are_found() -> None:
    source = """
        assert!(found.phase_rms_rad < 0.005, "{name}");
        prop_assert!(found.wrong_share() <= 2e-3);
        assert!(worst_mm < 1e-6, "rounding");
        assert!(count > 3);
        assert!(
            share > 0.96 && found.lit > 7,
            "{share}"
        );
    hold_shares(Method::Joint, &["face"], [0.06, 0.1], [0.04, 0.02]);
    """
    expected = ["found.phase_rms_rad < 0.005", "found.wrong_share() <= 2e-3", "share > 0.96 && found.lit > 7"]
    expected.append('hold_shares(Method::Joint, &["face"], [0.06, 0.1], [0.04, 0.02])')
    assert list(rust_bars(source)) == expected


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        ("upper = 1.0", "missing fields"),
        ("figure = 'f'\nunit = '1'\ncommand = 'c'\nsince = 2026-01-01\nmoved = 'm'", "expected lower, upper or both"),
        ("figur = 'f'\nupper = 1.0", "unknown fields"),
    ],
)
def test_incomplete_entries_are_refused(tmp_path: Path, entry: str, reason: str) -> None:
    (tmp_path / "bars.toml").write_text(f"[group.name]\n{entry}\n")
    with pytest.raises(ValueError, match=reason):
        ledger.bars(tmp_path / "bars.toml")
