"""The table of tuned numbers: how the sources are made variable, and which changes are listed."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.trees import write_tree

from quadfringe.evaluation import _sensitivity as sensitivity
from quadfringe.evaluation import _tunable as tunable

TREE = {
    "params/mod.rs": "pub mod fit;\npub mod tasks;\n",
    "params/fit.rs": (
        "//! Fit.\n\n/// Width of the window in px. Larger: less noise.\npub const WIDTH: f32 = 0.5;\n"
        "/// Rounds.\npub const ROUNDS: usize = 2;\n"
    ),
    "params/tasks.rs": "/// Rows of a task.\npub const ROWS: usize = 32;\n",
    "fit.rs": (
        "use super::params::fit::WIDTH;\nuse super::params::tasks::ROWS;\n/// Wider than [`WIDTH`].\n"
        "fn wide() -> f32 { 2.0 * WIDTH + ROWS as f32 + params::fit::ROUNDS as f32 } // WIDTH\n"
    ),
    "other.rs": "const WIDTH: usize = 3;\nfn width() -> usize { WIDTH }\n",
}


def test_numbers_have_value_and_meaning(tmp_path: Path) -> None:
    found = tunable.numbers(write_tree(tmp_path, TREE) / "params")
    assert [(one.key, one.value, one.meaning) for one in found] == [
        ("fit::WIDTH", "0.5", "Width of the window in px"),
        ("fit::ROUNDS", "2", "Rounds"),
    ]


def test_uses_of_a_number_become_calls(tmp_path: Path) -> None:
    root = write_tree(tmp_path, TREE)
    tunable.make_variable(root)
    params = (root / "params/fit.rs").read_text()
    assert 'super::tuned("fit::WIDTH", 0.5)' in params
    assert "const" not in params
    assert (root / "params/tasks.rs").read_text() == TREE["params/tasks.rs"]
    used = (root / "fit.rs").read_text()
    assert "2.0 * WIDTH() + ROWS as f32 + params::fit::ROUNDS() as f32" in used
    assert used.startswith(TREE["fit.rs"].partition("fn")[0])
    assert (root / "other.rs").read_text() == TREE["other.rs"]


def test_numbers_that_stay_fixed_exist() -> None:
    assert {one.key for one in tunable.numbers(tunable.PARAMS)} >= tunable.FIXED


def test_the_page_has_a_row_for_every_number_with_its_value() -> None:
    rows = (Path(__file__).parents[1] / "docs/method/sensitivity.md").read_text().splitlines()
    listed = [tuple(row.strip("| ").split(" | ")[:2]) for row in rows if row.startswith("| ")][2:]
    numbers = [one for one in tunable.numbers(tunable.PARAMS) if one.file != sensitivity.MOTION]
    assert listed == [(f"{one.file} {one.name}", one.value) for one in numbers]


def test_changes_beyond_chance_are_listed() -> None:
    base = {("white", "RMS"): 0.02, ("white", "returned"): 99.0, ("rods", "wrong"): 0.1}
    chance = {("white", "RMS"): 0.05, ("white", "returned"): 0.1, ("rods", "wrong"): 0.02}
    worse = {("white", "RMS"): 0.024, ("white", "returned"): 98.95, ("rods", "wrong"): 0.05}
    assert sensitivity.listed(worse, base, chance) == "white +20 %; rods -0.05 wrong"
    assert sensitivity.listed(base, base, chance) == "none"
    assert sensitivity.listed(None, base, chance) == "fails"


@pytest.mark.parametrize("name", sensitivity.SCENES.values())
def test_the_scenes_exist(name: tuple[str, ...]) -> None:
    assert set(name) <= set(sensitivity.world.SCENES)
