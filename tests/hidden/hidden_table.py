"""The hidden effects: one row per recording, with what a diagnosis by the whole library must say of it.

A row hides ``effects`` in a world of a generator and a seed. The diagnosis must name these effects and no others, each
size within three of its standard deviations (`hidden_check.problems`). Where the data can't tell an effect from others,
``or_else`` lists those and ``why`` gives the reason. Seeds are taken in order within each group.

Generators: ``campaign`` is the project's own simulation; ``independent`` shares no code with it; ``programmed`` is the
independent one under commands as people program them (stairs, swings); ``foreign`` hides in it what no library has;
``body`` throws a free body with a gyro.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sim.effects import EFFECTS
from sim.trials.benchmark.generators.foreign_effects import FOREIGN
from sim.trials.benchmark.generators.independent_effects import EXOTICS
from sim.trials.study.cases import Case

GENERATORS = Path(__file__).resolve().parents[2] / "sim" / "trials" / "benchmark" / "generators"
SOURCES = {
    "campaign": "",
    "body": "",
    "independent": f"{GENERATORS / 'independent_world.py'}:hide",
    "programmed": f"{GENERATORS / 'independent_profiles.py'}:hide",
    "foreign": f"{GENERATORS / 'foreign_world.py'}:hide",
}
"""Function that draws a world, by the generator's name; empty: `sim.trials.study.outcome.draw_world` itself."""


@dataclass(frozen=True)
class Hidden:
    """One recording and the answer that is right.

    Parameters
    ----------
    effects : str
        Names of what is hidden, joined by ``+``; empty: nothing.
    generator : str
        Key of `SOURCES`.
    seed : int
        Seed of motion, place, shape and noise.
    size : float
        Size d′ of each effect over all samples, the motion known; no meaning for faults of the digital samples.
    seconds : float
        Length of the recording.
    or_else : str
        Further names, separated by spaces, in a set that these data can't separate. For what no library holds: the
        places, as ``verdict.json`` has them, or the name that is right.
    why : str
        Why the data can't tell them apart, or why the row departs from the others.
    setting : mapping
        Further fields of `sim.trials.study.cases.Case`.
    """

    effects: str
    generator: str
    seed: int
    size: float = 300.0
    seconds: float = 12.0
    or_else: str = ""
    why: str = ""
    setting: Mapping[str, Any] = field(default_factory=dict, hash=False)

    @property
    def names(self) -> frozenset[str]:
        """Names of what is hidden."""
        return frozenset(self.effects.split("+")) - {""}

    @property
    def outside(self) -> bool:
        """Whether the library lacks what is hidden."""
        return bool(self.names & (EXOTICS.keys() | FOREIGN.keys())) or "without" in self.setting

    @property
    def case(self) -> Case:
        """The case that `sim.trials.study.outcome.draw_world` draws."""
        names = tuple(name for name in self.effects.split("+") if name)
        size = self.size if names else 0.0
        body = self.generator == "body"
        return Case("hidden", self.seed, names, size, duration=self.seconds, body=body, **self.setting)

    def __str__(self) -> str:
        return f"{self.effects or 'nothing'}-{self.generator}-{self.seed}-{self.seconds:g}s"


CONSTANT = "gravity is all that this channel sees in an upright run: an offset, a gain and a curvature read alike"
PLACE = "its place is what a diagnosis can say of what has no name"

ONCE = [
    Hidden("bias", "campaign", 1),
    Hidden("scale_factor", "campaign", 2),
    Hidden("misalignment", "campaign", 3),
    Hidden("sensor_position", "campaign", 4),
    Hidden("eccentricity", "campaign", 5),
    Hidden("mount_tilt", "campaign", 6),
    Hidden("table_tilt", "campaign", 7),
    Hidden("axis_wobble", "campaign", 8),
    Hidden("gravity", "campaign", 9),
    Hidden("cogging", "campaign", 10),
    # The campaign's motion is too smooth for a mode: the independent generator's row of it, below, is the only one.
    Hidden("centrifugal_flex", "campaign", 12, seconds=16.0),
    Hidden("sensor_lag", "campaign", 13),
    Hidden("channel_skew", "campaign", 14),
    Hidden("clock_error", "campaign", 15),
    Hidden("tacho_latency", "campaign", 16),
    Hidden("tacho_scale", "campaign", 17),
    Hidden("bias_temperature", "campaign", 18),
    Hidden("warm_up", "campaign", 19),
    Hidden("bias_random_walk", "campaign", 20),
    Hidden("quadratic", "campaign", 21, or_else="bias scale_factor", why=CONSTANT),
    Hidden("cross_axis", "campaign", 22),
    Hidden("hysteresis", "campaign", 23),
    Hidden("interference_tone", "campaign", 24),
    Hidden("gain_drift", "campaign", 25),
    Hidden("vibration_rectification", "campaign", 26, seconds=16.0),
    Hidden("tacho_ripple", "campaign", 27),
    Hidden("noise", "campaign", 28),
    Hidden("saturation", "campaign", 29),
    Hidden("coarse_resolution", "campaign", 30),
    Hidden("wrong_range", "campaign", 31),
    Hidden("axis_swap", "campaign", 32),
    Hidden("sign_flip", "campaign", 33),
    Hidden("stuck_channel", "campaign", 34),
    Hidden("dropped_frames", "campaign", 35),
]
"""Every effect of the library once."""

MECHANICAL = [
    Hidden("misalignment", "independent", 101),
    Hidden("sensor_position", "independent", 102),
    Hidden("eccentricity", "independent", 103),
    Hidden("mount_tilt", "independent", 104),
    Hidden("table_tilt", "independent", 105),
    Hidden("axis_wobble", "independent", 106),
    Hidden("gravity", "independent", 107),
    Hidden(
        "cogging", "independent", 108, seconds=8.0, why="over 12 s the speed loop takes this ripple out of the motion"
    ),
    Hidden("centrifugal_flex", "independent", 109),
    Hidden("resonance", "independent", 111, seconds=8.0, why="seed 110 draws a mode that the motion hardly excites"),
]
"""Every effect of geometry and motion once more, in worlds of MuJoCo that share no code with the project."""

PAIRS = [
    Hidden("table_tilt+clock_error", "campaign", 201),
    Hidden("eccentricity+scale_factor", "independent", 202),
    Hidden("mount_tilt+noise", "campaign", 203),
    Hidden("tacho_latency+misalignment", "independent", 204),
    Hidden("wrong_range+channel_skew", "campaign", 205),
    Hidden("hysteresis+table_tilt", "independent", 206),
]
"""Two effects at once."""

NULLS = [
    Hidden("", "campaign", 301),
    Hidden("", "independent", 302),
    Hidden("", "programmed", 303),
    Hidden("", "campaign", 304, setting={"bias_instability_mg": 0.5, "sample_rate": 50.0}),
    Hidden("", "independent", 305, seconds=20.0, setting={"tacho_noise": 0.05, "sample_rate": 25.0}),
    Hidden("", "campaign", 306, setting={"encoder_counts": 4096}),
]
"""Nothing hidden: weak and strong bias instability, slow samples, a noisy tachometer, an encoder."""

OUTSIDE = [
    Hidden("tone_on_one_channel", "independent", 403, 600.0, 8.0, or_else="channel", why=PLACE),
    Hidden("bias_jump", "independent", 404, 600.0, 8.0, or_else="channel", why=PLACE),
    Hidden("lean_with_rate", "foreign", 411, 500.0, or_else="array", why=PLACE),
    Hidden("tacho_asymmetry", "foreign", 413, 500.0, or_else="reference", why=PLACE),
    Hidden("rate_offsets", "foreign", 414, 500.0, or_else="channel", why=PLACE),
    Hidden("late_chip", "foreign", 415, 500.0, or_else="chip_delay clock", why=PLACE),
]
"""What has no name in the contract: its place, and no other name."""

BODIES = [
    Hidden("sensor_position", "body", 501, seconds=8.0),
    Hidden("gyro_scale", "body", 502, seconds=8.0),
    Hidden("chip_delay", "body", 503, seconds=8.0),
]
"""Free bodies: a tumble, its motion known by a gyro only."""

TABLE = {"once": ONCE, "mechanical": MECHANICAL, "pair": PAIRS, "null": NULLS, "outside": OUTSIDE, "body": BODIES}
ROWS = [row for rows in TABLE.values() for row in rows]


def row_of(effect: str) -> Hidden:
    """Return the row that hides one effect of the library alone."""
    return next(row for row in (*ONCE, *MECHANICAL) if row.names == {effect})


MECHANICAL_NAMES = tuple(name for name, family in EFFECTS.items() if family.place in {"geometry", "motion"})
"""Effects of mounting, structure and table dynamics."""
