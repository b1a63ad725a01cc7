"""The proposal of an experiment: in numbers, in words, and as a scenario file."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

from gfimu.base.declared import Declared, Table, figure, table
from gfimu.base.results import Panel, PlottedResult, Series, text_column
from gfimu.base.short_repr import short_repr
from gfimu.diagnosis.design.distinguishability import Distinguishability, PlannedRun
from gfimu.diagnosis.design.profile_search import Limits
from gfimu.diagnosis.design.table_profile import TableProfile
from gfimu.model.world_model import WorldModel

__all__ = ["SEPARATED", "Pair", "Proposal", "in_words", "scenario_of"]

SEPARATED = 12.0
"""D_ij from which on two effects are distinguished with confidence, nats: odds of 10⁵, less what the prior costs."""


@dataclass(frozen=True)
class Pair(Declared):
    """Margin of an effect over a rival."""

    effect: Annotated[str, figure("The effect.", head="effect")]
    rival: Annotated[str, figure("The rival.", head="rival")]
    nats_before: Annotated[
        float,
        figure("Margin with what was recorded so far, or a plain run.", "nats", head="before, nats", form=".3g"),
    ]
    nats_after: Annotated[
        float, figure("Margin with this experiment.", "nats", head="with this experiment, nats", form=".3g")
    ]
    unexplained_before: Annotated[float, figure("Share of the effect that the rival does not explain, before.")]
    unexplained_after: Annotated[
        float, figure("Share of the effect that the rival does not explain, with this experiment.")
    ]


@dataclass(frozen=True)
class Proposal(Declared, PlottedResult):
    """A proposed experiment: the profile or mounting that best separates effects.

    ``before`` holds how well the recordings at hand separate them, or where there are none a plain run up to speed and
    back in the same time; ``after`` everything together once the proposal is recorded. ``limits`` are what the table
    may do, and ``scenario`` is the scenario file of the proposed recording.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.design("cube12_turntable", ["tacho_scale", "scale_factor"]).to_toml()  # doctest: +SKIP
    """

    effects: Annotated[tuple[str, ...], figure("The effects to distinguish.")]
    mounting: Annotated[
        tuple[float, float, float],
        figure("How the array is to be turned from upright.", "rad", key="mounting_rotvec_rad"),
    ]
    upright_too: Annotated[
        bool,
        figure("Whether the same profile has to be recorded upright as well, and both recordings diagnosed together."),
    ]
    profile: Annotated[TableProfile, figure("Motion of the table.", flat=True)]
    before: Distinguishability
    after: Distinguishability
    limits: Limits
    text: Annotated[str, figure("The proposal in words.")]
    scenario: Mapping[str, Any]

    __repr__ = short_repr

    @property
    def separates(
        self,
    ) -> Annotated[
        bool, figure("Whether every effect is expected to be separated from every other.", before="mounting")
    ]:
        """Whether every effect is expected to be separated from every other."""
        return self.after.least_nats >= SEPARATED

    @property
    def nats_needed(
        self,
    ) -> Annotated[float, figure("Margin that separates two effects.", "nats", before="mounting")]:
        """Margin that separates two effects, nats."""
        return SEPARATED

    @property
    def detectability_before(
        self,
    ) -> Annotated[
        NDArray[np.float64],
        figure("d′ of each effect with what was recorded so far, or a plain run.", before="text"),
    ]:
        """d′ of each effect before (e,)."""
        return self.before.detectability

    @property
    def detectability_after(
        self,
    ) -> Annotated[NDArray[np.float64], figure("d′ of each effect with this experiment.", before="text")]:
        """d′ of each effect with this experiment (e,)."""
        return self.after.detectability

    @property
    def pairs(self) -> Annotated[list[Pair], figure("Margins of each effect over each rival.", before="text")]:
        """Margins of each effect over each rival."""
        parts = (self.before.nats, self.after.nats, self.before.unexplained, self.after.unexplained)
        return [
            Pair(effect, other, *(float(part[i, j]) for part in parts))
            for i, effect in enumerate(self.effects)
            for j, other in enumerate(self.effects)
            if i != j
        ]

    def to_toml(self) -> str:
        """Return the scenario file, which ``gfimu simulate`` accepts."""
        return tomli_w.dumps(self.scenario)

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per effect and rival: nats and unexplained share, before and after the experiment."""
        pairs = self.pairs
        rows = [pair.row() for pair in pairs]
        return {
            "effect": text_column(one.effect for one in pairs),
            "rival": text_column(one.rival for one in pairs),
            **{name: np.concatenate([row[name] for row in rows]) for name in rows[0]},
        }

    def shown(self) -> Iterator[Table | str]:
        """Yield the tables and sentences that people read."""
        yield table(
            "Margin of each effect over each rival",
            self.pairs,
            "effect rival nats_before nats_after",
            note="Expected log likelihood by which the effect, at its size, beats the best fit of the rival. Before: "
            "with what was recorded so far, or a plain run.",
        )
        pieces = enumerate(self.profile.in_words(), start=1)
        yield Table("Profile", ["piece"], [[f"{number}. {piece}"] for number, piece in pieces])
        yield self.text

    def _heading(self) -> str:
        return f"Experiment to separate {', '.join(self.effects)}"

    def _facts(self) -> list[tuple[str, str]]:
        turned = ", ".join(f"{one:.3g}" for one in self.mounting)
        return [
            ("mounting", f"turned by ({turned}) rad from upright" if any(self.mounting) else "upright"),
            ("duration", f"{self.profile.duration:.4g} s"),
            ("largest rate", f"{self.profile.peak_rate:.3g} rad/s"),
            ("largest angular acceleration", f"{self.profile.peak_acceleration:.3g} rad/s²"),
            ("weakest margin", f"{self.after.least_nats:.3g} nats, {SEPARATED:g} needed"),
        ]

    def _notes(self) -> tuple[str, ...]:
        return (self.text,)

    def _panels(self) -> list[Panel]:
        t = np.linspace(0.0, self.profile.duration, 1000)
        profile = Panel("profile of the table", "rate, rad/s", (Series("", self.profile.at(t).rate),), t)
        columns = self.to_columns()
        names = tuple(f"{one}, not {other}" for one, other in zip(columns["effect"], columns["rival"], strict=True))
        margins = tuple(  # a logarithmic axis has no zero
            Series(when, np.maximum(columns[f"nats_{when}"], 0.1), role=when) for when in ("before", "after")
        )
        needed = Series("needed", np.full(len(names), SEPARATED), role="noise")
        return [profile, Panel("margin over each rival", "nats", (*margins, needed), names, scale="log")]


def in_words(
    before: Distinguishability,
    after: Distinguishability,
    mounting: str,
    inseparable: Sequence[tuple[str, str]],
    *,
    recorded: bool,
    limits: Limits,
    asked: Limits,
) -> str:
    """Say what to do and what it brings, in a few sentences."""
    i, j = after.weakest()
    pair = f"{after.effects[i]} against {after.effects[j]}"
    sentences = []
    if mounting:
        if inseparable:
            which = "; ".join(f"{one} from {other}" for one, other in inseparable)
            sentences.append(
                f"No motion of an upright array separates {which}: whatever one does, the other can do too."
            )
        else:
            sentences.append("The best motion of an upright array does not suffice.")
        where = "record the profile so" if recorded else "record the profile upright and so mounted"
        sentences.append(f"Mount the array {mounting}, {where}, and diagnose the recordings together.")
    else:
        again = ", and diagnose it together with what is recorded" if recorded else ""
        sentences.append(f"Record the profile with the array upright{again}.")
    rise = f"from {before.nats[i, j]:.3g} to {after.nats[i, j]:.3g} nats ({SEPARATED:g} needed)"
    sentences.append(f"The weakest margin, {pair}, goes {rise}.")
    if after.least_nats < SEPARATED:
        if after.least_nats > 0.02 * SEPARATED:
            times = SEPARATED / after.least_nats
            sentences.append(f"That is not enough at this size: allow about {times:.2g} times the time, or more rate.")
        else:
            sentences.append("These limits can't separate them: allow more rate or acceleration, or a remounting.")
    if limits.rate < asked.rate:
        sentences.append(f"The rate stays below {limits.rate:.3g} rad/s, where the sensors would clip.")
    return " ".join(sentences)


def scenario_of(
    model: WorldModel,
    effects: Sequence[str],
    profile: TableProfile,
    mounting: tuple[float, float, float],
    sample_rate: float,
    text: str,
) -> dict[str, Any]:
    """Return the scenario file: the twin's world without chip errors, on the profile."""
    twin = tomllib.loads(model.to_toml())
    return {
        **twin,
        "name": "separate_" + "_".join(effects),
        "description": text,
        "sample_rate_hz": sample_rate,
        "duration_s": profile.duration,
        "mounting_rotvec_rad": list(mounting),
        "sensor": {**twin.get("sensor", {}), "errors": False},
        "reference": {"tacho_noise_std_rad_s": PlannedRun.reference_noise},
        "motion": {"kind": "profile", "segment": [segment.to_dict() for segment in profile.segments]},
    }
