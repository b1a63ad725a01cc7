"""The fixed lists of the benchmark: sets, splits and cases. A change of anything here is a new release.

Names of effects stand here as text, so that a library that grows does not change the release.
"""

from __future__ import annotations

import functools
import hashlib
import itertools
import lzma
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError, check_name

__all__ = [
    "MEASURED",
    "RELEASE",
    "SETS",
    "SPLITS",
    "TRUTH_FILE",
    "Case",
    "SetInfo",
    "cases",
    "chosen_cases",
    "find_case",
    "release_hash",
]

RELEASE = "gfimu-bench-1"
"""Name of the release; answers carry it."""

TRUTH_FILE = Path(__file__).with_name(f"{RELEASE}.jsonl.xz")
"""What the release says of its worlds (`sim.trials.benchmark.truth_file`)."""

MEASURED = "measured"
"""Generator of the worlds that are not drawn but measured."""

SPLITS = ("dev", "test")
"""Worlds to develop on, and worlds for the published table, of other seeds."""


@dataclass(frozen=True)
class SetInfo(Declared):
    """A set of worlds."""

    name: Annotated[str, figure("Its name.", head="set")]
    about: Annotated[str, figure("What its worlds are.", head="worlds")]
    licence: Annotated[str, figure("Licence of its recordings.", head="licence")]

    @property
    def dev(self) -> Annotated[int, figure("Worlds to develop on.", head="dev")]:
        """Worlds to develop on."""
        return len(cases(self.name, "dev"))

    @property
    def test(self) -> Annotated[int, figure("Worlds of the published table.", head="test")]:
        """Worlds of the published table."""
        return len(cases(self.name, "test"))


SETS: dict[str, SetInfo] = {
    one.name: one
    for one in (
        SetInfo("own", "effects of the library in worlds of the twin's own equations: one, two or none hidden", "MIT"),
        SetInfo("independent", "the same effects from a generator that shares no code with the twin", "MIT"),
        SetInfo("unlisted", "effects that the library lacks, from that generator", "MIT"),
        SetInfo("dcmotor", "effects of the library on a table turned by MuJoCo's dcmotor actuator", "MIT"),
        SetInfo(
            "real",
            "measured data, read from --data DIR: MIMU4444 boards",
            "MIT, © 2021 Håkan Carlsson; not part of gfimu",
        ),
    )
}
"""Sets by name."""

_LIBRARY = (
    *("bias", "scale_factor", "misalignment", "sensor_position", "eccentricity", "mount_tilt", "table_tilt"),
    *("axis_wobble", "gravity", "cogging", "resonance", "centrifugal_flex", "sensor_lag", "channel_skew"),
    *("clock_error", "tacho_latency", "tacho_scale", "bias_temperature", "warm_up", "bias_random_walk"),
    *("quadratic", "cross_axis", "hysteresis", "interference_tone", "gain_drift", "vibration_rectification"),
    *("tacho_ripple", "noise", "saturation", "coarse_resolution", "wrong_range", "axis_swap", "sign_flip"),
    *("stuck_channel", "dropped_frames"),
)
SIZELESS = frozenset(
    {
        *("bias_random_walk", "noise", "saturation", "coarse_resolution", "wrong_range", "axis_swap", "sign_flip"),
        *("stuck_channel", "dropped_frames"),
    }
)
"""Effects without a continuous size; the generators draw what occurs in practice."""

_ON_A_MOTOR = (
    *("bias", "scale_factor", "misalignment", "sensor_position", "eccentricity", "mount_tilt", "table_tilt"),
    *("axis_wobble", "gravity", "sensor_lag", "channel_skew", "clock_error", "tacho_latency", "tacho_scale"),
    *("bias_temperature", "warm_up", "quadratic", "cross_axis", "hysteresis", "tacho_ripple"),
)
_EXOTIC = (
    *("stick_slip", "cubic_channel", "tone_on_one_channel", "bias_jump", "square_wave", "magnetic_pickup"),
    "backlash",
)
_FOREIGN = (
    *("bearing_friction", "bench_sway", "sinking_bench", "floor_vibration", "footsteps", "bearing_shake"),
    *("lean_with_rate", "lean_with_turns", "rocking_foot", "stretch_in_plane", "loose_chip", "cubic_channels"),
    *("chip_crosstalk", "supply_sag", "slip_ring", "torque_offsets", "rate_offsets", "lagged_temperature"),
    *("temperature_gradient", "warm_start", "turn_on_bias", "chip_lag", "tacho_cubic", "tacho_asymmetry"),
    *("tacho_offset", "tacho_dead_band", "tacho_low_pass", "tacho_disc", "tacho_gate", "free_running_chips"),
    *("late_chip", "warming_clock", "late_from_then", "stamp_jitter", "burst_reads", "gear_teeth", "rate_noise"),
)

_FIRST_SEED = {"dev": 4_100_000, "test": 5_100_000}
_STRIDE = 100_000  # seeds between the sets
_NOISE = (0.05, 0.15, 0.5)  # rms of 1/f noise in turn, thousandths of standard gravity


@dataclass(frozen=True)
class Case:
    """One world of the release.

    Parameters
    ----------
    set_name, split : str
        Where it belongs.
    number : int
        Its number there.
    generator : str
        ``campaign``, ``table``, ``programmed``, ``foreign``, ``dcmotor`` or ``measured``.
    effects : tuple of str
        What is hidden.
    size : float
        d′ of each hidden effect that has a size; 0 where none has.
    bias_instability_mg : float
        Rms of the 1/f noise of a channel, thousandths of standard gravity.
    duration, sample_rate : float
        Length, s, and samples per second, Hz.
    tacho_noise : float
        White noise of the tachometer, rad/s.
    """

    set_name: str
    split: str
    number: int
    generator: str
    effects: tuple[str, ...] = ()
    size: float = 0.0
    bias_instability_mg: float = 0.15
    duration: float = 40.0
    sample_rate: float = 100.0
    tacho_noise: float = 0.02

    @property
    def world(self) -> str:
        """Name of the world."""
        return f"{self.set_name}/{self.split}/{self.number:03d}"

    def seed(self, attempt: int = 0) -> int:
        """Return the seed of a draw; further attempts replace draws in which what is hidden can't be seen."""
        return _FIRST_SEED[self.split] + _STRIDE * list(SETS).index(self.set_name) + self.number + 1000 * attempt


def _made(set_name: str, split: str, generators: Iterable[str], hidden: Iterable[tuple[str, ...]]) -> list[Case]:
    """Return cases with drawn sizes, in a fixed shuffled order, so that the first few are a fair sample."""
    rng = np.random.default_rng([1, list(SETS).index(set_name), SPLITS.index(split)])
    listed = list(zip(hidden, itertools.cycle(generators), strict=False))
    found = []
    for index, place in enumerate(rng.permutation(len(listed))):
        effects, generator = listed[place]
        low, high = (150.0, 1500.0) if set_name == "unlisted" else (30.0, 3000.0)
        size = float(np.exp(rng.uniform(np.log(low), np.log(high))))
        sized = bool(effects) and not set(effects) <= SIZELESS
        found.append(
            Case(set_name, split, index, generator, effects, size if sized else 0.0, _NOISE[index % len(_NOISE)])
        )
    return found


def _drawn(set_name: str, split: str, names: Iterable[str], counts: Mapping[int, int]) -> list[tuple[str, ...]]:
    """Return what is hidden: so many worlds with that many effects each, single ones without repetition."""
    rng = np.random.default_rng([2, list(SETS).index(set_name), SPLITS.index(split)])
    listed = list(names)
    order = [str(name) for name in rng.permutation(listed)]
    hidden: list[tuple[str, ...]] = [(name,) for name in order[: counts.get(1, 0)]]
    hidden += [tuple(map(str, rng.choice(listed, 2, replace=False))) for _ in range(counts.get(2, 0))]
    return hidden + [()] * counts.get(0, 0)


def _unlisted(split: str) -> list[Case]:
    """Return unlisted effects; no effect is in both splits."""
    names = [str(name) for name in np.random.default_rng(3).permutation([*_EXOTIC, *_FOREIGN])]
    mine = names[SPLITS.index(split) :: len(SPLITS)][:16]
    found = _made("unlisted", split, ["foreign"], [(name,) for name in mine])
    return [Case(**{**vars(one), "generator": "table" if one.effects[0] in _EXOTIC else "foreign"}) for one in found]


@functools.cache
def cases(set_name: str, split: str) -> tuple[Case, ...]:
    """Return the worlds of a set and split; recordings of ``real`` are read from a folder (`.benchmark.real`).

    Raises
    ------
    InputError
        If there is no such set or split.
    """
    check_name("set", set_name, SETS)
    check_name("split", split, SPLITS)
    if set_name == "own":
        made = _made("own", split, ["campaign"], _drawn("own", split, _LIBRARY, {1: 35, 2: 12, 0: 13}))
    elif set_name == "independent":
        hidden = _drawn("independent", split, _LIBRARY, {1: 24, 2: 8, 0: 8})
        made = _made("independent", split, ["table", "programmed"], hidden)
    elif set_name == "unlisted":
        made = _unlisted(split)
    elif set_name == "dcmotor":
        made = _made("dcmotor", split, ["dcmotor"], _drawn("dcmotor", split, _ON_A_MOTOR, {1: 9, 0: 3}))
    else:
        made = [Case("real", split, index, MEASURED) for index in range(2 if split == "test" else 0)]
    return tuple(made)


def chosen_cases(sets: Iterable[str], split: str, limit: int | None = None) -> list[Case]:
    """Return the worlds of some sets, at most so many of each; of all sets that are drawn where none is named."""
    drawn = (name for name in SETS if name != "real")
    return [case for name in dict.fromkeys(sets) or drawn for case in cases(name, split)[:limit]]


def find_case(world: str) -> Case:
    """Return the case of a world's name, such as ``own/test/007``.

    Raises
    ------
    InputError
        If the release has no such world.
    """
    parts: list[Any] = world.split("/")
    if len(parts) == 3 and parts[0] in SETS and parts[1] in SPLITS:
        for case in cases(parts[0], parts[1]):
            if case.world == world:
                return case
    raise InputError(f"{RELEASE} has no world {world!r}; names are like own/test/007 (gfimu benchmark list)")


def release_hash() -> str:
    """Return the hash of the release: of its truth, which holds the hash of each recording."""
    return hashlib.sha256(lzma.decompress(TRUTH_FILE.read_bytes())).hexdigest()[:16]
