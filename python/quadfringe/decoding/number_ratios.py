"""Fringe numbers of a shot by the two ratios that it shows: green to red, and infrared to red, with their errors.

Ratios over few fringes have large errors. So numbers are doubted, and others proposed, by how likely they make what was
measured; where none are likely the message states the ratios.
"""

from __future__ import annotations

import numpy as np

from quadfringe import _core
from quadfringe.decoding import closure_params as limits
from quadfringe.decoding import params
from quadfringe.decoding.cause import Cause
from quadfringe.decoding.closures import Closure
from quadfringe.decoding.plan import Plan

__all__ = [
    "NUMBERS_FIX",
    "FringeNumbers",
    "agree",
    "channels_fit",
    "covers",
    "families",
    "family",
    "listed",
    "measured",
    "other_numbers",
    "strange",
    "wrong_numbers",
]

FringeNumbers = tuple[float, ...]
NUMBERS_FIX = "give the numbers that were projected (--fringes), or project these"
SMALLEST_ROOT, LARGEST_ROOT = 4, 12  # 16, 15, 12 and 144, 143, 132: coarser or finer fringes measure nothing
SMALLEST_PAIR, LARGEST_PAIR = 6, 20  # N, N - 1 without infrared: finer fringes look alike after one of them


def channels_fit(closure: Closure | None) -> bool:
    """Say whether every channel has the frequency of its fringe number, and red and blue are in order."""
    return closure is not None and closure.angle.agreement > params.AGREEMENT_MIN and closure.off < params.RATIO_OFF


def strange(closure: Closure | None) -> bool:
    """Say whether a channel has a frequency that no other fringe numbers explain, as an exchanged one has."""
    return closure is not None and closure.off >= params.RATIO_STRANGE


def agree(numbers: FringeNumbers, plan: Plan, closure: Closure, floor: float = limits.EXACT_SD) -> bool:
    """Say whether both ratios are those of these numbers within their errors, which are `floor` at least."""
    return bool(np.abs(_misses(numbers, plan, closure, floor)).max() <= limits.ERRORS_MAX)


def wrong_numbers(plan: Plan, closure: Closure | None) -> Cause | None:
    """Find fringes whose ratios are not those of the fringe numbers, and the numbers that fit.

    Either other numbers make the ratios far likelier, or both errors together exclude those of the plan.
    """
    if closure is None or closure.angle.agreement < params.AGREEMENT_MIN:
        return None
    if not params.RATIO_OFF < closure.off < params.RATIO_STRANGE:
        return None
    given = _misfit(plan.fringes.numbers, plan, closure, limits.RATIO_SD)
    best = min((_misfit(numbers, plan, closure, limits.RATIO_SD) for numbers in families(plan)), default=np.inf)
    if given < min(best + limits.LIKELIER, limits.OFF_THE_PLAN):
        return None
    proposed = _proposed(plan, closure)
    fits = f", which fits {listed(proposed)}" if proposed else ""
    words = f"the fringe numbers {listed(plan.fringes.numbers)} are not those of this shot: {measured(plan, closure)}"
    return Cause("fringe numbers", words + fits, NUMBERS_FIX)


def measured(plan: Plan, closure: Closure) -> str:
    """Write the ratios that a shot shows, with their errors, as fringe numbers next to the first one of the plan."""
    first, second, *others = plan.fringes.numbers
    seen, last = ("red and blue", "infrared") if plan.fringes.quadrature else ("red", "blue")
    found = [("green", closure.green * second, closure.errors[0] * second)]
    found += [(last, closure.infrared * third, closure.errors[1] * third) for third in others]
    errors = [f" +/- {max(error, 0.01):.2f}" if np.isfinite(error) else "" for *_, error in found]
    shown = [f"{ratio:.2f}{error} of {name}" for (name, ratio, _), error in zip(found, errors, strict=True)]
    return f"for {first:g} fringes of {seen} it has {' and '.join(shown)}"


def _proposed(plan: Plan, closure: Closure) -> FringeNumbers | None:
    """Give the family of numbers that both ratios fit within their errors, if all others are far less likely."""
    misfits = sorted((_misfit(one, plan, closure, limits.EXACT_SD), one) for one in families(plan))
    if not misfits or not agree(misfits[0][1], plan, closure):
        return None
    clear = len(misfits) == 1 or misfits[1][0] > misfits[0][0] + limits.LIKELIER
    return misfits[0][1] if clear else None


def _misfit(numbers: FringeNumbers, plan: Plan, closure: Closure, floor: float) -> float:
    """Give the sum of the squared deviations of the ratios from these numbers, in errors: -2 ln of their likelihood."""
    return float(np.sum(np.square(_misses(numbers, plan, closure, floor))))


def _misses(numbers: FringeNumbers, plan: Plan, closure: Closure, floor: float) -> list[float]:
    """Give the deviations of the ratios from these numbers, in errors, which are `floor` at least."""
    given, ratios = plan.fringes.numbers, (closure.green, closure.infrared)[: len(numbers) - 1]
    expected = [one / numbers[0] * given[0] / other for one, other in zip(numbers[1:], given[1:], strict=True)]
    pairs = zip(ratios, expected, closure.errors, strict=False)
    return [(ratio - one) / float(np.hypot(error, floor)) for ratio, one, error in pairs]


def families(plan: Plan) -> list[FringeNumbers]:
    """Give the families of three numbers, without that of the plan; none for two numbers."""
    if len(plan.fringes.numbers) < 3:
        return []
    families = [family(root) for root in range(SMALLEST_ROOT, LARGEST_ROOT + 1)]
    return [numbers for numbers in families if numbers != plan.fringes.numbers]


def other_numbers(plan: Plan, closure: Closure) -> list[FringeNumbers]:
    """Give the numbers n, n - 1, n - k of k^2 = n next to the ratio of infrared to red, without those of the plan.

    With two numbers, give n, n - 1 next to the ratio of green to red.
    """
    first, second, *others = plan.fringes.numbers
    if not others:
        whole = round(1 / max(1 - closure.green * second / first, 1e-3))
        pairs = [(float(n), float(n - 1)) for n in (whole - 1, whole, whole + 1) if SMALLEST_PAIR <= n <= LARGEST_PAIR]
        return [numbers for numbers in pairs if numbers != plan.fringes.numbers and covers(numbers, plan)]
    root = 1 / max(1 - closure.infrared * others[0] / first, 1e-3)
    near = [family(whole) for whole in {int(root), int(root) + 1}]
    return [numbers for numbers in families(plan) if numbers in near and covers(numbers, plan)]


def family(root: int) -> FringeNumbers:
    """Give the numbers n, n - 1, n - k of k^2 = n."""
    return float(root**2), float(root**2 - 1), float(root**2 - root)


def covers(numbers: FringeNumbers, plan: Plan) -> bool:
    """Say whether these numbers distinguish the columns of the projector."""
    try:
        _core.check_code(numbers, plan.projector_width_px, columns_px=plan.fringes.columns_px)
    except ValueError:
        return False
    return True


def listed(numbers: FringeNumbers) -> str:
    """Write fringe numbers."""
    return ", ".join(f"{number:g}" for number in numbers)
