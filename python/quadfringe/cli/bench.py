"""`quadfringe bench`: how fast this machine decodes, and how much memory a decoder holds."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from quadfringe.cli._options import METHODS, JsonOption, method_named
from quadfringe.cli._output import rows, say, write_record

if TYPE_CHECKING:
    from quadfringe.evaluation.timing import Case, Cost, Memory, Timing

__all__ = ["bench"]

SMALLEST_PX = 16  # below this no carrier fits an image
SizeOption = Annotated[list[str], typer.Option(metavar="WxH", help="Image size, px; may be repeated.")]
MethodOption = Annotated[
    list[str] | None,
    typer.Option(metavar=METHODS, parser=method_named, help="Method to time; may be repeated; default: both."),
]
ThreadsOption = Annotated[
    list[int] | None,
    typer.Option(min=1, help="Number of threads; may be repeated; default: 1 and the number of cores."),
]
RepeatsOption = Annotated[int, typer.Option(min=3, help="Timed decodes of each case; the median is reported.")]
SurfaceOption = Annotated[str, typer.Option(help="Surface in front of the virtual camera.")]
PatchOption = Annotated[
    float | None,
    typer.Option(min=0.1, help="Print squares of different albedo and this side on the surface, mm; default: white."),
]
ScalingOption = Annotated[
    bool, typer.Option("--scaling", help="Also time seven sizes from 0.25 to 16 million pixels; takes minutes.")
]


def bench(
    size: SizeOption = ["1024x768"],  # noqa: B006 - typer only reads it
    method: MethodOption = None,
    threads: ThreadsOption = None,
    repeats: RepeatsOption = 20,
    surface: SurfaceOption = "face",
    patch_mm: PatchOption = None,
    scaling: ScalingOption = False,
    json: JsonOption = None,
) -> None:
    """Time the decoding of a shot of the virtual bench, from four 8-bit images to X, Y, Z, and measure the memory."""
    from quadfringe.config import SceneConfig
    from quadfringe.evaluation import timing
    from quadfringe.evaluation.machine import described, usable_cores

    sizes = [_size(text) for text in dict.fromkeys(size)]
    methods = list(dict.fromkeys(method)) if method else list(timing.METHODS)
    light: dict[str, Any] = {"surface": surface, "patch_mm": patch_mm, "noise": timing.NOISE}
    scene = SceneConfig.model_validate(light)
    counts = sorted(set(threads or (1, usable_cores())))
    machine = described()
    say("\n".join(f"{name}: {value}" for name, value in machine.items() if value is not None), json)
    timings = [t for wh in sizes for t in timing.time_decoding(wh, methods, counts, repeats=repeats, scene=scene)]
    _show_times(f"{surface}, 3 % noise, 8 bit to X, Y, Z and verdict, {repeats} repeats; ms", timings, json)
    memories = [m for wh in sizes for m in timing.memory(wh, methods, counts[-1], scene=scene)]
    _show_memory(memories, json)
    grown = list(timing.scaling(methods, counts[-1], repeats=repeats, scene=scene)) if scaling else []
    costs = [timing.cost_of([t for t in grown if t.case.method == name]) for name in methods if grown]
    _show_scaling(grown, costs, json)
    found: dict[str, Sequence[Timing | Memory | Cost]] = {"timings": timings, "memory": memories}
    found |= {"scaling": grown, "cost": costs}
    records = {name: [one.record() for one in every] for name, every in found.items()}
    figures = {"figures": dict(_figure(t, usable_cores()) for t in timings)}
    write_record({"schema_version": 1, "machine": machine} | light | records | figures, json)


def _size(text: str) -> tuple[int, int]:
    """Parse a size such as 1024x768."""
    found = re.fullmatch(r"(\d+)x(\d+)", text)
    if found is None:
        raise typer.BadParameter(f"expected width x height as in 1024x768, got {text!r}", param_hint="--size")
    width, height = int(found[1]), int(found[2])
    if min(width, height) < SMALLEST_PX:
        raise typer.BadParameter(
            f"expected at least {SMALLEST_PX} x {SMALLEST_PX} pixels, got {text}", param_hint="--size"
        )
    return width, height


def _figure(timing: Timing, cores: int) -> tuple[str, float]:
    """Return the median time and a name that is the same on every machine, as in joint_1024x768_all_threads_ms."""
    case = timing.case
    threads = "all" if case.threads == cores else str(case.threads)
    return f"{case.method}_{_size_text(case)}_{threads}_threads_ms", timing.median_ms


def _size_text(case: Case) -> str:
    return f"{case.width_px}x{case.height_px}"


def _show_times(title: str, timings: Sequence[Timing], json: Path | None, rate: str = "shots_per_s") -> None:
    """Print a table of times; `rate` is `shots_per_s` or `ns_per_pixel`."""
    units = {"shots_per_s": "shots/s", "ns_per_pixel": "ns/pixel"}
    cells = [
        (
            *(t.case.method, _size_text(t.case), t.case.threads),
            *(t.median_ms, t.minimum_ms, t.verdict_ms, getattr(t, rate), t.busy_cores),
        )
        for t in timings
    ]
    rows(title, ("method", "size", "threads", "median", "min", "verdict", units[rate], "busy cores"), cells, json)


def _show_memory(memories: Sequence[Memory], json: Path | None) -> None:
    if memories:
        held = [(m.case.method, _size_text(m.case), m.held_mb) for m in memories]
        rows("resident memory of one decoder with its results", ("method", "size", "held MB"), held, json)


def _show_scaling(timings: Sequence[Timing], costs: Sequence[Cost], json: Path | None) -> None:
    """Print the times of all sizes, and the line of time against pixels of each method."""
    if not timings:
        return
    _show_times("time against pixels at a constant field of view; ms", timings, json, "ns_per_pixel")
    heads = ("method", "fixed ms per shot", "ns per pixel", "largest distance from the line %", "spread per pixel %")
    lines = [(c.method, c.fixed_ms, c.ns_per_pixel, c.off_percent, c.spread_percent) for c in costs]
    rows("straight line through these times", heads, lines, json)
