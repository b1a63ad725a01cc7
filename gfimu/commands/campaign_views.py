"""Under `gfimu campaign status`, `table` and `plot`: what the folder of a campaign holds, also while it runs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.files.outputs import OutputFile, writes
from gfimu.results import Panel, PlottedResult, Series, TableResult, one_row, text_column

if TYPE_CHECKING:
    from sim.sweep.pace import Run
    from sim.sweep.sensitivity import Sensitivity
    from sim.sweep.summary import Group

__all__ = ["CampaignStatus", "CampaignTable", "campaign_plot", "campaign_status", "campaign_table"]


@dataclass(frozen=True)
class CampaignStatus(TableResult):
    """Progress of a campaign: cases done, failed and to come.

    Parameters
    ----------
    folder : Path
        Its folder.
    cases, done : int
        Cases of the plan, and those whose row is there.
    failures : dict of str to int
        How many cases failed, by the reason.
    runs : tuple of Run
        Processes that run it now.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.campaign_status("campaign").done  # doctest: +SKIP
    """

    folder: Path
    cases: int
    done: int
    failures: dict[str, int]
    runs: tuple[Run, ...]

    @property
    def rate_per_s(self) -> float:
        """Cases per second of the processes that run it now; what was there before them does not count."""
        return math.fsum(run.rate_per_s for run in self.runs)

    @property
    def left_s(self) -> float:
        """Time until it is done, s; NaN where nothing runs it, or no batch has come yet."""
        return (self.cases - self.done) / self.rate_per_s if self.rate_per_s else math.nan

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row: cases, those done and failed, cases per second, time left."""
        numbers = {"cases": self.cases, "done": self.done, "failed": sum(self.failures.values())}
        return one_row({"folder": self.folder, **numbers, "rate_per_s": self.rate_per_s, "left_s": self.left_s})

    def _heading(self) -> str:
        return f"Progress of the campaign in {self.folder}"

    def _facts(self) -> list[tuple[str, str]]:
        facts = progress_facts(self.cases, self.done, self.failures)
        facts += [(f"process {run.pid} on {run.host}", f"{run.rate_per_s:.3g} cases/s") for run in self.runs]
        return facts if math.isnan(self.left_s) else [*facts, ("time left", f"{self.left_s:.3g} s")]

    def _shown(self) -> None:
        return None

    def to_dict(self) -> dict[str, Any]:
        """Return the content for JSON."""
        return {
            "folder": str(self.folder),
            "cases": self.cases,
            "done": self.done,
            "failures": self.failures,
            "runs": [{"host": run.host, "pid": run.pid, "ran": run.ran} for run in self.runs],
            "rate_per_s": self.rate_per_s,
            "left_s": self.left_s,
        }


@dataclass(frozen=True)
class CampaignTable(PlottedResult):
    """Quantiles of a campaign's results, and their sensitivities to its factors.

    Parameters
    ----------
    groups : tuple of Group
        Quantiles of each result by the values of the factors.
    sensitivities : tuple of Sensitivity
        Share of each result's variance that each factor causes.
    seed_shares : dict of str to float
        Share of each result's variance that the seeds cause; empty without repeats.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.campaign_table("campaign", by=["sensor.range_g"]).to_pandas()  # doctest: +SKIP
    """

    groups: tuple[Group, ...]
    sensitivities: tuple[Sensitivity, ...]
    seed_shares: dict[str, float]

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per group and result: the factors' values, cases, quantiles 5, 50 and 95 %."""
        return group_columns(self.groups)

    def _heading(self) -> str:
        return "Results of a campaign"

    def _facts(self) -> list[tuple[str, str]]:
        return [
            (f"share of {one.factor} in {one.result}", f"{100 * one.first:.3g} %")
            for one in self.sensitivities
            if math.isfinite(one.first)
        ]

    def _panels(self) -> list[Panel]:
        return group_panels(self.groups)

    def to_dict(self) -> dict[str, Any]:
        """Return the content for JSON."""
        return {
            "groups": [group.to_dict() for group in self.groups],
            "sensitivities": [one.to_dict() for one in self.sensitivities],
            "seed_shares": self.seed_shares,
        }


_PICTURE = OutputFile(
    "a picture", (".png", ".svg", ".html"), dict.fromkeys((".png", ".svg", ".html"), ("matplotlib",)), any_case=True
)


def progress_facts(cases: int, done: int, failures: Mapping[str, int]) -> list[tuple[str, str]]:
    """Return how many cases of a campaign are done, and how many failed by the reason, in words."""
    return [("cases done", f"{done} of {cases}"), *((why, f"{count} failed") for why, count in failures.items())]


def group_columns(groups: Sequence[Group]) -> dict[str, NDArray[Any]]:
    """Return groups as columns: the factors' values, then result, cases, failed, low, median_or_share, high."""
    factors = list(groups[0].values) if groups else []
    columns: dict[str, NDArray[Any]] = {name: np.array([group.values[name] for group in groups]) for name in factors}
    columns["result"] = text_column(group.result for group in groups)
    columns |= {key: np.array([getattr(group, key) for group in groups], dtype=int) for key in ("cases", "failed")}
    for key, name in (("low", "low"), ("median", "median_or_share"), ("high", "high")):
        columns[name] = np.array([getattr(group, key) for group in groups], dtype=float)
    return columns


def group_panels(groups: Sequence[Group]) -> list[Panel]:
    """Return one panel per result: median and quantiles 5 and 95 % of each group."""
    panels = []
    for result in dict.fromkeys(group.result for group in groups):
        members = [group for group in groups if group.result == result]
        names = tuple(", ".join(f"{key} {value}" for key, value in one.values.items()) or "all" for one in members)
        series = tuple(
            Series(label, np.array([getattr(one, key) for one in members], dtype=float), role=role)
            for label, key, role in (
                ("95 %", "high", "noise"),
                ("median or share", "median", "after"),
                ("5 %", "low", "noise"),
            )
        )
        panels.append(Panel(result, result, series, names))
    return panels


@writes(reads=("folder",))
def campaign_status(folder: str | Path) -> CampaignStatus:
    """Return the progress of a campaign, also while another process runs it.

    Raises
    ------
    InputError
        If the folder holds no campaign, or a file in it is damaged.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.campaign_status("campaign").done  # doctest: +SKIP
    """
    from sim.sweep.dataset import Dataset
    from sim.sweep.design import Design
    from sim.sweep.pace import runs
    from sim.sweep.summary import failures

    dataset = Dataset.open(folder)
    running = tuple(runs(dataset))
    table = dataset.table(["failure"])
    return CampaignStatus(dataset.folder, len(Design(dataset.plan)), len(table), failures(table), running)


@writes(reads=("folder",), csv=OutputFile("a table", (".csv",)))
def campaign_table(folder: str | Path, *, by: Sequence[str] = (), csv: str | Path | None = None) -> CampaignTable:
    """Return quantiles of each result by the values of factors, and which factors cause its variance.

    Parameters
    ----------
    folder : str or Path
        Folder of the campaign.
    by : sequence of str
        Factors by whose values the results are grouped; all that are lists of values by default.
    csv : str or Path, optional
        File for the quantiles, one row per group and result.

    Raises
    ------
    InputError
        If the folder holds no campaign, a file in it is damaged, or there is no such factor.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.campaign_table("campaign").to_pandas()  # doctest: +SKIP
    """
    from sim.sweep.dataset import Dataset
    from sim.sweep.design import Design
    from sim.sweep.sensitivity import seed_shares, sensitivities
    from sim.sweep.summary import grouped

    dataset = Dataset.open(folder)
    table, design = dataset.table(), Design(dataset.plan)
    found = CampaignTable(
        tuple(grouped(table, dataset.plan, list(by))), tuple(sensitivities(table, design)), seed_shares(table, design)
    )
    if csv is not None:
        _write_csv(csv, found.groups)
    return found


@writes(reads=("folder",), out=_PICTURE)
def campaign_plot(folder: str | Path, *, out: str | Path, result: Sequence[str] = ()) -> list[str]:
    """Draw results against each factor, and which factors cause their variance; return the names of what is drawn.

    Parameters
    ----------
    folder : str or Path
        Folder of the campaign.
    out : str or Path
        Picture to write; an ``.html`` page holds it with the counts and the reasons of failures.
    result : sequence of str
        Results to draw; the first four by default.

    Raises
    ------
    InputError
        If the folder holds no campaign or no result yet, a file in it is damaged, or there is no such result.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.campaign_plot("campaign", out="campaign.png")  # doctest: +SKIP
    """
    from sim.sweep.dataset import Dataset
    from sim.sweep.design import Design
    from sim.sweep.picture import campaign_picture

    dataset = Dataset.open(folder)
    return campaign_picture(out, dataset.folder, dataset.table(), Design(dataset.plan), list(result))


def _write_csv(path: str | Path, groups: Sequence[Group]) -> None:
    from csv import writer

    from gfimu.files.atomic_file import atomic_path

    factors = list(groups[0].values) if groups else []
    with atomic_path(path) as part, Path(part).open("w", encoding="utf-8", newline="") as file:
        lines = writer(file, lineterminator="\n")
        lines.writerow([*factors, "result", "cases", "failed", "low", "median_or_share", "high"])
        for one in groups:
            lines.writerow([*one.values.values(), one.result, one.cases, one.failed, one.low, one.median, one.high])
