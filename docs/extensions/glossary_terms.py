"""Terms of docs/glossary.md as targets of links: `{term}` in pages, `:term:` in docstrings.

The glossary is a list on GitHub, each term in bold at the beginning of its item. The anchor of a term is `term-` and
its words with hyphens.
"""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes

PAGE = "glossary"


def note_terms(app: Any, document: nodes.document) -> None:
    """Register every term of the glossary."""
    if app.env.docname != PAGE:
        return
    terms = app.env.domains.standard_domain
    for item in document.findall(nodes.list_item):
        strong = next(iter(item.findall(nodes.strong)), None)
        if strong is None:
            continue
        term = strong.astext().rstrip(".")
        anchor = "term-" + re.sub(r"\W+", "-", term.lower()).strip("-")
        if anchor not in document.ids:  # one term may have two meanings, of which the first is linked
            item["ids"].append(anchor)
            document.ids[anchor] = item
            terms._note_term(term, anchor, item)  # as the directive `glossary` does


def setup(app: Any) -> dict[str, Any]:
    """Connect to Sphinx."""
    app.connect("doctree-read", note_terms)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
