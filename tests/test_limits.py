"""A source file has at most 300 lines, a function at most 40; exceptions are listed here, each with its reason."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
from support.sizes import python_functions, rust_functions, violations

ROOT = Path(__file__).resolve().parents[1]
FILE_LINES, FUNCTION_LINES = 300, 40
MOST_EXCEPTIONS = 8

# Functions of tests, benchmarks, examples and scripts may be longer; their files may not.
LONG_FUNCTIONS = ("crates/*/src/**/*.rs", "python/**/*.py")
FILES = (
    *LONG_FUNCTIONS,
    "python/**/*.pyi",
    "crates/*/tests/**/*.rs",
    "crates/*/benches/**/*.rs",
    "crates/*/examples/**/*.rs",
    "crates/*/fuzz/*.rs",
    "tests/**/*.py",
    "benches/**/*.py",
    "evaluation/**/*.py",
    "docs/**/*.py",
    "scripts/**/*.py",
)

# `path`, or `path::function`, and why it is better long.
JOINT = "crates/quadfringe/src/joint"
REPLACED = "the joint energy replaces this step; to polish it before that would be work for nothing"
EXCEPTIONS = {
    "python/quadfringe/cli/decode.py::decode": "one parameter for each option; its body has ten lines",
    "python/quadfringe/_core.pyi": "one compiled module has one stub file; type checkers do not read several",
    f"{JOINT}/photometry/choice/mod.rs::make": REPLACED,
    f"{JOINT}/photometry/project.rs::project": REPLACED,
    f"{JOINT}/photometry/solve.rs::new": REPLACED,
    f"{JOINT}/photometry/solve.rs::solve": REPLACED,
}


@cache
def too_long() -> dict[str, int]:
    """Give everything over a limit in the repository, with its lines."""
    found: dict[str, int] = {}
    for pattern in FILES:
        for path in sorted(ROOT.glob(pattern)):
            if "target" in path.relative_to(ROOT).parts:
                continue
            functions = pattern in LONG_FUNCTIONS and path.stem != "tests" and path.parent.name != "tests"
            limits = {"file_lines": FILE_LINES, "function_lines": FUNCTION_LINES}
            found |= violations(ROOT, path, functions=functions, **limits)
    return found


def test_files_and_functions_are_short() -> None:
    over = {name: lines for name, lines in too_long().items() if name not in EXCEPTIONS}
    assert not over, f"split by idea, or add to EXCEPTIONS with a reason (lines, limits 300 and 40): {over}"


def test_no_exception_is_short_by_now() -> None:
    short = EXCEPTIONS.keys() - too_long().keys()
    assert not short, f"remove from EXCEPTIONS: {sorted(short)}"


def test_exceptions_are_few_and_reasoned() -> None:
    assert len(EXCEPTIONS) <= MOST_EXCEPTIONS
    assert all(len(reason.split()) >= 5 for reason in EXCEPTIONS.values())


# The measure itself, on planted sources


RUST = r"""
//! A brace in a comment: {
fn declared(&self) -> [u8; 2];
/* fn commented() { /* nested } */ */
impl Reader<'_> {
    /// fn documented() {
    pub fn three<T>(&'a self, sizes: [usize; { 2 + 1 }], brace: char) -> Option<T>
    where T: Fn(u8) -> bool {
        let text = "fn quoted() { \" {{{"; let raw = r#"}}} " }"#; let letters = ('{', '\'', b'}', '"');
    }
}
#[cfg(test)]
mod tests {
    fn tested() {
    }
}
fn last() { if true { loop { break; } } }
"""


def test_rust_functions_are_measured_by_their_braces() -> None:
    assert list(rust_functions(RUST)) == [("three", 4), ("last", 1)]


def test_python_functions_are_measured_from_def_to_end() -> None:
    source = "class A:\n @property\n def b(self):\n  'Say.'\n\n  async def c(): return 1\n  return c\n"
    assert list(python_functions(source)) == [("A.b", 5), ("A.b.c", 1)]


@pytest.mark.parametrize(
    ("name", "source", "expected"),
    [
        ("a.py", "x = 1\n" * 300, {}),
        ("a.py", "x = 1\n" * 301, {"a.py": 301}),
        ("a.py", "def f():\n" + "    x = 1\n" * 39, {}),
        ("a.py", "def f():\n" + "    x = 1\n" * 40, {"a.py::f": 41}),
        ("a.rs", "fn f() {\n" + "    g();\n" * 38 + "}\n", {}),
        ("a.rs", "fn f() {\n" + "    g();\n" * 39 + "}\n", {"a.rs::f": 41}),
        ("a.rs", "// x\n" * 301, {"a.rs": 301}),
    ],
)
def test_planted_faults_are_found(tmp_path: Path, name: str, source: str, expected: dict[str, int]) -> None:
    (tmp_path / name).write_text(source)
    limits = {"file_lines": FILE_LINES, "function_lines": FUNCTION_LINES}
    assert violations(tmp_path, tmp_path / name, functions=True, **limits) == expected
