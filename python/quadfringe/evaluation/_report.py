"""Markdown reports of measured figures: run a script for its figures, write tables."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

Record = dict[str, Any]
METHODS = ("published", "joint")
# Columns of the table of scenes that resemble real objects: figure and title.
WORLD = {
    "rms_mm": "RMS, mm",
    "median_mm": "median",
    "p95_mm": "95 %",
    "p99_mm": "99 %",
    "rim_rms_mm": "rims, RMS",
    "returned_percent": "returned, %",
    "wrong_percent": "wrong, %",
    "inside_1_percent": "inside 1, %",
    "inside_2_percent": "2",
    "inside_3_percent": "3",
}


def measured(*command: str) -> Record:
    """Run a script and give the figures that it writes, also when it exits with 1 because it missed a bar.

    Raises SystemExit when the script wrote no figures.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "figures.json"
        done = subprocess.run([sys.executable, *command, "--json", str(file)])
        if not file.is_file():
            raise SystemExit(f"{' '.join(command)}: no figures, exit status {done.returncode}")
        record: Record = json.loads(file.read_text())
    return record


def words(cell: object) -> str:
    """Give a table cell as text; numbers have four digits, None is empty."""
    if cell is None:
        return ""
    return f"{cell:.4g}" if isinstance(cell, float) else str(cell)


def table(head: Sequence[str], lines: Iterable[Sequence[object]]) -> str:
    """Give a Markdown table."""
    rows = [head, ["---"] * len(head), *([words(cell) for cell in line] for line in lines)]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows) + "\n"


def columns(entries: list[Record], heads: dict[str, str]) -> str:
    """Give a table with a row for each record; `heads` maps the keys to the column titles."""
    return table(list(heads.values()), ([entry.get(key) for key in heads] for entry in entries))


def head_of(machine: Record, command: str, script: str) -> str:
    """Give the head of a report: title, the command that wrote it, and the machine that measured."""
    date = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    lines = [(name, value) for name, value in (machine | {"date": date}).items() if value is not None]
    return f"# Results\n\n`{command}` ({script}) measured and wrote this file.\n\n" + table(("", ""), lines)


def accuracy_section(found: Record) -> str:
    """Give the figures of evaluation/accuracy.py as a table with a column for each method."""
    figures: dict[str, float] = found["figures"]
    names = dict.fromkeys(key.partition("_")[2] for key in figures)
    lines = [(name, *(figures.get(f"{method}_{name}") for method in METHODS)) for name in names]
    missing = "" if any("capture" in name for name in names) else "\nReal captures: no test data here.\n"
    return "\n".join(
        [
            "## Accuracy\n",
            "`python evaluation/accuracy.py`. The head of the script explains each figure; the module "
            "quadfringe.evaluation.efficiency defines the efficiency.\n",
            table(("figure", *METHODS), lines) + missing,
        ]
    )


def world_section(found: Record, half: str) -> str:
    """Give the figures of evaluation/world.py: a row for each scene, and the rest as a list."""
    figures: dict[str, float] = found["figures"]
    scenes = [key.removesuffix("_median_mm") for key in figures if key.endswith("_median_mm")]
    lines = [(scene, *(figures[f"{scene}_{key}"] for key in WORLD)) for scene in scenes]
    listed = {f"{scene}_{key}" for scene in scenes for key in WORLD}
    rest = [(key, value) for key, value in figures.items() if key not in listed and "stated_wrong" not in key]
    return "\n".join(
        [
            "## Scenes that resemble real objects, and resolution\n",
            f"`python evaluation/world.py --half {half}`: depth errors of the joint method at 3 % noise. The module "
            "quadfringe.evaluation.world draws the scenes and defines the figures.\n",
            table(("scene", *WORLD.values()), lines),
            table(("figure", "value"), rest),
        ]
    )
