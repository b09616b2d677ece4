"""The documents: links lead somewhere, commands exist (those quoted in the code too), decision records are complete."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
DECISIONS = ROOT / "docs" / "decisions"
RECORDS = sorted(path for path in DECISIONS.glob("*.md") if path.name != "README.md")
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *ROOT.glob("crates/*/README.md")])
SOURCES = sorted(
    path
    for folder in ("crates", "python", "evaluation", "benches", "tests")
    for path in (ROOT / folder).rglob("*")
    if path.suffix in {".rs", ".py"} and path != Path(__file__) and "target" not in path.parts
)
PARTS = ("Context", "Decision", "Alternatives considered", "Consequence", "Command")
LINES_MAX = 30
FILE = re.compile(r"(?<!\S)((?:evaluation|benches|tests|scripts|docs)/[\w./-]+|[\w-]+/[\w./-]+\.(?:py|rs))")
FOLDERS = (ROOT, ROOT / "python" / "quadfringe", ROOT / "crates" / "quadfringe" / "src")
MAKEFILE = (ROOT / "Makefile").read_text()


def name(path: Path) -> str:
    return str(path.relative_to(ROOT))


def commands(text: str) -> list[str]:
    """Give the code spans and the lines of shell blocks."""
    blocks = re.findall(r"^```(?:sh|console)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    spans = re.findall(r"`([^`]+)`", re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL))
    return [" ".join(span.split()) for span in spans] + [line for block in blocks for line in block.splitlines()]


def quoted(text: str) -> list[str]:
    """Give the commands in code spans of a source; a span may continue on the next line of a comment."""
    joined = re.sub(r"\n[ \t]*(?://[/!]?|#)?[ \t]*", " ", text)
    return [" ".join(span.split()) for span in re.findall(r"`((?:cargo|make|pytest|python) [^`]+)`", joined)]


def missing(command: str) -> list[str]:
    """Give the files and targets that a command names and the repository does not have."""
    files = FILE.findall(command)
    targets = re.findall(r"--test (\w+)", command) if command.startswith("cargo test") else []
    lost = [t for t in targets if not [*ROOT.glob(f"crates/*/tests/{t}.rs"), *ROOT.glob(f"crates/*/tests/{t}/main.rs")]]
    if made := re.match(r"make ([\w-]+)", command):
        lost += [] if re.search(rf"^{made[1]}:", MAKEFILE, re.MULTILINE) else [made[1]]
    return lost + [file for file in files if not any((folder / file).exists() for folder in FOLDERS)]


@pytest.mark.parametrize("document", DOCUMENTS, ids=name)
def test_links_lead_to_files(document: Path) -> None:
    text = re.sub(r"^```.*?^```$", "", document.read_text(), flags=re.MULTILINE | re.DOTALL)
    targets = re.findall(r"\]\((?!https?:|#)([^)#\s]+)(?:#[^)]*)?\)", text)
    assert [target for target in targets if not (document.parent / target).exists()] == []


@pytest.mark.parametrize("document", [path for path in DOCUMENTS if path.name != "CHANGELOG.md"], ids=name)
def test_commands_exist(document: Path) -> None:
    lost = {command: gone for command in commands(document.read_text()) if (gone := missing(command))}
    assert lost == {}


def test_commands_in_the_sources_exist() -> None:
    cited = [(name(source), command) for source in SOURCES for command in quoted(source.read_text())]
    assert len(cited) > 30
    assert [(source, command, gone) for source, command in cited if (gone := missing(command))] == []


@pytest.mark.parametrize("record", RECORDS, ids=name)
def test_a_record_is_complete_and_short(record: Path) -> None:
    text = record.read_text()
    assert re.match(rf"# {record.name[:4]}: \S.*\n\nDate: 2\d{{3}}-\d\d-\d\d\. Status: (accepted|replaced)", text)
    assert re.findall(r"^\*\*([\w ]+)\.\*\*", text, re.MULTILINE) == list(PARTS)
    assert len(text.splitlines()) <= LINES_MAX


def test_the_list_of_records_is_whole() -> None:
    rows = []
    for number, record in enumerate(RECORDS, 1):
        head = re.match(r"# (\d{4}): (.+)\n\nDate: (\S+)\.", record.read_text())
        assert head is not None
        assert head[1] == record.name[:4] == f"{number:04d}"
        rows.append(f"| [{head[1]}]({record.name}) | {head[3]} | {head[2]} |")
    lines = (DECISIONS / "README.md").read_text().splitlines()
    assert [line for line in lines if line.startswith("| [")] == rows


def test_names_in_the_glossary_exist() -> None:
    sources = [*(ROOT / "python").rglob("*.py"), *ROOT.glob("crates/*/src/**/*.rs"), ROOT / "pyproject.toml"]
    known = set(re.findall(r"\w+", "\n".join(path.read_text() for path in sources)))
    spans = re.findall(r"`([^`]+)`", (ROOT / "docs" / "glossary.md").read_text())
    names = {word for span in spans for word in re.findall(r"[A-Za-z]\w+", span) if not word.isupper()}
    assert len(names) > 80
    assert names - known == set()


def test_what_is_missing_is_found() -> None:
    assert missing("python evaluation/nothing.py --seeds 3") == ["evaluation/nothing.py"]
    assert missing("cargo test --test nothing") == ["nothing"]
    assert missing("make nothing") == ["nothing"]
    assert missing("devices/nothing.py") == ["devices/nothing.py"]
    assert quoted("//! `python\n//! evaluation/nothing.py`") == ["python evaluation/nothing.py"]
    assert missing("make demo") == missing("pytest tests/test_documents.py") == []
