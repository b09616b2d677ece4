"""The tuned numbers of the kernel: each stands in a params file and says what measured it.

Each check returns a list of faults and takes the folder of the sources, so that a planted fault can show that it fails.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from support.trees import write_tree

KERNEL = Path(__file__).resolve().parents[1] / "crates" / "quadfringe" / "src"

COMMAND = re.compile(r"`(?:cargo|make|pytest|python|quadfringe|scripts/\w+) [^`]+`")
REASON = re.compile(r"\b(?:Follows from|Not measured)\b")
# Defined with its command in the head of joint/params/mod.rs.
VARIED = re.compile(r"\b[Vv]aried\b")
REFERENCE = re.compile(r"\b(?:See|As) \[`(\w+)`\]")

DECLARATION = re.compile(r"^\s*(pub(?:\([\w: ]+\))? )?const ([A-Z]\w*): ([^=;]+) =(.*)$")
TEST_MODULE = re.compile(r"#\[cfg\(test\)\]\s*(?:#\[[^\]]+\]\s*)*(?:pub(?:\(\w+\))? )?mod (\w+)(;| \{)")
LITERAL = re.compile(r"-?[\d.][\w.]*(?:e-?\d+)?(?: (?:[-+*/]|<<|>>) [\d.][\w.]*)*;")

# Numbers outside params files, by topic (the folder in src). None of them trades one property of a result for another.
ALLOWED: dict[tuple[str, str], str] = {
    **dict.fromkeys(
        [
            ("condition", "BLOCK"),
            ("height", "BLOCK"),
            ("reference", "BLOCK"),
            ("stages", "BLOCK"),
            ("joint", "LANES"),
            ("parallel", "LANES"),
            ("stages", "LANES"),
            ("surface", "LANES"),
            ("joint", "PAD"),
            ("parallel", "LINE"),
            ("stages", "WORD"),
        ],
        "size of a block, a vector, a word or a cache line: changes the time, not the result",
    ),
    **dict.fromkeys(
        [
            ("condition", "TERMS"),
            ("height", "NODES"),
            ("joint", "CANDIDATES"),
            ("joint", "COUNT"),
            ("joint", "FOLLOWED"),
            ("joint", "FREQUENCIES"),
            ("joint", "LEVEL_MAPS"),
            ("joint", "MATRIX"),
            ("joint", "NEAR"),
            ("joint", "RIM"),
            ("joint", "SUMS"),
            ("joint", "TERMS"),
        ],
        "number of terms of a formula that the code writes out",
    ),
    **dict.fromkeys(
        [
            ("condition", "INFRARED"),
            *(("joint", name) for name in ("A_R", "A_B", "P_R", "P_B", "A_G", "A_IR", "B_G", "B_IR", "WEAKEST")),
            *(("joint", name) for name in ("W", "C", "S", "CC", "CS")),
            *(("joint", name) for name in ("P", "RATIO", "PURITY", "MODULATION", "FIRST", "WEIGHT")),
            ("joint", "GROWN"),
            ("mesh", "FALLS"),
        ],
        "place in an array, or mark of a state",
    ),
    **dict.fromkeys(
        [("condition", "MARGIN"), ("condition", "ROW_MARGIN")],
        "reach of an interpolation, given by its number of samples",
    ),
    **dict.fromkeys(
        [("condition", "LEVELS"), ("condition", "FULL_SCALE")],
        "range of a number format",
    ),
    **dict.fromkeys(
        [
            ("joint", "IMPOSSIBLE"),
            ("parallel", "SHIFT"),
            ("parallel", "TAU_HIGH"),
            ("parallel", "TAU_LOW"),
            ("rig", "TAU_HIGH"),
            ("rig", "TAU_LOW"),
            ("stages", "GATHER"),
            ("stages", "STEPS"),
            ("stages", "WHOLE"),
        ],
        "convention of the arithmetic: bits of a format, halves of a constant, length of a table",
    ),
    **dict.fromkeys(
        [
            ("joint", "MEDIAN_OF_NORMAL"),
            ("stages", "MEDIAN_OF_NORMAL"),
            ("joint", "UNKNOWNS"),
            ("stages", "STEPS_MIN"),
        ],
        "follows from statistics or algebra, as its comment derives",
    ),
    **dict.fromkeys(
        [
            ("rig", "FOCAL_MM"),
            ("rig", "CAMERA_PITCH_UM"),
            ("surface", "CREASE_MM"),
            ("surface", "PEAKS_SLOPE_PER_MM"),
            ("surface", "PLATE_MM"),
            ("surface", "REFERENCE_Z_MM"),
            ("surface", "ROUNDING_MM"),
        ],
        "defines a scene or the reference bench",
    ),
}


class Number(NamedTuple):
    path: str
    name: str
    comment: str
    value: str

    @property
    def tuned(self) -> bool:
        parts = Path(self.path).parts
        return parts[-1] == "params.rs" or "params" in parts

    @property
    def key(self) -> tuple[str, str]:
        return Path(self.path).parts[0].removesuffix(".rs"), self.name


def sources(root: Path) -> Iterator[tuple[Path, str]]:
    """Give every source without its tests."""
    texts = {path: path.read_text() for path in sorted(root.rglob("*.rs"))}
    tests = set()
    for path, text in texts.items():
        folder = path.parent if path.name in {"mod.rs", "lib.rs"} else path.with_suffix("")
        names = [name for name, end in TEST_MODULE.findall(text) if end == ";"]
        tests |= {folder / f"{name}.rs" for name in names} | {folder / name / "mod.rs" for name in names}
    for path, text in texts.items():
        if path not in tests:
            inline = next((m.start() for m in TEST_MODULE.finditer(text) if m[2] == " {"), len(text))
            yield path, text[:inline]


def numbers(root: Path) -> Iterator[Number]:
    """Give the constants of all sources with the comment above each."""
    for path, text in sources(root):
        comment: list[str] = []
        for line in text.splitlines():
            stripped = line.strip()
            if found := DECLARATION.match(line):
                name, value = found[2], found[4].strip()
                yield Number(str(path.relative_to(root)), name, " ".join(comment), value)
            if stripped.startswith("///"):
                comment.append(stripped[3:].strip())
            elif not stripped.startswith("#["):
                comment = []


def explained(number: Number, known: dict[str, Number]) -> bool:
    """Say whether the comment of a number, or that of the number it refers to, names a command or a reason."""
    if COMMAND.search(number.comment) or REASON.search(number.comment):
        return True
    if Path(number.path).parts[0] == "joint" and VARIED.search(number.comment):
        return True
    reference = REFERENCE.search(number.comment)
    return bool(reference and reference[1] != number.name and explained(known[reference[1]], known))


def unexplained(root: Path) -> list[str]:
    """Name the numbers of params files without a command, "Varied", "Follows from" or "Not measured"."""
    tuned = [number for number in numbers(root) if number.tuned]
    faults = []
    for path in {number.path for number in tuned}:
        known = {number.name: number for number in tuned if number.path == path}
        faults += [f"{path}: {number.name}" for number in known.values() if not explained(number, known)]
    return sorted(faults)


def stray(root: Path) -> list[Number]:
    """Give the constants with a number for a value outside params files."""
    return [number for number in numbers(root) if not number.tuned and LITERAL.fullmatch(number.value)]


def test_every_tuned_number_names_what_measured_it() -> None:
    assert len([number for number in numbers(KERNEL) if number.tuned]) > 150
    assert unexplained(KERNEL) == []


def test_the_meaning_of_varied_names_its_command() -> None:
    head = " ".join(line[3:].strip() for line in (KERNEL / "joint/params/mod.rs").read_text().splitlines())
    assert '"Varied" means' in head
    assert COMMAND.search(head)


def test_tuned_numbers_stand_in_params_files() -> None:
    assert [f"{number.path}: {number.name}" for number in stray(KERNEL) if number.key not in ALLOWED] == []


def test_the_list_of_other_numbers_has_no_stale_entry() -> None:
    assert set(ALLOWED) - {number.key for number in stray(KERNEL)} == set()


SOUND = {
    "joint/params/mod.rs": '//! "Varied" means: `cargo test`.\npub mod orders;\n',
    "joint/params/orders.rs": (
        "/// Price. Varied: no effect.\npub const PRICE: f64 = 1.25;\n/// See [`PRICE`].\npub const OTHER: f64 = 1.0;\n"
    ),
    "stages/params.rs": "/// Rows (`python evaluation/accuracy.py`).\npub(crate) const ROWS: usize = 16;\n",
    "stages/mod.rs": "const ROWS: usize = params::ROWS;\n#[cfg(test)]\nmod tests {\n    const WIDTH: usize = 9;\n}\n",
}


def test_a_sound_tree_has_no_fault(tmp_path: Path) -> None:
    root = write_tree(tmp_path, SOUND)
    assert unexplained(root) == [] == stray(root)


@pytest.mark.parametrize(
    "comment",
    [
        "",
        "/// Rows that are read.\n",
        "/// Rows. Varied: no effect.\n",
        "/// See [`ROWS`].\n",
        "/// Rows, see `cargo`.\n",
    ],
)
def test_a_number_without_a_command_is_found(tmp_path: Path, comment: str) -> None:
    files = SOUND | {"stages/params.rs": f"{comment}pub(crate) const ROWS: usize = 16;\n"}
    root = write_tree(tmp_path, files)
    assert unexplained(root) == ["stages/params.rs: ROWS"]


def test_a_reference_to_a_number_without_a_command_is_found(tmp_path: Path) -> None:
    text = "/// Price.\npub const PRICE: f64 = 1.25;\n/// See [`PRICE`].\npub const OTHER: f64 = 1.0;\n"
    assert len(unexplained(write_tree(tmp_path, SOUND | {"joint/params/orders.rs": text}))) == 2


@pytest.mark.parametrize("value", ["0.3", "1 << 14", "9.0 / 64.0", "1e-3", "-4", "16usize"])
def test_a_number_outside_params_files_is_found(tmp_path: Path, value: str) -> None:
    text = f"/// Threshold.\npub(super) const LIMIT: f32 = {value};\n"
    root = write_tree(tmp_path, SOUND | {"stages/mod.rs": text})
    assert [(number.path, number.name) for number in stray(root)] == [("stages/mod.rs", "LIMIT")]
