"""`quadfringe accept`: whether the instrument is good."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli._output import JsonOption, rows, say, write_figures

__all__ = ["accept"]

NOT_ACCEPTED = 1
ShapesOption = Annotated[list[Path] | None, typer.Option(metavar="FILE", help="Shape, .npz; may be repeated.")]


def accept(
    plane: ShapesOption = None,
    sphere: ShapesOption = None,
    sphere_diameter_mm: Annotated[float, typer.Option(min=1.0, help="Calibrated diameter of --sphere.")] = 60.0,
    steps: ShapesOption = None,
    step_height_mm: Annotated[
        list[float] | None, typer.Option(metavar="MM", help="Calibrated height of a top of --steps; may be repeated.")
    ] = None,
    system: Annotated[
        Path | None, typer.Option(metavar="FILE", help="System of the virtual bench to measure, .toml.")
    ] = None,
    calibration: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Calibration to measure with, else that of the bench itself.")
    ] = None,
    plane_form_mm: Annotated[float, typer.Option(min=0.0, help="Greatest form error of a plane.")] = 0.10,
    sphere_form_mm: Annotated[float, typer.Option(min=0.0, help="Greatest form error of a sphere.")] = 0.15,
    sphere_size_mm: Annotated[float, typer.Option(min=0.0, help="Greatest error of a diameter.")] = 0.10,
    step_mm: Annotated[float, typer.Option(min=0.0, help="Greatest error of a step.")] = 0.05,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Picture of the deviations, .png; needs the extra plot.")
    ] = None,
    json: JsonOption = None,
) -> None:
    """Judge measured planes, spheres and steps (VDI/VDE 2634, part 2); without files, those of the virtual bench.

    The status is 1 when a limit is not kept.
    """
    from quadfringe.calibration import acceptance
    from quadfringe.data import Calibration
    from quadfringe.errors import InputError
    from quadfringe.evaluation.simulate import virtual_bench_config
    from quadfringe.files import require_suffix

    if out is not None:
        require_suffix(out, (".png",))
    given = (plane or [], sphere or [], steps or [])
    if steps and not step_height_mm:
        raise InputError("--steps needs the calibrated height of every top: --step-height-mm MM for each")
    if any(given):
        if system is not None or calibration is not None:
            raise InputError("--system and --calibration measure on the virtual bench; leave them out with files")
        artefacts = acceptance.read_artefacts(*given, sphere_diameter_mm, step_height_mm or [])
    else:
        known = None if calibration is None else Calibration.load(calibration)
        artefacts = acceptance.measure_artefacts(virtual_bench_config(system, noise=None if system else 0.01), known)
    limits = acceptance.Limits(plane_form_mm, sphere_form_mm, sphere_size_mm, step_mm)
    found = acceptance.accept(artefacts, limits)
    lines = [(line.name, line.value_mm, line.limit_mm, "yes" if line.accepted else "NO") for line in found.lines]
    rows("acceptance, mm", ("figure", "value", "limit", "accepted"), lines, json)
    write_figures({line.name: line.value_mm for line in found.lines} | dict(found.figures), json)
    if out is not None:
        acceptance.write_acceptance(out, found)
        say(str(out), json)
    if not found.accepted:
        raise typer.Exit(NOT_ACCEPTED)
