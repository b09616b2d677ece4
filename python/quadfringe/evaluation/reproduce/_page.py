"""The page of `reproduce all`: one HTML file with every figure next to the published one, and every picture.

`page.html` is its frame and `page.css` its style. It needs no network and runs no program.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from string import Template

from quadfringe.evaluation.machine import described
from quadfringe.evaluation.reproduce._together import Outcome
from quadfringe.evaluation.reproduction import Figure
from quadfringe.files import atomic
from quadfringe.view.page.tables import escaped

__all__ = ["write_all_page"]

PICTURES = {".png": "image/png", ".webp": "image/webp"}


def write_all_page(path: Path, outcomes: Sequence[Outcome]) -> None:
    """Write the page of all experiments, whole or not at all."""
    here = files(__package__)
    style = here.joinpath("page.css").read_text(encoding="utf-8")
    facts = described()
    text = Template(here.joinpath("page.html").read_text(encoding="utf-8")).substitute(
        style=style,
        style_hash=f"sha256-{base64.b64encode(sha256(style.encode()).digest()).decode()}",
        machine=escaped(f"quadfringe {facts['quadfringe']}, Python {facts['python']}, {facts['cores']} cores"),
        spent=f"All experiments took {sum(outcome.spent_s for outcome in outcomes):.0f} s.",
        failures=_failures(outcomes),
        published=_table(_stated(outcomes), named=True),
        contents="".join(_entry(outcome) for outcome in outcomes),
        experiments="".join(_section(outcome) for outcome in outcomes),
    )
    with atomic(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _stated(outcomes: Sequence[Outcome]) -> list[tuple[Outcome, Figure]]:
    """Give the figures that the paper states, each once, with its experiment."""
    rows = {one.name: (outcome, one) for outcome in outcomes for one in outcome.records if one.published is not None}
    return list(rows.values())


def _failures(outcomes: Sequence[Outcome]) -> str:
    lost = [outcome for outcome in outcomes if outcome.error]
    if not lost:
        return ""
    words = ", ".join(f"{outcome.experiment.name} ({outcome.error})" for outcome in lost)
    return f'<p class="failed">{len(lost)} of {len(outcomes)} experiments failed: {escaped(words)}</p>'


def _entry(outcome: Outcome) -> str:
    name = escaped(outcome.experiment.name)
    word = " (failed)" if outcome.error else ""
    return f'<li><a href="#{name}">{name}</a>: {escaped(outcome.experiment.title)}{word}</li>'


def _section(outcome: Outcome) -> str:
    one = outcome.experiment
    lines = [
        f'<section id="{escaped(one.name)}"><h2>{escaped(one.name)}: {escaped(one.title)}</h2>',
        f'<p class="note"><code>quadfringe reproduce {escaped(one.name)}</code>, {outcome.spent_s:.1f} s</p>',
    ]
    if one.smaller_words:
        lines.append(f'<p class="note">Made smaller for this page: {escaped(one.smaller_words)}.</p>')
    if outcome.result is None:
        return "".join([*lines, f'<p class="failed">{escaped(outcome.error)}</p></section>'])
    lines.append(f'<p class="verdict">{escaped(outcome.result.verdict[:1].upper() + outcome.result.verdict[1:])}.</p>')
    lines += [_image(path, one.title) for path in outcome.result.pictures if path.suffix in PICTURES]
    others = [path.name for path in outcome.result.pictures if path.suffix not in PICTURES]
    lines += [f'<p class="note">Next to this page: {escaped(", ".join(others))}</p>'] if others else []
    lines.append(_table([(outcome, figure) for figure in outcome.records]))
    return "".join([*lines, "</section>"])


def _image(path: Path, words: str) -> str:
    data = base64.b64encode(path.read_bytes()).decode()
    return f'<figure><img alt="{escaped(words)}" src="data:{PICTURES[path.suffix]};base64,{data}"></figure>'


def _table(rows: Sequence[tuple[Outcome, Figure]], *, named: bool = False) -> str:
    """Give figures as a table; `named` tells the experiment of each."""
    if not rows:
        return "<p>none</p>"
    head = [*(["experiment"] if named else []), "figure", "ours", "published", "expected", "unit"]
    theory = any(figure.expected is not None for _, figure in rows)
    published = any(figure.published is not None for _, figure in rows)
    head = [word for word in head if (word != "expected" or theory) and (word != "published" or published)]
    lines = []
    for outcome, one in rows:
        cells = {
            "experiment": f'<a href="#{escaped(outcome.experiment.name)}">{escaped(outcome.experiment.name)}</a>',
            "figure": escaped(one.words),
            "ours": escaped(one.shown),
            "published": _number(one.published),
            "expected": _number(one.expected),
            "unit": escaped(one.unit),
        }
        lines.append("".join(_cell(word, cells[word]) for word in head))
    heads = "".join(f"<th{_class(word)}>{word}</th>" for word in head)
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f"<table><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>"


def _cell(head: str, text: str) -> str:
    return f"<td{_class(head)}>{text}</td>"


def _class(head: str) -> str:
    return ' class="number"' if head in ("ours", "published", "expected") else ""


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"
