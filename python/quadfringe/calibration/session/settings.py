"""A calibration session: its settings, its steps, and the name of every capture.

A session is a folder with `session.json` and one folder for each capture, such as `levels/r050_g000_b000_ir000_e100`
with red.png, green.png, blue.png and ir.png, as `quadfringe calibrate plan` lists them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from quadfringe.calibration._params import SHORTER_EXPOSURES
from quadfringe.calibration.acceptance import SPHERE_DIAMETER_MM, STEP_HEIGHTS_MM
from quadfringe.calibration.levels import LevelPlan, level_plan
from quadfringe.calibration.projector import AXES, StepPlan
from quadfringe.calibration.targets import Target, ring_board
from quadfringe.config import BayerPattern, Finite, Fringes, Pixels, Positive
from quadfringe.data.calibration import Stored
from quadfringe.errors import InputError

__all__ = ["BEAMS", "STEPS", "STEP_NAMES", "Session", "Step", "step_named"]

BEAMS = ("visible", "infrared")
FILE = "session.json"


@dataclass(frozen=True)
class Step:
    """One step of a session: name, title, instructions for a person, and whether a calibration needs it."""

    name: str
    title: str
    how: str
    needed: bool


STEPS = (
    Step(
        "dark",
        "dark level",
        "Cover the lens and switch every projector to black; take the shots one after another.",
        True,
    ),
    Step(
        "levels",
        "responses and crosstalk",
        "Put a white, matt board where you will measure, so that it fills the middle of the image. Project uniform "
        "light at the levels in the name (per cent of each channel), with the exposure e (per cent).",
        True,
    ),
    Step(
        "flat",
        "flat field",
        "Leave the white board, defocus the lens, and light all channels uniformly to about half of full scale.",
        False,
    ),
    Step(
        "poses",
        "camera, projectors and their poses",
        "Hold the calibration board in the light of every projector, and keep it still during all fringe images of a "
        "pose; of two projectors, one shows them while the other is black. Tilt it to all four sides by 20 to 40 "
        "degrees, move it nearer and farther, and into the corners of the image.",
        True,
    ),
    Step(
        "planes",
        "height from phase",
        "Mount the white board on a stage, facing the camera. Move it to the heights in the names (mm, towards the "
        "camera), and take one shot of the measuring fringes at each.",
        False,
    ),
    Step(
        "acceptance",
        "acceptance",
        "Take one shot of the measuring fringes on the plane, the sphere and the steps: plane_1, sphere_1, steps_1.",
        False,
    ),
)

STEP_NAMES = tuple(step.name for step in STEPS)


def step_named(name: str) -> Step:
    """Return a step by name; raises `InputError` listing all steps for an unknown name."""
    for step in STEPS:
        if step.name == name:
            return step
    raise InputError(f"step: expected one of {', '.join(step.name for step in STEPS)}, got {name!r}")


class Session(Stored):
    """Settings of a session; the defaults are those of the published bench.

    `rig` is the name of the bench. `distance_mm` is the approximate distance of the first board from the camera, the
    only check of its size. `bits` are the significant bits of 16-bit files. `level_exposures` are the shorter exposures
    of the brightest level, shares of the full one; without any, the camera is taken as linear. `offset_px`, the first
    column and row of the images on the chip, is written with the first capture of a camera that tells.
    """

    schema_version: Literal[1] = 1
    rig: str
    target: Target = Field(default_factory=ring_board)
    fringes: Fringes = Fringes()
    projector_size_px: tuple[Pixels, Pixels] = (912, 1140)
    infrared: bool = True
    bits: Literal[10, 12, 14, 16] | None = None
    bayer: BayerPattern | None = None
    offset_px: tuple[int, int] | None = None
    dark_shots: Annotated[int, Field(ge=2, le=100)] = 4
    level_steps: Annotated[int, Field(ge=4, le=32)] = 8
    level_exposures: tuple[Annotated[float, Field(gt=0, lt=1)], ...] = SHORTER_EXPOSURES
    flat_shots: Annotated[int, Field(ge=4, le=100)] = 8
    poses: Annotated[int, Field(ge=4, le=60)] = 12
    phase_steps: Annotated[int, Field(ge=4, le=64)] = 8
    distance_mm: Positive | None = None
    heights_mm: tuple[Finite, ...] = (-60.0, -40.0, -20.0, 0.0, 20.0, 40.0, 60.0)
    height_degree: Annotated[int, Field(ge=1, le=5)] = 3
    sphere_diameter_mm: Positive = SPHERE_DIAMETER_MM
    step_heights_mm: tuple[Positive, ...] = STEP_HEIGHTS_MM

    @property
    def level_plan(self) -> LevelPlan:
        """The captures under uniform light."""
        return level_plan(self.level_steps, len(self.fringes.channels), self.level_exposures)

    @property
    def step_plan(self) -> StepPlan:
        """The fringes of a pose: those of the shots, or three numbers of one projector if these have no infrared."""
        fringes = self.fringes if self.fringes.infrared else Fringes(layout=self.fringes.layout)
        return StepPlan(fringes, self.phase_steps, self.projector_size_px)

    @property
    def beams(self) -> tuple[str, ...]:
        """The projectors to calibrate."""
        return BEAMS if self.infrared and self.fringes.infrared else BEAMS[:1]

    def captures(self, step: str) -> tuple[str, ...]:
        """Return the names of the captures of a step in the order of taking them; a pose is one capture."""
        names = {
            "dark": tuple(_numbered(self.dark_shots)),
            "levels": self.level_plan.names,
            "flat": tuple(_numbered(self.flat_shots)),
            "poses": tuple(_numbered(self.poses)),
            "planes": tuple(f"{height:+07.2f}" for height in self.heights_mm),
            "acceptance": ("plane_1", "sphere_1", "steps_1"),
        }
        return names[step_named(step).name]

    def pose_images(self) -> tuple[str, ...]:
        """Return the names of the images of one pose, such as visible/columns_36_0."""
        numbers = self.step_plan.fringes.numbers
        return tuple(
            f"{beam}/{axis}_{number:g}_{step}"
            for beam in self.beams
            for axis in AXES
            for number in numbers
            for step in range(self.phase_steps)
        )


def _numbered(count: int) -> list[str]:
    return [f"{i:02d}" for i in range(1, count + 1)]
