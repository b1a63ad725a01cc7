"""What a campaign's folder says: counts, failures, quantiles, sensitivities, and how far it is."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray

from gfimu.base.declared import Declared, Line, Table, figure
from gfimu.base.files.atomic_file import atomic_path
from gfimu.base.results import Panel, PlottedResult, Series, TableResult, one_row, text_column
from gfimu.base.units import duration_text
from gfimu.recording.tables.arrow import as_found
from sim.trials.sweep.dataset import Dataset
from sim.trials.sweep.design import Design
from sim.trials.sweep.pace import Run, runs
from sim.trials.sweep.sensitivity import METHODS, Sensitivity, seed_shares, sensitivities
from sim.trials.sweep.summary import Group, failures, grouped

__all__ = ["CampaignPlot", "CampaignResult", "CampaignStatus", "CampaignTable"]

Shown = Iterator[Table | Line | str]


@dataclass(frozen=True)
class _Counts(Declared):
    """How many cases of a campaign are done, and how many failed."""

    folder: Annotated[Path, figure("Its folder.")]
    cases: Annotated[int, figure("Cases of the plan.")]
    done: Annotated[int, figure("Cases that are done, failed ones included.")]
    failures: Annotated[dict[str, int], figure("Cases that failed, by reason.")]

    def _facts(self) -> list[tuple[str, str]]:
        failed = ((why, f"{count} failed") for why, count in self.failures.items())
        return [("cases done", f"{self.done} of {self.cases}"), *failed]

    def failed(self) -> Shown:
        """Yield how many cases failed, a line for each reason."""
        for reason, count in self.failures.items():
            yield Line(f"{count} failed: {reason}", style="yellow")


@dataclass(frozen=True)
class CampaignResult(_Counts, PlottedResult):
    """Summary of a campaign's folder: cases, results and failures.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.campaign("plan.toml", out="campaign").to_pandas()  # doctest: +SKIP
    """

    groups: Annotated[tuple[Group, ...], figure("Quantiles of each result by the values of the factors.")]
    ran: bool = False  # whether this call ran cases

    @classmethod
    def of(cls, dataset: Dataset, by: Sequence[str] = (), *, ran: bool = False) -> Self:
        """Summarise a campaign by the values of factors, by default of all."""
        table = dataset.table()
        groups = tuple(grouped(table, dataset.plan, by))
        return cls(dataset.folder, len(Design(dataset.plan)), len(table), failures(table), groups, ran)

    @property
    def every_case_failed(self) -> bool:
        """Whether no case has results."""
        return self.done == sum(self.failures.values())

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per case that is done, with the columns of the dataset: factors, results, failure."""
        table = Dataset.open(self.folder).table()
        return {name: as_found(table.column(name)) for name in table.column_names}

    def shown(self) -> Shown:
        """Yield counts, quantiles and failures."""
        yield f"{self.folder}: {self.done} of {self.cases} cases"
        yield from _group_tables(self.groups)
        yield from self.failed()

    def _heading(self) -> str:
        return f"Campaign in {self.folder}"

    def _shown(self) -> dict[str, NDArray[Any]]:
        return group_columns(self.groups)

    def _panels(self) -> list[Panel]:
        return _group_panels(self.groups)


@dataclass(frozen=True)
class CampaignStatus(_Counts, TableResult):
    """Progress of a campaign: cases done, failed and to come.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.campaign_status("campaign").done  # doctest: +SKIP
    """

    runs: Annotated[tuple[Run, ...], figure("Processes that work at it now.")]

    @classmethod
    def of(cls, dataset: Dataset) -> Self:
        """Return how far a campaign is."""
        running = tuple(runs(dataset))  # first: a case that ends meanwhile is then one of those that are done
        table = dataset.table(["failure"])
        return cls(dataset.folder, len(Design(dataset.plan)), len(table), failures(table), running)

    @property
    def rate_per_s(self) -> Annotated[float, figure("Cases per second.", "1/s")]:
        """Cases per second of the processes that run it now; what was there before them does not count."""
        return math.fsum(run.rate_per_s for run in self.runs)

    @property
    def left_s(self) -> Annotated[float, figure("Time that the remaining cases take; null: not known.", "s")]:
        """Time until it is done, s; NaN where nothing runs it, or no batch has come yet."""
        return (self.cases - self.done) / self.rate_per_s if self.rate_per_s else math.nan

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row: cases, those done and failed, cases per second, time left."""
        numbers = {"cases": self.cases, "done": self.done, "failed": sum(self.failures.values())}
        return one_row({"folder": self.folder, **numbers, "rate_per_s": self.rate_per_s, "left_s": self.left_s})

    def shown(self) -> Shown:
        """Yield how far it is, who runs it, and what failed."""
        share = f" ({100.0 * self.done / self.cases:.1f} %)"
        yield f"{self.folder}: {self.done} of {self.cases} cases{share}, {sum(self.failures.values())} failed"
        if self.runs:
            processes = ", ".join(f"process {run.pid} on {run.host}" for run in self.runs)
            left = "time left not known yet" if math.isnan(self.left_s) else f"{duration_text(self.left_s)} left"
            yield f"runs: {processes}; {self.rate_per_s:.3g} cases/s, {left}"
        elif self.done < self.cases:
            yield f"does not run; gfimu campaign PLAN.toml --out {self.folder} with its plan goes on with it"
        yield from self.failed()

    def _heading(self) -> str:
        return f"Progress of the campaign in {self.folder}"

    def _facts(self) -> list[tuple[str, str]]:
        facts = super()._facts()
        facts += [(f"process {run.pid} on {run.host}", f"{run.rate_per_s:.3g} cases/s") for run in self.runs]
        return facts if math.isnan(self.left_s) else [*facts, ("time left", f"{self.left_s:.3g} s")]

    def _shown(self) -> None:
        return None


@dataclass(frozen=True)
class CampaignTable(Declared, PlottedResult):
    """Quantiles of a campaign's results, and their sensitivities to its factors.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.campaign_table("campaign", by=["sensor.range_g"]).to_pandas()  # doctest: +SKIP
    """

    groups: Annotated[tuple[Group, ...], figure("Quantiles of each result by the values of the factors.")]
    sensitivities: Annotated[tuple[Sensitivity, ...], figure("Share of each factor in the variance of each result.")]
    seed_shares: Annotated[
        dict[str, float], figure("Share of the seeds in the variance of each result; empty without repeats.")
    ]

    @classmethod
    def of(cls, dataset: Dataset, by: Sequence[str] = ()) -> Self:
        """Tabulate a campaign by the values of factors, by default of all."""
        table, design = dataset.table(), Design(dataset.plan)
        groups = tuple(grouped(table, dataset.plan, by))
        return cls(groups, tuple(sensitivities(table, design)), seed_shares(table, design))

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per group and result: the factors' values, cases, quantiles 5, 50 and 95 %."""
        return group_columns(self.groups)

    def write_csv(self, path: str | Path) -> None:
        """Write the quantiles, one row per group and result."""
        columns = group_columns(self.groups)
        with atomic_path(path) as part, Path(part).open("w", encoding="utf-8", newline="") as file:
            lines = csv.writer(file, lineterminator="\n")
            lines.writerow(columns)
            lines.writerows(zip(*(values.tolist() for values in columns.values()), strict=True))

    def shown(self) -> Shown:
        """Yield the quantiles, and the shares of the factors with how they were found."""
        yield from _group_tables(self.groups)
        if not self.sensitivities:
            yield "no sensitivities: no factor varies, or too few combinations are done"
            return
        rows = [sensitivity.row_text() for sensitivity in self.sensitivities]
        rows += [(result, "(seeds)", f"{share:.3f}", "", "") for result, share in self.seed_shares.items()]
        order = list(dict.fromkeys(row[0] for row in rows))
        rows.sort(key=lambda row: order.index(row[0]))
        yield Table("Share of the variance", ("result", "factor", "first order", "total", "points"), rows, left=2)
        yield from dict.fromkeys(METHODS[one.method] for one in self.sensitivities)
        yield Line("Factors: of the variance of the mean over seeds, with 95 % interval (bootstrap). ", style="dim")
        seeds = (
            "Seeds: of the variance of single cases; factors act through them too."
            if self.seed_shares
            else "One seed for all combinations: what chance causes is not seen; repeats = N shows it."
        )
        yield Line(seeds, style="dim")

    def _heading(self) -> str:
        return "Results of a campaign"

    def _facts(self) -> list[tuple[str, str]]:
        finite = (sensitivity for sensitivity in self.sensitivities if math.isfinite(sensitivity.first))
        return [(f"share of {one.factor} in {one.result}", f"{100 * one.first:.3g} %") for one in finite]

    def _panels(self) -> list[Panel]:
        return _group_panels(self.groups)


@dataclass(frozen=True)
class CampaignPlot(Declared):
    """A picture of a campaign."""

    results: Annotated[list[str], figure("Results that are drawn.")]

    def shown(self) -> Shown:
        """Yield nothing: the picture says it."""
        yield from ()


def group_columns(groups: Sequence[Group]) -> dict[str, NDArray[Any]]:
    """Return groups as columns: the factors' values, then result, cases, failed, low, median_or_share, high."""
    factors = list(groups[0].values) if groups else []
    columns: dict[str, NDArray[Any]] = {name: np.array([group.values[name] for group in groups]) for name in factors}
    columns["result"] = text_column(group.result for group in groups)
    columns |= {key: np.array([getattr(group, key) for group in groups], dtype=int) for key in ("cases", "failed")}
    for key, name in (("low", "low"), ("median", "median_or_share"), ("high", "high")):
        columns[name] = np.array([getattr(group, key) for group in groups], dtype=float)
    return columns


def _group_tables(groups: Sequence[Group]) -> Iterator[Table]:
    """Yield the quantiles of each result, or its share and the interval of that, in a table of its own."""
    factors = list(groups[0].values) if groups else []
    for result, members in _by_result(groups).items():
        heads = ("from", "share", "to (95 %)") if members[0].share else ("5 %", "median", "95 %")
        rows = [
            (
                *(str(group.values[name]) for name in factors),
                str(group.cases),
                *(f"{value:.4g}" for value in (group.low, group.median, group.high)),
            )
            for group in members
        ]
        yield Table(result, (*factors, "cases", *heads), rows, left=len(factors))


def _group_panels(groups: Sequence[Group]) -> list[Panel]:
    """Return one panel per result: median and quantiles 5 and 95 % of each group."""
    panels = []
    for result, members in _by_result(groups).items():
        names = tuple(", ".join(f"{key} {value}" for key, value in one.values.items()) or "all" for one in members)
        series = tuple(
            Series(label, np.array([getattr(member, key) for member in members], dtype=float), role=role)
            for label, key, role in (
                ("95 %", "high", "noise"),
                ("median or share", "median", "after"),
                ("5 %", "low", "noise"),
            )
        )
        panels.append(Panel(result, result, series, names))
    return panels


def _by_result(groups: Sequence[Group]) -> Mapping[str, list[Group]]:
    found: dict[str, list[Group]] = {}
    for group in groups:
        found.setdefault(group.result, []).append(group)
    return found
