"""`gfimu drift`: how far navigation, or a rotation about a known axis, runs off, cause by cause."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.cli.axis_options import AxisOption, AxisPointOption, HubOption, InclinationOption
from gfimu.cli.output import print_json, print_paths, print_table, print_text, progress
from gfimu.cli.shared_options import ForceOption, JsonOption, MapOption, MapSetOption, shared
from gfimu.errors import InputError

if TYPE_CHECKING:
    from gfimu.commands.drift_from_position import EquivalentErrors
    from gfimu.known_axis.accuracy.drift import AxisDrift
    from gfimu.position_drift import DriftBudget
    from gfimu.position_drift.monte_carlo import DriftSample
    from gfimu.position_drift.rest_windows import RestDrift

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command("drift")(_drift)


def _drift(
    run: Annotated[
        Path | None,
        typer.Argument(
            metavar="[RUN]", help="Recording with long rests: the drift that it has, beside what its noise predicts."
        ),
    ] = None,
    array: Annotated[
        str | None, shared("--array", more="; else the recording's own, or cube12 without a recording")
    ] = None,
    duration: Annotated[float, shared("--duration", more=", from the start of navigation")] = 30.0,
    bias_mg: Annotated[float, shared("--bias-mg")] = 0.0,
    noise_ug: Annotated[float, shared("--noise-ug")] = 0.0,
    walk_ug: Annotated[float, typer.Option(help="Random walk of each channel's bias, µg/√s.")] = 0.0,
    rate_drift_deg_h: Annotated[float, typer.Option(help="Constant error of the angular rate per axis, °/h.")] = 0.0,
    speed_rad_s: Annotated[
        float, shared("--speed-rad-s", more=", of the table about the vertical; 0 is at rest")
    ] = 0.0,
    offset: Annotated[tuple[float, float], typer.Option(help="Horizontal place of the unit off the axis, x y, m.")] = (
        0.0,
        0.0,
    ),
    gravity: Annotated[float, shared("--gravity")] = 9.80665,
    monte_carlo: Annotated[int, typer.Option(help="Number of nonlinear Monte Carlo runs; 0 for none.")] = 0,
    seed: Annotated[int, shared("--seed", min=0)] = 0,
    axis: AxisOption = None,
    axis_point: AxisPointOption = (0.0, 0.0, 0.0),
    hub: HubOption = "fixed",
    inclination_rad: InclinationOption = None,
    hub_noise: Annotated[
        float, typer.Option("--hub-noise-m-s2-rthz", help="Of a free hub: density of its own force, m/s²/√Hz.")
    ] = 0.1,
    from_position: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            help="Measured position error x y z after --duration, m, z up: which bias or drift would explain it?"
        ),
    ] = None,
    known_bias_mg: Annotated[
        tuple[float, float, float],
        typer.Option(help="With --from-position: known bias of p, x y z, mg; its share is taken off first."),
    ] = (0.0, 0.0, 0.0),
    latitude: Annotated[
        float | None, shared("--latitude", when="With --from-position: ", more=", for the Earth's share")
    ] = None,
    lead: Annotated[
        float | None,
        typer.Option(help="With RUN: rest before each window, from which tilt and biases are read off, s; else 10."),
    ] = None,
    calibration: Annotated[Path | None, shared("--calibration", when="With RUN: ")] = None,
    picture: Annotated[Path | None, shared("--picture", when="With RUN: ")] = None,
    force: ForceOption = False,
    column_map: MapOption = None,
    map_set: MapSetOption = None,
    json: JsonOption = False,
) -> None:
    """Position-drift budget of an array in closed form, with a Monte Carlo; the drift of a recording at rest.

    Examples
    --------
    gfimu drift --array cube12 --duration 0.3 --bias-mg 35 --noise-ug 290 --monte-carlo 400
    # The paper's inversion
    gfimu drift --from-position 6.42 0 0 --known-bias-mg 1 0 0 --latitude 35.7
    # Of a recording at rest
    gfimu drift run.parquet --duration 30 --picture drift.png
    # One chip on a table
    gfimu drift --array one_chip --axis z --speed-rad-s 6 --duration 60 --bias-mg 5 --noise-ug 290
    """
    from gfimu.commands.drift import axis_drift, drift
    from gfimu.commands.drift_from_position import drift_from_position
    from gfimu.commands.drift_of_rest import drift_of_rest
    from gfimu.commands.known_axis import known_axis, turning_axis
    from gfimu.commands.opened import as_array

    budgeted = bias_mg or noise_ug or walk_ug or rate_drift_deg_h or speed_rad_s or monte_carlo or any(offset)
    if run is not None:
        if budgeted or axis is not None or from_position is not None or any(known_bias_mg) or latitude is not None:
            raise InputError(
                f"{run}: the drift of a recording goes with --array, --calibration, --duration, --lead, --gravity, "
                "--picture, --map and --force; its noise is measured"
            )
        with progress("navigating through the rests"):
            seen = drift_of_rest(
                run,
                array,
                duration=duration,
                lead=10.0 if lead is None else lead,
                gravity=gravity,
                calibration=calibration,
                picture=picture,
                column_map=column_map,
                map_set=map_set or [],
                force=force,
            )
        files = {} if picture is None else {"picture": picture}
        if json:
            print_json(seen.to_dict() | {"files": files})
        else:
            _print_of_rest(seen)
            print_paths(files.items())
        return
    if lead is not None or calibration or picture or column_map or map_set or force:
        raise InputError("--lead, --calibration, --picture, --map and --force are of a recording; name it first")
    array = array or "cube12"
    if from_position is not None:
        if budgeted or axis is not None:
            raise InputError(
                "--from-position works errors out; give it with --duration, --known-bias-mg, --latitude, --gravity"
            )
        explained = drift_from_position(
            from_position, duration=duration, known_bias_mg=known_bias_mg, latitude=latitude, gravity=gravity
        )
        if json:
            print_json(explained.to_dict())
        else:
            _print_equivalent(explained)
        return
    if any(known_bias_mg) or latitude is not None:
        raise InputError("--known-bias-mg and --latitude go with --from-position")
    turning = known_axis(turning_axis(axis, axis_point, hub, inclination_rad), as_array(array))
    if turning is not None:
        if rate_drift_deg_h or monte_carlo or any(offset):
            raise InputError("--rate-drift-deg-h, --offset and --monte-carlo have no use with a known axis (--axis)")
        found = axis_drift(
            array,
            axis=turning,
            duration=duration,
            bias_mg=bias_mg,
            noise_ug=noise_ug,
            walk_ug=walk_ug,
            speed_rad_s=speed_rad_s,
            hub_noise_m_s2_rthz=hub_noise,
        )
        print_json(found.to_dict()) if json else _print_about_axis(found)
        return
    with progress("Monte Carlo", monte_carlo) as advance:
        result = drift(
            array,
            duration=duration,
            bias_mg=bias_mg,
            noise_ug=noise_ug,
            walk_ug=walk_ug,
            rate_drift_deg_h=rate_drift_deg_h,
            speed_rad_s=speed_rad_s,
            offset=offset,
            gravity=gravity,
            monte_carlo=monte_carlo,
            seed=seed,
            progress=advance,
        )
    if json:
        print_json(result.to_dict())
        return
    budget, sample = result.budget, result.sample
    rows = [
        [f"{term.name}, {term.size:.3g} {term.size_unit}", term.form, *map(_length, term.std), f"{term.share:.1%}"]
        for term in budget.terms
    ]
    rows.append(["total", "", *map(_length, budget.total_std), ""])
    if sample is not None:
        rows.append([f"Monte Carlo, {sample.runs} runs", "", *map(_length, sample.std[-1]), ""])
        rows.append(["Monte Carlo / total", "", *(f"{r:.2f}" for r in sample.std[-1] / budget.total_std), ""])
    where = f"turning at {speed_rad_s:g} rad/s" if speed_rad_s else "at rest"
    print_table(
        f"Position error after {duration:g} s, {budget.array}, {where} (1 σ)",
        ["cause", "law at rest", "x", "y", "z", "share"],
        rows,
    )
    for line in _remarks(budget, sample):
        print_text(line, style="" if budget.valid else "yellow")


def _print_equivalent(found: EquivalentErrors) -> None:
    """Print what would explain a position error."""
    rows = [
        ("position error, m", *(f"{value:.4g}" for value in found.position_m)),
        ("bias of p that explains it, mg: 2 r/t²", *(f"{value:.4g}" for value in found.bias_mg)),
    ]
    if any(found.known_bias_mg):
        rows.append(("known bias of p, mg", *(f"{value:.4g}" for value in found.known_bias_mg)))
        rows.append(("position error without its share, m", *(f"{value:.4g}" for value in found.left_m)))
    about_x, about_y, _ = found.rate_drift_deg_h
    rows.append(("drift about the axis, °/h: 6 r/(g t³)", f"{about_x:.4g}", f"{about_y:.4g}", "none"))
    print_table(f"What explains a position error after {found.time_s:g} s at rest", ("", "x", "y", "z"), rows)
    if found.earth_share_m is not None:
        print_text(
            f"The Earth's rate has {found.earth_rate_deg_h:.3g} °/h in the horizontal: {found.earth_share_m:.3g} m in "
            "a unit that takes the Earth for still, in a direction that its heading decides."
        )


def _print_of_rest(found: RestDrift) -> None:
    """Print the errors of a recording at rest beside their prediction."""
    from gfimu.position_drift import TILT_LIMIT

    rows = [("first window", *found.final_m[0])]
    if len(found.start_s) > 1:
        rows.append((f"rms of {len(found.start_s)} windows", *found.rms_m))
    rows.append(("rms predicted from the noise", *found.predicted_m))
    print_table(
        f"Position error after {found.time_s:g} s at rest, {found.array}, biases read off over {found.lead_s:g} s, m",
        ("", "x", "y", "z"),
        [(name, *(f"{value:.4g}" for value in values)) for name, *values in rows],
    )
    low, high = found.ratio_interval
    good = found.valid and low <= found.ratio <= high
    verdict = "as predicted" if good else "NOT AS PREDICTED" if found.valid else "beyond first order"
    print_text(
        f"Error over prediction, horizontal, rms over the windows: {found.ratio:.2f}, {verdict} (95 % of right "
        f"predictions: {low:.2f} to {high:.2f}). Terms of the noise found: {', '.join(found.found_terms)}.",
        style="" if good else "yellow",
    )
    if not found.valid:
        print_text(
            f"The prediction is of first order in the tilt, which reaches {found.tilt_std_rad:.2g} rad (1 σ); it holds "
            f"to {TILT_LIMIT} rad: give a shorter --duration.",
            style="yellow",
        )
    where = " ".join(f"{value:.4g}" for value in found.final_m[0])
    print_text(
        f"The first window's error is that of a rate drift of {found.rate_drift_deg_h:.4g} °/h: gfimu drift "
        f"--from-position {where} --duration {found.time_s:g}"
    )


def _print_about_axis(found: AxisDrift) -> None:
    """Print the drift about a known axis."""
    where = f"turning at {found.rate_rad_s:g} rad/s" if found.rate_rad_s else "at rest"
    rows: list[tuple[str, ...]] = [
        (one.name, one.size, f"{one.rate_std:.3g}", f"{one.angle_std:.3g}") for one in found.terms
    ]
    rows.append(("total", "", *(f"{value:.3g}" for value in found.total)))
    print_table(
        f"Rotation about the known axis after {found.time_s:g} s, {found.array}, {where} (1 σ)",
        ("cause", "size", "rate, rad/s", "angle, rad"),
        rows,
        left=2,
    )
    print_text(f"{found.remark[0].upper()}{found.remark[1:]}.")


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
    from gfimu.position_drift import TILT_LIMIT
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
                f"The closed forms hold for {budget.valid_until:.3g} s only, where the attitude error "
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
        lines.append(f"Note: {budget.note}.")
    return lines
