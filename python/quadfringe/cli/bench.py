"""`quadfringe bench`: how fast this machine decodes, and what a decoder holds in memory."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._output import JsonOption, rows, say, write_record
from quadfringe.cli.decode import Method

if TYPE_CHECKING:
    from quadfringe.evaluation.timing import Case, Timing

__all__ = ["bench"]

SMALLEST_PX = 16


def bench(
    size: Annotated[list[str], typer.Option(metavar="WxH", help="Size of an image; may be repeated.")] = ["1024x768"],  # noqa: B006 - typer only reads it
    method: Annotated[list[Method] | None, typer.Option(help="Default: both.")] = None,
    threads: Annotated[list[int] | None, typer.Option(min=1, help="Default: 1, and all cores.")] = None,
    repeats: Annotated[int, typer.Option(min=3, help="Timed decodes of each case.")] = 20,
    surface: Annotated[str, typer.Option(help="What stands on the bench.")] = "face",
    patch_mm: Annotated[float | None, typer.Option(min=0.1, help="Print coloured squares of this side, mm.")] = None,
    scaling: Annotated[bool, typer.Option("--scaling", help="Time 0.25 to 16 million pixels too.")] = False,
    json: JsonOption = None,
) -> None:
    """Time decoding of a bench shot, four 8-bit images to X, Y, Z, and weigh the decoders."""
    from quadfringe.config import SceneConfig
    from quadfringe.evaluation import timing
    from quadfringe.evaluation.machine import described, usable_cores

    sizes = [_size(text) for text in dict.fromkeys(size)]
    methods = list(dict.fromkeys(m.value for m in method)) if method else list(timing.METHODS)
    scene = SceneConfig.model_validate({"surface": surface, "patch_mm": patch_mm, "noise": timing.NOISE})
    counts = sorted(set(threads or (1, usable_cores())))
    machine = described()
    say("\n".join(f"{name}: {value}" for name, value in machine.items() if value is not None), json)
    timings = [t for wh in sizes for t in timing.time_decoding(wh, methods, counts, repeats=repeats, scene=scene)]
    _show(f"{surface}, 3 % noise, 8 bit to X, Y, Z and verdict, {repeats} times; ms and busy cores", timings, json)
    memories = [m for wh in sizes for m in timing.memory(wh, methods, counts[-1], scene=scene)]
    if memories:
        held = [(m.case.method, _words(m.case), m.held_mb) for m in memories]
        rows("resident memory of one decoder, results included", ("method", "size", "held MB"), held, json)
    grown = list(timing.scaling(methods, counts[-1], repeats=repeats, scene=scene)) if scaling else []
    if scaling:
        _show("cost against pixels, the same field of view; ms, ns and busy cores", grown, json, "ns_per_pixel")
    costs = [timing.cost_of([t for t in grown if t.case.method == method]) for method in methods if grown]
    if costs:
        heads = ("method", "every shot ms", "a pixel ns", "furthest from the line %", "spread of a pixel %")
        lines = [(c.method, c.fixed_ms, c.ns_per_pixel, c.off_percent, c.spread_percent) for c in costs]
        rows("the line through these times", heads, lines, json)
    record = {
        "schema_version": 1,
        "machine": machine,
        "surface": surface,
        "patch_mm": patch_mm,
        "noise": timing.NOISE,
        "timings": [t.record() for t in timings],
        "memory": [m.record() for m in memories],
        "scaling": [t.record() for t in grown],
        "cost": [cost.record() for cost in costs],
        "figures": dict(_figure(t, usable_cores()) for t in timings),
    }
    write_record(record, json)


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d+)x(\d+)", text)
    if found is None:
        raise typer.BadParameter(f"expected width x height as in 1024x768, got {text!r}", param_hint="--size")
    width, height = int(found[1]), int(found[2])
    if min(width, height) < SMALLEST_PX:
        raise typer.BadParameter(f"expected at least 16 x 16 pixels, got {text}", param_hint="--size")
    return width, height


def _figure(timing: Timing, cores: int) -> tuple[str, float]:
    """Give a name that stays the same on every machine, as in best_1024x768_all_threads_ms, and the median."""
    case = timing.case
    threads = "all" if case.threads == cores else str(case.threads)
    return f"{case.method}_{_words(case)}_{threads}_threads_ms", timing.median_ms


def _words(case: Case) -> str:
    return f"{case.width_px}x{case.height_px}"


def _show(title: str, timings: list[Timing], json: Path | None, cost: str = "shots_per_s") -> None:
    heads = {"shots_per_s": "shots/s", "ns_per_pixel": "ns/pixel"}
    cells = [
        (t.case.method, _words(t.case), t.case.threads, t.median_ms, t.minimum_ms, t.verdict_ms, cost_of, t.busy_cores)
        for t in timings
        for cost_of in [t.record()[cost]]
    ]
    rows(title, ("method", "size", "threads", "median", "min", "verdict", heads[cost], "busy"), cells, json)
