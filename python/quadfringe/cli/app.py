"""The commands, in the order of a measuring session, and the one place that turns errors into exit statuses."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from quadfringe.cli import (
    accept,
    batch,
    bench,
    calibrate,
    camera,
    compare,
    convert,
    decode,
    demo,
    doctor,
    info,
    live,
    measure,
    pattern,
    projector,
    record,
    report,
    reproduce,
    simulate,
    target,
    view,
)
from quadfringe.cli._options import in_words, joined_numbers
from quadfringe.cli._output import cautions, complain
from quadfringe.errors import BatchError, CameraError, DecodeError, MissingExtraError, RecordingError

__all__ = ["app"]

USAGE, FAILED = 2, 1


class Commands(TyperGroup):
    """Exit with 2 for bad input and with 1 for a failed run; both print one message and no traceback."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Take as many numbers after an option as the encoding needs."""
        return super().parse_args(ctx, joined_numbers(args))

    def invoke(self, ctx: Any) -> Any:
        """Run the command and turn its errors into exit statuses."""
        try:
            with cautions():
                return super().invoke(ctx)
        except typer.BadParameter as error:
            error.message = in_words(error)
            raise
        except (BatchError, DecodeError, CameraError, RecordingError) as error:
            complain(str(error))
            raise typer.Exit(FAILED) from error
        except MemoryError as error:
            complain(f"out of memory: {error or 'use smaller images or shapes'}")
            raise typer.Exit(FAILED) from error
        except BrokenPipeError:
            raise  # the reader closed the pipe early, as `head` does; this is no error
        except (ValueError, OSError, MissingExtraError) as error:
            complain(str(error))
            raise typer.Exit(USAGE) from error


app = typer.Typer(
    cls=Commands,
    name="quadfringe",
    help="Single-shot 3D measurement: from the four fringe images of one exposure to absolute phase and millimetres.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _show_version(requested: bool) -> None:
    if requested:
        from quadfringe import _core

        typer.echo(f"quadfringe {_core.__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit."),
    ] = False,
) -> None:
    """Single-shot 3D measurement: from the four fringe images of one exposure to absolute phase and millimetres."""


app.command("demo")(demo.demo)
app.command("target")(target.target)
app.command("pattern")(pattern.pattern)
app.command("simulate")(simulate.simulate)
app.command("decode")(decode.decode)
app.command("convert")(convert.convert)
app.command("measure")(measure.measure)
app.command("view")(view.view)
app.command("live")(live.live)
app.command("record")(record.record)
app.command("recover")(record.recover)
app.command("batch")(batch.batch)
app.command("report")(report.report)
app.command("compare")(compare.compare)
app.command("accept")(accept.accept)
app.command("doctor")(doctor.doctor)
app.command("info")(info.info)
app.command("reproduce")(reproduce.reproduce)
app.command("bench")(bench.bench)
app.add_typer(calibrate.app, name="calibrate")
app.add_typer(projector.app, name="projector")
app.add_typer(camera.app, name="camera")
