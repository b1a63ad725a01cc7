"""The plots of a run: raw channels, rate, angular acceleration, specific force, angle, drift."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.results.colours import chip_colour
from gfimu.motion.attitude import table_angle, to_rotation
from gfimu.rate.health.fault import HealthCode
from gfimu.recording import Recording
from gfimu.visual.colours import AXES, COMMAND, ESTIMATE, ESTIMATE_BAND, TACHO, TRUTH, UNDECIDED
from gfimu.visual.motion import ExpectedDrift, KnownMotion, MotionEstimate, reference_rate
from gfimu.visual.plots import LONGEST_LEGEND, Line, Plot

__all__ = [
    "angle_plot",
    "banded_rate_plots",
    "carriage_plots",
    "drift_plot",
    "free_rate_plots",
    "health_plot",
    "known_motion_plots",
    "motion_plots",
    "position_plot",
    "raw_plots",
    "spin_rate_plots",
    "true_displacement",
]

_NAMES = ("x", "y", "z")
_BOTH_SIDES = 2 * np.array([-1.0, 1.0])  # ±2σ
_CHIPS_PER_GROUP = 8
_SHOWN = 0.9  # of the errors and their band


def raw_plots(t: NDArray[np.float64], readings: NDArray[np.float64], array: AccelerometerArray) -> list[list[Plot]]:
    """Plot the readings (n, c), m/s², in groups of plots: one per number of sensing axis, one line per chip.

    More chips than a legend can name are split into groups.
    """
    axis_on_chip = np.concatenate([np.arange(len(chip.axes)) for chip in array.chips])
    count = len(array.chips)
    size = count if count <= LONGEST_LEGEND else _CHIPS_PER_GROUP
    groups = []
    for first in range(0, count, size):
        inside = (array.chip_of_channel >= first) & (array.chip_of_channel < first + size)
        named = f"{array.chips[first].name} to {array.chips[min(first + size, count) - 1].name}, "
        groups.append(
            [
                Plot(
                    f"raw, {named if size < count else ''}axis {axis + 1}, m/s²",
                    [
                        Line(
                            array.channels[column],
                            t,
                            readings[:, column],
                            chip_colour(int(array.chip_of_channel[column])),
                            1.0,
                        )
                        for column in np.flatnonzero(inside & (axis_on_chip == axis))
                    ],
                )
                for axis in np.unique(axis_on_chip[inside])
            ]
        )
    return groups


_CARRIAGE = {
    "carriage_m": "place of the carriage, m",
    "carriage_speed_m_s": "speed of the carriage, m/s",
    "carriage_acceleration_m_s2": "acceleration of the carriage, m/s²",
}


def carriage_plots(recording: Recording) -> list[Plot]:
    """Plot place, speed and acceleration of a carriage, those that the recording has as references."""
    return [
        Plot(title, [Line("commanded", recording.t_s, recording.reference[name], COMMAND)], legend=False)
        for name, title in _CARRIAGE.items()
        if name in recording.reference and np.isfinite(recording.reference[name]).any()
    ]


def spin_rate_plots(
    recording: Recording, estimate: MotionEstimate | None, known: KnownMotion | None, axis: NDArray[np.float64]
) -> list[Plot]:
    """Rate about an axis, shape (3,), with every reference and its ±2σ band; then its error in the same band."""
    t = recording.t_s
    lines = []
    if "command_rad_s" in recording.reference:
        lines.append(Line("command", t, recording.reference["command_rad_s"], COMMAND, 2.0))
    if (measured := reference_rate(recording, axis)) is not None:
        lines.append(Line(measured[0], t, measured[1], TACHO, 1.5))
    compared = (lines[-1].name, t, lines[-1].values) if lines else None
    if known is not None and known.omega is not None:
        lines.append(Line(known.name, known.t, known.omega @ axis, TRUTH, 2.5))
        compared = (known.name, known.t, known.omega @ axis)
    if estimate is not None:
        rate = estimate.omega @ axis
        spread = np.sqrt(estimate.omega_std**2 @ axis**2)[:, None] * _BOTH_SIDES
        lines.insert(0, Line("±2σ", estimate.t_s, rate[:, None] + spread, ESTIMATE_BAND, 1.0))
        lines.append(Line("estimate", estimate.t_s, rate, ESTIMATE))
        lines += _undecided(estimate, rate)
    span = None if estimate is None else _span(rate, 1.0, margin=1.2)
    plots = [Plot("angular rate about the axis of rotation, rad/s", lines, span=span)] if lines else []
    if estimate is not None and compared is not None:
        name, reference_t, reference = compared
        error = rate - np.interp(estimate.t_s, reference_t, reference)
        plots.append(
            Plot(
                "error of the rate, rad/s",
                [
                    Line("±2σ", estimate.t_s, spread, ESTIMATE_BAND, 1.5),
                    Line(f"estimate − {name}", estimate.t_s, error, ESTIMATE, 1.2),
                ],
                span=_span(np.abs(np.concatenate([spread[:, 1], error])), _SHOWN, margin=2.0, even=True),
            )
        )
    return plots


def free_rate_plots(recording: Recording, estimate: MotionEstimate | None, known: KnownMotion | None) -> list[Plot]:
    """Three components of the rate beside truth or gyro; then their errors with the band of the widest.

    Truth or gyro are grey behind an estimate; alone they have the hues of the axes.
    """
    lines, errors = [], []
    for axis, (name, colour) in enumerate(zip(_NAMES, AXES, strict=True)):
        reference = _rate_reference(recording, known, axis)
        if reference is not None:
            grey = estimate is not None
            lines.append(
                Line(
                    f"{reference[0]} {name}",
                    reference[1],
                    reference[2],
                    TRUTH if grey else colour,
                    2.5 if grey else 1.5,
                )
            )
        if estimate is None:
            continue
        lines.append(Line(f"estimate {name}", estimate.t_s, estimate.omega[:, axis], colour))
        lines += _undecided(estimate, estimate.omega[:, axis])
        if reference is not None:
            error = estimate.omega[:, axis] - np.interp(estimate.t_s, reference[1], reference[2])
            errors.append(Line(f"{name}, estimate − {reference[0]}", estimate.t_s, error, colour, 1.2))
    plots = [Plot("angular rate ω, rad/s", lines)] if lines else []
    if estimate is not None and errors:
        edges = estimate.omega_std.max(axis=1)[:, None] * _BOTH_SIDES
        band = Line("±2σ", estimate.t_s, edges, ESTIMATE_BAND)
        sizes = np.abs(np.concatenate([edges[:, 1], *(line.values for line in errors)]))
        span = _span(sizes, _SHOWN, margin=2.0, even=True)
        plots.append(Plot("error of the rate, rad/s", [band, *errors], span=span))
    return plots


def banded_rate_plots(estimate: MotionEstimate) -> list[Plot]:
    """Each component of the rate in its ±2σ band."""
    plots = []
    for axis, name in enumerate(_NAMES):
        rate = estimate.omega[:, axis]
        if not np.isfinite(rate).any():
            continue
        band = Line("±2σ", estimate.t_s, rate[:, None] + estimate.omega_std[:, axis, None] * _BOTH_SIDES, ESTIMATE_BAND)
        lines = [band, Line("estimate", estimate.t_s, rate, ESTIMATE), *_undecided(estimate, rate)]
        plots.append(Plot(f"angular rate ω, {name}, rad/s", lines, span=_span(rate, 1.0, margin=1.2)))
    return plots


def _undecided(estimate: MotionEstimate, rate: NDArray[np.float64]) -> list[Line]:
    """Return the stretches of a component (n,) of the rate in which its sign is not decided, as a line; or none."""
    marked = getattr(estimate, "sign_undecided", None)
    if marked is None or not marked.any():
        return []
    return [Line("sign undecided", estimate.t_s, np.where(marked, rate, np.nan), UNDECIDED, 3.0)]


def motion_plots(estimate: MotionEstimate, known: KnownMotion | None) -> Iterator[Plot]:
    """Yield angular acceleration, and horizontal and vertical specific force of the body origin where it is known."""
    known_alpha, known_p = (None, None) if known is None else (known.alpha, known.p)
    for title, symbol, values, truth, axes in (
        ("angular acceleration α, rad/s²", "α", estimate.alpha, known_alpha, [0, 1, 2]),
        ("specific force p, body x and y, m/s²", "p", estimate.p, known_p, [0, 1]),
        ("p, body z, m/s²", "p", estimate.p, known_p, [2]),
    ):
        if not np.isfinite(values[:, axes]).any():
            continue
        lines = [Line(f"{symbol} {_NAMES[axis]}", estimate.t_s, values[:, axis], AXES[axis], 1.0) for axis in axes]
        if known is not None and truth is not None:
            lines.insert(0, Line(known.name, known.t, truth[:, axes], TRUTH, 2.5))
        yield Plot(title, lines)


def known_motion_plots(known: KnownMotion | None) -> list[Plot]:
    """Plot angular acceleration and specific force of a motion that is known, where no estimate stands beside them."""
    parts = [] if known is None else [("α, rad/s²", "α", known.alpha), ("p, m/s²", "p", known.p)]
    names = {"α": "angular acceleration", "p": "specific force"}
    return [
        Plot(
            f"{names[symbol]} {title}",
            [Line(f"{symbol} {name}", known.t, values[:, axis], AXES[axis]) for axis, name in enumerate(_NAMES)],
        )
        for title, symbol, values in parts
        if known is not None and values is not None and np.isfinite(values).any()
    ]


def angle_plot(estimate: MotionEstimate | None, known: KnownMotion | None, axis: NDArray[np.float64]) -> Plot | None:
    """Angle about an axis, shape (3,); of a free body, the angle between the estimated attitude and the known one."""
    if known is not None and known.angle is None:
        if estimate is None:
            return None
        nearest = np.clip(np.searchsorted(known.t, estimate.t_s), 0, len(known.t) - 1)
        complete = np.isfinite(estimate.quaternion).all(axis=1)
        apart = to_rotation(known.quaternion[nearest][complete]).inv() * to_rotation(estimate.quaternion[complete])
        return Plot(
            "error of the attitude, rad",
            [Line("error", estimate.t_s[complete], np.asarray(apart.magnitude()), ESTIMATE)],
        )
    lines = []
    if known is not None and known.angle is not None:
        lines.append(Line(known.name, known.t, known.angle, TACHO if known.omega is None else TRUTH, 2.5))
    if estimate is not None:
        angle = table_angle(estimate.t_s, estimate.omega, axis=axis)
        lines.append(Line("estimate", estimate.t_s, angle, ESTIMATE))
    return Plot("angle about the axis of rotation, rad", lines) if lines else None


def position_plot(estimate: MotionEstimate, known: KnownMotion | None) -> Plot | None:
    """Position of the body origin in the world, from where it started; None where it was not estimated."""
    if estimate.position is None or not np.isfinite(estimate.position).any():
        return None
    lines = [Line(name, estimate.t_s, estimate.position[:, axis], AXES[axis]) for axis, name in enumerate(_NAMES)]
    place = true_displacement(known)
    if known is not None and place is not None:
        lines.insert(0, Line(known.name, known.t, place, TRUTH, 2.5))
    return Plot("position in the world, m", lines)


def true_displacement(known: KnownMotion | None) -> NDArray[np.float64] | None:
    """Return how far the body origin is from where it started, as it is known to be, shape (n, 3), m."""
    if known is None or known.omega is None or known.position.ndim != 2:
        return None
    return known.position - known.position[0]


def drift_plot(drift: ExpectedDrift) -> Plot:
    """Position error in the world within its expected ±2σ."""
    band = Line("expected ±2σ", drift.t, drift.std[:, None] * _BOTH_SIDES, ESTIMATE_BAND, 1.5)
    return Plot(
        "position drift, m",
        [band, *[Line(f"error {name}", drift.t, drift.error[:, axis], AXES[axis]) for axis, name in enumerate(_NAMES)]],
    )


def health_plot(t: NDArray[np.float64], health: Mapping[str, NDArray[Any]], array: AccelerometerArray) -> Plot:
    """Lane of each channel, the first at the top: thin while it is used, thick in doubt and where it is not used."""
    names = [name for name in array.channels if name in health]
    codes = np.column_stack([health[name] for name in names])  # (n, c)
    lanes = np.broadcast_to(-np.arange(len(names), dtype=float), codes.shape)
    lines = [Line("used", t, np.where(codes == HealthCode.USED, lanes, np.nan), TRUTH, 1.0)]
    if (codes == HealthCode.DOUBTED).any():
        lines.append(Line("in doubt", t, np.where(codes == HealthCode.DOUBTED, lanes, np.nan), ESTIMATE, 4.0))
    unused = ~np.isin(codes, (HealthCode.USED, HealthCode.DOUBTED))
    for column in np.flatnonzero(unused.any(axis=0)):
        colour = chip_colour(int(array.chip_of_channel[array.channels.index(names[column])]))
        left_out = np.where(unused[:, column], lanes[:, column], np.nan)
        lines.append(Line(f"{names[column]} not used", t, left_out, colour, 8.0))
    title = f"health, a lane per channel from {names[0]} (top) to {names[-1]}"
    return Plot(title, lines, span=(-len(names) + 0.5, 0.5))


def _span(
    values: NDArray[np.float64], share: float, *, margin: float, even: bool = False
) -> tuple[float, float] | None:
    """Range that shows a share of the values with a margin; bands can be wide beyond measure where ω is unknown."""
    known = values[np.isfinite(values)]
    if not len(known):
        return None
    high, low = float(np.quantile(known, share)), float(np.quantile(known, 1.0 - share))
    if even:
        low = -high
    centre, half = 0.5 * (low + high), 0.5 * margin * (high - low)
    return (centre - half, centre + half) if half > 0 else None


def _rate_reference(
    recording: Recording, known: KnownMotion | None, axis: int
) -> tuple[str, NDArray[np.float64], NDArray[np.float64]] | None:
    """Name, times and values of the best reference of one component of the rate: truth, then gyro."""
    if known is not None and known.omega is not None:
        return known.name, known.t, known.omega[:, axis]
    gyro = recording.reference.get(f"gyro_{_NAMES[axis]}_rad_s")
    return None if gyro is None else ("gyro", recording.t_s, gyro)
