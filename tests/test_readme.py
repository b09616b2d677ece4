"""README and pages run: every block of each, in order, in one folder, unless the line above it says why not.

Pages that are notebooks run when the site is built (`make docs`).
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from support.blocks import FENCE, ROOT, Block, blocks_of, check_commands, judge, run

README = ROOT / "README.md"
NOTEBOOK = re.compile(r"\A---\n.*?^kernelspec:.*?^---$", re.MULTILINE | re.DOTALL)
CRATE = ROOT / "crates" / "quadfringe" / "README.md"
PAGES = [
    README,
    CRATE,
    *(page for page in sorted((ROOT / "docs").rglob("*.md")) if not NOTEBOOK.match(page.read_text())),
]
BLOCKS = [(page, i, block) for page in PAGES for i, block in enumerate(blocks_of(page.read_text()))]


def name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[Path, Path]:
    return {page: tmp_path_factory.mktemp(page.stem) for page in PAGES}


@pytest.mark.parametrize(
    ("page", "block"),
    [(page, block) for page, _, block in BLOCKS],
    ids=[f"{name(page)}-{i}-{block.kind}" for page, i, block in BLOCKS],
)
def test_block_runs_or_says_why_not(page: Path, block: Block, folders: dict[Path, Path]) -> None:
    judge(block, folders[page], page)


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_block_is_seen(page: Path) -> None:
    rest = FENCE.sub("", page.read_text())
    assert re.findall(r"^ *(?:```|~~~).*$", rest, re.MULTILINE) == []


def test_each_kind_of_block_is_run() -> None:
    run_kinds = {block.kind for page, _, block in BLOCKS if page == README and block.reason is None}
    assert {"python", "sh"} <= run_kinds
    assert {"toml", "rust"} <= {block.kind for _, _, block in BLOCKS if block.reason is None}


@pytest.mark.parametrize("picture", re.findall(r"!\[[^\]]*\]\(([^)]+)\)", README.read_text()))
def test_pictures_exist(picture: str) -> None:
    assert (ROOT / picture).is_file()


# On planted faults


def test_directives_are_no_blocks_but_hold_some() -> None:
    document = "````{tab-set}\n```sh\nfalse\n```\n````\n\n```{toctree}\na\n```\n\n```sh\ntrue\n```\n"
    assert [block.text for block in blocks_of(document)] == ["false\n", "true\n"]


@pytest.mark.parametrize(
    ("document", "error"),
    [
        ("```python\nraise SystemExit(3)\n```\n", AssertionError),
        ("```sh\nfalse\ntrue\n```\n", AssertionError),
        ("```toml\n[decode]\nmethd = 1\n```\n", ValueError),
        ("```console\nquadfringe live\n```\n", pytest.fail.Exception),
        ("```\nquadfringe live\n```\n", pytest.fail.Exception),
        ("1. Do\n\n   ```sh\n   false\n   ```\n", AssertionError),
        ("```rust\nfn main() {}\n```\n", AssertionError),
    ],
)
def test_a_block_that_fails_is_found(document: str, error: type[BaseException], tmp_path: Path) -> None:
    (block,) = blocks_of(document)
    with pytest.raises(error):
        run(block, tmp_path, ROOT / "docs" / "glossary.md")


@pytest.mark.parametrize("line", ["quadfringe lve", "quadfringe decode --gren x.png", "make nothing"])
def test_a_command_that_does_not_exist_is_found(line: str) -> None:
    (block,) = blocks_of(f"<!-- not run: it needs a camera -->\n```console\n{line}\n```\n")
    assert block.reason == "it needs a camera"
    with pytest.raises(AssertionError):
        check_commands(block)
