"""Find accuracy bars in sources: limits that stand as numbers in a test, and keys of the ledger that are used."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

ROUNDING = 1e-3  # smaller limits are tolerances of arithmetic, not accuracy bars
ACCURACY = re.compile(r"(_rad|_percent|_mm|_px|_deg)\b|rms|median|exponent|uncertain|share|error|wrong|returned")
TOLERANCES = {"abs", "rel", "atol", "rtol"}
RUST_ASSERT = re.compile(r"\b(?:prop_)?assert!\((.*?)(?:,\s*\"|\);)", re.DOTALL)
RUST_HOLD = re.compile(r"^    (hold_\w+\(.*?\));", re.DOTALL | re.MULTILINE)  # a helper with the limits as arguments
RUST_LIMIT = re.compile(r"[<>]=? ?[^<>=&|;]*?\b\d[\d_]*(?:\.\d+)?(?:e-?\d+)?")


def literal_bars(source: str) -> Iterator[tuple[int, str]]:
    """Give line and text of every comparison in a Python test of a measured figure with a number written there.

    A number that is a constant of the module counts; one that comes as an argument of a function cannot be seen.
    """
    tree = ast.parse(source)
    constants = {
        target.id
        for node in tree.body
        if isinstance(node, ast.Assign) and _is_limit(node.value, set())
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Assert):
            for compared in ast.walk(node.test):
                if isinstance(compared, ast.Compare) and _is_bar(compared, constants):
                    yield compared.lineno, ast.unparse(compared)
        if isinstance(node, ast.keyword) and node.arg in TOLERANCES and _is_limit(node.value, constants):
            yield node.value.lineno, f"{node.arg}={ast.unparse(node.value)}"


def _is_bar(compared: ast.Compare, constants: set[str]) -> bool:
    ordered = any(isinstance(operator, ast.Lt | ast.LtE | ast.Gt | ast.GtE) for operator in compared.ops)
    sides = [compared.left, *compared.comparators]
    return ordered and any(_is_limit(side, constants) for side in sides) and any(map(_is_figure, sides))


def _is_figure(side: ast.expr) -> bool:
    words = []
    for node in ast.walk(side):
        if isinstance(node, ast.Name):
            words.append(node.id)
        elif isinstance(node, ast.Attribute):
            words.append(node.attr)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            words.append(node.value)
    return any(ACCURACY.search(word) for word in words)


def _is_limit(side: ast.expr, constants: set[str]) -> bool:
    """Tell whether a number stands in an expression of arithmetic; indices and arguments are none."""
    if isinstance(side, ast.Constant):
        return isinstance(side.value, int | float) and not isinstance(side.value, bool) and abs(side.value) >= ROUNDING
    if isinstance(side, ast.Name):
        return side.id in constants
    parts = (ast.BinOp, ast.UnaryOp, ast.IfExp, ast.operator, ast.unaryop)
    return isinstance(side, parts) and any(
        _is_limit(child, constants) for child in ast.iter_child_nodes(side) if isinstance(child, ast.expr)
    )


def keys_used(source: str) -> Iterator[re.Pattern[str]]:
    """Give patterns of the strings in a source that may be keys of the ledger; a placeholder fits anything."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and "." in node.value:
            yield re.compile(re.escape(node.value))
        if isinstance(node, ast.JoinedStr):
            parts = [
                re.escape(part.value) if isinstance(part, ast.Constant) else r"\w+"
                for part in node.values
                if isinstance(part, ast.Constant | ast.FormattedValue)
            ]
            if r"\." in parts[0]:
                yield re.compile("".join(parts))


def rust_bars(source: str) -> Iterator[str]:
    """Give the condition of every assertion in a Rust test that limits a measured figure by a number, in one line."""
    for found in RUST_ASSERT.finditer(source):
        condition = " ".join(found[1].split())
        limit = RUST_LIMIT.search(condition)
        if limit and ACCURACY.search(condition) and _largest(limit[0]) >= ROUNDING:
            yield condition
    yield from (" ".join(found[1].split()) for found in RUST_HOLD.finditer(source))


def _largest(text: str) -> float:
    numbers = re.findall(r"(?<![\w.])\d[\d_]*(?:\.\d+)?(?:e-?\d+)?", text)
    return max((float(number.replace("_", "")) for number in numbers), default=0.0)
