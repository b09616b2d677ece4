"""Measure what three colours without infrared lose against four channels, on all scenes and on the real captures.

    python evaluation/rgb.py [--half tune|report] [--method joint] [--only WORD ...] [--data FOLDER] [--json FILE]
                             [--markdown FILE]

Every scene of evaluation/world.py, 3 % noise, 8 bit, linear: with infrared at the fringe numbers of the paper (36, 35,
30) and at the fringe period of the three colours (16, 15, 12), and without (16, 15). Depth and phase errors are of
returned pixels with the right order at least 2 px from an edge. The captures are decoded from their red, green and blue
images, one range of 630 known columns after the other, because their two fringe numbers repeat after that; right: of
the object, a missing pixel counts as wrong.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import quadfringe as qf
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import three_colours, world
from quadfringe.evaluation._report import head_of, table
from quadfringe.evaluation.machine import described
from quadfringe.files import figures_text

HALVES = {"tune": world.TUNE, "report": world.REPORT}
HEADS = ("scene", *(f"{code}: mm, returned %, wrong %" for code in three_colours.CODES), "rgb over four")

CAPTURED = ("captured, within 630 known columns", "right order, % of the object", "% of the returned pixels")
WORDS = """Depth RMS of right orders, returned pixels and wrong orders of these: with infrared at 36, 35, 30 fringes
(paper) and at 16, 15, 12 (four), and without at 16, 15 (rgb). 3 % noise, 8 bit, mean over two seeds. The last column
divides the errors at the same fringe period.
"""


def line(name: str, figures: dict[str, float]) -> tuple[str, ...]:
    """Give the cells of a scene: errors and shares of each code, and the ratio at the same fringe period."""
    keys = ("rms_mm", "returned_percent", "wrong_percent")
    cells = []
    for code in three_colours.CODES:
        error_mm, returned, wrong = (figures[f"{name}_{code}_{key}"] for key in keys)
        cells.append(f"{error_mm:.3f}, {returned:.2f}, {wrong:.3f}")
    ratio = figures[f"{name}_rgb_rms_mm"] / figures[f"{name}_four_rms_mm"]
    return name, *cells, f"{ratio:.2f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--half", choices=HALVES, default="report")
    parser.add_argument("--method", default="joint")
    parser.add_argument("--only", nargs="+", metavar="WORD", help="scenes whose name contains one of these words")
    parser.add_argument("--data", type=Path, default=scenes.data_folder())
    parser.add_argument("--json", type=Path, help="write the figures here")
    parser.add_argument("--markdown", type=Path, help="write the table here")
    options = parser.parse_args()
    with qf.open(qf.SystemConfig()) as scanner:
        calibration = scanner.calibration
    assert calibration is not None
    figures: dict[str, float] = {}
    lines = []
    chosen = options.only or [""]
    # The scenes of other fringe periods differ in their fringes alone.
    names = [name for name in world.SCENES if not name.startswith("fringes_")]
    for name in (name for name in names if any(word in name for word in chosen)):
        for code, numbers in three_colours.CODES.items():
            found = three_colours.figures_of(name, numbers, calibration, HALVES[options.half], options.method)
            figures |= {f"{name}_{code}_{key}": value for key, value in found.items()}
        lines.append(line(name, figures))
        print(" | ".join(lines[-1]), flush=True)
    captured = three_colours.captures(options.data, method=options.method) if options.data.is_dir() else ()
    rows = []
    for name, found in captured:
        right, of_returned = found.right_percent, found.right_of_returned_percent
        figures |= {f"{name}_right_percent": right, f"{name}_right_of_returned_percent": of_returned}
        rows.append((name, f"{right:.2f}", f"{of_returned:.3f}"))
        print(" | ".join(rows[-1]))
    if options.markdown:
        head = head_of(described(), "python evaluation/rgb.py --markdown evaluation/RGB.md", "three colours")
        options.markdown.write_text("\n".join([head, WORDS, table(HEADS, lines), table(CAPTURED, rows)]))
    if options.json:
        options.json.write_text(figures_text(figures))


if __name__ == "__main__":
    main()
