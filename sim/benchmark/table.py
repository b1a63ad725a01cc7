"""Tables of judged answers: shares with exact binomial intervals, points, calibration, removal, time."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binomtest, norm

from sim.benchmark.judge import Judged
from sim.benchmark.release import SETS

__all__ = ["COLUMNS", "POINTS_NOTE", "Share", "Summary", "markdown", "summaries"]

COLUMNS = (
    *("set", "method", "worlds", "points", "named alone %", "in a set %", "wrong name %", "unknown %", "missed %"),
    *("false alarm %", "removed", "within 1σ, 2σ %", "processor s"),
)
"""Heads of the table."""

POINTS_NOTE = "points: right 1, in part or in a set 0.5 or less, unknown 0.25, missed 0, wrong name or false alarm -1"
"""What the points mean, below the table."""

_SHARES = {
    "named_alone": ("alone",),
    "in_a_set": ("set", "part"),
    "wrong_name": ("wrong",),
    "unknown": ("unknown", "error"),
    "missed": ("missed",),
}
"""Outcomes that each share counts, of worlds with something hidden."""

_LEVEL = 0.95
_WORSE = -0.05  # of the removed share, from which an answer predicts worse than the given simulation


@dataclass(frozen=True)
class Share:
    """A share with its exact interval.

    Parameters
    ----------
    hits, cases : int
        Counts.
    """

    hits: int
    cases: int

    @property
    def value(self) -> float:
        """The share; NaN without cases."""
        return self.hits / self.cases if self.cases else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of Clopper and Pearson (Biometrika 26:404, 1934); 0 to 1 without cases."""
        if not self.cases:
            return 0.0, 1.0
        found = binomtest(self.hits, self.cases).proportion_ci(_LEVEL, method="exact")
        return float(found.low), float(found.high)

    def __str__(self) -> str:
        if not self.cases:
            return "–"
        low, high = self.interval
        return f"{100 * self.value:.0f} ({100 * low:.0f}–{100 * high:.0f})"


@dataclass(frozen=True)
class Summary:
    """What a method reached in a set.

    Parameters
    ----------
    set_name, method : str
        Which.
    judged : tuple of Judged
        Its answers.
    """

    set_name: str
    method: str
    judged: tuple[Judged, ...]

    def share(self, *outcomes: str, nothing: bool | None = False) -> Share:
        """Return the share of outcomes among worlds with something hidden, with nothing, or (None) all."""
        drawn = [one for one in self.judged if np.isfinite(one.points)]  # measured data have no truth and no points
        chosen = [one for one in drawn if nothing is None or _is_nothing(one) == nothing]
        return Share(sum(one.outcome in outcomes for one in chosen), len(chosen))

    @property
    def shares(self) -> dict[str, Share]:
        """Shares of the table by name; of a false alarm among worlds with nothing hidden."""
        found = {name: self.share(*outcomes) for name, outcomes in _SHARES.items()}
        return {**found, "false_alarm": self.share("false_alarm", nothing=True)}

    @property
    def points_std(self) -> float:
        """Standard deviation of the mean of the points, by the central limit; NaN of a single world."""
        values = np.array([one.points for one in self.judged])
        return float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else float("nan")

    @property
    def points(self) -> tuple[float, float]:
        """Mean of the points and half its 95 % interval."""
        mean = float(np.mean([one.points for one in self.judged]))
        return mean, float(norm.ppf(0.5 + _LEVEL / 2)) * self.points_std

    @property
    def removed(self) -> tuple[float, int, int]:
        """Median share of the squared distance removed, answers that predict worse than the twin, and of how many."""
        values = np.array([one.removed for one in self.judged if np.isfinite(one.removed)])
        return (float(np.median(values)) if len(values) else float("nan")), int(np.sum(values < _WORSE)), len(values)

    def within(self, width: float) -> Share:
        """Return the share of sizes within so many standard deviations of the truth."""
        z = np.abs([value for one in self.judged for value in one.z])
        return Share(int(np.sum(z <= width)), len(z))

    @property
    def processor_s(self) -> float:
        """Median processor time, s; NaN where none is given."""
        values = [one.processor_s for one in self.judged if np.isfinite(one.processor_s)]
        return float(np.median(values)) if values else float("nan")

    def to_dict(self) -> dict[str, Any]:
        """Return the content for JSON: counts, so that anybody can make intervals of their own."""
        mean, half = self.points
        median, worse, measured = self.removed
        return {
            "set": self.set_name,
            "method": self.method,
            "worlds": len(self.judged),
            "points": mean,
            "points_half_interval": half,
            "outcomes": dict(Counter(one.outcome for one in self.judged)),
            "removed_median": median,
            "predicts_worse": worse,
            "removed_measured": measured,
            "sizes": len([value for one in self.judged for value in one.z]),
            "sizes_within_1_std": self.within(1.0).hits,
            "sizes_within_2_std": self.within(2.0).hits,
            "processor_s_median": self.processor_s,
        }

    def row(self) -> tuple[str, ...]:
        """Return the cells of the table."""
        mean, half = self.points
        median, worse, measured = self.removed
        one, two = self.within(1.0), self.within(2.0)
        removal = f"{median:.3f}, worse {worse}/{measured}" if measured else "–"
        cases = max(one.cases, 1)
        sizes = f"{100 * one.hits / cases:.0f}, {100 * two.hits / cases:.0f} of {one.cases}"
        return (
            self.set_name,
            self.method,
            str(len(self.judged)),
            "–" if np.isnan(mean) else f"{mean:+.2f}" + ("" if np.isnan(half) else f" ± {half:.2f}"),
            *map(str, self.shares.values()),
            removal,
            sizes if one.cases else "–",
            "–" if np.isnan(self.processor_s) else f"{self.processor_s:.2g}",
        )


def _is_nothing(one: Judged) -> bool:
    return one.outcome in {"quiet", "false_alarm"} or not one.hidden


def summaries(judged: Iterable[Judged], *, together: bool = True) -> list[Summary]:
    """Return a summary per set and method, in the order of the release; ``together`` adds one of all that are drawn."""
    groups: dict[tuple[str, str], list[Judged]] = defaultdict(list)
    listed = list(judged)
    several = together and len({one.set_name for one in listed} - {"real"}) > 1
    for one in listed:
        groups[one.set_name, one.method].append(one)
        if several and one.set_name != "real":
            groups["all", one.method].append(one)
    order = [*SETS, "all"]
    methods = list(dict.fromkeys(method for _, method in groups))
    places = sorted(groups, key=lambda key: (order.index(key[0]), methods.index(key[1])))
    return [Summary(*key, tuple(groups[key])) for key in places]


def markdown(found: Sequence[Summary]) -> str:
    """Return summaries as a table in Markdown."""
    rows = [COLUMNS, tuple("---" for _ in COLUMNS), *(one.row() for one in found)]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows) + "\n"
