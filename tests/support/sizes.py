"""Measure how long source files and their functions are."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

# Tried in this order: comments, raw strings, strings, character literals. A lifetime has no closing quote.
RUST_TEXT = re.compile(
    r"""//[^\n]*|/\*|b?r(?P<hashes>\#*)".*?"(?P=hashes)|b?"(?:\\.|[^"\\])*"|b?'(?:\\(?:x..|u\{[^}]*\}|.)|[^'\\\n])'""",
    re.DOTALL,
)
RUST_FUNCTION = re.compile(r"\bfn\s+([\w$]+)")
RUST_TESTS = re.compile(r"#\[cfg\(test\)\]\s*(?:pub(?:\([^)]*\))?\s+)?mod\s+\w+\s*\{")


def line_count(source: str) -> int:
    """Give the number of lines of a file."""
    return len(source.splitlines())


def python_functions(source: str) -> Iterator[tuple[str, int]]:
    """Give each function's name with its class, and its lines from `def` to the end."""
    yield from _functions_in(ast.parse(source), "")


def _functions_in(node: ast.AST, outer: str) -> Iterator[tuple[str, int]]:
    for child in ast.iter_child_nodes(node):
        name = outer
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            name = f"{outer}.{child.name}".lstrip(".")
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
            assert child.end_lineno is not None
            yield name, child.end_lineno - child.lineno + 1
        yield from _functions_in(child, name)


def rust_functions(source: str) -> Iterator[tuple[str, int]]:
    """Give each function's name and its lines from `fn` to the closing brace; test modules are left out."""
    code = rust_code(source)
    tests = [(found.start(), _closing(code, found.end() - 1)) for found in RUST_TESTS.finditer(code)]
    for found in RUST_FUNCTION.finditer(code):
        if any(start <= found.start() < end for start, end in tests):
            continue
        body = _body(code, found.end())
        if body is not None:
            yield found[1], code.count("\n", found.start(), _closing(code, body)) + 1


def rust_code(source: str) -> str:
    """Give the source with comments and literals blanked out, so that every brace left is one of the code."""
    pieces, place = [], 0
    while (found := RUST_TEXT.search(source, place)) is not None:
        end = _comment_end(source, found.start()) if found[0] == "/*" else found.end()
        pieces += [source[place : found.start()], re.sub(r"[^\n]", " ", source[found.start() : end])]
        place = end
    return "".join([*pieces, source[place:]])


def _comment_end(source: str, start: int) -> int:
    """Give the end of a block comment; Rust nests them."""
    depth = 0
    for mark in re.finditer(r"/\*|\*/", source[start:]):
        depth += 1 if mark[0] == "/*" else -1
        if depth == 0:
            return start + mark.end()
    return len(source)


def _body(code: str, start: int) -> int | None:
    """Give the opening brace of the function whose signature continues at `start`; None for a declaration."""
    depth = 0
    for place in range(start, len(code)):
        if code[place] in "([":
            depth += 1
        elif code[place] in ")]":
            depth -= 1
        elif depth == 0 and code[place] in "{;":
            return place if code[place] == "{" else None
    return None


def _closing(code: str, opening: int) -> int:
    """Give the brace that closes the one at `opening`."""
    depth = 0
    for found in re.finditer(r"[{}]", code[opening:]):
        depth += 1 if found[0] == "{" else -1
        if depth == 0:
            return opening + found.start()
    raise ValueError(f"brace at {opening} is never closed")


def violations(root: Path, path: Path, *, file_lines: int, function_lines: int, functions: bool) -> dict[str, int]:
    """Give what is too long in one file: its path relative to `root`, or `path::function`, with the lines."""
    source, name = path.read_text(), path.relative_to(root).as_posix()
    found = {name: line_count(source)} if line_count(source) > file_lines else {}
    if functions:
        listed = rust_functions(source) if path.suffix == ".rs" else python_functions(source)
        for function, lines in listed:
            if lines > function_lines:
                key = f"{name}::{function}"
                found[key] = max(lines, found.get(key, 0))
    return found
