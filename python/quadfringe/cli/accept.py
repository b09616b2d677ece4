"""`quadfringe accept`: the acceptance test of the instrument."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._options import JsonOption, VirtualSystemOption
from quadfringe.cli._output import rows, say, table, write_figures

if TYPE_CHECKING:
    from quadfringe.calibration.acceptance import Artefacts, Limits

__all__ = ["accept"]

NOT_ACCEPTED = 1
WORDS = ("precision", "trueness")  # of figures in the words of data sheets
ShapesOption = Annotated[
    list[Path] | None, typer.Option(metavar="FILE", help="Measured shape of this artefact, .npz; may be repeated.")
]
DiameterOption = Annotated[float, typer.Option(min=1.0, help="Calibrated diameter of the --sphere artefact, mm.")]
StepHeightOption = Annotated[
    list[float] | None,
    typer.Option(metavar="MM", help="Calibrated height of one top of the --steps artefact, mm; repeat it for each."),
]
KnownOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Calibration for measuring on the virtual bench, .json; default: the exact one."),
]
PlaneFormOption = Annotated[float, typer.Option(min=0.0, help="Largest accepted form error of a plane, mm.")]
SphereFormOption = Annotated[float, typer.Option(min=0.0, help="Largest accepted form error of a sphere, mm.")]
SphereSizeOption = Annotated[float, typer.Option(min=0.0, help="Largest accepted error of a sphere diameter, mm.")]
StepOption = Annotated[float, typer.Option(min=0.0, help="Largest accepted error of a step height, mm.")]
PictureOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Write the deviation maps as .png; needs the extra plot.")
]


def accept(
    plane: ShapesOption = None,
    sphere: ShapesOption = None,
    sphere_diameter_mm: DiameterOption = 60.0,
    steps: ShapesOption = None,
    step_height_mm: StepHeightOption = None,
    system: VirtualSystemOption = None,
    calibration: KnownOption = None,
    plane_form_mm: PlaneFormOption = 0.10,
    sphere_form_mm: SphereFormOption = 0.15,
    sphere_size_mm: SphereSizeOption = 0.10,
    step_mm: StepOption = 0.05,
    out: PictureOption = None,
    json: JsonOption = None,
) -> None:
    """Test measured planes, spheres and steps against limits, in the manner of VDI/VDE 2634 part 2.

    Without shapes, the artefacts are measured on the virtual bench. The exit status is 1 when a limit is exceeded.
    """
    from quadfringe.calibration import acceptance
    from quadfringe.errors import InputError
    from quadfringe.files import require_suffix

    if out is not None:
        require_suffix(out, (".png",))
    if steps and not step_height_mm:
        raise InputError("--steps needs the calibrated height of every top: add --step-height-mm MM for each")
    shapes = (plane or [], sphere or [], steps or [])
    if any(shapes):
        if system is not None or calibration is not None:
            raise InputError("--system and --calibration apply to the virtual bench; leave them out with shape files")
        artefacts = acceptance.read_artefacts(*shapes, sphere_diameter_mm, step_height_mm or [])
    else:
        artefacts = _measured(system, calibration)
    limits = acceptance.Limits(plane_form_mm, sphere_form_mm, sphere_size_mm, step_mm)
    _report(artefacts, limits, out, json)


def _measured(system: Path | None, calibration: Path | None) -> Artefacts:
    """Measure the artefacts on the virtual bench."""
    from quadfringe.calibration.acceptance import measure_artefacts
    from quadfringe.data import Calibration
    from quadfringe.evaluation.simulate import virtual_bench_config

    known = None if calibration is None else Calibration.load(calibration)
    return measure_artefacts(virtual_bench_config(system, noise=None if system else 0.01), known)


def _report(artefacts: Artefacts, limits: Limits, out: Path | None, json: Path | None) -> None:
    """Judge the artefacts, print the result and exit with status 1 when a limit is exceeded."""
    from quadfringe.calibration.acceptance import accept, write_acceptance

    found = accept(artefacts, limits)
    lines = [(line.name, line.value_mm, line.limit_mm, "yes" if line.accepted else "NO") for line in found.lines]
    rows("acceptance, mm", ("figure", "value", "limit", "accepted"), lines, json)
    words = {name: value for name, value in found.figures.items() if any(word in name for word in WORDS)}
    if words:
        table("precision (one standard deviation) and trueness", words, json)
    write_figures({line.name: line.value_mm for line in found.lines} | dict(found.figures), json)
    if out is not None:
        write_acceptance(out, found)
        say(str(out), json)
    if not found.accepted:
        raise typer.Exit(NOT_ACCEPTED)
