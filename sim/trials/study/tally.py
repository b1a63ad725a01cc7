"""Outcomes judged and counted: right, wrong or unknown, with intervals of the rates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

__all__ = ["LEAST_APART", "LEAST_VISIBLE", "Outcome", "Tally", "brief", "rate_with_interval", "score", "visible"]

Outcome = Mapping[str, Any]

INSEPARABLE = (
    frozenset({"bias", "scale_factor", "quadratic", "cross_axis", "gravity"}),
    frozenset({"mount_tilt", "misalignment"}),
    frozenset({"eccentricity", "sensor_position"}),
)
"""Effects that one upright run can't tell apart on channels that see constant gravity, or that contain each other.

For sets of which what each leaves of the other was not computed.
"""

LEAST_SEPARABLE = 3.0
"""Size d′ below which what a rival leaves of an effect, the drive unknown, does not tell them apart.

The log odds of an ideal observer are 4.5 ± 3 there.
"""

LEAST_APART = 15.0
"""Size d′ that the best other effect must leave of one taken out of the library for it to have a signature of its own;
just detectable."""

LEAST_VISIBLE = 7.0
"""Size d′ below which an effect is at or below the information limit."""
_ROUNDED = 1e-5  # of a size that is kept


def score(outcome: Outcome) -> dict[str, bool]:
    """Judge one outcome.

    Returns
    -------
    dict
        ``exact``: the right names alone (nothing found where nothing is hidden). ``within``: every hidden effect is
        among the names or among what is not distinguishable from them. ``wrong``: said to be explained, with a
        name that is not hidden. ``fair``: exact, or a set of effects that one upright run truly can't tell apart, the
        hidden one among them. ``named``, ``nothing``, ``unknown``, ``set``, ``error``: what was said.
    """
    hidden = set(outcome["effects"])
    names = {cause["effect"] for cause in outcome["causes"]}
    listed = names.union(*(cause["rivals"] for cause in outcome["causes"]))
    verdict = outcome["verdict"]
    explained, named = verdict == "explained", verdict in {"explained", "ambiguous"}
    exact = (explained and names == hidden) if hidden else verdict == "nothing_found"
    same = verdict == "ambiguous" and hidden <= listed and _inseparable(outcome, listed - hidden)
    return {
        "exact": exact,
        "fair": exact or same,
        "within": (named and hidden <= listed) if hidden else verdict == "nothing_found",
        "wrong": explained and not names <= hidden,
        "named": named,
        "set": verdict == "ambiguous",
        "nothing": verdict == "nothing_found",
        "unknown": verdict == "unknown",
        "error": verdict == "error",
    }


def brief(outcome: Outcome) -> dict[str, Any]:
    """Return what was said, the names as one text, and whether it was exactly right or wrong (`score`)."""
    judged, names = score(outcome), sorted(cause["effect"] for cause in outcome["causes"])
    return {
        "verdict": outcome["verdict"],
        "causes": ", ".join(names),
        "exact": judged["exact"],
        "wrong": judged["wrong"],
    }


def _inseparable(outcome: Outcome, rivals: set[str]) -> bool:
    """Whether the data can't tell any of these rivals from what is hidden."""
    left_by = outcome.get("left_by")
    if not left_by:
        return any(rivals | set(outcome["effects"]) <= group for group in INSEPARABLE)
    return all(left_by.get(rival, np.inf) < LEAST_SEPARABLE for rival in rivals)


def visible(outcome: Outcome) -> bool:
    """Whether what is hidden can be seen in the recording at all."""
    reached = outcome.get("reached")
    return reached is None or reached >= (1.0 - _ROUNDED) * LEAST_VISIBLE


def rate_with_interval(hits: int, cases: int) -> tuple[float, float, float]:
    """Return a rate and its 95 % interval (Clopper & Pearson 1934)."""
    low = float(beta.ppf(0.025, hits, cases - hits + 1)) if hits else 0.0
    high = float(beta.ppf(0.975, hits + 1, cases - hits)) if hits < cases else 1.0
    return (hits / cases if cases else float("nan")), low, high


class Tally:
    """Outcomes of one study.

    Parameters
    ----------
    outcomes : sequence of mapping
        Outcomes as `run_case` returns them.
    """

    def __init__(self, outcomes: Sequence[Outcome]) -> None:
        self.outcomes = outcomes
        self.scores = [score(outcome) for outcome in outcomes]

    def __len__(self) -> int:
        return len(self.outcomes)

    def share(self, what: str) -> str:
        """Return a rate in per cent with its interval, as text."""
        hits = sum(entry[what] for entry in self.scores)
        rate, low, high = rate_with_interval(hits, len(self))
        return f"{100 * rate:.1f} ({100 * low:.0f}–{100 * high:.0f})"

    def numbers(self, key: str) -> NDArray[np.float64]:
        """Return the values of a number in the outcomes, where there is one."""
        values = [outcome.get(key) for outcome in self.outcomes]
        return np.array([value for value in values if value is not None], dtype=float)

    def z(self) -> NDArray[np.float64]:
        """Return |error|/std of all parameters of rightly named causes."""
        return np.array(
            [
                abs(value)
                for outcome, entry in zip(self.outcomes, self.scores, strict=True)
                if entry["exact"]
                for cause in outcome["causes"]
                for value in cause["z"].values()
            ]
        )

    def words(self, outcome: Outcome) -> str:
        """Return what was said, in a word or two."""
        words = {"nothing_found": "nothing", "unknown": "unknown", "error": "error"}
        if outcome["verdict"] in words:
            return words[outcome["verdict"]]
        names = " + ".join(sorted({cause["effect"] for cause in outcome["causes"]}))
        return f"one of {names}" if outcome["verdict"] == "ambiguous" else names
