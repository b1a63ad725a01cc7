"""Tables of judged answers: shares with exact binomial intervals, points, calibration, removal, time."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest, norm

from gfimu.base.declared import Declared, Table, figure
from gfimu.base.results import Panel, PlottedResult, Series, text_column
from sim.trials.benchmark.judged import Judged
from sim.trials.benchmark.release import SETS

__all__ = ["COLUMNS", "POINTS_NOTE", "Judgement", "Share", "Summary", "markdown", "summaries"]

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
class Summary(Declared):
    """What a method reached in a set.

    Parameters
    ----------
    judged : tuple of Judged
        Its answers.
    """

    set_name: Annotated[str, figure("The set; all: those that are drawn.", key="set")]
    method: Annotated[str, figure("The method.")]
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
    def worlds(self) -> Annotated[int, figure("Worlds.")]:
        """Worlds that were answered."""
        return len(self.judged)

    @property
    def points(self) -> Annotated[float, figure("Mean of the points.")]:
        """Mean of the points."""
        return float(np.mean([one.points for one in self.judged]))

    @property
    def points_half_interval(self) -> Annotated[float, figure("Half the 95 % interval of that mean.")]:
        """Half the 95 % interval of the mean of the points."""
        return float(norm.ppf(0.5 + _LEVEL / 2)) * self.points_std

    @property
    def outcomes(self) -> Annotated[dict[str, int], figure("Worlds by outcome.")]:
        """Worlds by outcome."""
        return dict(Counter(one.outcome for one in self.judged))

    @property
    def removed_median(
        self,
    ) -> Annotated[float, figure("Median share of the squared distance removed in a fresh motion.")]:
        """Median share of the squared distance removed; NaN where none can be measured."""
        values = self._removed()
        return float(np.median(values)) if values else float("nan")

    @property
    def predicts_worse(
        self,
    ) -> Annotated[int, figure("Answers that predict the fresh motion worse than the twin.")]:
        """Answers that predict the fresh motion worse than the twin."""
        return sum(value < _WORSE for value in self._removed())

    @property
    def removed_measured(self) -> Annotated[int, figure("Worlds in which the removal can be measured.")]:
        """Worlds in which the removal can be measured."""
        return len(self._removed())

    @property
    def sizes(self) -> Annotated[int, figure("Sizes with a standard deviation, of causes that are hidden.")]:
        """Sizes with a standard deviation."""
        return self.within(1.0).cases

    @property
    def sizes_within_1_std(
        self,
    ) -> Annotated[int, figure("Of these within one standard deviation of the truth; theory 68.3 %.")]:
        """Sizes within one standard deviation of the truth."""
        return self.within(1.0).hits

    @property
    def sizes_within_2_std(self) -> Annotated[int, figure("Of these within two; theory 95.4 %.")]:
        """Sizes within two standard deviations of the truth."""
        return self.within(2.0).hits

    @property
    def processor_s_median(self) -> Annotated[float, figure("Median processor time.", "s")]:
        """Median processor time, s; NaN where none is given."""
        values = [one.processor_s for one in self.judged if np.isfinite(one.processor_s)]
        return float(np.median(values)) if values else float("nan")

    def within(self, width: float) -> Share:
        """Return the share of sizes within so many standard deviations of the truth."""
        z = np.abs([value for one in self.judged for value in one.z])
        return Share(int(np.sum(z <= width)), len(z))

    def _removed(self) -> list[float]:
        return [one.removed for one in self.judged if np.isfinite(one.removed)]

    def cells(self) -> tuple[str, ...]:
        """Return the cells of the table."""
        one, two = self.within(1.0), self.within(2.0)
        removal = f"{self.removed_median:.3f}, worse {self.predicts_worse}/{self.removed_measured}"
        cases = max(one.cases, 1)
        sizes = f"{100 * one.hits / cases:.0f}, {100 * two.hits / cases:.0f} of {one.cases}"
        half = "" if np.isnan(self.points_std) else f" ± {self.points_half_interval:.2f}"
        return (
            self.set_name,
            self.method,
            str(self.worlds),
            "–" if np.isnan(self.points) else f"{self.points:+.2f}{half}",
            *map(str, self.shares.values()),
            removal if self.removed_measured else "–",
            sizes if one.cases else "–",
            "–" if np.isnan(self.processor_s_median) else f"{self.processor_s_median:.2g}",
        )


@dataclass(frozen=True)
class Judgement(Declared, PlottedResult):
    """Judged answers and their summary."""

    judged: Annotated[tuple[Judged, ...], figure("Per world and method.")]

    @property
    def summaries(self) -> Annotated[tuple[Summary, ...], figure("Per set and method.", before="judged")]:
        """Summaries per set and method."""
        return tuple(summaries(self.judged))

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per set and method: mean points with standard deviation, shares, median removal and time."""
        found = self.summaries
        shares = [{f"{name}_share": share.value for name, share in one.shares.items()} for one in found]
        numbers = {
            "points": [one.points for one in found],
            "points_std": [one.points_std for one in found],
            **{name: [row[name] for row in shares] for name in (shares[0] if shares else {})},
            "removed_median_share": [one.removed_median for one in found],
            "processor_median_s": [one.processor_s_median for one in found],
        }
        return {
            "set": text_column(one.set_name for one in found),
            "method": text_column(one.method for one in found),
            "worlds": np.array([one.worlds for one in found], dtype=int),
            **{name: np.array(values) for name, values in numbers.items()},
        }

    def shown(self) -> Iterator[Table | str]:
        """Yield a table per set, a column per method, and what the points mean."""
        rows = [summary.cells() for summary in self.summaries]
        for name in dict.fromkeys(row[0] for row in rows):
            first, *others = zip(COLUMNS[1:], *(row[1:] for row in rows if row[0] == name), strict=True)
            yield Table(name, first, others)
        yield POINTS_NOTE

    def _heading(self) -> str:
        return "Judged answers"

    def _shown(self) -> dict[str, NDArray[Any]]:
        rows = [summary.cells() for summary in self.summaries]
        return {name: text_column(row[index] for row in rows) for index, name in enumerate(COLUMNS)}

    def _notes(self) -> tuple[str, ...]:
        return (POINTS_NOTE, "intervals: 95 %")

    def _panels(self) -> list[Panel]:
        sets = tuple(dict.fromkeys(summary.set_name for summary in self.summaries))
        series = []
        for method in dict.fromkeys(one.method for one in self.summaries):
            by_set = {one.set_name: (one.points, one.points_std) for one in self.summaries if one.method == method}
            mean, std = np.array([by_set.get(name, (np.nan, np.nan)) for name in sets]).T
            series.append(Series(method, mean, std))
        return [Panel("mean points of each method", "points", tuple(series), sets)]


def _is_nothing(one: Judged) -> bool:
    return one.outcome in {"quiet", "false_alarm"} or not one.hidden


def summaries(judged: Iterable[Judged]) -> list[Summary]:
    """Return a summary per set and method, in the order of the release, and one of all that are drawn."""
    groups: dict[tuple[str, str], list[Judged]] = defaultdict(list)
    listed = list(judged)
    several = len({one.set_name for one in listed} - {"real"}) > 1
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
    rows = [COLUMNS, tuple("---" for _ in COLUMNS), *(one.cells() for one in found)]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows) + "\n"
