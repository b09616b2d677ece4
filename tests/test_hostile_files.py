"""A sample of the attack by damaged files; `python -m hostile --count 1000` in the folder tests is the whole."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hostile.files import KINDS, LIMITS, Kind, attack, importable, originals
from hostile.targets import KEPT, TARGETS, corpus, input_name, refusal, sound_inputs, target

from quadfringe.io.bounded import Helper

SAMPLE = 40  # of each of the eight kinds
HARMLESS = {"png/compressed-text-of-8-MB", "png/1-bit-grey", "png/two-billion-frames"}  # inputs that are read
REPORTS = ("calibration", "response", "system")  # their errors have a line for each problem


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Path]]:
    return originals(tmp_path_factory.mktemp("sound"))


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files_give_what_was_saved_or_one_error(kind: str, sound: dict[str, list[Path]]) -> None:
    outcomes = list(attack(kind, sound[kind], range(SAMPLE)))
    assert [outcome for outcome in outcomes if outcome.fault] == []
    assert sum(outcome.found == "refused" for outcome in outcomes) > SAMPLE / 4


@pytest.mark.parametrize(
    ("faulty", "found"),
    [
        (lambda path, _: path.read_bytes(), "changed"),
        (lambda path, _: {}[path], "traceback"),
        (lambda _, helper: helper.run(os.abort), "hang or crash"),
    ],
)
def test_the_attack_finds_a_faulty_reader(
    faulty: Callable[[Path, Any], Any], found: str, sound: dict[str, list[Path]], monkeypatch: pytest.MonkeyPatch
) -> None:
    files = sound["opencv"]
    reader = Kind(lambda path, helper: b"" if path in files else faulty(path, helper), exact=True)
    monkeypatch.setitem(KINDS, "opencv", reader)
    outcomes = list(attack("opencv", files, range(3)))
    assert [(outcome.found, outcome.fault) for outcome in outcomes] == [(found, True)] * 3


@pytest.mark.parametrize("kind", TARGETS)
def test_what_failed_once_gives_a_result_or_one_error(kind: str, tmp_path: Path) -> None:
    (tmp_path / "sound").mkdir()
    with target(kind, tmp_path) as attack_by:
        for data in sound_inputs(kind, tmp_path / "sound"):
            attack_by(data)
            attack_by(data[: len(data) // 2])
        for path in corpus(kind):
            attack_by(path.read_bytes())


@pytest.fixture(scope="module")
def bounded() -> Iterator[Helper]:
    """A helper process that ends when it reads for longer than a file may take."""
    with importable(), Helper(LIMITS) as helper:
        yield helper


@pytest.mark.parametrize("path", sorted(KEPT.glob("*/*")), ids=lambda path: f"{path.parent.name}-{path.name}")
def test_kept_inputs_are_refused_in_time_with_one_line(path: Path, bounded: Helper, tmp_path: Path) -> None:
    kind = path.parent.name
    name = input_name(kind)
    (tmp_path / name).write_bytes(path.read_bytes())
    words = bounded.run(refusal, kind, tmp_path / name)
    if f"{kind}/{path.name}" in HARMLESS:
        assert words == ""
    else:
        assert name in words or "/dev/zero" in words
        assert words.isprintable() or kind in REPORTS


def test_the_inputs_that_failed_are_of_known_kinds() -> None:
    folders = {path.parent.name for path in KEPT.glob("*/*")}
    assert folders
    assert folders <= set(TARGETS)
