"""The results of `gfimu campaign` and its commands."""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import UNSET, UnsetType

from gfimu.commands.results.base import Files, Number, Result
from gfimu.files.schema import about

__all__ = ["Campaign", "CampaignPlot", "CampaignStatus", "CampaignTable", "Group", "Run", "Sensitivity"]


class Group(Result, kw_only=True):
    """Quantiles of one result for one combination of factors."""

    values: Annotated[dict[str, Any], about("Values of the factors; of a range, the part of it.")]
    result: Annotated[str, about("Name of the result, with its unit.")]
    cases: Annotated[int, about("Cases.")]
    failed: Annotated[int, about("Cases that failed.")]
    low: Annotated[Number, about("5 % quantile; of a share, lower 95 % limit.")]
    median: Annotated[Number, about("Median; of a share, the share.")]
    high: Annotated[Number, about("95 % quantile; of a share, upper 95 % limit.")]
    share: Annotated[bool, about("Whether the result is true or false, and the figures are a share.")]


class Campaign(Result, kw_only=True):
    """A campaign."""

    folder: Annotated[str, about("Its folder.")]
    cases: Annotated[int, about("Cases of the plan.")]
    done: Annotated[int, about("Cases that are done, failed ones included.")]
    failures: Annotated[dict[str, int], about("Cases that failed, by reason.")]
    groups: Annotated[list[Group], about("Quantiles of each result.")]
    files: Files


class Run(Result, kw_only=True):
    """A process that works at a campaign."""

    host: Annotated[str, about("Its machine.")]
    pid: Annotated[int, about("Its number.")]
    ran: Annotated[int | UnsetType, about("Cases that it has done.")] = UNSET


class CampaignStatus(Result, kw_only=True):
    """How far a campaign is."""

    folder: Annotated[str, about("Its folder.")]
    cases: Annotated[int, about("Cases of the plan.")]
    done: Annotated[int, about("Cases that are done, failed ones included.")]
    failures: Annotated[dict[str, int], about("Cases that failed, by reason.")]
    runs: Annotated[list[Run], about("Processes that work at it.")]
    rate_per_s: Annotated[Number, about("Cases per second.", "1/s")]
    left_s: Annotated[Number, about("Time that the remaining cases take; null: not known.", "s")]


class Sensitivity(Result, kw_only=True):
    """Share of one factor in the variance of one result."""

    result: Annotated[str, about("Name of the result.")]
    factor: Annotated[str, about("Name of the factor.")]
    method: Annotated[str, about("How it was found.")]
    points: Annotated[int, about("Combinations that it was found from.")]
    first: Annotated[Number, about("First-order index.")]
    first_low: Annotated[Number, about("Lower 95 % limit.")]
    first_high: Annotated[Number, about("Upper 95 % limit.")]
    total: Annotated[Number, about("Total index; null where the method gives none.")]
    total_low: Annotated[Number, about("Lower 95 % limit.")]
    total_high: Annotated[Number, about("Upper 95 % limit.")]


class CampaignTable(Result, kw_only=True):
    """Quantiles and sensitivities of a campaign."""

    groups: Annotated[list[Group], about("Quantiles of each result.")]
    sensitivities: Annotated[list[Sensitivity], about("Share of each factor in the variance of each result.")]
    seed_shares: Annotated[
        dict[str, Number], about("Share of the seeds in the variance of each result; empty without repeats.")
    ]
    files: Files


class CampaignPlot(Result, kw_only=True):
    """A picture of a campaign."""

    results: Annotated[list[str], about("Results that are drawn.")]
    files: Files
