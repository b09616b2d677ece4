"""`quadfringe demo`: the virtual bench, one shot of each scene, compared with the simulator's truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli._output import JsonOption, say, steps, table, write_figures

__all__ = ["demo"]


def demo(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for PLY, report and figures.")] = Path("out/demo"),
    json: JsonOption = None,
) -> None:
    """Measure steps and a face on the virtual bench; write PLY, a PNG report and the figures."""
    from quadfringe.evaluation.demo import SCENES, run_scene
    from quadfringe.files import folder_for

    folder_for(out)
    figures: dict[str, float] = {}
    decode_ms = []
    with steps(SCENES, "virtual bench") as scenes:
        for scene in scenes:
            result = run_scene(scene, out)
            figures |= result.figures
            decode_ms.append(result.decode_ms)
    figures["decode_ms"] = min(decode_ms)
    table("one shot, one shape: against the simulator's truth", figures, json)
    say(f"look at {out}: {', '.join(sorted(p.name for p in out.iterdir()))}", json)
    write_figures(figures, out / "figures.json")
    write_figures(figures, json)
