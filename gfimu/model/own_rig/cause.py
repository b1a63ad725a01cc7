"""What may be wrong with a simulation of one's own: parameters with a prior, which the diagnosis may fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.model.own_rig.places import Pattern, Size, channel_patterns
from gfimu.model.parameter_units import RATIO
from gfimu.model.world_model import SpinState

__all__ = ["Cause", "Moment", "Parameter", "Presence", "bias_cause", "gain_cause"]

Parameter = Size
"""A parameter of a simulation that may be wrong: key, unit, and the usual size of its error."""

_BIAS = 20e-3 * STANDARD_GRAVITY  # m/s²: of MEMS chips that were not calibrated
_BIAS_LEFT = 0.3e-3 * STANDARD_GRAVITY  # m/s²: what a good calibration leaves
_GAIN, _GAIN_LEFT = 0.02, 5e-4
_LARGEST_GAIN = 0.3  # more is another unit


@dataclass(frozen=True)
class Moment:
    """When readings are taken: the motion at n times, and the time since the recording began (n,), s."""

    state: SpinState
    since_start: NDArray[np.float64]


@dataclass(frozen=True)
class Presence:
    """A cause with values: those that a simulation assumes, or those that a diagnosis found.

    Parameters
    ----------
    cause : Cause
        What it is of.
    parameters : dict
        Differences from the values of the simulation, by key; those that are left out are zero.
    """

    cause: Cause
    parameters: dict[str, Any]

    @property
    def name(self) -> str:
        """Name of the cause."""
        return self.cause.name

    @property
    def place(self) -> str:
        """Where it acts."""
        return self.cause.place

    def size_values(self, array: AccelerometerArray) -> NDArray[np.float64]:
        """Return the values in the order of the cause's parameters."""
        return np.array([float(self.parameters.get(size.key, 0.0)) for size in self.cause.sizes(array)])

    def shape_values(self) -> dict[str, float]:
        """Return no shape: such a cause has sizes only."""
        return {}


@dataclass(frozen=True)
class Cause:
    """Something that a simulation may have wrong.

    Parameters
    ----------
    name : str
        Name in verdicts and files, such as ``"arm_length"``.
    summary : str
        What is wrong, in one line.
    parameters : tuple of Parameter
        What it is described by; all zero where the simulation is right. Their keys end in the unit.
    separated_by : str
        Which run would separate it from others.
    place : str
        Where it acts: geometry, motion, timing, sensing or reference.
    of_channels : {"", "offset", "gain"}
        Whether its parameters, one per channel, are added to the readings or multiply them; the simulation is not asked
        then.
    per_run : bool
        Whether another mounting or another day has its own value.
    tolerance : float
        Standard deviation of each parameter that a good calibration leaves, in the unit of the parameters.
    rarity : float
        How many times rarer than a usual cause it is, before any data.

    Raises
    ------
    InputError
        If it has no parameters, or two of the same key.
    """

    name: str
    summary: str
    parameters: tuple[Parameter, ...]
    separated_by: str = "a run at two or more speeds in both directions"
    place: str = "geometry"
    of_channels: str = ""
    per_run: bool = False
    tolerance: float = 0.0
    rarity: float = 1.0

    inexactness = 0.0
    starts: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        keys = [parameter.key for parameter in self.parameters]
        if not keys or len(set(keys)) < len(keys):
            raise InputError(f"cause {self.name!r}: needs parameters, each with a key of its own, not {keys}")

    @property
    def of_pose(self) -> bool:
        """Whether it depends on the specific force alone."""
        return bool(self.of_channels)

    def __call__(self, parameters: Mapping[str, Any]) -> Presence:
        """Return the cause with values.

        Raises
        ------
        InputError
            For a key that it does not have.
        """
        valid = [parameter.key for parameter in self.parameters]
        unknown = [key for key in parameters if key not in valid]
        if unknown:
            raise InputError(f"cause {self.name!r}: unknown parameter {unknown[0]!r}; valid: {', '.join(valid)}")
        return Presence(self, dict(parameters))

    def sizes(self, array: AccelerometerArray) -> tuple[Size, ...]:
        """Return the parameters."""
        return self.parameters

    def parameter_units(self, array: AccelerometerArray) -> Mapping[str, str]:
        """Return the unit of each parameter."""
        return {parameter.key: parameter.unit for parameter in self.parameters}

    def patterns(self, array: AccelerometerArray) -> tuple[Pattern, ...]:
        """Return the places it can take: channels and chips of a cause of channels, one place otherwise."""
        if self.of_channels:
            return channel_patterns(array)
        return (Pattern("", np.eye(len(self.parameters))),)

    def reach(self, array: AccelerometerArray) -> NDArray[np.bool_] | None:
        """Return that each parameter of a cause of channels changes its own; None, of others any may change."""
        return np.eye(array.n_channels, dtype=bool) if self.of_channels else None

    def shapes(self, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Return no shape."""
        return ({},)

    def from_sizes(
        self, array: AccelerometerArray, values: NDArray[np.float64], shape: Mapping[str, float]
    ) -> Presence:
        """Return the cause with values in the order of its parameters."""
        return self({one.key: float(value) for one, value in zip(self.parameters, values, strict=True)})

    def on_readings(
        self, readings: NDArray[np.float64], values: NDArray[np.float64], moment: Moment
    ) -> NDArray[np.float64]:
        """Return readings (n, c) with a cause of channels in them; those of another cause as they are."""
        if not self.of_channels:
            return readings
        return readings * (1.0 + values) if self.of_channels == "gain" else readings + values

    def on_reference(
        self, reading: NDArray[np.float64], values: NDArray[np.float64], moment: Moment
    ) -> NDArray[np.float64]:
        """Return the reference as it is: the simulation itself has what changes it."""
        return reading


def bias_cause(array: AccelerometerArray, *, prior_std: float = _BIAS) -> Cause:
    """Return that each channel may have an offset; ``prior_std`` in m/s²."""
    parameters = tuple(Parameter(f"{name}_m_s2", "m/s²", prior_std, bound=STANDARD_GRAVITY) for name in array.channels)
    return Cause(
        "bias",
        "a bias: a constant offset per channel",
        parameters,
        "static poses on several sides",
        "sensing",
        "offset",
        tolerance=_BIAS_LEFT,
    )


def gain_cause(array: AccelerometerArray, *, prior_std: float = _GAIN) -> Cause:
    """Return that each channel may have another gain; ``prior_std`` relative to one."""
    parameters = tuple(Parameter(name, RATIO, prior_std, bound=_LARGEST_GAIN) for name in array.channels)
    return Cause(
        "scale_factor",
        "a scale-factor error per channel",
        parameters,
        "static poses on several sides",
        "sensing",
        "gain",
        tolerance=_GAIN_LEFT,
    )
