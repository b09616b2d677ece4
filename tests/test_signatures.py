"""No function of the kernel takes or gives a tuple of mixed meaning: such things are structs with named fields."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

KERNEL = Path(__file__).resolve().parents[1] / "crates" / "quadfringe" / "src"

# Files of the joint method whose inside the joint energy replaces.
REPLACED = ("joint/photometry/", "joint/window")
# Tuples that remain, by file and function, each with its reason.
ALLOWED = {
    **dict.fromkeys(
        [
            "height/pair_table.rs: check",
            "height/pair_table.rs: shape",
            "height/triangulator/mod.rs: shape",
            "rig/options.rs: check",
            "rig/render.rs: shape",
            "rig/truth.rs: shape",
        ],
        "rows and columns of an image, as `ndarray` gives and takes them",
    ),
    "condition/shot.rs: mosaic": "an image and its Bayer pattern: the two types say which is which",
    "parallel/angle.rs: sin_cos": "sine and cosine, as `f32::sin_cos` gives them",
    "surface/face.rs: add": "a row of the table of parts of the face",
    "surface/face.rs: take": "a row of the table of parts of the face",
}
# A bracket after a name or `>` holds the arguments of a function type such as `Fn(f32, f32)`.
TUPLE = re.compile(r"(?<![\w>])\((?=[^()]*,\s*\S)[^()]*\)")


def closing(text: str, start: int) -> int:
    """Give the place of the bracket that closes the one at `start`."""
    depth = 0
    for place in range(start, len(text)):
        depth += {"(": 1, ")": -1}.get(text[place], 0)
        if depth == 0:
            return place
    raise ValueError(f"no bracket closes {text[start : start + 40]!r}")


def signatures(text: str) -> Iterator[tuple[str, str]]:
    """Give the name of every function outside test modules, and its types."""
    code = re.sub(r"//[^\n]*", "", text.partition("#[cfg(test)]\nmod tests {")[0])
    for found in re.finditer(r"\bfn (\w+)\s*(?:<[^(]*>)?\(", code):
        end = closing(code, found.end() - 1)
        parameters = code[found.end() : end]
        result = re.split(r"[{;]|\bwhere\b", code[end + 1 :], maxsplit=1)[0]
        # Names of parameters, which may be patterns of tuples, stand before the colon.
        types = re.sub(r"(?:\([^()]*\)|\w+)\s*:(?!:)", "", parameters)
        yield found[1], f"{types} -> {result}"


def tuples(root: Path) -> list[str]:
    """Name the functions with a tuple among their types, outside the replaced files."""
    found = []
    for path in sorted(root.rglob("*.rs")):
        name = str(path.relative_to(root))
        if not name.startswith(REPLACED) and path.stem != "tests":
            found += [f"{name}: {function}" for function, types in signatures(path.read_text()) if TUPLE.search(types)]
    return found


def test_no_function_takes_or_gives_a_tuple_of_mixed_meaning() -> None:
    assert [place for place in tuples(KERNEL) if place not in ALLOWED] == []


def test_no_exception_is_stale() -> None:
    assert ALLOWED.keys() - set(tuples(KERNEL)) == set()


@pytest.mark.parametrize(
    ("signature", "found"),
    [
        ("fn fit(phase: f32, how: (bool, usize)) {", True),
        ("fn fit<'a>(rows: &[(usize, f32)]) {", True),
        ("pub fn verdict(&self) -> (f32, f32, bool) {", True),
        ("fn find() -> Option<(usize, f32)> {", True),
        ("fn apply(change: impl Fn(f32, f32) -> f32) -> f32 {", False),
        ("fn apply((x, y): Point) {", False),
        ("fn nothing() -> Result<()> {", False),
        ("// fn fit(how: (bool, usize)) {", False),
        ("#[cfg(test)]\nmod tests {\n    fn fit(how: (bool, usize)) {", False),
    ],
)
def test_a_tuple_is_found(tmp_path: Path, signature: str, found: bool) -> None:
    (tmp_path / "a.rs").write_text(f"{signature}\n}}\n")
    assert bool(tuples(tmp_path)) is found
