"""`gfimu estimate`: motion from a recording."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gfimu.cli import completion
from gfimu.cli.axis_options import (
    AxisOption,
    AxisPointOption,
    BiasStdOption,
    DirectionStdOption,
    HubOption,
    InclinationOption,
    LeverStdOption,
    PointStdOption,
    RotationStdOption,
)
from gfimu.cli.output import print_json, print_paths, print_table, print_text, progress
from gfimu.cli.shared_options import ForceOption, JsonOption, MapOption, MapSetOption, RrdOption, shared
from gfimu.rate.registry import RATE_METHODS, rate_method, recursive_methods
from gfimu.units import STANDARD_GRAVITY

if TYPE_CHECKING:
    import numpy as np

    from gfimu.motion.estimate_summary import EstimateSummary, PositionSummary
    from gfimu.motion.rest_bias import ForceAtRest

__all__ = ["register"]

_RECURSIVE = recursive_methods(", ")


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="estimate")(_estimate)


def _estimate(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="Recording: .csv, .parquet, or a MIMU4444 stream (.bin, .bin.gz).")
    ],
    out: Annotated[Path, typer.Option("--out", help="Estimate to write (.csv, .parquet).")],
    array: Annotated[str | None, shared("--array", more="; else the recording's own")] = None,
    method: Annotated[
        str,
        typer.Option(
            "--method",
            metavar="METHOD",
            autocompletion=completion.words(*RATE_METHODS),
            help=f"Angular rate by: {', '.join(RATE_METHODS)}.",
        ),
    ] = "integrate",
    form: Annotated[
        str,
        typer.Option(
            "--form",
            metavar="FORM",
            autocompletion=completion.words("auto", "linear", "joint", "recursive"),
            help="How readings turn into p and α: auto, linear, joint or recursive.",
        ),
    ] = "auto",
    rest_bias: Annotated[
        bool, typer.Option("--rest-bias", help="Read the biases off the first rest (table level) and take them off.")
    ] = False,
    calibration: Annotated[Path | None, shared("--calibration")] = None,
    unknown_start: Annotated[bool, shared("--unknown-start", more=" (filter, smoother)")] = False,
    gyro: Annotated[bool, shared("--gyro", more=" (filter, smoother)")] = False,
    position: Annotated[bool, typer.Option("--position", help="Integrate to velocity and position too.")] = False,
    latitude: Annotated[
        float | None, shared("--latitude", more=": the Earth's rotation and the local gravity from it")
    ] = None,
    north_rad: Annotated[
        float | None,
        typer.Option("--north-rad", help="With --latitude: north from the x-axis at the start, about up, rad; else 0."),
    ] = None,
    force: ForceOption = False,
    keep_faulty: Annotated[bool, shared("--keep-faulty", more=" (filter, smoother)")] = False,
    rrd: RrdOption = None,
    column_map: MapOption = None,
    map_set: MapSetOption = None,
    axis: AxisOption = None,
    axis_point: AxisPointOption = (0.0, 0.0, 0.0),
    hub: HubOption = "fixed",
    inclination_rad: InclinationOption = None,
    point_std: PointStdOption = 0.0,
    direction_std: DirectionStdOption = 0.0,
    lever_std: LeverStdOption = 0.0,
    rotation_std: RotationStdOption = 0.0,
    bias_std: BiasStdOption = 0.0,
    json: JsonOption = False,
) -> None:
    r"""Estimate p, α, ω, attitude and table angle from a recording.

    Examples
    --------
    gfimu estimate run.parquet --method filter --rest-bias --out estimate.parquet
    # One chip on a table
    gfimu estimate run.csv --array arm.toml --axis z --out estimate.csv
    # Two chips on a wheel
    gfimu estimate run.csv --array wheel.toml --axis z --hub free --unknown-start --out est.csv
    # Mounted by eye
    gfimu estimate run.csv --array arm.toml --axis z --lever-std-m 0.003 --rotation-std-rad 0.05 \
        --bias-std-m-s2 0.3 --out est.csv
    """
    from gfimu.commands.estimate import estimate_run
    from gfimu.commands.known_axis import turning_axis
    from gfimu.geometry.turning_axis import AxisUncertainty
    from gfimu.motion.estimate_summary import summarise

    with progress(_describe(method, axis), total=1.0) as done:
        found = estimate_run(
            run,
            array,
            out=out,
            method=method,
            form=form,
            rest_bias=rest_bias,
            calibration=calibration,
            column_map=column_map,
            map_set=map_set or [],
            axis=turning_axis(axis, axis_point, hub, inclination_rad),
            uncertainty=AxisUncertainty(point_std, direction_std, lever_std, rotation_std, bias_std),
            omega0=None if unknown_start else (0.0, 0.0, 0.0),
            fuse_gyro=gyro,
            with_position=position,
            latitude=latitude,
            north_rad=north_rad,
            force=force,
            keep_faulty=keep_faulty,
            progress=lambda share: done(share, f"estimating by {method}"),
            rrd=rrd,
        )
    written = {"estimate": out} | ({} if rrd is None else {"rrd": rrd})
    summary = summarise(found.estimate, found.recording, found.array)
    if json:
        print_json(summary.to_dict() | {"files": written})
    else:
        _print_summary(summary)
        for warning in summary.warnings:
            print_text(f"WARNING {warning}", style="yellow")
        print_paths(written.items())


def _describe(method: str, axis: str | None = None) -> str:
    """Return what is being done, for the progress bar; says so when the filter is compiled first."""
    if axis is not None:
        from gfimu.known_axis.recursion import filter_axis
        from gfimu.rate.first_call import must_compile

        compiling = "compiling the filter, the first time only: a minute or so"
        return compiling if must_compile(filter_axis) else "estimating about one axis"
    if rate_method(method).recursive:
        from gfimu.rate.first_call import must_compile

        if must_compile():
            return "compiling the filter, the first time only: a minute or so"
    return f"estimating by {method}"


def _print_summary(summary: EstimateSummary) -> None:
    def by_axis(values: np.ndarray) -> str:
        return "  ".join(f"{value:.4g}" for value in values)

    rows: list[tuple[str, object, str]] = [
        ("samples", summary.samples, ""),
        ("sample rate", f"{summary.sample_rate_hz:.4g}", "Hz"),
        ("duration", f"{summary.duration_s:.4g}", "s"),
        ("gaps", summary.gaps, ""),
        ("samples without estimate", summary.samples_without_estimate, ""),
        ("p, rms x y z", by_axis(summary.p_rms_m_s2), "m/s²"),
        ("α, rms x y z", by_axis(summary.alpha_rms_rad_s2), "rad/s²"),
        ("ω, rms x y z", by_axis(summary.omega_rms_rad_s), "rad/s"),
        ("σ of ω at the end, x y z", by_axis(summary.omega_std_rad_s), "rad/s"),
        ("angle at the end", f"{summary.angle_rad:.5g}", "rad"),
    ]
    if summary.tacho_rmse_rad_s is not None:
        rows.append(("ω against tacho, rmse", f"{summary.tacho_rmse_rad_s:.4g}", "rad/s"))
    if summary.gyro_rmse_rad_s is not None:
        rows.append(("ω against gyro, rmse", f"{summary.gyro_rmse_rad_s:.4g}", "rad/s"))
    if summary.centripetal is not None:
        rows.append(("centripetal terms against gyro, slope", f"{summary.centripetal.slope:.4f}", ""))
        rows.append(("centripetal terms against gyro, correlation", f"{summary.centripetal.correlation:.4f}", ""))
    if summary.disagreement is not None:
        found = summary.disagreement
        size = f"{found['times']:.2g} times in {found['share']:.0%} of the samples" if found["share"] else "below 2"
        rows.append(("noise measured, times the stated", size, ""))
    if summary.sign_undecided_samples is not None:
        rows.append(("samples with undecided sign", summary.sign_undecided_samples, ""))
    if summary.consistency is not None:
        found = summary.consistency
        verdict = "consistent" if found["consistent"] else "INCONSISTENT"
        rows.append(("innovations squared over stated (NIS)", f"{found['nis']:.3f}", f"≤ {found['bound']:.3f}"))
        rows.append(("innovations", verdict, ""))
        if found["worst_channel"] is not None:
            rows.append(("channel that disagrees most", found["worst_channel"], ""))
    if summary.health is not None:
        faulty = dict.fromkeys(name for fault in summary.health["faults"] for name in fault["channels"])
        rows.append(("channels that contradict the others", ", ".join(faulty) or "none", ""))
    stuck = dict.fromkeys(fault["channel"] for fault in summary.faults if fault["kind"] == "stuck")
    if stuck:
        rows.append(("channels stuck for a while", ", ".join(stuck), ""))
    if summary.channels_left_out:
        rows.append(("channels left out", ", ".join(summary.channels_left_out), ""))
    print_table(f"{summary.array}, method {summary.method}, {summary.form} form", ("quantity", "value", "unit"), rows)
    if summary.at_rest is not None:
        _print_at_rest(summary.at_rest, has_tacho=summary.tacho_rmse_rad_s is not None)
    if summary.position is not None:
        _print_position(summary.position)
    if summary.mounting is not None:
        _print_mounting(summary.mounting)


def _print_at_rest(found: ForceAtRest, *, has_tacho: bool) -> None:
    """Print what p reads beyond gravity at the first rest, and the lean that would read the same."""
    rows = [
        ("bias of p", *(f"{value:+.2f}" for value in found.bias_mg), f"{found.magnitude_mg:+.2f}"),
        ("standard uncertainty", *(f"{value:.2g}" for value in found.std_mg), f"{found.magnitude_std_mg:.2g}"),
    ]
    print_table(
        f"Equivalent biases of p, first rest ({found.start_s:.4g} to {found.stop_s:.4g} s), mg",
        ("mean less gravity", "x", "y", "z", "magnitude"),
        rows,
        note="The first rest is the first stretch in which no reading varies beyond its noise. "
        + ("" if has_tacho else "Without a tachometer a steady spin may pass for one. ")
        + f"At rest a bias and a lean are one: a lean of {math.degrees(found.lean_rad):.2g}° reads the same across "
        "the vertical. No lean makes the magnitude.",
    )


def _print_position(position: PositionSummary) -> None:
    """Print where navigation ends, and the constant errors that would explain it."""
    bias_mg = 1e3 * position.equivalent_p_bias_m_s2 / STANDARD_GRAVITY
    rows = [
        ("position x y z", "  ".join(f"{value:.4g}" for value in position.position_m), "m"),
        ("equivalent bias of p, x y z: 2 r/t²", "  ".join(f"{value:.4g}" for value in bias_mg), "mg"),
        ("equivalent drift of ω: 6 r/(g t³)", f"{position.equivalent_rate_drift_deg_h:.4g}", "°/h"),
    ]
    if position.earth_horizontal_rate_deg_h is not None:
        rows.append(("Earth's horizontal rate, taken off", f"{position.earth_horizontal_rate_deg_h:.4g}", "°/h"))
    print_table(
        f"Position in the world after {position.after_s:.4g} s",
        ("quantity", "value", "unit"),
        rows,
        note="The equivalent errors hold for a body that ends where it started: r is then all error. The drift is that "
        "of the horizontal part.",
    )


def _print_mounting(mounting: Mapping[str, Any]) -> None:
    """Print the constants of a mounting that were estimated, and what the data leave open."""
    print_table(
        "Mounting, estimated with the rotation: corrections to the array file",
        ("constant", "value", "± std", "prior std"),
        [
            (one["name"], f"{one['value']:+.4g}", f"{one['std']:.2g}", f"{one['prior_std']:.2g}")
            for one in mounting["constants"]
        ],
        left=1,
        note="Units are in the names; rotations and levers in body axes.",
    )
    for line in mounting["undetermined_combinations_in_prior_std"]:
        print_text(f"- not determined by these data (each in units of its prior std): {line}")
