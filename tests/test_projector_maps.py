"""Maps of projector pixels from stacks of stepped fringes, and projector pixels of points from these maps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.bars import tolerance

from quadfringe import _core
from quadfringe.calibration.detect import View
from quadfringe.calibration.projector import (
    ProjectorMap,
    StepPlan,
    projector_map,
    projector_points,
    step_image,
)
from quadfringe.config import Fringes
from quadfringe.errors import InputError


def flat_map(width: int = 200, height: int = 150) -> ProjectorMap:
    """A map with the bends of perspective and lenses."""
    y, x = np.mgrid[:height, :width].astype(np.float64)
    column = 300 + 0.6 * x + 0.02 * y + 1e-4 * (x - 80) ** 2
    row = 400 - 0.01 * x + 0.7 * y - 2e-4 * x * y
    full = np.full((height, width), 0.4, np.float32)
    return ProjectorMap(column.astype(np.float32), row.astype(np.float32), full, full, (912, 1140))


def test_projector_points_follow_bent_maps_and_registration() -> None:
    view = View(np.array([[60.3, 70.7], [100.2, 70.1], [60.4, 30.9], [198.0, 148.0]]), np.arange(4), (200, 150))
    found = projector_points(flat_map(), view, radius_px=15)
    x, y = view.points_px[:3].T
    np.testing.assert_allclose(
        found.points_px[:3, 0],
        300 + 0.6 * x + 0.02 * y + 1e-4 * (x - 80) ** 2,
        atol=tolerance("projector_map.points_px"),
    )
    np.testing.assert_allclose(found.slope[:3, 1, 1], 0.7 - 2e-4 * x, atol=1e-4)
    assert np.isnan(found.points_px[3]).all()  # too few pixels around it
    moved = projector_points(flat_map(), view, radius_px=15, ir_registration=((1.0, 0.0, 2.0), (0.0, 1.0, -1.0)))
    there = replace(view, points_px=view.points_px + np.array((2.0, -1.0)))
    np.testing.assert_allclose(moved.points_px, projector_points(flat_map(), there, radius_px=15).points_px)
    with pytest.raises(InputError, match="one size"):
        projector_points(flat_map(), replace(view, size_px=(100, 100)))


def stacks(plan: StepPlan, axis: Any) -> list[NDArray[np.float32]]:
    """Images of a camera whose pixels are the mirrors of the projector."""
    return [
        np.stack([0.05 + 0.9 * step_image(plan, axis, f, step) for step in range(plan.steps)]).astype(np.float32)
        for f in range(3)
    ]


@pytest.mark.parametrize("layout", ["regular", "diamond"])
def test_patterns_of_both_layouts_lead_back_to_their_mirrors(layout: Any) -> None:
    plan = StepPlan(Fringes(layout=layout), steps=4, size_px=(228, 286))
    found = projector_map(stacks(plan, "columns"), stacks(plan, "rows"), plan)
    y, x = np.mgrid[:286, :228]
    shift = 0.5 * (y % 2) if layout == "diamond" else 0.0
    # The last mirror of a shifted row lies where the field ends, and has the phases of its beginning.
    np.testing.assert_allclose(found.column_px[:, :-1], (x + shift)[:, :-1], atol=tolerance("projector_map.column_px"))
    np.testing.assert_allclose(found.row_px, y, atol=tolerance("projector_map.column_px"))


def test_missing_steps_and_mixed_sizes_are_named() -> None:
    plan = StepPlan(steps=4, size_px=(228, 286))
    columns, rows = stacks(plan, "columns"), stacks(plan, "rows")
    for bad, words in (
        (columns[:2], "expected 3 stacks"),
        ([columns[0], columns[1][:3], columns[2]], "35 fringes along columns: expected 4 steps"),
        ([columns[0], columns[1][:, :100], columns[2]], "must have one size"),
        ([stack[:, :100] for stack in columns], "must have one size"),
    ):
        with pytest.raises(InputError, match=words):
            projector_map(bad, rows, plan)
    with pytest.raises(InputError, match="at least 4"):
        StepPlan(steps=3)
    with pytest.raises(ValueError, match="columns"):
        _core.step_pattern(36.0, 0.0, 10, 10, axis="diagonal")


def test_saturated_pixels_are_no_data() -> None:
    plan = StepPlan(steps=4, size_px=(228, 286))
    columns = stacks(plan, "columns")
    columns[1][2, 10, 20] = 1.0
    found = projector_map(columns, stacks(plan, "rows"), plan)
    assert np.isnan(found.column_px[10, 20])
    assert np.isfinite(found.column_px).sum() == found.column_px.size - 1
