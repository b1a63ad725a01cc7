"""The located terms that a search compares: places times dependences, on the scales of what a rig did."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.diagnosis.terms.located.policy import LOCATED
from gfimu.diagnosis.terms.located.term import LocatedTerm
from gfimu.model.located.dependences.curves import OfReading, Product, curve_over
from gfimu.model.located.dependences.dependence import Dependence
from gfimu.model.located.dependences.forms import Form, Step, vector_forms
from gfimu.model.located.dependences.memories import LowPassed, Memory, Mode
from gfimu.model.located.dependences.regressors import (
    ACCELERATION,
    ANGLE,
    FORCES,
    RATE,
    RATE_SQUARED,
    TEMPERATURE,
    TIME,
    WARMING,
    Regressor,
)
from gfimu.model.located.dependences.waves import Revolution
from gfimu.model.located.operators import body_places, channel_place, rig_places
from gfimu.model.located.rig_state import RigState
from gfimu.model.located.usual import USUAL

__all__ = [
    "ChannelTerms",
    "body_dependences",
    "body_terms",
    "channel_patterns",
    "channel_terms",
    "chip_groups",
    "dependences",
    "rig_terms",
]

_Floats = NDArray[np.float64]
ChannelPattern = tuple[str, str, tuple[tuple[int, ...], ...], tuple[str, ...]]
"""Place of the contract, pattern, groups of channels that share an error, and names of the groups."""


def _largest(states: Sequence[RigState], regressor: Regressor) -> float:
    return max(1e-9, *(float(np.abs(regressor.of(state)).max()) for state in states))  # numerical


def dependences(states: Sequence[RigState]) -> dict[str, Dependence]:
    """Return all dependences but modes and waves, by name, on the scales of what rigs did."""
    seen = {one.name: np.concatenate([one.of(state) for state in states]) for one in (RATE, ACCELERATION, ANGLE, TIME)}
    rate, acceleration = _largest(states, RATE), _largest(states, ACCELERATION)
    usual = max(float(np.sqrt(np.mean(seen["alpha"] ** 2))) / 2.0, 0.05)  # numerical
    slow = max(rate / 6.0, 0.05)  # numerical
    first, turned = float(seen["theta"][0]), max(float(np.ptp(seen["theta"])), 1e-9)  # numerical
    scales = {"1": 1.0, "omega": rate, "omega^2": rate**2, "omega^3": rate**3, "omega^4": rate**4, "|omega|": rate}
    scales |= {"omega|omega|": rate**2, "alpha": acceleration, "|alpha|": acceleration}
    scales |= {"alpha omega": acceleration * rate, "t": float(seen["t"].max())}
    forms = [*(Form(name, scale) for name, scale in scales.items()), Form("theta", turned, first)]
    lengths, of_two = USUAL.lengths, (LOCATED.product_functions, (LOCATED.product_length,))
    curves = [
        curve_over(RATE, seen["omega"], LOCATED.rate_functions, lengths, warp=slow),
        curve_over(ACCELERATION, seen["alpha"], LOCATED.acceleration_functions, lengths, warp=usual),
        curve_over(ANGLE, seen["theta"], LOCATED.angle_functions, lengths),
        curve_over(TIME, seen["t"], LOCATED.time_functions, LOCATED.time_lengths),
        Product(
            curve_over(RATE, seen["omega"], *of_two, warp=slow),
            curve_over(ACCELERATION, seen["alpha"], *of_two, warp=usual),
        ),
        *(Revolution(f"revolution{growth}", rate) for growth in ("", " |omega|", " omega^2", " omega")),
        Memory(ACCELERATION, acceleration),
    ]
    return {one.name: one for one in (*forms, *curves, *_of_temperature(states), *_steps(states))}


def body_dependences(states: Sequence[RigState]) -> dict[str, Dependence]:
    """Return all dependences of an array on a free body, by name, on the scales of what bodies did."""
    seen = {one.name: np.concatenate([one.of(state) for state in states]) for one in (RATE, TIME)}
    rate, slow = _largest(states, RATE), max(_largest(states, RATE) / 6.0, 0.05)  # numerical
    scales = {"1": 1.0, "omega": rate, "omega^2": rate**2, "omega^4": rate**4, "t": float(seen["t"].max())}
    curves = [
        curve_over(RATE, seen["omega"], LOCATED.rate_functions, USUAL.lengths, warp=slow),
        curve_over(TIME, seen["t"], LOCATED.time_functions, LOCATED.time_lengths),
    ]
    forms = [Form(name, scale) for name, scale in scales.items()]
    others = (*vector_forms(states), *_of_temperature(states), *_steps(states))
    return {one.name: one for one in (*forms, *curves, *others)}


def _steps(states: Sequence[RigState]) -> list[Step]:
    """Return steps all over the time of the runs, but not at their ends."""
    first, last = min(float(state.t[0]) for state in states), max(float(state.t[-1]) for state in states)
    times = np.linspace(first, last, LOCATED.steps + 2)[1:-1]
    return [Step(float(at), float(times[1] - times[0])) for at in times]


def _of_temperature(states: Sequence[RigState]) -> list[Dependence]:
    if any(state.temperature is None for state in states):
        return []
    seen = np.concatenate([TEMPERATURE.of(state) for state in states])
    first, spread = float(seen[0]), float(np.ptp(seen))
    if not spread > LOCATED.warmed:
        return []
    steep = max(float(np.std(np.concatenate([WARMING.of(state) for state in states]))), 1e-9)  # numerical
    return [
        Form("T", spread, first),
        curve_over(TEMPERATURE, seen, LOCATED.temperature_functions, LOCATED.temperature_lengths),
        Form("dT/dt", steep),
        LowPassed(TEMPERATURE, first, spread),
    ]


_OF_REFERENCE = (
    *("1", "f(omega)", "f(alpha)", "f(omega, alpha)", "f(theta)", "revolution", "revolution |omega|"),
    *("revolution omega", "memory of alpha", "omega", "omega^2", "omega^3", "|omega|"),
    *("omega|omega|", "|alpha|", "alpha omega", "theta", "t", "f(t)", "T", "f(T)"),
)
_OF_RIG = (
    *("f(omega)", "f(alpha)", "f(theta)", "revolution", "revolution |omega|", "revolution omega^2", "f(t)"),
    *("omega", "omega^2", "omega^3", "|omega|", "omega|omega|", "alpha", "|alpha|", "alpha omega", "theta", "f(T)"),
)
_OF_PLACE = {
    "reads": _OF_REFERENCE,
    "late": ("1", "t", "f(t)", "f(T)"),
    "leans": ("1", *_OF_RIG, "memory of alpha"),
    "moves": ("1", *_OF_RIG, "memory of alpha"),
    "stretches": ("1", *_OF_RIG),
    "shakes": (*_OF_RIG, "memory of alpha"),
    "heaves": (*_OF_RIG, "memory of alpha"),
    "tilts": ("1", *_OF_RIG),
    "gain": ("1", *_OF_RIG, "f(omega, alpha)", "t"),
}


_STEPPED = ("reads", "late", "leans", "moves", "gain")
"""Places of the rig where something may slip or jump."""

_OF_BODY = {
    "gyro": ("omega vector", "omega products", "omega cubes", "force change", "t", "f(t)", "T", "f(T)"),
    "gyro late": ("1", "t", "f(t)", "f(T)"),
    "arms": ("1", "omega^2", "f(omega)", "f(t)", "f(T)"),
    "gain": ("1", "omega", "omega^2", "f(omega)", "t", "f(t)", "f(T)"),
}


def body_terms(every: dict[str, Dependence]) -> list[LocatedTerm]:
    """Return the terms of an array on a free body but those of its channels."""
    places = body_places()
    return [
        LocatedTerm(places[what], every[name]) for what, names in _OF_BODY.items() for name in names if name in every
    ]


def rig_terms(states: Sequence[RigState], every: dict[str, Dependence], *, is_angle: bool) -> list[LocatedTerm]:
    """Return the terms of places in the rig, but those of waves that are looked for."""
    places = rig_places(is_angle=is_angle, has_geometry=states[0].placed is not None)
    terms = [
        LocatedTerm(place, every[name])
        for what, place in places.items()
        for name in _OF_PLACE.get(what, ())
        if name in every
    ]
    steps = [one for one in every.values() if isinstance(one, Step)]
    terms += [LocatedTerm(places[what], one) for what in _STEPPED if what in places for one in steps]
    displacement, acceleration = (0,), (2,)
    followed = dict.fromkeys(("twists", "leans", "moves", "tilts"), displacement)
    for what, outputs in (followed | {"shakes": acceleration, "heaves": acceleration}).items():
        if what not in places:
            continue
        regressors = FORCES if places[what].name == "bench" else (ACCELERATION, RATE_SQUARED)
        terms += [LocatedTerm(places[what], mode) for mode in _modes(states, regressors, outputs)]
    return terms


def _modes(states: Sequence[RigState], regressors: Sequence[Regressor], outputs: tuple[int, ...]) -> list[Mode]:
    grid = np.geomspace(*LOCATED.mode_hz, LOCATED.modes)
    slow = grid[grid * states[0].period < LOCATED.fastest]
    return [Mode(one, _largest(states, one), float(hz), outputs) for one in regressors for hz in slow]


@dataclass(frozen=True)
class ChannelTerms:
    """The terms of one dependence on one kind of error of channels, whose columns they share.

    ``patterns`` holds of each the place of the contract, the pattern, the groups of channels and their names.
    """

    kind: str
    dependence: Dependence
    patterns: tuple[ChannelPattern, ...]

    def terms(self) -> list[tuple[LocatedTerm, tuple[tuple[int, ...], ...]]]:
        """Return the terms with their groups of channels."""
        return [
            (LocatedTerm(channel_place(name, self.kind, groups, labels), self.dependence, pattern), groups)
            for name, pattern, groups, labels in self.patterns
        ]


def channel_terms(
    states: Sequence[RigState], every: dict[str, Dependence], array: AccelerometerArray
) -> list[ChannelTerms]:
    """Return the terms of channels and chips."""
    chips, names = chip_groups(array), tuple(chip.name for chip in array.chips)
    several = [(chip, name) for chip, name in zip(chips, names, strict=True) if len(chip) > 1]
    of_chip: tuple[ChannelPattern, ...] = tuple(
        ("chip", "chip", tuple((c,) for c in chip), tuple(array.channels[c] for c in chip)) for chip, _ in several
    )
    alike: tuple[ChannelPattern, ...] = tuple(("chip", "chip", (chip,), (name,)) for chip, name in several)
    clocks: list[ChannelPattern] = [("clock", "chip", (one,), (name,)) for one, name in zip(chips, names, strict=True)]
    clocks += [("clock", "own", chips, names)] if len(chips) > 1 else []
    each = channel_patterns(array)
    most = max(float(np.abs(state.readings).max()) for state in states)
    readings = [OfReading(most, power) for power in (0, 2, 3)]
    others = ("memory of alpha", "revolution omega", "force change")
    offsets = [one for name, one in every.items() if name not in others]
    modes = _modes(states, (ACCELERATION, RATE_SQUARED), (2,)) if states[0].body is None else []
    gains = ("1", "f(omega)", "f(alpha)", "f(theta)", "revolution", "f(t)", "omega", "omega^2", "|omega|", "t", "f(T)")
    late = ("1", "t", "f(t)", "f(T)")
    steps = tuple(name for name, one in every.items() if isinstance(one, Step))
    return [
        *(ChannelTerms("offset", one, (*each, *of_chip)) for one in (*offsets, *readings)),
        *(ChannelTerms("gain", every[name], (*each, *of_chip, *alike)) for name in (*gains, *steps) if name in every),
        *(ChannelTerms("delay", every[name], tuple(clocks)) for name in late if name in every),
        *(ChannelTerms("offset", mode, of_chip) for mode in modes),
    ]


def chip_groups(array: AccelerometerArray) -> tuple[tuple[int, ...], ...]:
    """Return the channels of each chip."""
    return tuple(tuple(np.flatnonzero(array.chip_of_channel == chip).tolist()) for chip in range(len(array.chips)))


def channel_patterns(array: AccelerometerArray) -> tuple[ChannelPattern, ...]:
    """Return the patterns of an error of one channel, and of an error of each channel's own."""
    single = tuple((index,) for index in range(array.n_channels))
    one: list[ChannelPattern] = [("channel", "one", (group,), (array.channels[group[0]],)) for group in single]
    return (*one, ("channel", "own", single, tuple(array.channels)))
