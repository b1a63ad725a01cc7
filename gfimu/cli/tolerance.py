"""`gfimu tolerance`: what machining and chip tolerances do to α, ω and position, and which to pay for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.cli import completion
from gfimu.cli.output import print_json, print_paths, print_table, print_text, progress
from gfimu.cli.shared_options import JsonOption, PictureOption, shared

if TYPE_CHECKING:
    from gfimu.commands.tolerance import ToleranceResult

__all__ = ["register"]

_SHORT = {"alpha": "α", "omega": "ω integrated", "omega_null_space": "ω null space", "position": "position"}
"""Names of the quantities in the heads of columns."""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="tolerance")(_tolerance)


def _tolerance(
    array: Annotated[
        str,
        typer.Argument(
            metavar="ARRAY",
            autocompletion=completion.arrays,
            help="Array as drawn: a name, a TOML file, or an MJCF file with sites.",
        ),
    ],
    scenario: Annotated[
        str | None, shared("--scenario", when="Motion. ", more="; by default rest, then a spin about the vertical")
    ] = None,
    duration: Annotated[float | None, shared("--duration", more="; 3, or that of the scenario")] = None,
    speed_rad_s: Annotated[float, shared("--speed-rad-s", more=", of the default motion")] = 5.0,
    position_mm: Annotated[
        float, typer.Option(metavar="MM", help="Limit ± of each chip's place along each axis, mm.")
    ] = 0.2,
    angle_deg: Annotated[float, typer.Option(help="Limit ± of each chip's rotation about each axis, °.")] = 0.5,
    normal: Annotated[
        bool,
        typer.Option("--normal", help="Limits are 3 σ of a normal distribution; else errors are uniform between them."),
    ] = False,
    part: Annotated[
        str | None,
        typer.Option(
            metavar="PART", autocompletion=completion.parts, help="Part of every chip, in place of those of the array."
        ),
    ] = None,
    bias_mg: Annotated[float | None, shared("--bias-mg", more="; else the data sheet's")] = None,
    gain_percent: Annotated[float | None, typer.Option(help="Gain error, 1 σ, %; else the data sheet's.")] = None,
    cross_axis_percent: Annotated[
        float | None, typer.Option(help="Pick-up of each other axis of the chip, 1 σ, %; else the data sheet's.")
    ] = None,
    nonlinearity_percent: Annotated[
        float | None, typer.Option(help="Non-linearity at full scale, 1 σ, %; else the data sheet's.")
    ] = None,
    noise_ug: Annotated[float | None, shared("--noise-ug", more="; else the data sheet's")] = None,
    temperature_k: Annotated[float, typer.Option(help="Temperature of the run less that of the calibration, K.")] = 5.0,
    calibrated: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            autocompletion=completion.words("none", "rest", "poses", "poses+rest"),
            help="none, rest, poses or poses+rest; may be repeated; all that are possible by default.",
        ),
    ] = None,
    closed_form: Annotated[
        bool, typer.Option("--closed-form", help="First order alone, without simulated units.")
    ] = False,
    units: Annotated[int, typer.Option(help="Number of simulated units.")] = 200,
    seed: Annotated[int, shared("--seed", min=0)] = 0,
    workers: Annotated[int | None, shared("--workers")] = None,
    picture: PictureOption = None,
    json: JsonOption = False,
) -> None:
    """Budget the errors of α, ω and position from machining and chip tolerances: shares, simulated units.

    Examples
    --------
    gfimu tolerance cube12 --position-mm 0.2 --angle-deg 0.5 --picture tolerance.png
    # Another part, without simulated units
    gfimu tolerance cube12 --closed-form --part adxl355 --calibrated poses+rest
    """
    from gfimu.commands.tolerance import tolerance

    with progress("simulating units", None if closed_form else units) as advance:
        result = tolerance(
            array,
            scenario=scenario,
            duration=duration,
            speed_rad_s=speed_rad_s,
            position_mm=position_mm,
            angle_deg=angle_deg,
            normal=normal,
            part=part,
            bias_mg=bias_mg,
            gain_percent=gain_percent,
            cross_axis_percent=cross_axis_percent,
            nonlinearity_percent=nonlinearity_percent,
            noise_ug=noise_ug,
            temperature_k=temperature_k,
            calibrated=calibrated or [],
            closed_form=closed_form,
            units=units,
            seed=seed,
            workers=workers,
            picture=picture,
            progress=advance,
        )
    if json:
        print_json(result.to_dict() | {"files": {} if picture is None else {"picture": picture}})
        return
    _print(result)
    if picture is not None:
        print_paths([("picture", picture)])


def _print(result: ToleranceResult) -> None:
    from gfimu.tolerances.words import stated_tolerances

    start = "levelled by themselves at rest" if result.levelled else "with known attitude and rate at the start"
    print_table(
        f"{result.array}: {result.motion}; estimates by integration, {start}",
        ("tolerance", "size", "what it is"),
        list(stated_tolerances(result.tolerances)),
        left=3,
    )
    for calibration in result.budgets:
        _print_calibration(result, calibration)
    _print_totals(result)


def _print_totals(result: ToleranceResult) -> None:
    """Print what each calibration makes of the errors, and what the quantities are."""
    first = next(iter(result.budgets.values()))
    rows = []
    for calibration, budget in result.budgets.items():
        found = result.comparisons.get(calibration, {})
        # Where first order fails, what was simulated stands in its place.
        cells = []
        for name, one in budget.quantities.items():
            if result.units and name not in found:
                cells.append("no unit estimated")
            elif name in found and not found[name].agrees:
                cells.append(f"{found[name].rms:.3g} (simulated)")
            else:
                cells.append(f"{one.rms:.3g}")
        rows.append([calibration, *cells])
    meanings = "; ".join(f"{_SHORT[name]}: {one.meaning}" for name, one in first.quantities.items())
    print_table(
        "Error, norm of three components, rms over units",
        ("calibration", *(f"{_SHORT[name]}, {one.unit}" for name, one in first.quantities.items())),
        rows,
        note=meanings,
    )


def _print_calibration(result: ToleranceResult, calibration: str) -> None:
    """Print shares, totals and simulated units after one calibration."""
    from gfimu.position_drift import TILT_LIMIT
    from gfimu.tolerances.calibrated import CALIBRATIONS
    from gfimu.tolerances.tolerances import CAUSES
    from gfimu.tolerances.words import pay_for, room_for

    budget, simulated = result.budgets[calibration], result.comparisons.get(calibration, {})
    quantities = list(budget.quantities.values())
    rows: list[list[str]] = [
        [cause, *(f"{one.shares[cause]:.1%}" if cause in one.shares else "0" for one in quantities)]
        for cause in CAUSES
        if any(cause in one.by_cause for one in quantities)
    ]
    rows.append(["total, first order", *(f"{one.rms:.3g}" for one in quantities)])
    if simulated:
        found = [simulated[one.name] for one in quantities if one.name in simulated]
        rows.append([f"total, {found[0].units} simulated", *(f"{one.rms:.3g}" for one in found)])
        rows.append(["simulated / first order", *(f"{one.ratio:.3f} ± {one.ratio_std:.3f}" for one in found)])
        rows.append(["95 % of units below", *(f"{one.quantiles[0.95]:.3g}" for one in found)])
    print_table(
        f"Calibration {calibration}: {CALIBRATIONS[calibration]}; shares of the variance",
        ("cause", *(f"{_SHORT[one.name]}, {one.unit}" for one in quantities)),
        rows,
    )
    for one in quantities:
        room = room_for(one, result.tolerances)
        print_text(f"  {_SHORT[one.name]}: {pay_for(one)}" + (f"; {room}" if room else ""))
    failing = [_SHORT[one.name] for one in quantities if one.name in simulated and not simulated[one.name].agrees]
    if failing:
        print_text(
            f"  FIRST ORDER FAILS for {'; '.join(failing)}: there the simulated figures hold, and the shares do not.",
            style="yellow",
        )
    if budget.attitude_rad > TILT_LIMIT:
        print_text(
            f"  The attitude error reaches {budget.attitude_rad:.2g} rad (1 σ per axis); position is of first order up "
            f"to {TILT_LIMIT} rad: calibrate, or give a shorter --duration.",
            style="yellow",
        )
    for reason, count in result.units[calibration].failures.items() if result.units else ():
        print_text(f"  {count} units could not be estimated: {reason}", style="yellow")
