"""What a verdict is made of: named causes, rivals, the residual, and what is unexplained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from gfimu.diagnosis.criticism.views.run_view import RunView

__all__ = ["NamedCause", "Residual", "Rival", "Unexplained"]


@dataclass(frozen=True)
class NamedCause:
    """One cause in a verdict: an effect with its sizes, their standard deviations and a probability.

    Parameters
    ----------
    effect : str
        Contract name.
    parameters : mapping
        Values by contract key (numbers, names or lists of names).
    std : mapping
        Standard deviations of those that are estimated.
    probability : float
        Probability that this effect is among the causes.
    place : str
        Where it acts (``"chip a2"``), empty where it has only one place.
    not_distinguishable_from : tuple of str
        Effects that explain these data as well.
    would_be_separated_by : str
        Excitation that would separate them.
    why : str
        One sentence: where and how it shows.
    log_odds : float
        Log odds of the explanation with this cause against the best one without it.
    unlisted : mapping of str to str
        Of an effect that the contract has no name for: its ``place`` in the chain, the ``dependence`` on the motion and
        the ``pattern`` of its sizes. Empty for all others.

    Examples
    --------
    >>> import gfimu
    >>> cause = gfimu.diagnose("run.parquet", "cube12_turntable").causes[0]  # doctest: +SKIP
    >>> cause.parameters, cause.std  # doctest: +SKIP
    """

    effect: str
    parameters: Mapping[str, Any]
    std: Mapping[str, float]
    probability: float
    place: str = ""
    not_distinguishable_from: tuple[str, ...] = ()
    would_be_separated_by: str = ""
    why: str = ""
    log_odds: float = 0.0
    unlisted: Mapping[str, str] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form of the contract."""
        parameters = {
            key: {"value": value, "std": self.std.get(key)} if isinstance(value, int | float) else {"value": value}
            for key, value in self.parameters.items()
        }
        return {
            "effect": self.effect,
            "parameters": parameters,
            "probability": self.probability,
            "place": self.place,
            "not_distinguishable_from": list(self.not_distinguishable_from),
            "would_be_separated_by": self.would_be_separated_by,
            "why": self.why,
            "log_odds": self.log_odds,
            **({"effect": "unlisted", "name": self.effect, **self.unlisted} if self.unlisted else {}),
        }


@dataclass(frozen=True)
class Rival:
    """Another explanation and why it lost.

    Parameters
    ----------
    effects : tuple of str
        Its effects.
    log_odds : float
        Log odds against the verdict (negative: less probable).
    why : str
        One sentence.
    """

    effects: tuple[str, ...]
    log_odds: float
    why: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form of the contract."""
        return {"effects": list(self.effects), "log_odds": self.log_odds, "why": self.why}


@dataclass(frozen=True)
class Residual:
    """Size of the residual before and after, m/s², over valid samples of all channels.

    ``before_by_channel`` and ``after_by_channel`` hold it per channel; ``noise_floor`` is the rms of the noise as
    estimated from the data.
    """

    rms_before: float
    rms_after: float
    noise_floor: float
    before_by_channel: Mapping[str, float]
    after_by_channel: Mapping[str, float]

    @classmethod
    def of_views(cls, views: Sequence[RunView], channels: Sequence[str], noise_floor: float) -> Residual:
        """Measure the residual over the valid samples of all runs."""
        count = np.maximum(np.sum([view.valid.sum(axis=0) for view in views], axis=0), 1)
        before, after = (
            np.sum([np.sum(np.where(v.valid, v.measured - getattr(v, name), 0.0) ** 2, axis=0) for v in views], axis=0)
            for name in ("before", "after")
        )
        return cls(
            float(np.sqrt(before.sum() / count.sum())),
            float(np.sqrt(after.sum() / count.sum())),
            noise_floor,
            dict(zip(channels, map(float, np.sqrt(before / count)), strict=True)),
            dict(zip(channels, map(float, np.sqrt(after / count)), strict=True)),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form of the contract."""
        return {
            "rms_before": self.rms_before,
            "rms_after": self.rms_after,
            "noise_floor": self.noise_floor,
            "unit": "m/s2",
            "before_by_channel": dict(self.before_by_channel),
            "after_by_channel": dict(self.after_by_channel),
        }


@dataclass(frozen=True)
class Unexplained:
    """What is left and nothing in the library explains.

    Parameters
    ----------
    significant : bool
        Whether it is more than chance.
    signature : str
        Which channels, which dependence, in words.
    log_odds : float
        Log odds of the strongest term against chance.
    surrogate : mapping of str to float
        Data-driven terms: coefficients by what they are of, with its unit, and function: ``"a11_m_s2: rate²"``.
    extends_twin : bool
        Whether such terms are in the extended twin, as they predict validation data.
    left_out : int
        How many of the terms are not in it, as they are of absolute time, which another recording has otherwise.
    mistake : str
        A mistake in the files that makes the simulation fit; empty where none does.
    """

    significant: bool = False
    signature: str = ""
    log_odds: float = 0.0
    surrogate: Mapping[str, float] = field(default_factory=dict)
    extends_twin: bool = False
    left_out: int = 0
    mistake: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form of the contract."""
        return {**asdict(self), "surrogate": dict(self.surrogate)}
