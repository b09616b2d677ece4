"""All experiments in one run: their figures on one page and in one record; one that fails stops none of the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

from quadfringe.evaluation.machine import described
from quadfringe.evaluation.reproduce._registry import EXPERIMENTS, Experiment
from quadfringe.evaluation.reproduction import Figure, Reproduction

__all__ = ["Outcome", "record_of", "run_all"]

# What an experiment may raise; anything else, such as a wrong name, is a fault of the program and ends the run.
FAILURES = (ArithmeticError, AssertionError, ImportError, LookupError, MemoryError, OSError, RuntimeError, ValueError)


@dataclass(frozen=True)
class Outcome:
    """What became of an experiment: its result, or its error in words; and the time it took, s."""

    experiment: Experiment
    result: Reproduction | None
    error: str
    spent_s: float

    @property
    def records(self) -> tuple[Figure, ...]:
        """The figures; none after an error."""
        return () if self.result is None else self.result.records


def run_all(
    out: Path,
    begin: Callable[[Experiment], None] = lambda _: None,
    end: Callable[[Outcome], None] = lambda _: None,
    experiments: Sequence[Experiment] | None = None,
) -> list[Outcome]:
    """Run every experiment, smaller where that is noted, into the folder `out`; return what became of each.

    `begin` and `end` are called before and after each. An experiment that raises one of `FAILURES` has an error in its
    outcome, and the next one runs.
    """
    outcomes = []
    for experiment in tuple(EXPERIMENTS.values()) if experiments is None else experiments:
        begin(experiment)
        outcomes.append(_outcome(experiment, out))
        end(outcomes[-1])
    return outcomes


def _outcome(experiment: Experiment, out: Path) -> Outcome:
    start = perf_counter()
    try:
        result = experiment.small(out)
    except FAILURES as error:
        words = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
        return Outcome(experiment, None, words, perf_counter() - start)
    return Outcome(experiment, result, "", perf_counter() - start)


def record_of(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Give the outcomes as plain data for JSON: `figures` by name, and each experiment with what the paper has.

    Numbers that are not finite become None.
    """
    return {
        "figures": {one.name: _finite(one.value) for outcome in outcomes for one in outcome.records},
        "experiments": [_experiment(outcome) for outcome in outcomes],
        "machine": described(),
    }


def _experiment(outcome: Outcome) -> dict[str, Any]:
    result = outcome.result
    return {
        "name": outcome.experiment.name,
        "title": outcome.experiment.title,
        "smaller": outcome.experiment.smaller_words or None,
        "spent_s": round(outcome.spent_s, 1),
        "error": outcome.error or None,
        "verdict": None if result is None else result.verdict,
        "figures": [{k: _finite(v) for k, v in asdict(one).items()} for one in outcome.records],
        "pictures": [] if result is None else [path.name for path in result.pictures],
    }


def _finite(value: Any) -> Any:
    """Give a value as JSON can hold it."""
    if not isinstance(value, float):
        return value
    return value if abs(value) != float("inf") and value == value else None
