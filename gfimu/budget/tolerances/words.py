"""Tolerances in the units of the field, and what to pay for, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gfimu.base.units import MILLI_G
from gfimu.budget.tolerances.budget import QuantityBudget
from gfimu.budget.tolerances.tolerances import Tolerances

__all__ = ["pay_for", "room_for", "stated_tolerances"]

_WORTH = 0.02  # of the error: a tolerance whose half gains less is not worth a word

_OVER = 10.0  # times a tolerance, beyond which first order says no more than that it does not matter

_OF_CHIP = {
    "bias": "bias_m_s2",
    "gain": "gain",
    "cross-axis": "cross_axis",
    "nonlinearity": "nonlinearity",
    "noise": "noise_m_s2_rthz",
}


def stated_tolerances(tolerances: Tolerances) -> Iterator[tuple[str, str, str]]:
    """Yield each cause with its size in the field's unit, and where the size is from."""
    machined = "limits, uniform between them" if tolerances.shape == "uniform" else "limits at 3 σ, normal"
    yield "placement", f"±{1e3 * tolerances.placement_m:.3g} mm", f"each chip and axis; {machined}"
    yield "angles", f"±{math.degrees(tolerances.angle_rad):.3g}°", f"each chip about each axis; {machined}"
    for cause, values, factor, unit in (
        ("bias", tolerances.bias, MILLI_G, "mg"),
        ("gain", tolerances.gain, 0.01, "%"),
        ("cross-axis", tolerances.cross_axis, 0.01, "%"),
        ("nonlinearity", tolerances.nonlinearity, 0.01, "% of full scale"),
        ("noise", tolerances.noise, MILLI_G, "mg per sample"),
    ):
        sheet = "data sheet" if _OF_CHIP[cause] in tolerances.from_data_sheet else "as given"
        yield cause, f"{_span(values / factor)} {unit}", f"1 σ, {sheet}"
    yield (
        "temperature",
        f"{tolerances.temperature_K:.3g} K",
        "run against calibration; coefficients 1 σ, data sheet",
    )


def room_for(budget: QuantityBudget, tolerances: Tolerances) -> str:
    """Say how large placement and angles may be, each alone, before an error grows by a tenth; empty without them."""
    sizes = {
        "placement": (1e3 * tolerances.placement_m, " mm"),
        "angles": (math.degrees(tolerances.angle_rad), "°"),
    }
    found = [
        f"{cause} {'±' if budget.allowance[cause] <= _OVER else 'over ±'}"
        f"{size * min(budget.allowance[cause], _OVER):.2g}{unit}"
        for cause, (size, unit) in sizes.items()
        if cause in budget.by_cause
    ]
    return "a tenth more at " + " or ".join(found) if found else ""


def pay_for(budget: QuantityBudget) -> str:
    """Say which tolerance of a quantity to pay for and which next, and by how much halving it lowers the error."""
    order = sorted(budget.halving.items(), key=lambda item: -item[1])
    gains = [(cause, gain) for cause, gain in order if gain >= _WORTH]
    if not gains:
        return "no tolerance gains 2 % if halved"
    return "halve " + ", then ".join(f"{cause} (−{gain:.0%})" for cause, gain in gains[:2])


def _span(values: NDArray[np.float64]) -> str:
    """Write the least and the largest of some figures."""
    low, high = float(values.min()), float(values.max())
    return f"{high:.3g}" if math.isclose(low, high, rel_tol=1e-9, abs_tol=1e-300) else f"{low:.3g} to {high:.3g}"
