"""One impact in a recording: time zero, zeroed and filtered channels, motion, and the figures that are reported."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import pseudo_inverse
from gfimu.array.parts.limits import PartLimits
from gfimu.base.declared import Declared, Line, Table, figure
from gfimu.base.errors import InputError
from gfimu.base.results import Panel, PlottedResult, Series, axis_series
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.motion.estimate import Estimate
from gfimu.motion.impact.channel_class import channel_filter
from gfimu.motion.impact.criteria import head_injury_criterion
from gfimu.motion.impact.polarity import DIRECTIONS, direction_remark, moved, sign_remark
from gfimu.recording import Recording

__all__ = ["Impact", "ImpactSettings", "measure_impact", "time_zero"]

_HIC_S = 0.015
_DRAWN_BEFORE_S, _DRAWN_DURATIONS, _DRAWN_S = 0.005, 3.0, 0.02
"""Of the picture: time before time zero, and after it in durations of the impact, and at least."""
_NEAR_END = 0.98  # share of a channel's range


@dataclass(frozen=True)
class ImpactSettings:
    """How an impact is measured.

    Parameters
    ----------
    channel_class : float
        Channel frequency class (`gfimu.motion.impact.channel_class`).
    standard : {"sae", "iso"}
        SAE J211-1 or ISO 6487.
    threshold_m_s2 : float
        Change of a channel that is an impact, m/s²; 5 g by default.
    guard_s : float
        Samples that come less than this before time zero are not used for zeroing, s.
    before_s : float
        Least time before time zero from which the channels are zeroed, s.
    direction : str
        Where the body is accelerated, as ``"+x"``, if that is known; empty if not.
    """

    channel_class: float = 1000.0
    standard: str = "sae"
    threshold_m_s2: float = 5.0 * STANDARD_GRAVITY
    guard_s: float = 0.005
    before_s: float = 0.02
    direction: str = ""

    def __post_init__(self) -> None:
        if not 0.0 < self.threshold_m_s2 < np.inf:
            raise InputError(f"threshold {self.threshold_m_s2 / STANDARD_GRAVITY:g} g; give one above 0")
        if self.direction and self.direction not in DIRECTIONS:
            raise InputError(f"direction {self.direction!r}; choose among {', '.join(DIRECTIONS)}")


@dataclass(frozen=True)
class Impact(Declared, PlottedResult):
    """Measures of one impact: time zero, filtered channels, peaks.

    Parameters
    ----------
    motion : Estimate
        p, α, ω from shortly before time zero on; its time is zero there.
    recording : Recording
        The channels, zeroed and filtered, in the same time.
    settings : ImpactSettings
        How it was measured.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.impact("drop.csv", array="cube12").peak_p_m_s2  # doctest: +SKIP
    """

    time_zero_s: Annotated[float, figure("Time zero in the recording's time.", "s")]
    duration_s: Annotated[float, figure("From time zero until the resultant of p stays below the threshold.", "s")]
    offset_m_s2: Annotated[
        dict[str, float],
        figure("Reading of each channel before time zero, taken off: bias and gravity.", "m/s²"),
    ]
    peak_p_m_s2: Annotated[float, figure("Largest resultant of p; gravity before the impact is taken off.", "m/s²")]
    peak_p_time_s: Annotated[float, figure("When, after time zero.", "s")]
    velocity_change_m_s: Annotated[NDArray[np.float64], figure("Integral of p over the duration, body axes.", "m/s")]
    peak_alpha_rad_s2: Annotated[float, figure("Largest resultant of α.", "rad/s²")]
    peak_alpha_std_rad_s2: Annotated[
        float, figure("Its standard deviation by noise and by the channels' gain errors.", "rad/s²")
    ]
    peak_alpha_time_s: Annotated[float, figure("When, after time zero.", "s")]
    peak_omega_rad_s: Annotated[float, figure("Largest resultant of ω, which is zero at time zero.", "rad/s")]
    hic15: Annotated[
        float, figure("Head injury criterion over at most 15 ms; of a head if the origin is its centre of mass.")
    ]
    warnings: Annotated[tuple[str, ...], figure("What speaks against these figures.")]
    motion: Estimate
    recording: Recording
    settings: ImpactSettings

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return the motion from shortly before time zero on, the columns of an Estimate file."""
        return self.motion.to_columns()

    def shown(self) -> Iterator[Table | Line]:
        """Yield the table and the warnings that people read."""
        title = f"Impact, {self.settings.standard.upper()} class {self.settings.channel_class:g}"
        yield Table(title, ("quantity", "value"), self._facts())
        for warning in self.warnings:
            yield Line(warning, "yellow")

    def _facts(self) -> list[tuple[str, str]]:
        peak_alpha = f"{self.peak_alpha_rad_s2:.4g} ± {self.peak_alpha_std_rad_s2:.2g} rad/s²"
        return [
            ("time zero", f"{self.time_zero_s:.6f} s"),
            ("duration", f"{1e3 * self.duration_s:.2f} ms"),
            ("peak p", f"{self.peak_p_m_s2 / STANDARD_GRAVITY:.4g} g at {1e3 * self.peak_p_time_s:.2f} ms"),
            ("change of velocity", f"({', '.join(f'{one:.3g}' for one in self.velocity_change_m_s)}) m/s"),
            ("peak α", f"{peak_alpha} at {1e3 * self.peak_alpha_time_s:.2f} ms"),
            ("peak ω", f"{self.peak_omega_rad_s:.4g} rad/s"),
            ("HIC15", f"{self.hic15:.4g}"),
        ]

    def _notes(self) -> tuple[str, ...]:
        return self.warnings

    def _panels(self) -> list[Panel]:
        motion = self.motion
        shown = (motion.t_s >= -_DRAWN_BEFORE_S) & (motion.t_s <= max(_DRAWN_DURATIONS * self.duration_s, _DRAWN_S))
        panels = []
        for title, label, values in (
            ("specific force of the origin", "p, g", motion.p[shown] / STANDARD_GRAVITY),
            ("angular acceleration", "α, rad/s²", motion.alpha[shown]),
            ("angular rate", "ω, rad/s", motion.omega[shown]),
        ):
            series = (Series("resultant", np.linalg.norm(values, axis=1), role="noise"), *axis_series(values))
            panels.append(Panel(title, label, series, motion.t_s[shown], shaded=(0.0, self.duration_s)))
        return panels


def time_zero(changes: NDArray[np.float64], threshold: float) -> int:
    """Return the first sample of an impact: behind the last one before the peak at which all are below the threshold.

    Parameters
    ----------
    changes : ndarray, shape (n, c)
        Channels with their values before the impact taken off.
    threshold : float
        In their unit.

    Raises
    ------
    InputError
        If nothing exceeds the threshold, or the recording begins above it.
    """
    size = np.abs(changes).max(axis=1)  # (n,)
    peak = int(size.argmax())
    if size[peak] < threshold:
        raise InputError(
            f"no impact: no channel changes by more than {size[peak] / STANDARD_GRAVITY:.3g} g; "
            "--threshold-g sets the least"
        )
    below = np.flatnonzero(size[:peak] < threshold)
    if not len(below):
        raise InputError("the recording begins within the impact; record from before it on")
    return int(below[-1]) + 1


def measure_impact(recording: Recording, array: AccelerometerArray, settings: ImpactSettings | None = None) -> Impact:
    """Measure one impact, the largest of a recording.

    Parameters
    ----------
    recording : Recording
        Readings in m/s², on an even grid.
    array : AccelerometerArray
        The array that was recorded.
    settings : ImpactSettings, optional
        How it is measured.

    Returns
    -------
    Impact
        Its figures. α and p by the array's closed form, ω by integrating α from zero.

    Raises
    ------
    InputError
        If the recording has gaps or missing readings, is sampled too slowly for the class, holds no impact, or begins
        too late before it.
    """
    settings = settings or ImpactSettings()
    if len(recording.gaps):
        raise InputError(
            f"there is a gap behind {recording.t_s[recording.gaps[0]]:.6f} s; choose a stretch without gaps"
        )
    rate = recording.sample_rate
    before = round(settings.before_s * rate)
    readings = recording.for_array(array)  # (n, c)
    filtered = channel_filter(readings, rate, settings.channel_class, settings.standard)
    first = time_zero(filtered - np.median(filtered[: max(before, 1)], axis=0), settings.threshold_m_s2)
    last_quiet = first - round(settings.guard_s * rate)
    if last_quiet < before:
        raise InputError(
            f"the impact comes {first / rate:.3g} s after the start; "
            f"{settings.before_s + settings.guard_s:g} s before it are needed to zero the channels"
        )
    quiet = filtered[:last_quiet]
    offset = quiet.mean(axis=0)  # (c,)
    time = recording.t_s - recording.t_s[first]
    zeroed = Recording.from_arrays(
        time[last_quiet:], filtered[last_quiet:] - offset, array, metadata=dict(recording.metadata)
    )
    motion = moved(zeroed, array)
    limits = PartLimits.of(array, rate)
    if "calibration" in recording.metadata:
        limits = replace(limits, gain_std=np.zeros(array.n_channels))
    noise = (quiet - offset).std(axis=0)
    found = _figures(settings, motion, zeroed, noise, limits, array)
    beyond = np.abs(readings).max(axis=0) >= _NEAR_END * limits.full_range
    warnings = [
        direction_remark(settings.direction, found["velocity_change_m_s"]) if settings.direction else "",
        sign_remark(zeroed, array, motion),
        _cut_off(array.channels, beyond),
    ]
    return Impact(
        time_zero_s=float(recording.t_s[first]),
        offset_m_s2=dict(zip(array.channels, map(float, offset), strict=True)),
        motion=motion,
        recording=zeroed,
        settings=settings,
        warnings=tuple(filter(None, warnings)),
        **found,
    )


def _figures(
    settings: ImpactSettings,
    motion: Estimate,
    zeroed: Recording,
    noise: NDArray[np.float64],
    limits: PartLimits,
    array: AccelerometerArray,
) -> dict[str, Any]:
    """Return the figures of an impact by the names of the fields of `Impact`."""
    time = motion.t_s
    started = time >= 0.0
    force = np.linalg.norm(motion.p, axis=1)
    twist = np.linalg.norm(motion.alpha, axis=1)
    strongest, sharpest = int(force.argmax()), int(twist.argmax())
    loud = np.flatnonzero(started & (force >= settings.threshold_m_s2))
    end = int(loud[-1] if len(loud) else started.argmax()) + 1
    during = started & (np.arange(len(time)) < end)
    sensed = pseudo_inverse(array)[:3]  # (3, c)
    error = noise**2 + (limits.gain_std * zeroed.readings[sharpest]) ** 2  # (c,)
    along = motion.alpha[sharpest] / max(twist[sharpest], np.finfo(float).tiny)  # (3,)
    return {
        "duration_s": float(time[end - 1]),
        "peak_p_m_s2": float(force[strongest]),
        "peak_p_time_s": float(time[strongest]),
        "velocity_change_m_s": np.trapezoid(motion.p[during], time[during], axis=0),
        "peak_alpha_rad_s2": float(twist[sharpest]),
        "peak_alpha_std_rad_s2": float(np.sqrt((along @ sensed) ** 2 @ error)),
        "peak_alpha_time_s": float(time[sharpest]),
        "peak_omega_rad_s": float(np.linalg.norm(motion.omega, axis=1).max()),
        "hic15": head_injury_criterion(force / STANDARD_GRAVITY, zeroed.sample_period, _HIC_S),
    }


def _cut_off(channels: Sequence[str], beyond: NDArray[np.bool_]) -> str:
    """Name the channels that were at the end of their range."""
    names = ", ".join(name for name, one in zip(channels, beyond, strict=True) if one)
    return f"{names}: at the end of the range; the peak may be cut off" if names else ""
