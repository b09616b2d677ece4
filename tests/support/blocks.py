"""The fenced blocks of documents: they run, or a line above says why they cannot."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from quadfringe.cli import app
from quadfringe.config import load_system

ROOT = Path(__file__).resolve().parents[2]
# The kind of a directive of Sphinx stands in braces.
FENCE = re.compile(
    r"^ *(?:<!-- not run: (?P<reason>[^\n]*) -->\n *)?(?P<fence>`{3,})(?P<kind>\w*|\{[^\n]*)\n"
    r"(?P<text>.*?)^ *(?P=fence)$",
    re.MULTILINE | re.DOTALL,
)
MOST_WORDS, LEAST_WORDS = 30, 4  # of a reason
COMMAND = re.compile(r"^(?:\$ |>>> |quadfringe |pip |make |python )", re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """One fenced block; `reason` says why it is not run, None when it is."""

    kind: str
    text: str
    reason: str | None


def blocks_of(document: str) -> list[Block]:
    """Give the blocks of a document in order, also those inside directives, which are no blocks themselves."""
    blocks: list[Block] = []
    for fence in FENCE.finditer(document):
        text = textwrap.dedent(fence["text"])
        inside = fence["kind"].startswith("{")
        blocks += blocks_of(text) if inside else [Block(fence["kind"], text, fence["reason"])]
    return blocks


def judge(block: Block, folder: Path, document: Path) -> None:
    """Run a block, or check its reason and its commands."""
    if block.reason is None:
        run(block, folder, document)
    else:
        assert LEAST_WORDS <= len(block.reason.split()) <= MOST_WORDS
        check_commands(block)


def run(block: Block, folder: Path, document: Path) -> None:
    """Run a block as its kind says, in a folder that keeps what earlier blocks have written."""
    if block.kind in ("python", "sh"):
        command = [sys.executable, "-c"] if block.kind == "python" else ["bash", "-euc"]
        path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
        environment = {**os.environ, "PATH": path}
        done = subprocess.run([*command, block.text], cwd=folder, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
    elif block.kind == "toml":
        (folder / "system.toml").write_text(block.text)
        load_system(folder / "system.toml")
    elif block.kind == "rust":
        # The doc tests of the crate run every Rust block of the document.
        library = ROOT / "crates" / "quadfringe" / "src" / "lib.rs"
        assert f'include_str!("{os.path.relpath(document, library.parent)}")' in library.read_text()
    elif block.kind or COMMAND.search(block.text):
        pytest.fail(f"a block of kind {block.kind!r} is not run; state why in a line <!-- not run: REASON --> above it")


def check_commands(block: Block) -> None:
    """Check what can be checked without running: commands and options of quadfringe, targets of make."""
    if block.kind not in ("sh", "console"):
        return
    for line in block.text.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        if words[:1] == ["make"]:
            assert re.search(rf"^{words[1]}:", (ROOT / "Makefile").read_text(), re.MULTILINE), line
        elif words[:1] == ["quadfringe"]:
            check_options(words[1:], line)


def check_options(words: list[str], line: str) -> None:
    """Check that a command and its options exist."""
    command: Any = get_command(app)
    while hasattr(command, "commands"):  # a group
        assert words, line
        assert words[0] in command.commands, line
        command, words = command.commands[words[0]], words[1:]
    known = {name for parameter in command.params for name in (*parameter.opts, *parameter.secondary_opts)}
    assert {word for word in words if word.startswith("--")} <= known, line
