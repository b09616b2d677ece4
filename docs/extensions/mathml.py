"""Formulas as MathML, made when the site is built: browsers draw it without a program and without network.

A formula with a tag, such as (S7), has an anchor, and where the tag is cited in parentheses a link leads there.
"""

from __future__ import annotations

import re
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert

DOCS = Path(__file__).resolve().parents[1]
TAG = re.compile(r"\\tag\{([^}]*)\}")
CITED = re.compile(r"\((?:[A-Z]\d{1,2})(?:, [A-Z]\d{1,2})*\)")
ONE = re.compile(r"([A-Z]\d{1,2})")
PLAIN = (nodes.literal, nodes.literal_block, nodes.math, nodes.math_block, nodes.reference, nodes.title)


@cache
def pages() -> dict[str, str]:
    """Give the page of each tag."""
    found = sorted((DOCS / "method").glob("*.md"))
    return {tag: f"method/{page.stem}" for page in found for tag in TAG.findall(page.read_text())}


def inline(writer: Any, node: nodes.Element) -> None:
    """Write a formula in a line of text."""
    writer.body.append(convert(node.astext()))
    raise nodes.SkipNode


def block(writer: Any, node: nodes.Element) -> None:
    """Write a formula on a line of its own, with its tag at the right."""
    latex = node.astext()
    tag = TAG.search(latex)
    number = node.get("number") if tag is None else tag[1]
    formula = convert(TAG.sub("", latex).strip(), display="block")
    anchor = "" if tag is None else f' id="equation-{escape(tag[1])}"'
    label = "" if number is None else f'<span class="equation-tag">({escape(str(number))})</span>'
    writer.body.append(f'<div class="equation"{anchor}>{formula}{label}</div>\n')
    raise nodes.SkipNode


def cite(app: Any, document: nodes.document, name: str) -> None:
    """Turn cited tags into links."""
    for text in list(document.findall(nodes.Text)):
        if CITED.search(text) and not _is_inside(text, PLAIN):
            parts = CITED.split(text)
            cited = [_links(app, name, found) for found in CITED.findall(text)]
            mixed = [nodes.Text(parts[0])]
            for links, rest in zip(cited, parts[1:], strict=True):
                mixed += [*links, nodes.Text(rest)]
            text.parent.replace(text, mixed)


def _is_inside(node: nodes.Node, kinds: tuple[type, ...]) -> bool:
    while node.parent is not None:
        node = node.parent
        if isinstance(node, kinds):
            return True
    return False


def _links(app: Any, name: str, cited: str) -> list[nodes.Node]:
    found: list[nodes.Node] = []
    for part in ONE.split(cited):
        if part in pages():
            page = "" if pages()[part] == name else app.builder.get_relative_uri(name, pages()[part])
            found.append(nodes.reference("", part, refuri=f"{page}#equation-{part}", internal=True))
        else:
            found.append(nodes.Text(part))
    return found


def setup(app: Any) -> dict[str, bool]:
    """Name the renderer to Sphinx."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    app.connect("doctree-resolved", cite)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
