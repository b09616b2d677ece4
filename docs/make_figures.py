"""Draw the pictures of the README and measure its figures again; `make figures` runs this.

Every row of the table names the command that gave its number. Rows on captures and renders need the test data
(QUADFRINGE_DATA, or ../shared/data) and are left as they are without it.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import LightSource
from matplotlib.figure import Figure

import quadfringe as qf

ROOT = Path(__file__).resolve().parents[1]
PICTURES = ROOT / "docs" / "images"
BEGIN, END = "<!-- figures -->", "<!-- /figures -->"


@dataclass(frozen=True)
class Source:
    """A command that writes figures as JSON, and the rows that come from it: figure, words, bar."""

    command: tuple[str, ...]
    rows: tuple[tuple[str, str, str], ...]


SOURCES = (
    Source(
        ("quadfringe", "demo"),
        (
            ("steps_depth_rms_mm", "steps at 800 mm, 3 % noise, 8 bit: depth RMS away from edges, mm", "0.10"),
            ("steps_wrong_order_percent", "steps: wrong fringe orders among returned pixels, %", "0.1"),
            ("steps_returned_percent", "steps: lit pixels returned, %", ""),
            ("face_depth_rms_mm", "face: depth RMS away from edges, mm", "0.10"),
            ("face_wrong_order_percent", "face: wrong fringe orders among returned pixels, %", "0.1"),
            ("face_returned_percent", "face: lit pixels returned, %", ""),
            ("decode_ms", "one decode, 1024 x 768 to X, Y, Z, ms", ""),
        ),
    ),
    Source(
        ("quadfringe", "reproduce", "peaks"),
        (
            ("traditional_ftp_rms_rad", "peaks, 3 % noise: traditional FTP, full field, rad", "fails at slopes"),
            ("traditional_ftp_rms_rad_row760", "the same along row 760, rad (published 0.1316)", "fails at slopes"),
            ("improved_ftp_rms_rad", "improved FTP, full field, rad", "0.0408"),
            ("improved_ftp_rms_rad_row760", "the same along row 760, rad (published 0.0408)", "0.0408"),
            ("proposed_rms_rad", "proposed, full field, rad", "0.0099"),
            ("proposed_rms_rad_row760", "the same along row 760, rad (published 0.0099)", "0.0099"),
        ),
    ),
    Source(("benches/first_frame.py",), (("first_frame_s", "first frame from process start, s", "1.5"),)),
)


def main() -> None:
    PICTURES.mkdir(parents=True, exist_ok=True)
    with qf.open(qf.SystemConfig(scene=qf.SceneConfig(surface="face", noise=0.03))) as scanner:
        shot = scanner.grab()
        shape = scanner.decode(shot)
    draw_fringes(PICTURES / "fringes.png", shot)
    draw_shape(PICTURES / "shape.png", shape)
    readme = ROOT / "README.md"
    before, _, rest = readme.read_text().partition(BEGIN)
    _, _, after = rest.partition(END)
    readme.write_text(f"{before}{BEGIN}\n{measured_table()}{END}{after}")


def draw_fringes(path: Path, shot: qf.Shot) -> None:
    """Draw the visible image and the infrared one, side by side, each cut in half."""
    full = shot.full_scale_value
    colour = np.stack([shot.red, shot.green, shot.blue], axis=2) / full
    infrared = np.repeat(shot.ir[:, :, None], 3, axis=2) / full
    middle = colour.shape[1] // 2
    joined = np.concatenate([colour[:, :middle], infrared[:, middle:]], axis=1)
    figure = Figure(figsize=(5.12, 3.84), dpi=110)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.imshow(joined, interpolation="antialiased", aspect="auto")
    axes.axvline(middle, color="white", linewidth=1.5)
    for x, words in ((0.02, "red, green, blue"), (0.52, "infrared")):
        style = {"color": "white", "fontsize": 10, "transform": axes.transAxes}
        axes.text(x, 0.03, words, bbox={"facecolor": "black", "alpha": 0.6, "edgecolor": "none"}, **style)
    axes.set_axis_off()
    figure.savefig(path)


def draw_shape(path: Path, shape: qf.Shape, stride: int = 3) -> None:
    """Draw the points as a lit surface, colour by depth."""
    assert shape.xyz_mm is not None
    x, y, z = np.moveaxis(shape.xyz_mm[::stride, ::stride], 2, 0).astype(float)
    near, far = np.nanquantile(z, (0.001, 0.999))
    height = np.clip(far - z, 0, far - near)
    light = LightSource(azdeg=315, altdeg=40)
    colour = light.shade(np.nan_to_num(height), cmap=colormaps["viridis"], vert_exag=2.0 / stride, blend_mode="soft")
    colour[np.isnan(z)] = 0
    figure = Figure(figsize=(5.12, 3.84), dpi=110)
    axes = figure.add_axes((-0.32, -0.38, 1.64, 1.76), projection="3d")
    axes.plot_surface(x, -y, height, facecolors=colour, rstride=1, cstride=1, antialiased=False, shade=False)
    axes.set_box_aspect((np.ptp(x[np.isfinite(x)]), np.ptp(y[np.isfinite(y)]), 1.6 * (far - near)))
    axes.view_init(elev=62, azim=-80)
    axes.set_axis_off()
    figure.savefig(path)


def measured_table() -> str:
    lines = ["| figure | value | bar | command |", "|---|---|---|---|"]
    for source in SOURCES:
        figures, command = run(source.command)
        lines += [f"| {words} | {figures[name]:.4g} | {bar} | `{command}` |" for name, words, bar in source.rows]
    return "\n".join(lines) + "\n"


def run(command: tuple[str, ...]) -> tuple[dict[str, float], str]:
    with tempfile.TemporaryDirectory() as folder:
        json_file = Path(folder) / "figures.json"
        if command[0] == "quadfringe":
            full = [sys.executable, "-m", *command, "--out", folder, "--json", str(json_file)]
        else:
            full = [sys.executable, str(ROOT / command[0]), *command[1:], "--json", str(json_file)]
        subprocess.run(full, check=True, stdout=subprocess.DEVNULL)
        figures: dict[str, float] = json.loads(json_file.read_text())["figures"]
    return figures, " ".join(command if command[0] == "quadfringe" else ("python", *command))


if __name__ == "__main__":
    main()
