"""Measure what three colours without infrared lose against four channels, on all scenes and on the real captures.

    python evaluation/rgb.py [--half tune|report] [--method joint] [--only WORD ...] [--numbers N,N[,N] ...]
                             [--data FOLDER] [--json FILE] [--markdown FILE]

Every scene of evaluation/world.py, 3 % noise, 8 bit, linear: with infrared at the fringe numbers of the paper (36, 35,
30) and at 16, 15, 12, and without: three different numbers (36, 35, 30), and two (16, 15) with red and blue in
quadrature. `--numbers` measures other numbers of three colours in their place. Depth and phase errors are of returned
pixels with the right order at least 2 px from an edge. The captures are decoded from their red, green and infrared
images as three colours with three numbers, and from their red, green and blue images with two numbers, one range of 630
known columns after the other, because these repeat after that; right: of the object, a missing pixel counts as wrong.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path

import quadfringe as qf
from quadfringe.config import Fringes
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import three_colours, world
from quadfringe.evaluation._report import head_of, table
from quadfringe.evaluation.machine import described
from quadfringe.files import figures_text

HALVES = {"tune": world.TUNE, "report": world.REPORT}
CAPTURED = ("captured", "right order, % of the object", "% of the returned pixels")
WORDS = """Depth RMS of right orders, returned pixels and wrong orders of these: with infrared at 36, 35, 30 fringes
(paper) and at 16, 15, 12 (four), and without at 36, 35, 30 in red, green and blue (three) and at 16, 15 with red and
blue in quadrature (two). 3 % noise, 8 bit, mean over two seeds. The last columns divide the errors at the same fringe
period.
"""
DEFAULT = """
Three different numbers are the default. Their fringes are 2.25 times as fine, and an order is mistaken only if the
phases together are off by 0.52 rad, against 0.20 rad with two numbers. Errors are smaller on white planes and steps, on
patches, prints, photographs and gloss, and small squares on a face keep their orders. Two numbers return up to one
percent more of white surfaces and have fewer wrong orders on objects that are narrower than a fringe (rods, clutter),
because red and blue give a phase to every pixel.
"""


def line(name: str, figures: dict[str, float], codes: Iterable[str]) -> tuple[str, ...]:
    """Give the cells of a scene: errors and shares of each code, and the ratios at the same fringe period."""
    keys = ("rms_mm", "returned_percent", "wrong_percent")
    cells = []
    for code in codes:
        error_mm, returned, wrong = (figures[f"{name}_{code}_{key}"] for key in keys)
        cells.append(f"{error_mm:.3f}, {returned:.2f}, {wrong:.3f}")
    pairs = [(one, other) for one, other in three_colours.SAME_PERIOD.items() if one in codes]
    ratios = [figures[f"{name}_{one}_rms_mm"] / figures[f"{name}_{other}_rms_mm"] for one, other in pairs]
    return name, *cells, *(f"{ratio:.2f}" for ratio in ratios)


def heads(codes: Iterable[str]) -> tuple[str, ...]:
    """Give the heads of the columns."""
    ratios = (f"{one} over {other}" for one, other in three_colours.SAME_PERIOD.items() if one in codes)
    return ("scene", *(f"{code}: mm, returned %, wrong %" for code in codes), *ratios)


def codes_of(words: list[str] | None) -> dict[str, Fringes]:
    """Give the encodings to compare: all, or three colours with these numbers."""
    if words is None:
        return three_colours.CODES
    given = [tuple(float(number) for number in word.split(",")) for word in words]
    return {" ".join(f"{n:g}" for n in numbers): Fringes(encoding="rgb", numbers=numbers) for numbers in given}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--half", choices=HALVES, default="report")
    parser.add_argument("--method", default="joint")
    parser.add_argument("--only", nargs="+", metavar="WORD", help="scenes whose name contains one of these words")
    parser.add_argument(
        "--numbers", nargs="+", metavar="N,N[,N]", help="other numbers of three colours, such as 25,24,20"
    )
    parser.add_argument("--data", type=Path, default=scenes.data_folder())
    parser.add_argument("--json", type=Path, help="write the figures here")
    parser.add_argument("--markdown", type=Path, help="write the table here")
    options = parser.parse_args()
    with qf.open(qf.SystemConfig()) as scanner:
        calibration = scanner.calibration
    assert calibration is not None
    figures: dict[str, float] = {}
    codes = codes_of(options.numbers)
    lines = []
    chosen = options.only or [""]
    # The scenes of other fringe periods differ in their fringes alone.
    names = [name for name in world.SCENES if not name.startswith("fringes_")]
    for name in (name for name in names if any(word in name for word in chosen)):
        for code, fringes in codes.items():
            found = three_colours.figures_of(name, fringes, calibration, HALVES[options.half], options.method)
            figures |= {f"{name}_{code}_{key}": value for key, value in found.items()}
        lines.append(line(name, figures, codes))
        print(" | ".join(lines[-1]), flush=True)
    kinds = {"three numbers": three_colours.captures_of_three, "two, within 630 columns": three_colours.captures}
    measured = kinds if options.data.is_dir() and options.numbers is None else {}
    rows = []
    for kind, measure in measured.items():
        for name, seen in measure(options.data, method=options.method):
            right, of_returned = seen.right_percent, seen.right_of_returned_percent
            figures |= {f"{kind}_{name}_right_percent": right, f"{kind}_{name}_right_of_returned_percent": of_returned}
            rows.append((f"{name}, {kind}", f"{right:.2f}", f"{of_returned:.3f}"))
            print(" | ".join(rows[-1]))
    if options.markdown:
        head = head_of(described(), "python evaluation/rgb.py --markdown evaluation/RGB.md", "three colours")
        options.markdown.write_text(
            "\n".join(
                [
                    head,
                    WORDS,
                    table(heads(codes), lines),
                    *([DEFAULT] if options.numbers is None else []),
                    table(CAPTURED, rows),
                ]
            )
        )
    if options.json:
        options.json.write_text(figures_text(figures))


if __name__ == "__main__":
    main()
