"""`gfimu drift`: how far navigation runs off, cause by cause, and a Monte Carlo beside it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gfimu.cli.output import JsonOption, console, print_json, print_table, progress

if TYPE_CHECKING:
    from gfimu.drift import DriftBudget
    from gfimu.drift_monte_carlo import DriftSample

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command("drift")(_drift)


def _drift(
    array: Annotated[str, typer.Option(help="Array: a name in models/arrays or a TOML file.")] = "cube12",
    time: Annotated[float, typer.Option(help="Time since the start of navigation, s.")] = 30.0,
    bias_mg: Annotated[float, typer.Option(help="Standard deviation of each channel's constant bias, mg.")] = 0.0,
    noise_ug: Annotated[float, typer.Option(help="White noise of each channel, one-sided density, µg/√Hz.")] = 0.0,
    walk_ug: Annotated[float, typer.Option(help="Random walk of each channel's bias, µg/√s.")] = 0.0,
    rate_drift_deg_h: Annotated[float, typer.Option(help="Constant error of the angular rate per axis, °/h.")] = 0.0,
    rate: Annotated[float, typer.Option(help="Rate of the table about the vertical, rad/s; 0 is at rest.")] = 0.0,
    offset: Annotated[tuple[float, float], typer.Option(help="Horizontal place of the unit off the axis, x y, m.")] = (
        0.0,
        0.0,
    ),
    gravity: Annotated[float, typer.Option(help="Local gravity, m/s².")] = 9.80665,
    monte_carlo: Annotated[int, typer.Option(help="Number of nonlinear Monte Carlo runs; 0 for none.")] = 0,
    seed: Annotated[int, typer.Option(help="Seed of the Monte Carlo.")] = 0,
    as_json: JsonOption = False,
) -> None:
    """Position-drift budget of an array: closed forms, their validity limit, Monte Carlo beside.

    Example: `gfimu drift --array cube12 --time 0.3 --bias-mg 35 --noise-ug 290 --monte-carlo 400`
    """
    import numpy as np

    from gfimu.array import AccelerometerArray
    from gfimu.drift import ErrorSources, drift_budget
    from gfimu.drift_monte_carlo import monte_carlo_drift
    from gfimu.errors import InputError
    from gfimu.units import STANDARD_GRAVITY

    if monte_carlo == 1 or monte_carlo < 0:
        raise InputError(f"--monte-carlo {monte_carlo}: give 0 for none, or 2 or more runs")
    sources = ErrorSources(
        bias=bias_mg * 1e-3 * STANDARD_GRAVITY,
        noise_density=noise_ug * 1e-6 * STANDARD_GRAVITY,
        bias_random_walk=walk_ug * 1e-6 * STANDARD_GRAVITY,
        rate_drift=math.radians(rate_drift_deg_h / 3600.0),
    )
    if not any(vars(sources).values()):
        raise InputError(
            "no error to budget: give at least one of --bias-mg, --noise-ug, --walk-ug, --rate-drift-deg-h"
        )
    geometry = AccelerometerArray.load(array)
    budget = drift_budget(geometry, time, sources, rate=rate, offset=offset, gravity=gravity)
    sample = None
    if monte_carlo:
        with progress("Monte Carlo", monte_carlo) as advance:
            sample = monte_carlo_drift(
                geometry,
                time,
                sources,
                runs=monte_carlo,
                rng=np.random.default_rng(seed),
                rate=rate,
                offset=offset,
                gravity=gravity,
                progress=advance,
            )
    if as_json:
        result: dict[str, Any] = budget.to_dict()
        if sample is not None:
            result["monte_carlo"] = {
                "runs": sample.runs,
                "seed": seed,
                "std_m": sample.std[-1],
                "mean_m": sample.mean[-1],
                "relative_sampling_error": sample.relative_sampling_error,
            }
        print_json(result)
        return

    rows = [
        [f"{term.name}, {term.size:.3g} {term.size_unit}", term.form, *map(_length, term.std), f"{term.share:.1%}"]
        for term in budget.terms
    ]
    rows.append(["total", "", *map(_length, budget.total_std), ""])
    if sample is not None:
        rows.append([f"Monte Carlo, {sample.runs} runs", "", *map(_length, sample.std[-1]), ""])
        rows.append(["Monte Carlo / total", "", *(f"{r:.2f}" for r in sample.std[-1] / budget.total_std), ""])
    where = f"turning at {rate:g} rad/s" if rate else "at rest"
    print_table(
        f"Position error after {time:g} s, {budget.array}, {where} (1 σ)",
        ["cause", "law at rest", "x", "y", "z", "share"],
        rows,
    )
    for line in _remarks(budget, sample):
        console.print(line, highlight=False, soft_wrap=True)


def _length(metres: float) -> str:
    """Write a length with the prefix that fits."""
    if metres == 0:
        return "0"
    for factor, unit in ((1e3, "km"), (1.0, "m"), (1e-3, "mm")):
        if metres >= factor:
            return f"{metres / factor:.3g} {unit}"
    return f"{metres / 1e-6:.3g} µm"


def _remarks(budget: DriftBudget, sample: DriftSample | None) -> list[str]:
    """Say in words how far the table holds."""
    from gfimu.drift import TILT_LIMIT
    from gfimu.units import STANDARD_GRAVITY

    if budget.valid:
        until = f"{budget.valid_until:.3g} s" if math.isfinite(budget.valid_until) else "far later"
        lines = [
            (
                f"The closed forms hold: attitude error {budget.attitude_error:.2g} rad (1 σ); "
                f"the limit of {TILT_LIMIT} rad comes after {until}."
            )
        ]
    else:
        lines = [
            (
                f"[yellow]The closed forms hold for {budget.valid_until:.3g} s only[/yellow], where the attitude error "
                f"reaches {TILT_LIMIT} rad (1 σ). The figures above extrapolate them; the true error is below "
                f"g t² = {_length(STANDARD_GRAVITY * budget.time**2)}. Calibrate the biases, or see --monte-carlo."
            )
        ]
    lines.append(
        f"At rest a bias acts more through alpha and gravity than through p after {budget.alpha_overtakes:.3g} s."
    )
    if sample is not None:
        lines.append(f"Sampling error of the Monte Carlo: {sample.relative_sampling_error:.1%} per axis.")
    if budget.note:
        lines.append(f"[yellow]Note:[/yellow] {budget.note}.")
    return lines
