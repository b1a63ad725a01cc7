"""`gfimu score`: compare array geometries."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

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
from gfimu.cli.output import print_json, print_table, print_text
from gfimu.cli.shared_options import JsonOption, shared

if TYPE_CHECKING:
    from gfimu.geometry.scoring import Score
    from gfimu.known_axis.accuracy.bounds import AxisBounds

__all__ = ["print_scores", "register"]

_MG = 9.80665e-3  # numerical: m/s²


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="score")(_score)


def _score(
    arrays: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[ARRAY]...",
            autocompletion=completion.arrays,
            help="Names, array files (.toml) or MJCF files (.xml); all shipped ones.",
        ),
    ] = None,
    length_unit: Annotated[
        float | None, typer.Option("--length-unit-m", help="Length that counts as 1, m; else half of each cube's edge.")
    ] = None,
    speed: Annotated[float, shared("--speed-rad-s", more=", of the rate bound")] = math.tau,
    spin_axis: Annotated[
        str,
        typer.Option(
            metavar="AXIS", autocompletion=completion.words("x", "y", "z"), help="Body axis of that spin: x, y or z."
        ),
    ] = "z",
    noise: Annotated[
        float, typer.Option("--noise-m-s2", help="Standard deviation of a channel, m/s²: 0.0287 is ADXL345 at 100 Hz.")
    ] = 0.0287,
    axis: AxisOption = None,
    axis_point: AxisPointOption = (0.0, 0.0, 0.0),
    hub: HubOption = "fixed",
    rate: Annotated[float, shared("--rate", more=", of least faults, and with --axis")] = 100.0,
    inclination_rad: InclinationOption = None,
    point_std: PointStdOption = 0.0,
    direction_std: DirectionStdOption = 0.0,
    lever_std: LeverStdOption = 0.0,
    rotation_std: RotationStdOption = 0.0,
    bias_std: BiasStdOption = 0.0,
    duration: Annotated[
        float, shared("--duration", when="With --axis: ", more=", that the estimate is predicted for")
    ] = 60.0,
    hub_std: Annotated[
        float,
        typer.Option("--hub-std-m-s2", help="With a free hub: standard deviation of its own acceleration, m/s²."),
    ] = 0.7,
    jerk: Annotated[
        float, typer.Option("--jerk-rad2-s5", help="With --axis: spectral density of the change of α, rad²/s⁵.")
    ] = 1.0,
    fault_time: Annotated[
        float, typer.Option("--fault-time-s", help="Time within which a fault of a channel is to be found, s.")
    ] = 1.0,
    per_channel: Annotated[bool, typer.Option("--per-channel", help="Least fault of every channel.")] = False,
    json: JsonOption = False,
) -> None:
    r"""Score array geometries: condition number, GDOP, errors, leakage of ω², visible products of ω, least faults.

    Examples
    --------
    gfimu score cube12 p3_three_plus_one --speed-rad-s 10
    # Two chips on a wheel
    gfimu score wheel.toml --axis z --hub free --speed-rad-s 12
    # Mounted by eye
    gfimu score one_chip --axis z --axis-point -0.1 0 0 --lever-std-m 0.003 --rotation-std-rad 0.05 \
        --bias-std-m-s2 0.2
    """
    from gfimu.commands.score import score
    from gfimu.geometry.scoring import Score

    scores = score(
        arrays,
        length_unit_m=length_unit,
        speed_rad_s=speed,
        spin_axis=spin_axis,
        noise_m_s2=noise,
        axis=axis,
        axis_point=axis_point,
        hub=hub,
        inclination_rad=inclination_rad,
        point_std_m=point_std,
        direction_std_rad=direction_std,
        lever_std_m=lever_std,
        rotation_std_rad=rotation_std,
        bias_std_m_s2=bias_std,
        rate=rate,
        duration=duration,
        hub_std_m_s2=hub_std,
        jerk_rad2_s5=jerk,
        fault_time_s=fault_time,
        per_channel=per_channel,
    )
    bounds = [entry for entry in scores if not isinstance(entry, Score)]
    figures = [entry for entry in scores if isinstance(entry, Score)]
    if json:
        units = {"length_unit_m": figures[0].length_unit_m} if figures else {}
        print_json(units | {"arrays": [entry.to_dict() for entry in scores]})
        return
    if figures:
        print_scores(figures, f"{speed:.4g} rad/s about {spin_axis} and channel noise {noise:.4g} m/s²")
        _print_protection(figures)
    if bounds:
        _print_bounds(bounds, noise, rate)


def print_scores(scores: list[Score], condition: str) -> None:
    """Print the figures of merit of arrays; ``condition`` is that of the rate bound, in words."""
    from gfimu.geometry.scoring import ranking_remark

    units = sorted({entry.length_unit_m for entry in scores})
    unit = (
        f"{units[0]:g} m"
        if len(units) == 1
        else ", ".join(f"{entry.length_unit_m:g} m ({entry.name})" for entry in scores)
        if len(scores) <= 3
        else "each array's own: " + "; ".join(f"{length:g} m for {_names_of(scores, length)}" for length in units)
    )
    print_table(
        "Array geometries",
        ["array", "axes", "κ(J)", "GDOP", "GDOP*", "ω² left in", "ω seen"],
        [
            [
                entry.name,
                entry.n_channels,
                f"{entry.condition_number:.4f}",
                f"{entry.gdop:.4f}",
                _number(entry.gdop_joint, ".4f"),
                _contaminated(entry),
                f"{entry.null_space_rank} of 6",
            ]
            for entry in scores
        ],
        note=f"Lengths in units of {unit}. GDOP*: with ω unknown and no recursion (joint form). "
        "ω seen: products of ω that the null space of J sees.",
    )
    print_table(
        "Standard deviations, x y z",
        ["array", "σ_α", "σ_p", "σ_ω, rad/s"],
        [
            [
                entry.name,
                _triple(entry.sigma_alpha, ".4f"),
                _triple(entry.sigma_p, ".4f"),
                _triple(entry.rate_bound_rad_s, ".3g"),
            ]
            for entry in scores
        ],
        note="σ_α (per length unit) and σ_p for channels of standard deviation 1. σ_ω: least one sample can reach "
        f"(Cramér–Rao) at {condition}; —: one sample doesn't determine it.",
    )
    remark = ranking_remark(scores)
    if remark:
        print_text(remark)
    dirty = [entry for entry in scores if entry.omega_squared_terms]
    if dirty:
        print_table(
            "Products of ω left in the linear solution [α; p] = S a",
            ["array", "of", "terms"],
            [
                [entry.name if first else "", component.replace("alpha", "α"), terms]
                for entry in dirty
                for first, (component, terms) in _with_first(entry.omega_squared_terms)
            ],
        )


def _print_protection(scores: list[Score]) -> None:
    """Print the least fault of a channel that each array finds."""
    from gfimu.integrity.protection import FaultProtection, protection_remark

    found = {entry.name: entry.protection for entry in scores if isinstance(entry.protection, FaultProtection)}
    if not found:
        return
    one = next(iter(found.values()))
    print_table(
        f"Least fault of a channel that is found within {one.duration_s:g} s, worst channel, mg",
        ["array", "seen", "assigned", "seen, ω unknown", "assigned, ω unknown", "unseen error of α, rad/s²"],
        [
            [
                name,
                *(
                    _number(faults.max() / _MG, ".2f")
                    for faults in (
                        entry.followed.detected, entry.followed.isolated, entry.single.detected, entry.single.isolated
                    )
                ),
                _number(entry.unseen_alpha.max(), ".3g"),
            ]
            for name, entry in found.items()
        ],
        note=f"A constant fault, found with 95 % probability at {one.sample_rate_hz:g} Hz and channel noise "
        f"{one.noise_m_s2:.4g} m/s². Assigned: to its channel. ω unknown: by the parity space of single samples; else "
        "as a filter follows ω. Unseen error of α: by a fault that is just not seen. —: never.",
    )  # fmt: skip
    if one.per_channel:
        for name, entry in found.items():
            print_table(
                f"{name}: least fault of each channel, mg",
                ["channel", "seen", "assigned", "seen, ω unknown", "assigned, ω unknown", "nearest channel"],
                [
                    [
                        channel,
                        *(
                            _number(faults[i] / _MG, ".2f")
                            for faults in (
                                entry.followed.detected, entry.followed.isolated, entry.single.detected,
                                entry.single.isolated,
                            )
                        ),
                        entry.followed.rivals[i] or "—",
                    ]
                    for i, channel in enumerate(entry.followed.channels)
                ],
            )  # fmt: skip
    remark = protection_remark(found)
    if remark:
        print_text(remark)


def _print_bounds(bounds: list[AxisBounds], noise: float, sample_rate_hz: float) -> None:
    print_table(
        "Rotation about one known axis: bounds with an exact mounting",
        ["array", "hub", "σ_α, rad/s²", "σ of Ω², rad²/s²", "σ_Ω per sample, rad/s", "σ_Ω of a filter, rad/s"],
        [
            [
                entry.array,
                entry.axis.hub,
                _number(entry.acceleration_std, ".4g"),
                _number(entry.square_std, ".4g"),
                _number(entry.sample_std, ".3g"),
                _number(entry.filter_std, ".3g"),
            ]
            for entry in bounds
        ],
        note=f"At {bounds[0].rate_rad_s:.4g} rad/s, channel noise {noise:.4g} m/s², {sample_rate_hz:g} Hz; —: not "
        "observable. A filter is at this bound with biases known, white noise and any motion.",
    )
    predicted = [(entry, entry.predicted) for entry in bounds if entry.predicted is not None]
    if not predicted:
        return
    run = predicted[0][1].run
    print_table(
        f"What gfimu estimate reaches at {bounds[0].rate_rad_s:.4g} rad/s, in a run of {run.duration_s:g} s from rest",
        ["array", "inclination, rad", "σ_Ω by noise, rad/s", "by the mounting, rad/s", "σ_Ω, rad/s"],
        [
            [
                entry.array,
                f"{found.inclination_rad:.3g}",
                _number(found.noise_std, ".3g"),
                "exact" if entry.axis.uncertainty.exact else _number(found.mounting_std, ".3g"),
                _number(found.std, ".3g"),
            ]
            for entry, found in predicted
        ],
        note="Gravity, which turns in an inclined body, counts too; the uncertain constants of the mounting are "
        f"estimated in that run. Change of α of density {run.jerk_rad2_s5:g} rad²/s⁵"
        + (
            f", acceleration of a free hub {run.hub_std_m_s2:g} m/s²."
            if any(entry.axis.hub == "free" for entry in bounds)
            else "."
        ),
    )
    for entry, found in predicted:
        if found.undetermined:
            print_text(f"{entry.array}: such a run does not determine {'; '.join(found.undetermined)}.")


def _names_of(scores: list[Score], length: float) -> str:
    same = [entry.name for entry in scores if entry.length_unit_m == length]
    return ", ".join(same) if len(same) <= 2 else f"{len(same)} arrays"


def _with_first(terms: dict[str, str]) -> list[tuple[bool, tuple[str, str]]]:
    return [(number == 0, item) for number, item in enumerate(terms.items())]


def _number(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else "—"


def _triple(values: Iterable[float], form: str) -> str:
    """Three numbers, or one where they agree."""
    texts = [_number(value, form) for value in values]
    return texts[0] if len(set(texts)) == 1 else " ".join(texts)


def _contaminated(entry: Score) -> str:
    names = list(entry.omega_squared_terms)
    if not names:
        return "none"
    return "α and p" if len(names) == 6 else " ".join(name.replace("alpha", "α") for name in names)
