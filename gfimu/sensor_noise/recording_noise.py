"""Noise of every channel of a recording, from its longest stretch of rest."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.declared import Declared, Table, figure
from gfimu.base.errors import InputError, check_name
from gfimu.base.results import Panel, PlottedResult, Series, text_column
from gfimu.base.short_repr import short_repr
from gfimu.recording import Recording
from gfimu.recording.quantities import TIME_COLUMNS
from gfimu.recording.rest import detect_rest
from gfimu.recording.timing.reference_times import reference_series
from gfimu.sensor_noise.identification import TERMS, NoiseModel, identify_noise
from gfimu.sensor_noise.missing import without_isolated

__all__ = ["STRETCHES", "RecordingNoise", "recording_noise"]

STRETCHES = ("rest", "all")
"""Which samples to use: the longest rest without a gap, or everything up to the first gap."""


_AXIS_STYLES = ("line", "dashes", "dots")  # of the lines of a chip's sensing axes, which have one hue
_UNIT_WORDS = {"m_s2": "m/s²", "lsb": "counts"}


@dataclass(frozen=True)
class RecordingNoise(Declared, PlottedResult):
    """Noise of every channel of a recording at rest.

    Reference gyros stand among the channels as ``gyro_x`` … in rad/s; one with times of its own has a rate of its own
    (``models["gyro_x"].allan.rate``).

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.noise(gfimu.simulate("rest", seed=1))
    >>> print(f"{1e3 * found.models['a11']['N'].value:.2f}e-3 m/s²/√Hz")
    2.85e-3 m/s²/√Hz
    """

    unit: Annotated[str, figure("Unit of the readings; m_s2 is m/s².", head="unit of the readings")]
    rate: Annotated[float, figure("Sample rate.", "Hz", head="sample rate", key="rate_hz")]
    start_s: Annotated[float, figure("Start of the samples that were used.", "s", head="start")]
    duration_s: Annotated[float, figure("Their length.", "s", head="duration")]
    models: Annotated[Mapping[str, NoiseModel], figure("Noise by channel.", key="channels")]

    __repr__ = short_repr

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per channel and term that was found: value, its interval, and the unit of the coefficient."""
        rows = [(name, term) for name, model in self.models.items() for term in model.terms.values() if term.found]
        unit = _UNIT_WORDS.get(self.unit, self.unit)
        readings = {name: "rad/s" if name in self.gyros else unit for name in self.models}
        numbers = {key: np.array([getattr(term, key) for _, term in rows]) for key in ("value", "low", "high", "std")}
        return {
            "channel": text_column(name for name, _ in rows),
            "term": text_column(term.symbol for _, term in rows),
            "meaning": text_column(term.name for _, term in rows),
            **numbers,
            "unit": text_column(f"{readings[name]}{TERMS[term.symbol][1]}" for name, term in rows),
        }

    def _heading(self) -> str:
        return f"Noise at rest, {self.duration_s:.0f} s at {self.rate:.4g} Hz"

    def _panels(self) -> list[Panel]:
        groups = (
            ("specific force", self.accelerometers, _UNIT_WORDS.get(self.unit, self.unit)),
            ("angular rate", self.gyros, "rad/s"),
        )
        panels = []
        for title, models, unit in groups:
            stems = [name[:-1] for name in models]
            chips = list(dict.fromkeys(stems))
            series: list[Series] = []
            for place, ((name, model), stem) in enumerate(zip(models.items(), stems, strict=True)):
                tau = np.geomspace(model.allan.tau[0], model.allan.tau[-1], 100)
                chip, style = chips.index(stem), _AXIS_STYLES[stems[:place].count(stem) % 3]
                series.append(Series("", model.allan.deviation, x=model.allan.tau, chip=chip, style="points"))
                series.append(Series(name, model.deviation(tau), x=tau, chip=chip, style=style))
            if series:
                label = f"Allan deviation, {unit}"
                panels.append(
                    Panel(f"{title} at rest", label, tuple(series), np.empty(0), "averaging time τ, s", scale="log")
                )
        return panels

    def sample_std(self, channels: Sequence[str]) -> NDArray[np.float64]:
        """Return the standard deviation of one sample that the white noise N gives each channel, shape (c,)."""
        return np.array([self.models[name]["N"].value for name in channels]) * math.sqrt(self.rate)

    def instability(self, channels: Sequence[str]) -> NDArray[np.float64]:
        """Return the bias instability of each channel, by the minimum of its curve, shape (c,)."""
        return np.array([self.models[name].allan.bias_instability for name in channels])

    @property
    def accelerometers(self) -> dict[str, NoiseModel]:
        """Models of the accelerometer channels."""
        return {name: model for name, model in self.models.items() if not name.startswith("gyro")}

    @property
    def gyros(self) -> dict[str, NoiseModel]:
        """Models of the reference gyro's axes."""
        return {name: model for name, model in self.models.items() if name.startswith("gyro")}

    @property
    def symbols(self) -> tuple[str, ...]:
        """Symbols of the terms worth a column: N, B, K, and others found on a channel."""
        return tuple(
            symbol
            for symbol in TERMS
            if symbol in "NBK" or any(model[symbol].found or model[symbol].rivals for model in self.models.values())
        )

    def shown(self) -> Iterator[Table]:
        """Yield the table that people read.

        A term found is written with its standard deviation in units of the last digit, 0.00453(7); another one as
        below its 95 % limit, with a star where the record shows it or one that can't be separated from it.
        """
        unit = _UNIT_WORDS.get(self.unit, self.unit)
        rows = []
        for channel, model in self.models.items():
            terms = [model[symbol] for symbol in self.symbols]
            cells = [
                _concise(term.value, term.std) if term.found else f"<{term.high:.2g}{'*' * bool(term.rivals)}"
                for term in terms
            ]
            rows.append((channel, *cells, f"{model.allan.bias_instability:.3g}"))
        meanings = [f"{symbol} {TERMS[symbol][0]}, {_times(unit, TERMS[symbol][1])}" for symbol in self.symbols]
        yield Table(
            f"noise over {self.duration_s:.1f} s from {self.start_s:.1f} s, {self.rate:.4g} Hz, readings in {unit}",
            ("channel", *self.symbols, "B by minimum"),
            rows,
            note="; ".join(meanings) + "; <: not seen, 95 % limit; *: the record shows one of these, not which",
        )


def _times(unit: str, power: str) -> str:
    """Return the unit of a term from that of the readings."""
    return {"m/s²·s": "m/s", "m/s²/s": "m/s³"}.get(unit + power, unit + power)


def _concise(value: float, std: float) -> str:
    """Write a value with its standard deviation in units of its last digit: 0.00453(7)."""
    decimals = max(-math.floor(math.log10(std)), 0)
    return f"{value:.{decimals}f}({max(round(std * 10**decimals), 1)})"


def recording_noise(
    recording: Recording, *, stretch: str = "rest", rest_threshold: float | None = None, gyros: bool = True
) -> RecordingNoise:
    """Identify the noise of every channel of a recording.

    Parameters
    ----------
    recording : Recording
        Recording with a long rest. Isolated wrong reads are left out.
    stretch : {"rest", "all"}
        Use the longest rest (default), or all samples up to the first gap.
    rest_threshold : float, optional
        Threshold of rest, reading unit squared; chosen by the data if not given.
    gyros : bool
        Include the reference gyro where there is one.

    Raises
    ------
    InputError
        If there is no rest, or a channel lacks more than a few samples or does not vary.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.recording_noise(gfimu.simulate("rest", seed=1)).unit
    'm_s2'
    """
    check_name("stretch", stretch, STRETCHES)
    recording = replace(recording, readings=np.apply_along_axis(without_isolated, 0, recording.readings))
    if stretch == "all":
        gaps = recording.gaps
        start, stop = 0, int(gaps[0]) + 1 if len(gaps) else len(recording)
    else:
        rest = detect_rest(recording, threshold=rest_threshold)
        if len(rest) == 0:
            raise InputError(
                "no rest found; noise shows only while nothing moves: record at rest, or use all samples, --stretch all"
            )
        longest = int(np.argmax(rest.lengths))
        start, stop = int(rest.start[longest]), int(rest.stop[longest])
    part = recording.slice(start, stop)
    rate = recording.sample_rate
    series = {name: (values, rate) for name, values in zip(part.channels, part.readings.T, strict=True)}
    if gyros:
        names = [f"gyro_{axis}" for axis in "xyz" if f"gyro_{axis}_rad_s" in part.reference]
        series |= {name: _gyro_series(part, f"{name}_rad_s") for name in names}
    models = {}
    for name, (values, own_rate) in series.items():
        try:
            unit = "rad_s" if name.startswith("gyro") else recording.unit
            models[name] = identify_noise(values, own_rate, unit=unit)
        except InputError as error:
            raise InputError(f"channel {name}: {error}") from None
    return RecordingNoise(recording.unit, rate, float(part.t_s[0]), part.duration, models)


def _gyro_series(recording: Recording, column: str) -> tuple[NDArray[np.float64], float]:
    """Return the values of a gyro's axis and their rate, Hz: those of the rows, or its own where it has own times."""
    if TIME_COLUMNS[column] not in recording.reference:
        return recording.reference[column], recording.sample_rate
    t, values = reference_series(recording, column)
    if len(t) < 2:
        raise InputError(f"{column} has {len(t)} values in the stretch used; choose another run")
    return values, 1.0 / float(np.median(np.diff(t)))
