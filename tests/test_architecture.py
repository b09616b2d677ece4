"""Python imports between folders, and the size of the package; import-linter checks imports within it."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
TOP_LEVEL_ENTRIES = 18
FOLDERS = ("tests", "benches", "evaluation", "docs", "python", "scripts")
SOURCES = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py"))]
MODULES = {
    folder: {path.stem for path in (ROOT / folder).rglob("*.py") if path.stem not in ("__init__", "conftest")}
    for folder in ("tests", "benches", "evaluation", "docs")
}


def imported(tree: ast.AST) -> Iterator[str]:
    """Give the first part of the name of every module that a source imports."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.partition(".")[0]


def path_changes(tree: ast.AST) -> Iterator[int]:
    """Give the lines that use sys.path, as an attribute or imported by name."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and ast.unparse(node) == "sys.path":
            yield node.lineno
        if isinstance(node, ast.ImportFrom) and node.module == "sys" and any(a.name == "path" for a in node.names):
            yield node.lineno


def foreign(folder: str, tree: ast.AST) -> set[str]:
    """Give the modules of other folders that a source of this folder imports."""
    own = MODULES.get(folder, set())
    other = {name for other, names in MODULES.items() if other != folder for name in names} | {"support"}
    allowed = own | ({"support"} if folder == "tests" else set())
    return set(imported(tree)) & (other - allowed)


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_folders_do_not_import_each_other(path: Path) -> None:
    tree, folder = ast.parse(path.read_text()), path.relative_to(ROOT).parts[0]
    assert not foreign(folder, tree), "share it through tests/support (tests alone) or quadfringe.evaluation"
    assert not list(path_changes(tree)), "sys.path is not changed by hand"


def asserted_times(tree: ast.AST) -> Iterator[int]:
    """Give the lines of assertions that a duration is short: they would fail on a machine with other load."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Assert):
            for compared in (part for part in ast.walk(node.test) if isinstance(part, ast.Compare)):
                short = isinstance(compared.ops[0], ast.Lt | ast.LtE) and isinstance(compared.left, ast.BinOp)
                if short and any(
                    clock in ast.unparse(compared.left) for clock in ("monotonic", "perf_counter", "time.time")
                ):
                    yield compared.lineno


@pytest.mark.parametrize("path", sorted((ROOT / "tests").rglob("*.py")), ids=lambda path: path.name)
def test_no_test_depends_on_speed(path: Path) -> None:
    assert not list(asserted_times(ast.parse(path.read_text()))), "speed is measured in benches/"


def test_planted_times_are_found() -> None:
    assert list(asserted_times(ast.parse("assert time.monotonic() - start < 2.0"))) == [1]
    assert list(asserted_times(ast.parse("assert time.monotonic() - start > 0.4"))) == []
    assert list(asserted_times(ast.parse("assert time.monotonic() < deadline"))) == []


def test_planted_imports_are_found() -> None:
    assert foreign("tests", ast.parse("import peers")) == {"peers"}
    assert foreign("benches", ast.parse("from support.sizes import line_count")) == {"support"}
    assert foreign("evaluation", ast.parse("import numpy, accuracy")) == set()
    assert list(path_changes(ast.parse("import sys\nsys.path.append('x')"))) == [2]
    assert list(path_changes(ast.parse("from sys import path"))) == [1]


def test_the_package_has_few_rooms() -> None:
    ignored = {"__pycache__", *(path.name for path in (ROOT / "python" / "quadfringe").glob("_core.*so*"))}
    entries = {entry.name for entry in (ROOT / "python" / "quadfringe").iterdir()} - ignored
    assert len(entries) <= TOP_LEVEL_ENTRIES, sorted(entries)


def test_the_package_is_imported_without_modules_that_windows_lacks() -> None:
    without = "import sys; sys.modules.update(dict.fromkeys(['fcntl', 'resource', 'termios', 'pwd', 'grp']));"
    modules = "quadfringe, quadfringe.cli, quadfringe.recording, quadfringe.io.bounded, quadfringe.view.viewer"
    subprocess.run([sys.executable, "-c", f"{without} import {modules}"], check=True)
