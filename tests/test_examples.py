"""Examples in the docstrings of the packages that hold the public API run and give what they show."""

from __future__ import annotations

import doctest
import pkgutil
from importlib import import_module

import pytest

import quadfringe

PACKAGES = ("config", "data", "decoding", "scanner")
MODULES = ["quadfringe", "quadfringe.files", "quadfringe.errors", "quadfringe.io.bounded"] + [
    module.name
    for package in PACKAGES
    for module in pkgutil.walk_packages([f"{quadfringe.__path__[0]}/{package}"], f"quadfringe.{package}.")
]


@pytest.mark.parametrize("name", MODULES)
def test_examples_run(name: str) -> None:
    assert doctest.testmod(import_module(name)).failed == 0


def test_examples_are_found() -> None:
    assert (
        sum(len(test.examples) for test in doctest.DocTestFinder().find(import_module("quadfringe.decoding.stages")))
        > 5
    )
