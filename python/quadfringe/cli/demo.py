"""`quadfringe demo`: one shot of each demonstration scene on the virtual bench, compared with the truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli._options import EncodingOption, JsonOption, fringes_from
from quadfringe.cli._output import progress, say, table, write_figures

__all__ = ["demo"]


def demo(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the surfaces, reports and figures.")] = Path(
        "out/demo"
    ),
    encoding: EncodingOption = None,
    json: JsonOption = None,
) -> None:
    """Measure two scenes, steps and a face, on the virtual bench; write PLY files, PNG reports and figures.json.

    Without the extras export and plot it writes GLB files and small reports.
    """
    from quadfringe.evaluation.demo import SCENES, missing_extras, next_steps, run_scene
    from quadfringe.files import folder_for

    folder_for(out)
    fringes = fringes_from(encoding, None, None)
    figures: dict[str, float] = {}
    decode_ms = []
    with progress(SCENES, "virtual bench") as scenes:
        for scene in scenes:
            result = run_scene(scene, out, fringes)
            figures |= result.figures
            decode_ms.append(result.decode_ms)
    figures["decode_ms"] = min(decode_ms)
    table("one shot per scene, compared with the simulated truth", figures, json)
    say(f"files in {out}: {', '.join(sorted(p.name for p in out.iterdir()))}", json)
    if (left_out := missing_extras()) is not None:
        say(left_out, json)
    for line in next_steps(out):
        say(line, json)
    write_figures(figures, out / "figures.json")
    write_figures(figures, json)
