"""The pages in docs/method stay tied to the code: equation tags, links, paths, quoted code and constants.

Each check returns a list of faults and takes the root of a tree, so that a planted fault can show that it fails.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from support.trees import write_tree

import quadfringe as qf

ROOT = Path(__file__).resolve().parents[1]
THIS = Path(__file__).name
SOURCES = ("crates", "python", "evaluation", "benches", "tests")
TOP_LEVEL = (*SOURCES, "docs", "scripts")

TAG = re.compile(r"\\tag\{([A-Z]\d+)\}")
# Code cites (S4), (S8, S9) and "(step 1 of the chain, S1)"; other letters, as in (J2), stand alone in parentheses.
PARENTHESES = re.compile(r"\(([^()\n]*)\)")
MAIN = re.compile(r"\bS\d{1,2}\b")
OTHER = re.compile(r"\b[JTU]\d{1,2}\b")
CITED_ON_PAGE = re.compile(r"\(([A-Z]\d{1,2})\)")

LINK = re.compile(r"\[[^\]\n]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#{1,6} (.+)$", re.MULTILINE)
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
DISPLAY_MATH = re.compile(r"\$\$.*?\$\$", re.DOTALL)
CODE = re.compile(r"`([^`\n]+)`")
QUOTED = re.compile(r"`([^`\n]+)` in \[[^\]\n]*\]\(([^)\s]+)\)")

CONSTANT = re.compile(r"`(?:(\w+)::)?([A-Z][A-Z0-9_]*)` = (-?\d+(?:\.\d+)?(?:e-?\d+)?)")
RUST_CONSTANT = re.compile(r"\bconst ([A-Z][A-Z0-9_]*): [^=;]+ = ([^;]+);")
PYTHON_CONSTANT = re.compile(r"^([A-Z][A-Z0-9_]*)(?:: [^=\n]+)? = (?:\(\n +)?([^#\n]+)", re.MULTILINE)
OPERATORS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.LShift: operator.lshift,
    ast.USub: operator.neg,
}


def source_files(root: Path, *suffixes: str) -> list[Path]:
    found = (path for folder in SOURCES for path in (root / folder).rglob("*") if path.suffix in suffixes)
    skipped = {"target", "node_modules", "__pycache__"}
    return sorted(path for path in found if path.name != THIS and skipped.isdisjoint(path.parts))


def pages(root: Path, folder: str = "docs/method") -> dict[Path, str]:
    return {path: path.read_text() for path in sorted((root / folder).rglob("*.md"))}


def tag_faults(root: Path) -> list[str]:
    """Name tags defined twice, and citations in code or pages of tags that are not defined."""
    defined: dict[str, list[str]] = {}
    for path, text in pages(root).items():
        for tag in TAG.findall(text):
            defined.setdefault(tag, []).append(path.name)
    faults = [f"({tag}) is defined {len(at)} times: {at}" for tag, at in defined.items() if len(at) > 1]
    letters = {tag[0] for tag in defined}
    for path in source_files(root, ".rs", ".py"):
        inside = " ; ".join(PARENTHESES.findall(path.read_text()))
        alone = {part.strip() for part in re.split("[;,]", inside)}
        cited = set(MAIN.findall(inside)) | {part for part in alone if OTHER.fullmatch(part)}
        faults += [f"{path.relative_to(root)} cites ({tag})" for tag in sorted(cited - defined.keys())]
    for path, text in pages(root).items():
        cited = {tag for tag in CITED_ON_PAGE.findall(text) if tag[0] in letters}
        faults += [f"{path.name} cites ({tag})" for tag in sorted(cited - defined.keys())]
    return faults


def prose(text: str) -> str:
    return DISPLAY_MATH.sub("", FENCE.sub("", text))


def anchors(text: str) -> set[str]:
    """Give the anchors that GitHub and MyST make of the headings of a page."""
    found: set[str] = set()
    for heading in HEADING.findall(FENCE.sub("", text)):
        words = re.sub(r"[^\w\- ]", "", LINK.sub("", heading).lower())
        slug, count = words.strip().replace(" ", "-"), 0
        while (name := f"{slug}-{count}" if count else slug) in found:
            count += 1
        found.add(name)
    return found


def link_faults(root: Path) -> list[str]:
    """Name the relative links of all pages whose file or anchor does not exist."""
    faults = []
    for path, text in pages(root, "docs").items():
        for link in LINK.findall(prose(text)):
            if re.match(r"[a-z]+:", link):
                continue
            name, _, anchor = link.partition("#")
            target = (path.parent / name).resolve() if name else path
            missing = not target.exists()
            if missing or (anchor and target.suffix == ".md" and anchor not in anchors(target.read_text())):
                faults.append(f"{path.relative_to(root)}: {link}")
    return faults


def path_faults(root: Path) -> list[str]:
    """Name the repository paths in backticks on the method pages that do not exist."""
    words = ((page, word) for page, text in pages(root).items() for code in CODE.findall(text) for word in code.split())
    named = ((page, word) for page, word in words if re.fullmatch(r"[\w.\-]+(/[\w.\-]+)+/?", word))
    return [f"{page.name}: {w}" for page, w in named if w.split("/")[0] in TOP_LEVEL and not (root / w).exists()]


def quotation_faults(root: Path) -> list[str]:
    """Name quotations of the form `code` in [file](path) that the file does not hold."""
    faults = []
    for page, text in pages(root).items():
        for code, link in QUOTED.findall(text):
            target = (page.parent / link).resolve()
            if not target.is_file() or not re.search(rf"{re.escape(code)}\b", target.read_text()):
                faults.append(f"{page.name}: `{code}` is not in {link}")
    return faults


def number(expression: str) -> float | None:
    """Give the value of an arithmetic expression of Rust or Python, None for anything else."""
    plain = re.sub(r"(?<=[\d.])_?(?:[fiu](?:8|16|32|64)|usize)\b", "", expression.strip())
    try:
        return folded(ast.parse(plain, mode="eval").body)
    except (SyntaxError, TypeError, KeyError):
        return None


def folded(node: ast.expr) -> float:
    if isinstance(node, ast.BinOp):
        return float(OPERATORS[type(node.op)](literal(node.left), literal(node.right)))
    return float(literal(node))


def literal(node: ast.expr) -> float:
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return node.value
    if isinstance(node, ast.UnaryOp):
        return float(OPERATORS[type(node.op)](literal(node.operand)))
    if isinstance(node, ast.BinOp):
        return folded(node)
    raise TypeError(ast.dump(node))


def constants(root: Path) -> Iterator[tuple[Path, str, float]]:
    for path in source_files(root, ".rs", ".py"):
        pattern = RUST_CONSTANT if path.suffix == ".rs" else PYTHON_CONSTANT
        for name, expression in pattern.findall(path.read_text()):
            if (value := number(expression)) is not None:
                yield path, name, value


def constant_faults(root: Path) -> list[str]:
    """Name the constants quoted as `NAME` = value or `module::NAME` = value that the code defines otherwise or not."""
    known: dict[str, list[tuple[Path, float]]] = {}
    for path, name, value in constants(root):
        known.setdefault(name, []).append((path.relative_to(root).with_suffix(""), value))
    faults = []
    for page, text in pages(root).items():
        for module, name, quoted in CONSTANT.findall(text):
            values = {value for path, value in known.get(name, []) if not module or module in path.parts}
            if not (len(values) == 1 and math.isclose(values.pop(), float(quoted), rel_tol=1e-6)):
                where = [(str(path), value) for path, value in known.get(name, [])]
                faults.append(f"{page.name}: {module or ''}::{name} = {quoted}, the code has {where}")
    return faults


def test_every_tag_is_defined_once_and_every_citation_has_one() -> None:
    assert tag_faults(ROOT) == []
    defined = {tag for text in pages(ROOT).values() for tag in TAG.findall(text)}
    assert {f"S{i}" for i in range(1, 12)} <= defined


def test_every_link_leads_somewhere() -> None:
    assert link_faults(ROOT) == []


def test_every_path_exists() -> None:
    assert path_faults(ROOT) == []


def test_every_quotation_is_in_its_file() -> None:
    assert quotation_faults(ROOT) == []
    assert sum(len(QUOTED.findall(text)) for text in pages(ROOT).values()) >= 6


def test_every_constant_has_the_value_of_the_code() -> None:
    assert constant_faults(ROOT) == []
    assert sum(len(CONSTANT.findall(text)) for text in pages(ROOT).values()) > 50


def test_every_page_is_listed_in_the_index() -> None:
    folder = ROOT / "docs/method"
    listed = {link.partition("#")[0] for link in LINK.findall((folder / "index.md").read_text())}
    assert {path.name for path in folder.glob("*.md")} <= listed | {"index.md"}


def steps(text: str, pattern: str) -> list[int]:
    return [int(step) for step in re.findall(pattern, text, re.MULTILINE)]


def test_the_recipe_and_its_page_have_the_same_steps() -> None:
    recipe = steps((ROOT / "crates/quadfringe/src/joint/mod.rs").read_text(), r"^//! (\d+) +\w")
    page = steps((ROOT / "docs/method/joint.md").read_text(), r"^\| \[(\d+)\]\(")
    assert recipe == page == list(range(1, 12))


def test_a_wrong_order_displaces_a_point_by_what_the_geometry_page_says() -> None:
    page = (ROOT / "docs/method/geometry.md").read_text()
    stated = re.search(r"an? point in the middle of the image, 800 mm away, by (\d+) to (\d+) mm", page)
    assert stated is not None
    with qf.open_system() as scanner:
        projector = scanner.calibration.projector if scanner.calibration else None
    assert projector is not None
    rotation, translation = np.asarray(projector.rotation), np.asarray(projector.translation_mm)

    def column(depth_mm: float) -> float:
        x, _, z = rotation @ (0.0, 0.0, depth_mm) + translation
        return float(projector.centre_px[0] + projector.focal_px[0] * x / z)

    period = projector.width_px / qf.Fringes().numbers[0]
    moved = [brentq(lambda d, s=s: column(800 + d) - column(800) - s * period, -200, 200) for s in (-1, 1)]
    assert sorted(round(abs(mm)) for mm in moved) == [int(stated[1]), int(stated[2])]


# Planted faults: each check fails on a small tree with one mistake in it.

SOUND = {
    "docs/method/a.md": (
        "# One page (S1)\n\n$$ x = 1 \\tag{S1} $$\n\n`JUMP` = 1.25 and `fit::WIDTH` = 1e-3, see (S1).\n"
        "`fn go` in [b.rs](../../crates/b.rs), `crates/b.rs`, [here](#one-page-s1).\n"
    ),
    "crates/b.rs": "/// As (S1).\nconst JUMP: f64 = 1.25;\nfn go() {}\n",
    "crates/fit.rs": "const WIDTH: f32 = 1.0 / 1_000.0;\n",
    "crates/other.rs": "const WIDTH: f32 = 0.5;\n",
    "python/p.py": "LIMIT: Final = 3  # px\n",
}


CHECKS = (tag_faults, link_faults, path_faults, quotation_faults, constant_faults)


def test_a_sound_tree_has_no_faults(tmp_path: Path) -> None:
    write_tree(tmp_path, SOUND)
    assert [check(tmp_path) for check in CHECKS] == [[]] * len(CHECKS)


@pytest.mark.parametrize(
    ("check", "name", "before", "after"),
    [
        (tag_faults, "crates/b.rs", "(S1)", "(S2)"),
        (tag_faults, "crates/b.rs", "(S1)", "(S1) and (J3)"),
        (tag_faults, "crates/b.rs", "(S1)", "(step 2, S2)"),
        (tag_faults, "docs/method/a.md", "see (S1)", "see (S7)"),
        (tag_faults, "docs/method/a.md", "see (S1)", "$$ y \\tag{S1} $$"),
        (link_faults, "docs/method/a.md", "(../../crates/b.rs)", "(../../crates/c.rs)"),
        (link_faults, "docs/method/a.md", "#one-page-s1", "#one-page-s2"),
        (path_faults, "docs/method/a.md", "`crates/b.rs`", "`crates/c.rs`"),
        (quotation_faults, "crates/b.rs", "fn go()", "fn gone()"),
        (constant_faults, "crates/b.rs", "1.25", "1.5"),
        (constant_faults, "crates/b.rs", "const JUMP", "const LEAP"),
        (constant_faults, "crates/fit.rs", "1_000.0", "2_000.0"),
        (constant_faults, "docs/method/a.md", "`fit::WIDTH`", "`WIDTH`"),
        (constant_faults, "docs/method/a.md", "`JUMP` = 1.25", "`LIMIT` = 4"),
    ],
)
def test_a_planted_fault_is_found(tmp_path: Path, check: object, name: str, before: str, after: str) -> None:
    assert before in SOUND[name]
    write_tree(tmp_path, SOUND | {name: SOUND[name].replace(before, after)})
    assert callable(check)
    assert len(check(tmp_path)) == 1
