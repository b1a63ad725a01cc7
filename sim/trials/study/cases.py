"""The cases of a study: which effects are hidden, how large, in what measurement, drawn from which seed."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from gfimu.base.errors import InputError, check_name
from sim.effects import BODY_EFFECTS, EFFECTS, NOT_OF_AN_ENCODER

__all__ = ["BODY_PARTS", "EXOTICS", "STUDIES", "Case", "find_case", "study_cases"]

SIZES = (15.0, 60.0, 300.0, 1500.0, 6000.0)
"""Sizes as d′: from just detectable to gross."""

_FAINT_SIZES = (8.0, 10.0, 12.0, 7.0, 9.0, 11.0, 13.0, 14.0, 16.0, 18.0, 20.0, 22.0)

SIZELESS = tuple(name for name, family in EFFECTS.items() if family.place in {"data", "noise"})
"""Effects without a continuous size; the generators draw what occurs in practice."""

EXOTICS = (
    "stick_slip",
    "cubic_channel",
    "tone_on_one_channel",
    "bias_jump",
    "square_wave",
    "magnetic_pickup",
    "backlash",
)
"""Effects outside the library, known to the independent generator only."""

BODY_PARTS = {"mimu4444": "mpu9150", "cube12": "adxl345"}
"""Arrays that are thrown about as free bodies, and the part of their chips."""

_TAKEN_OUT = (
    "table_tilt",
    "axis_wobble",
    "channel_skew",
    "cogging",
    "clock_error",
    "hysteresis",
    "interference_tone",
    "vibration_rectification",
    "cross_axis",
    "gain_drift",
    "warm_up",
    "bias_temperature",
    "sensor_position",
    "misalignment",
    "scale_factor",
    "tacho_ripple",
    "eccentricity",
    "mount_tilt",
    "gravity",
    "tacho_scale",
    "centrifugal_flex",
    "tacho_latency",
)


@dataclass(frozen=True)
class Case:
    """One hidden world and its measurement.

    Parameters
    ----------
    study : str
        Name of the study it belongs to.
    seed : int
        Seed of everything that is drawn for it.
    effects : tuple of str
        Contract names of what is hidden (or an exotic effect's name).
    size : float
        Size of each, as d′ = √Σ(Δ/σ)².
    duration, sample_rate : float
        Length, s, and samples per second, Hz.
    bias_instability_mg : float
        Rms of the 1/f noise of a channel, thousandths of standard gravity.
    tacho_noise : float
        White noise of the tachometer, rad/s.
    array : str
        Name of the array.
    residue : bool
        Whether the nominal twin carries the residue of a calibration.
    without : str
        Effect taken out of the library, if any.
    encoder_counts : int
        Counts per revolution of an encoder that drives the twin instead of the tachometer; 0: none.
    body : bool
        Whether the array is a free body with a gyro instead of a rig on a table.
    """

    study: str
    seed: int
    effects: tuple[str, ...] = ()
    size: float = 0.0
    duration: float = 40.0
    sample_rate: float = 100.0
    bias_instability_mg: float = 0.15
    tacho_noise: float = 0.02
    array: str = "cube12"
    residue: bool = False
    without: str = ""
    encoder_counts: int = 0
    body: bool = False

    @property
    def key(self) -> str:
        """Name of the case within a file of outcomes."""
        return f"{self.study}/{self.seed}"

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form."""
        return {**asdict(self), "effects": list(self.effects)}


def _noise_of(number: int) -> dict[str, Any]:
    """Return one of three noise levels in turn; the diagnosis is given none of them."""
    level = ((0.05, 0.02), (0.15, 0.02), (0.5, 0.02))[number % 3]
    return {"bias_instability_mg": level[0], "tacho_noise": level[1]}


def _singles() -> list[Case]:
    pairs = [(name, size) for name in EFFECTS if name not in SIZELESS for size in SIZES]
    pairs += [(name, 0.0) for name in SIZELESS for _ in SIZES]
    return [
        Case("singles", 10_000 + index, (name,), size, **_noise_of(index // 5 + index))
        for index, (name, size) in enumerate(itertools.chain(pairs, pairs))
    ]


def _fresh_singles() -> list[Case]:
    """Return single effects of any size in runs of 40 to 60 s: seeds on which nothing was developed."""
    rng = np.random.default_rng(95_000)
    cases = []
    for index in range(140):
        name = list(EFFECTS)[index % len(EFFECTS)]
        size = float(np.exp(rng.uniform(np.log(SIZES[0]), np.log(SIZES[-1]))))
        duration = float(rng.choice([40.0, 50.0, 60.0]))
        noise = _noise_of(index // len(EFFECTS) + index)
        hidden = 0.0 if name in SIZELESS else size
        cases.append(Case("fresh_singles", 95_000 + index, (name,), hidden, duration=duration, **noise))
    return cases


def _faint() -> list[Case]:
    """Return sizes about the least that can be seen, where what is said is less certain."""
    names = [name for name in EFFECTS if name not in SIZELESS]
    return [
        Case("faint", 15_000 + index, (name,), size, **_noise_of(index))
        for index, (size, name) in enumerate(itertools.product(_FAINT_SIZES, names))
    ]


def _fresh_faint() -> list[Case]:
    """Return sizes from hardly to plainly seen: seeds on which nothing was developed, for the stated probabilities."""
    rng = np.random.default_rng(96_000)
    names = [name for name in EFFECTS if name not in SIZELESS]
    sizes = np.exp(rng.uniform(np.log(8.0), np.log(30.0), 1120))
    return [
        Case(
            "fresh_faint",
            96_000 + index,
            (names[index % len(names)],),
            float(size),
            **_noise_of(index // 3 + index),
        )
        for index, size in enumerate(sizes)
    ]


def _coarse_steps() -> list[Case]:
    """Return readings in coarse steps under the strongest bias instability, which passes for offsets there."""
    return [
        Case(
            "coarse_steps",
            993_000 + index,
            ("coarse_resolution",),
            duration=(40.0, 50.0, 60.0)[index % 3],
            bias_instability_mg=0.5,
        )
        for index in range(36)
    ]


def _other_settings() -> list[Case]:
    """Return single effects at lengths, rates and noise levels that are drawn.

    Seeds on which nothing was developed but the reading of temperatures between steps (995025).
    """
    cases = []
    for first, count in ((995_000, 60), (996_000, 40)):
        rng = np.random.default_rng(first)
        for index in range(count):
            name = list(EFFECTS)[int(rng.integers(len(EFFECTS)))]
            cases.append(_at_other_settings("other_settings", first + index, (name,), rng))
    return cases


def _other_pairs() -> list[Case]:
    """Return two effects at such settings.

    Nothing was developed on their seeds but what is tried in place of a cause (872024), and a walk beside a slow cause
    (872020).
    """
    rng = np.random.default_rng(872_000)
    drawn = ((tuple(str(name) for name in rng.choice(list(EFFECTS), 2, replace=False))) for _ in range(50))
    return [_at_other_settings("other_pairs", 872_000 + index, names, rng) for index, names in enumerate(drawn)]


def _other_nulls() -> list[Case]:
    """Return runs with nothing hidden at such settings."""
    rng = np.random.default_rng(871_000)
    return [_at_other_settings("other_nulls", 871_000 + index, (), rng) for index in range(60)]


def _at_other_settings(study: str, seed: int, effects: tuple[str, ...], rng: np.random.Generator) -> Case:
    size = float(np.exp(rng.uniform(np.log(60.0), np.log(3000.0))))
    rate = float(rng.choice([25.0, 50.0, 100.0, 200.0, 400.0]))
    length = float(rng.choice([20.0, 30.0, 60.0, 90.0] if rate <= 100.0 else [15.0, 25.0, 40.0]))
    bias_instability = float(np.exp(rng.uniform(np.log(0.03), np.log(0.8))))
    noise = float(np.exp(rng.uniform(np.log(0.003), np.log(0.1))))
    sized = effects and (len(effects) > 1 or effects[0] not in SIZELESS)
    return Case(study, seed, effects, size if sized else 0.0, length, rate, bias_instability, noise)


def _nulls() -> list[Case]:
    return [
        Case("nulls", 20_000 + 1000 * level + index, **_noise_of(level)) for index in range(200) for level in range(3)
    ]


def _long_nulls() -> list[Case]:
    """Return long runs with nothing hidden: bias instability over minutes looks like a drift."""
    return [Case("long_nulls", 69_000 + index, duration=600.0, **_noise_of(index)) for index in range(24)]


def _threshold_nulls() -> list[Case]:
    """Return runs on which the thresholds may be chosen; the figures come from ``nulls`` alone."""
    return [
        Case("threshold_nulls", 25_000 + 1000 * level + index, **_noise_of(level))
        for index in range(100)
        for level in range(3)
    ]


def _drawn_sets(study: str, first_seed: int, count: int, members: int) -> list[Case]:
    rng = np.random.default_rng(first_seed)
    names = list(EFFECTS)
    cases = []
    for index in range(count):
        drawn = tuple(str(name) for name in rng.choice(names, size=members, replace=False))
        size = float(np.exp(rng.uniform(np.log(60.0), np.log(1500.0))))
        cases.append(Case(study, first_seed + index, drawn, size, **_noise_of(index)))
    return cases


def _residue() -> list[Case]:
    cases = [Case("residue", 50_000 + index, residue=True, **_noise_of(index)) for index in range(30)]
    names = [name for name in EFFECTS if name not in SIZELESS]
    return cases + [
        Case("residue", 50_100 + number, (name,), size, residue=True, **_noise_of(number))
        for number, (size, name) in enumerate(itertools.product((300.0, 1500.0, 6000.0), names))
    ]


def _elsewhere(study: str, first_seed: int, settings: Mapping[str, Any], count: int = 24) -> list[Case]:
    """Return cases away from the usual run: a third with nothing hidden, the rest with one effect."""
    rng = np.random.default_rng(first_seed)
    left_out = NOT_OF_AN_ENCODER if "encoder_counts" in settings else {}
    library = [name for name in EFFECTS if name not in left_out]
    order = [str(name) for name in rng.permutation(library)]
    cases = []
    for index in range(count):
        hidden = () if index % 3 == 0 else (order[index % len(order)],)
        size = float(rng.choice([60.0, 300.0, 1500.0])) if hidden and hidden[0] not in SIZELESS else 0.0
        cases.append(Case(study, first_seed + index, hidden, size, **{**_noise_of(index), **settings}))
    return cases


def _left_out() -> list[Case]:
    return [
        Case("left_out", 80_000 + index, (name,), size, without=name, **_noise_of(index))
        for index, (size, name) in enumerate(itertools.product((60.0, 200.0, 1000.0), _TAKEN_OUT))
    ]


def _exotics() -> list[Case]:
    return [
        Case("exotics", 90_000 + index, (name,), size, **_noise_of(index))
        for index, (size, _, name) in enumerate(itertools.product((60.0, 200.0, 1000.0), range(2), EXOTICS))
    ]


_BODY_HIDDEN = tuple(
    name
    for name in BODY_EFFECTS
    # Temperature is constant in a tumble; noise, rounding, clipping and lost frames are the same as on a table.
    if name not in {"bias_temperature", "noise", "coarse_resolution", "saturation", "stuck_channel", "dropped_frames"}
)


def _free_body() -> list[Case]:
    """Return free bodies with a gyro: in turn nothing hidden, and every effect once at each of two sizes."""
    cases = []
    hidden = [(name, size) for size in (300.0, 1500.0) for name in _BODY_HIDDEN]
    for index in range(len(hidden) * 3 // 2):
        pair, step = divmod(index, 3)
        setting = {"array": list(BODY_PARTS)[index % 2], "body": True, "duration": 20.0, **_noise_of(index)}
        if step == 0:
            cases.append(Case("free_body", 85_000 + index, **setting))
            continue
        name, size = hidden[2 * pair + step - 1]
        sized = name not in SIZELESS
        cases.append(Case("free_body", 85_000 + index, (name,), size if sized else 0.0, **setting))
    return cases


STUDIES: dict[str, Callable[[], list[Case]]] = {
    "singles": _singles,
    "fresh_singles": _fresh_singles,
    "faint": _faint,
    "fresh_faint": _fresh_faint,
    "coarse_steps": _coarse_steps,
    "other_settings": _other_settings,
    "other_pairs": _other_pairs,
    "other_nulls": _other_nulls,
    "nulls": _nulls,
    "long_nulls": _long_nulls,
    "threshold_nulls": _threshold_nulls,
    "pairs": lambda: _drawn_sets("pairs", 30_000, 120, 2),
    "triples": lambda: _drawn_sets("triples", 40_000, 60, 3),
    "residue": _residue,
    "short_runs": lambda: _elsewhere("short_runs", 60_000, {"duration": 20.0}),
    "long_runs": lambda: _elsewhere("long_runs", 61_000, {"duration": 600.0}, 12),
    "slow_samples": lambda: _elsewhere("slow_samples", 62_000, {"sample_rate": 25.0}),
    "fast_samples": lambda: _elsewhere("fast_samples", 63_000, {"sample_rate": 800.0}, 12),
    "corners8": lambda: _elsewhere("corners8", 64_000, {"array": "corners8"}),
    "three_plus_one": lambda: _elsewhere("three_plus_one", 65_000, {"array": "p3_three_plus_one"}),
    "noisy_tacho": lambda: _elsewhere("noisy_tacho", 66_000, {"tacho_noise": 0.05}),
    "encoders": lambda: _elsewhere("encoders", 67_000, {"encoder_counts": 4096}),
    "coarse_encoders": lambda: _elsewhere("coarse_encoders", 68_000, {"encoder_counts": 360}),
    "left_out": _left_out,
    "exotics": _exotics,
    "free_body": _free_body,
}
"""Every study by name; each call returns the same cases."""


def study_cases(name: str, first: int | None = None) -> list[Case]:
    """Return the cases of a study in a fixed shuffled order, so that its first few are already a fair sample.

    Raises
    ------
    InputError
        If there is no such study.
    """
    check_name("study", name, STUDIES)
    cases = STUDIES[name]()
    order = np.random.default_rng(len(cases)).permutation(len(cases))
    return [cases[place] for place in order[:first]]


def find_case(key: str) -> Case:
    """Return the case of a key ``STUDY/SEED``.

    Raises
    ------
    InputError
        If no study has it.
    """
    study = key.partition("/")[0]
    found = _by_key(study).get(key) if study in STUDIES else None
    if found is None:
        raise InputError(f"no study has the case {key!r}")
    return found


@functools.cache
def _by_key(study: str) -> Mapping[str, Case]:
    return {case.key: case for case in STUDIES[study]()}
