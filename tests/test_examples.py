"""Every public name has an example that a reader sees in the reference, and every example runs and gives what it shows.

Public is what the pages in docs/reference/api describe: the names that their modules export.
"""

from __future__ import annotations

import doctest
import inspect
import pkgutil
import re
from collections.abc import Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

import quadfringe

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted((ROOT / "docs" / "reference" / "api").glob("*.md"))
PUBLIC = [name for page in PAGES for name in re.findall(r"<!-- generated: api ([\w.]+) -->", page.read_text())]
PARSER = doctest.DocTestParser()
PACKAGES = ("calibration", "config", "data", "decoding", "devices", "doctor", "io", "recording", "scanner", "view")
MODULES = ["quadfringe", "quadfringe.files", "quadfringe.errors"] + [
    module.name
    for package in PACKAGES
    for module in pkgutil.walk_packages([f"{quadfringe.__path__[0]}/{package}"], f"quadfringe.{package}.")
    if not module.name.endswith("__main__")
]
MODULES += [f"quadfringe.{package}" for package in PACKAGES]


def text_of(thing: object) -> str:
    """Give the docstring of something, and those of the members of a class."""
    texts = [inspect.getdoc(thing) or ""]
    if inspect.isclass(thing):
        members = [member for name, member in vars(thing).items() if not name.startswith("_")]
        texts += [inspect.getdoc(member) or "" for member in members]
    return "\n".join(texts)


def examples_in(text: str) -> str:
    """Give the code of the examples in a docstring, without imports, which show no use, and what they print."""
    shown = [part for example in PARSER.get_examples(text) for part in (*example.source.splitlines(), example.want)]
    return "\n".join(line for line in shown if not re.match(r"(from|import) ", line))


def identity(home: ModuleType, name: str) -> str:
    """Give the place where something is defined, which is the same in all modules that export it."""
    thing = getattr(home, name)
    documented = inspect.isclass(thing) or inspect.isfunction(thing)
    return f"{thing.__module__}.{thing.__qualname__}" if documented else f"{name} = {thing!r}"


def with_example(home: ModuleType) -> set[str]:
    """Give what a module exports and its text, or the text of the module, shows in use."""
    shown, found = examples_in(text_of(home)), set()
    for name in home.__all__:
        thing = getattr(home, name)
        described = inspect.isclass(thing) or inspect.isroutine(thing)
        if re.search(rf"\b{name}\b", shown) or (described and examples_in(text_of(thing))):
            found.add(identity(home, name))
    return found


def without_example(homes: Sequence[ModuleType]) -> list[str]:
    """Name what modules export and none of them shows in use; modules in modules have other pages."""
    found = set().union(*map(with_example, homes))
    named = [(home, name) for home in homes for name in home.__all__ if not inspect.ismodule(getattr(home, name))]
    return [f"{home.__name__}.{name}" for home, name in named if identity(home, name) not in found]


def test_every_public_name_has_an_example() -> None:
    assert len(PUBLIC) > 30
    assert without_example([import_module(name) for name in PUBLIC]) == []


def test_a_name_without_an_example_is_found() -> None:
    home = ModuleType("home", ">>> from home import used, imported\n>>> used()\n1\n")
    home.__all__ = ["used", "imported"]  # type: ignore[attr-defined]
    home.used, home.imported = partial(int, 1), partial(int, 2)  # type: ignore[attr-defined]
    assert without_example([home]) == ["home.imported"]


@pytest.mark.parametrize("name", MODULES)
def test_examples_run(name: str) -> None:
    assert doctest.testmod(import_module(name)).failed == 0


def test_examples_are_found() -> None:
    assert (
        sum(len(test.examples) for test in doctest.DocTestFinder().find(import_module("quadfringe.decoding.stages")))
        > 5
    )
