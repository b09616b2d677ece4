"""Formulas as MathML, made when the site is built: browsers draw it without a program and without network."""

from __future__ import annotations

import re
from html import escape
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert

TAG = re.compile(r"\\tag\{([^}]*)\}")


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


def setup(app: Any) -> dict[str, bool]:
    """Name the renderer to Sphinx."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
