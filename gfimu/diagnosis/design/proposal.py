"""The proposal of an experiment: in numbers, in words, and as a scenario file."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

from gfimu.diagnosis.design.distinguishability import Distinguishability, PlannedRun
from gfimu.diagnosis.design.profile_search import Limits
from gfimu.diagnosis.design.table_profile import TableProfile
from gfimu.results import Panel, PlottedResult, Series, text_column
from gfimu.short_repr import short_repr
from gfimu.world_model import WorldModel

__all__ = ["SEPARATED", "Proposal", "in_words", "scenario_of"]

SEPARATED = 12.0
"""D_ij from which on two effects are distinguished with confidence, nats: odds of 10⁵, less what the prior costs."""

_FIGURES = ("nats_before", "nats_after", "unexplained_before", "unexplained_after")


@dataclass(frozen=True)
class Proposal(PlottedResult):
    """A proposed experiment: the profile or mounting that best separates effects.

    Parameters
    ----------
    effects : tuple of str
        The effects to distinguish.
    profile : TableProfile
        Motion of the table.
    mounting : tuple of float
        Rotation vector by which the array is turned from upright, rad.
    upright_too : bool
        Whether the same profile has to be recorded upright as well, and both recordings diagnosed together.
    before : Distinguishability
        Of the recordings at hand; where there are none, of a plain run up to speed and back in the same time.
    after : Distinguishability
        Of everything together once the proposal is recorded.
    limits : Limits
        What the table may do.
    text : str
        The proposal in words.
    scenario : mapping
        Scenario file of the proposed recording.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.design("cube12_turntable", ["tacho_scale", "scale_factor"]).to_toml()  # doctest: +SKIP
    """

    effects: tuple[str, ...]
    profile: TableProfile
    mounting: tuple[float, float, float]
    upright_too: bool
    before: Distinguishability
    after: Distinguishability
    limits: Limits
    text: str
    scenario: Mapping[str, Any]

    __repr__ = short_repr

    @property
    def separates(self) -> bool:
        """Whether every effect is expected to be separated from every other."""
        return self.after.least_nats >= SEPARATED

    def to_toml(self) -> str:
        """Return the scenario file, which ``gfimu simulate`` accepts."""
        return tomli_w.dumps(self.scenario)

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per effect and rival: nats and unexplained share, before and after the experiment."""
        pairs = self._pairs()
        columns: dict[str, NDArray[Any]] = {
            key: text_column(pair[key] for pair in pairs) for key in ("effect", "rival")
        }
        return columns | {key: np.array([pair[key] for pair in pairs]) for key in _FIGURES}

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

    def _pairs(self) -> list[dict[str, Any]]:
        return [
            {
                "effect": one,
                "rival": other,
                "nats_before": float(self.before.nats[i, j]),
                "nats_after": float(self.after.nats[i, j]),
                "unexplained_before": float(self.before.unexplained[i, j]),
                "unexplained_after": float(self.after.unexplained[i, j]),
            }
            for i, one in enumerate(self.effects)
            for j, other in enumerate(self.effects)
            if i != j
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form."""
        return {
            "effects": list(self.effects),
            "separates": self.separates,
            "nats_needed": SEPARATED,
            "mounting_rotvec_rad": list(self.mounting),
            "upright_too": self.upright_too,
            "duration_s": self.profile.duration,
            "peak_rate_rad_s": self.profile.peak_rate,
            "peak_acceleration_rad_s2": self.profile.peak_acceleration,
            "segments": self.profile.to_segments(),
            "detectability_before": self.before.detectability.tolist(),
            "detectability_after": self.after.detectability.tolist(),
            "pairs": self._pairs(),
            "text": self.text,
        }


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
        "motion": {"kind": "profile", "segment": profile.to_segments()},
    }
