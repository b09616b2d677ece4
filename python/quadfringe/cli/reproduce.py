"""`quadfringe reproduce`: compute a published result again, or all of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._options import JsonOption
from quadfringe.cli._output import complain, rows, say, write_figures, write_record

if TYPE_CHECKING:
    from collections.abc import Sequence

    from quadfringe.evaluation.reproduce import Experiment, Figure, Outcome

__all__ = ["reproduce"]

FAILED = 1
PAGE, RECORD = "reproduce.html", "reproduce.json"
NameArgument = Annotated[
    str,
    typer.Argument(
        metavar="NAME",
        help="identity, deviated-pair, tolerance, projector-calibration, correction, row-profile, peaks, mask, steps, "
        "hand (as in the paper); range, geometry, crosstalk, depth; or all.",
    ),
]


def reproduce(
    name: NameArgument,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the pictures.")] = Path("out/reproduce"),
    json: JsonOption = None,
) -> None:
    """Compute a published result again: write its picture as PNG (the hand: also MP4) and print its numbers.

    With all, every experiment runs, some of them smaller, and one page shows all figures next to the published ones:
    reproduce.html, and the same in reproduce.json. One that fails does not stop the others; the exit status is then 1.
    """
    from quadfringe.evaluation.reproduce import ALL, named
    from quadfringe.evaluation.reproduce._names import name_of
    from quadfringe.files import folder_for

    if name_of(name) == ALL:
        _all(folder_for(out), json)
    else:
        _one(named(name), folder_for(out), json)


def _one(experiment: Experiment, out: Path, json: Path | None) -> None:
    from quadfringe.cli._progress import clock

    with clock(experiment.name, experiment.expected_s):
        result = experiment.run(out)
    _print_figures(f"reproduce {experiment.name}", result.records, json)
    say(f"{result.verdict}", json)
    say("\n".join(str(path) for path in result.pictures), json)
    write_figures(result.figures, json)


def _all(out: Path, json: Path | None) -> None:
    from quadfringe.cli._progress import meter
    from quadfringe.evaluation.reproduce import EXPERIMENTS, record_of, run_all
    from quadfringe.evaluation.reproduce._page import write_all_page

    expected_s = sum(one.in_all_s for one in EXPERIMENTS.values())
    with meter("reproduce", expected_s, expected_s, each=True) as shown:

        def begin(experiment: Experiment) -> None:
            shown.begin(experiment.name)

        def end(outcome: Outcome) -> None:
            shown.advance(outcome.experiment.in_all_s)
            if outcome.error:
                complain(f"{outcome.experiment.name}: {outcome.error}")

        outcomes = run_all(out, begin, end)
    write_all_page(out / PAGE, outcomes)
    write_record(record_of(outcomes), out / RECORD)
    stated = {one.name: one for outcome in outcomes for one in outcome.records if one.published is not None}
    _print_figures("published figures", list(stated.values()), json)
    for outcome in outcomes:
        verdict = f"FAILED: {outcome.error}" if outcome.result is None else outcome.result.verdict
        say(f"{outcome.experiment.name}: {verdict}", json)
    say(str(out / PAGE), json)
    write_record(record_of(outcomes), json)
    if any(outcome.error for outcome in outcomes):
        raise typer.Exit(FAILED)


def _print_figures(title: str, records: Sequence[Figure], json: Path | None) -> None:
    """Print the figures with what the paper and theory have, where they have any."""
    theory = any(one.expected is not None for one in records)
    published = any(one.published is not None for one in records)
    head = ["figure", "ours", *(["published"] if published else []), *(["expected"] if theory else []), "unit"]
    lines = []
    for one in records:
        line = [one.words, one.shown]
        line += [_number(one.published)] if published else []
        line += [_number(one.expected)] if theory else []
        lines.append([*line, one.unit])
    rows(title, head, lines, json)


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"
