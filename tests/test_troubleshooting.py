"""The page of troubleshooting knows every error, cause, finding and reason of the code, and no others."""

from __future__ import annotations

import ast
import pkgutil
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import quadfringe as qf
from quadfringe import errors
from quadfringe.calibration.detect import TargetNotFoundError
from quadfringe.calibration.poses import DegeneratePosesError
from quadfringe.io.bounded import BoundedError, UnansweredError

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "troubleshooting.md").read_text()
NAMES = set(re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```$", "", PAGE, flags=re.MULTILINE | re.DOTALL)))
ROW = re.compile(r"^\| (`[^|]*`) \|", re.MULTILINE)
# Calls whose first argument is a name that users read.
NAMING = {"Cause", "Finding", "graded", "TargetNotFoundError", "DegeneratePosesError", "CalibrationError"}
# Names that a call takes from a variable, by the name of the variable and the module.
VARIABLE = {
    ("ORDERS", "verdict"): ("fringe orders",),
    ("ORDERS", "channel_offsets"): ("fringe orders",),
    ("what", "calibration"): ("response", "projector response"),
    ("name", "calibration"): ("camera", "projector", "infrared"),
    ("name", "finding"): (),  # in `graded`
    ("name", "screens"): ("… screen",),
    ("name", "shot"): ("response", "decoding response"),
    ("one.name", "shot"): ("modulation …",),
}
# A name that another error or cause already has.
PASSED_ON = {"error.reason", "cause.name", "error.reason or 'fringe orders'"}
CLASSES = [*(getattr(errors, name) for name in errors.__all__ if name != "require"), TargetNotFoundError]
CLASSES += [DegeneratePosesError, BoundedError, UnansweredError]


def names_of(node: ast.expr, module: str) -> tuple[str, ...]:
    """Give the names that the first argument of a call may be; … stands for what is filled in."""
    if isinstance(node, ast.Constant):
        return (str(node.value),)
    if isinstance(node, ast.JoinedStr):
        return ("".join(part.value if isinstance(part, ast.Constant) else "…" for part in node.values),)
    if isinstance(node, ast.IfExp):
        return names_of(node.body, module) + names_of(node.orelse, module)
    written = ast.unparse(node)
    return () if written in PASSED_ON else VARIABLE[written, module]


def named(source: str, module: str) -> Iterator[str]:
    """Give the names of causes, findings and reasons that a module gives."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in NAMING and node.args:
            yield from names_of(node.args[0], module)


def names_in_the_code() -> set[str]:
    paths = (ROOT / "python" / "quadfringe").rglob("*.py")
    return {one.replace("… rate", "… screen rate") for path in paths for one in named(path.read_text(), path.stem)}


def first_cells() -> set[str]:
    return {name for cell in ROW.findall(PAGE) for name in re.findall(r"`([^`]+)`", cell)}


def test_every_cause_finding_and_reason_is_on_the_page() -> None:
    found = names_in_the_code()
    assert len(found) > 80
    assert found - NAMES == set()


def test_every_error_is_on_the_page_with_its_base() -> None:
    for error in CLASSES:
        base = error.__base__.__name__
        row = rf"^\| `{error.__name__}` \| `{base}` \|" if "Error" in error.__name__ else rf"^\| `{error.__name__}` \|"
        assert re.search(row, PAGE, re.MULTILINE), error


def test_every_public_error_class_is_known_here() -> None:
    modules = pkgutil.walk_packages(qf.__path__, "quadfringe.")
    public = [one.name for one in modules if not re.search(r"\._|\.__main__", one.name) and ".cli" not in one.name]
    found = {
        thing
        for name in public
        for thing in vars(import_module(name)).values()
        if isinstance(thing, type) and issubclass(thing, Exception) and thing.__module__ == name
    }
    assert found <= set(CLASSES)


def test_every_reason_of_a_hole_is_on_the_page_in_its_words() -> None:
    for reason in qf.Reason:
        assert f"| `{reason.name}` | {reason.words} |" in PAGE


def test_the_page_invents_no_name() -> None:
    known = names_in_the_code() | {error.__name__ for error in CLASSES} | {reason.name for reason in qf.Reason}
    assert first_cells() - known == set()


def test_a_name_that_is_not_on_the_page_is_found() -> None:
    source = (
        'Cause("new cause", words, fix)\ngraded(f"heat {name}", 1, LIMITS, words, fix)\nFinding(error.reason, "fault")'
    )
    assert set(named(source, "shot")) - NAMES == {"new cause", "heat …"}
