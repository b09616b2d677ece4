"""What the pages need beyond Markdown: links to files of the repository, and tables of contents made of tables.

The documents in docs are read on GitHub as well, so they hold no directive of Sphinx that GitHub would show as text.
"""

from __future__ import annotations

import os
import re
import tomllib
from os.path import relpath
from pathlib import Path
from typing import Any

import api_pages
import command_pages
import settings_pages

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
REPOSITORY = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["repository"]
# A page with one of these names is the head of its folder: the pages that its table links to follow it.
HEADS = ("method/index", "decisions/README", "reference/api/index")
LINK = re.compile(r"(?<=\]\()(?!https?:|#)([^)#\s]+)(#[^)\s]*)?(?=\))")
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
INCLUDE = re.compile(r"^```\{include\} (\S+\.md)\n```$", re.MULTILINE)
ROW = re.compile(r"^\| \[[^\]]*\]\(([\w.-]+)\.md\)", re.MULTILINE)


def rustdoc() -> str:
    """Give links to the pages of rustdoc that were made on this machine; `make rust` makes them."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    pages = {crate: target / "doc" / crate / "index.html" for crate in ("quadfringe", "lightcrafter")}
    links = [f'<a href="{page.as_uri()}"><code>{crate}</code></a>' for crate, page in pages.items() if page.is_file()]
    return f"On this machine: {', '.join(links)}." if links else ""


GENERATED = re.compile(r"^<!-- generated: (\w+) ?([\w.]*) -->$", re.MULTILINE)
GENERATORS = {
    "api": api_pages.page,
    "commands": lambda _: command_pages.page(),
    "rustdoc": lambda _: rustdoc(),
    "settings": lambda _: settings_pages.page(api_pages.link_to),
}


def read(app: Any, name: str, content: list[str]) -> None:
    """Change the text of a page before it is parsed."""
    path = Path(app.env.doc2path(name))
    if path.suffix != ".md":
        return
    content[0] = with_repository_links(with_included(content[0], path.parent), path.parent)
    content[0] = GENERATED.sub(lambda mark: GENERATORS[mark[1]](mark[2]), content[0])
    if name in HEADS:
        pages = dict.fromkeys(ROW.findall(content[0]))
        content[0] += "\n\n```{toctree}\n:hidden:\n\n" + "\n".join(pages) + "\n```\n"


def with_included(text: str, folder: Path) -> str:
    """Put Markdown files of the repository in the place of their `include`, with links that fit the page."""

    def content(include: re.Match[str]) -> str:
        file = (folder / include[1]).resolve()

        def moved(link: re.Match[str]) -> str:
            target = (file.parent / link[1]).resolve()
            return f"{relpath(target, folder)}{link[2] or ''}"

        return LINK.sub(moved, file.read_text())

    return INCLUDE.sub(content, text)


def with_repository_links(text: str, folder: Path) -> str:
    """Let links to files outside docs lead to the repository; links in fenced blocks stay."""

    def moved(link: re.Match[str]) -> str:
        target = (folder / link[1]).resolve()
        if target.is_relative_to(DOCS) or not target.is_relative_to(ROOT):
            return link[0]
        kind = "tree" if target.is_dir() else "blob"
        return f"{REPOSITORY}/{kind}/main/{target.relative_to(ROOT)}{link[2] or ''}"

    parts, end = [], 0
    for fence in FENCE.finditer(text):
        parts += [LINK.sub(moved, text[end : fence.start()]), fence[0]]
        end = fence.end()
    return "".join([*parts, LINK.sub(moved, text[end:])])


def setup(app: Any) -> dict[str, bool]:
    """Connect to Sphinx."""
    app.setup_extension("sphinx.ext.autodoc")
    api_pages.setup(app)
    app.connect("source-read", read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
