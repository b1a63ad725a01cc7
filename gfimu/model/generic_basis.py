"""A generic basis: smooth functions of the motion, the angle and time, as the effect ``unknown`` takes them.

Rate, acceleration and time enter in units of their largest values, so that every function is of order one.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import unknown_name
from gfimu.model.world_model import SpinState

__all__ = [
    "FUNCTIONS",
    "OF_READING",
    "UNIT_KEYS",
    "BasisUnits",
    "Motion",
    "basis_function",
    "is_of_time",
]

Function = Callable[["Motion"], NDArray[np.float64]]

_TURNING = 0.05  # rad/s
_ORDERS = (1, 2, 3, 4, 6, 8, 12)
_SLOW = 10
_STEPS = 16
UNIT_KEYS = {"rate_unit_rad_s": "rad/s", "acceleration_unit_rad_s2": "rad/s²", "duration_s": "s"}
"""Parameters of a term without a name that hold its `BasisUnits`, and their units."""

OF_READING = "reading³"
"""The one function that is another one in every channel."""


@dataclass(frozen=True)
class BasisUnits:
    """What rate (rad/s), acceleration (rad/s²) and time (s) are divided by in a generic basis; all positive."""

    rate: float
    acceleration: float
    duration: float


@dataclass(frozen=True)
class Motion:
    """Spin and time as the functions take them, each (n,): rate, acceleration and time in units, the angle in rad."""

    rate: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    angle: NDArray[np.float64]
    time: NDArray[np.float64]
    turning: NDArray[np.float64]
    units: BasisUnits

    @classmethod
    def of(cls, state: SpinState, time: NDArray[np.float64], units: BasisUnits) -> Motion:
        """Take a spin and the time since the recording began, s."""
        return cls(
            state.rate / units.rate,
            state.acceleration / units.acceleration,
            state.angle,
            time / units.duration,
            (np.abs(state.rate) > _TURNING).astype(float),
            units,
        )


def _ripple(order: int, power: int, phase: float, motion: Motion) -> NDArray[np.float64]:
    envelope = motion.rate**power if power else motion.turning
    return np.asarray(np.cos(order * motion.angle - phase) * envelope)


def _slow_wave(mode: int, motion: Motion) -> NDArray[np.float64]:
    return np.cos(np.pi * mode * motion.time)


def _step(share: float, motion: Motion) -> NDArray[np.float64]:
    return np.where(motion.time > share, 0.5, -0.5)


def _tone(turns: float, phase: float, motion: Motion) -> NDArray[np.float64]:
    return np.asarray(np.cos(turns * motion.time * motion.units.duration - phase))


def _ripples(orders: tuple[int, ...]) -> dict[str, Function]:
    return {
        f"{order} per revolution{times} ({wave})": partial(_ripple, order, power, phase)
        for order in orders
        for wave, phase in (("sine", np.pi / 2), ("cosine", 0.0))
        for power, times in enumerate(("", " × rate", " × rate²"))
    }


def _functions() -> dict[str, Function]:
    functions: dict[str, Function] = {
        "rate": lambda m: m.rate,
        "rate²": lambda m: m.rate**2,
        "rate³": lambda m: m.rate**3,
        "rate⁴": lambda m: m.rate**4,
        "|rate|": lambda m: np.abs(m.rate),
        "sign of rate": lambda m: np.sign(m.rate) * m.turning,
        "angular acceleration": lambda m: m.acceleration,
        "acceleration²": lambda m: m.acceleration**2,
        "|acceleration|": lambda m: np.abs(m.acceleration),
        "rate × acceleration": lambda m: m.rate * m.acceleration,
        "rate² × acceleration": lambda m: m.rate**2 * m.acceleration,
        "time × rate²": lambda m: m.time * m.rate**2,
        "time × acceleration": lambda m: m.time * m.acceleration,
        "turning": lambda m: m.turning,
        "rate⁶": lambda m: m.rate**6,
    }
    functions |= _ripples(_ORDERS)
    for mode in range(1, _SLOW + 1):
        functions[f"slow time ({mode} half-waves)"] = partial(_slow_wave, mode)
    for step in range(1, _STEPS):
        functions[f"step at {step / _STEPS:.0%} of the run"] = partial(_step, step / _STEPS)
    return functions


FUNCTIONS: Mapping[str, Function] = _functions()
"""The functions by name."""

_FAMILIES = (
    *("N per revolution (sine)", "N per revolution × rate (cosine)", "N per revolution × rate² (sine)"),
    *("slow time (N half-waves)", "step at N% of the run", "step at X s", "tone at X Hz (cosine)"),
)
_TONE_NAME = re.compile(r"tone at (\d+(?:\.\d+)?) Hz \((sine|cosine)\)")
_RIPPLE_NAME = re.compile(r"(\d{1,3}) per revolution(?: × rate²?)? \((?:sine|cosine)\)")
_STEP_NAME = re.compile(r"step at (\d+(?:\.\d+)?) s")


def is_of_time(name: str) -> bool:
    """Whether a function looks at the clock: what belongs to one recording and to no other."""
    return "time" in name or name.startswith(("step", "tone"))


def basis_function(name: str) -> Function:
    """Return a function by name: of `FUNCTIONS`, a constant, a tone or a step at a time.

    Raises
    ------
    InputError
        If no function has this name; the message lists those that are there.
    """
    if name == "constant":
        return lambda m: np.ones_like(m.rate)
    if found := _TONE_NAME.fullmatch(name):
        return partial(_tone, 2 * np.pi * float(found[1]), np.pi / 2 * (found[2] == "sine"))
    if found := _STEP_NAME.fullmatch(name):
        at = float(found[1])
        return lambda m: np.where(m.time * m.units.duration > at, 0.5, -0.5)
    if found := _RIPPLE_NAME.fullmatch(name):
        return _ripples((int(found[1]),))[name]
    if name not in FUNCTIONS:
        single = [one for one in FUNCTIONS if not re.search(r"\d+ per rev|slow time|step at", one)]
        raise unknown_name("dependence", name, [*single, *_FAMILIES, "constant", OF_READING])
    return FUNCTIONS[name]
