"""Measure all figures again and write them into docs/figures.md and the README; `make figures` runs this.

    python evaluation/figures.py [--only WORD ...]

With `--only`, runs the commands that contain one of these words. The table of docs/figures.md is written after every
command, so that an interrupted run keeps what it has measured. The README repeats some of its rows, which
figure_choice.py lists.

Each row names the command that gave its figure. Rows on captures and renders need the test data (QUADFRINGE_DATA, or
../shared/data), rows on cameras need Aravis and a network namespace (`make test-camera`), rows on the browser need
chromium (`make test-live`). Rows whose requirement is missing stay as they are.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from figure_choice import CHOSEN
from figure_rows import ROOT, SOURCES, Source

from quadfringe.evaluation._ledger import bars

BEGIN, END = "<!-- figures -->", "<!-- /figures -->"
HEAD = ("| figure | value | bar | command |", "|---|---|---|---|")
PAGE, README = ROOT / "docs" / "figures.md", ROOT / "README.md"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--only", nargs="+", metavar="WORD", help="run the commands that contain one of these words")
    only = parser.parse_args().only
    chosen = [source for source in SOURCES if only is None or any(word in words_of(source.command) for word in only)]
    if not chosen:
        parser.error(f"no command contains one of {only}; the last column of the table in docs/figures.md lists them")
    for source in chosen:
        if source.there():
            write_table(source, run(source))


def write_table(measured: Source, figures: dict[str, float]) -> None:
    """Put the figures of one source into the table of the page; all other rows stay as they stand there."""
    old = between(PAGE)
    lines = []
    for source in SOURCES:
        if source is measured:
            lines += [
                f"| {words} | {figures[name]:.4g} | {bar_text(bar)} | `{words_of(source.command)}` |"
                for name, words, bar in source.rows
            ]
        else:
            lines += rows_of(old, source)
    put_between(PAGE, lines)
    put_between(README, chosen(lines))


def chosen(lines: list[str]) -> list[str]:
    """Give the rows of the README: those of the chosen figures, in words that need no other row."""
    rows = []
    for name, words in CHOSEN:
        source = next(one for one in SOURCES if name in (row[0] for row in one.rows))
        found = rows_of(lines, source)[[row[0] for row in source.rows].index(name)]
        rows.append(f"| {words} |{found.split(' |', 1)[1]}")
    return rows


def rows_of(lines: list[str], source: Source) -> list[str]:
    return [line for line in lines if line.endswith(f"| `{words_of(source.command)}` |")]


def between(document: Path) -> list[str]:
    """Give the lines between the two marks of a document."""
    return document.read_text().partition(BEGIN)[2].partition(END)[0].splitlines()


def put_between(document: Path, lines: list[str]) -> None:
    before, _, rest = document.read_text().partition(BEGIN)
    table = "\n".join((*HEAD, *lines))
    document.write_text(f"{before}{BEGIN}\n{table}\n{END}{rest.partition(END)[2]}")


def bar_text(bar: str) -> str:
    """Give what the table shows for a bar: a key of the ledger as its limits, the bar of a time as it stands."""
    return bars()[bar].text if bar in bars() else bar


def words_of(command: tuple[str, ...]) -> str:
    if command[0] == "quadfringe":
        return " ".join(command)
    first = next(place for place, word in enumerate(command) if word.endswith(".py"))
    return " ".join((*command[:first], "python", *command[first:]))


def run(source: Source) -> dict[str, float]:
    command = source.command
    with tempfile.TemporaryDirectory() as folder:
        json_file = Path(folder) / "figures.json"
        if command[0] == "quadfringe":
            full = [sys.executable, "-m", *command, "--out", str(Path(folder) / source.out), "--json", str(json_file)]
        else:
            full = words_of(command).replace("python", sys.executable, 1).split()
            full += ["--json", str(json_file)]
        # A script that misses a bar exits with status 1; its figures make rows like all others.
        subprocess.run(full, check=False, stdout=subprocess.DEVNULL, cwd=ROOT)
        figures: dict[str, float] = json.loads(json_file.read_text())["figures"]
    return figures


if __name__ == "__main__":
    main()
