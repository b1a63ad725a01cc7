"""The results of `gfimu benchmark` and its commands."""

from __future__ import annotations

from typing import Annotated

from msgspec import UNSET, UnsetType

from gfimu.commands.results.base import Files, Number, Numbers, Result
from gfimu.files.schema import about

__all__ = ["BenchmarkJudged", "BenchmarkListed", "BenchmarkRun", "BenchmarkSet", "BenchmarkWorlds", "JudgedAnswer"]


class BenchmarkSet(Result, kw_only=True):
    """A set of worlds."""

    name: Annotated[str, about("Its name.")]
    about: Annotated[str, about("What its worlds are.")]
    licence: Annotated[str, about("Licence of its recordings.")]
    dev: Annotated[int, about("Worlds to develop on.")]
    test: Annotated[int, about("Worlds of the published table.")]


class BenchmarkListed(Result, kw_only=True):
    """What the benchmark holds."""

    release: Annotated[str, about("Name of the release.")]
    digest: Annotated[str, about("Hash of its truth, which holds the hash of each recording.")]
    sets: Annotated[list[BenchmarkSet], about("Sets of worlds.")]
    methods: Annotated[list[str], about("Methods that come with it.")]


class BenchmarkWorlds(Result, kw_only=True):
    """Worlds that were written."""

    worlds: Annotated[list[str], about("Their folders, below that of all.")]
    files: Files


class BenchmarkRun(Result, kw_only=True):
    """A run of a method."""

    folder: Annotated[str, about("Its folder.")]
    method: Annotated[str, about("Name of the method in tables.")]
    worlds: Annotated[int, about("Worlds that were answered.")]
    failed: Annotated[int, about("Worlds in which the method failed.")]
    files: Files


class MethodSummary(Result, kw_only=True):
    """What a method reached in a set."""

    set: Annotated[str, about("The set; all: those that are drawn.")]
    method: Annotated[str, about("The method.")]
    worlds: Annotated[int, about("Worlds.")]
    points: Annotated[Number, about("Mean of the points.")]
    points_half_interval: Annotated[Number, about("Half the 95 % interval of that mean.")]
    outcomes: Annotated[dict[str, int], about("Worlds by outcome.")]
    removed_median: Annotated[Number, about("Median share of the squared distance removed in a fresh motion.")]
    predicts_worse: Annotated[int, about("Answers that predict the fresh motion worse than the twin.")]
    removed_measured: Annotated[int, about("Worlds in which the removal can be measured.")]
    sizes: Annotated[int, about("Sizes with a standard deviation, of causes that are hidden.")]
    sizes_within_1_std: Annotated[int, about("Of these within one standard deviation of the truth; theory 68.3 %.")]
    sizes_within_2_std: Annotated[int, about("Of these within two; theory 95.4 %.")]
    processor_s_median: Annotated[Number, about("Median processor time.", "s")]


class JudgedAnswer(Result, kw_only=True):
    """One judged answer."""

    world: Annotated[str, about("The world.")]
    method: Annotated[str, about("The method.")]
    hidden: Annotated[list[str], about("What is hidden.")]
    said: Annotated[list[str], about("Claims of the answer; a set is written a|b.")]
    outcome: Annotated[str, about("The outcome.")]
    points: Annotated[Number, about("Its points; null for measured data.")]
    z: Annotated[Numbers, about("(estimate − truth)/std of each size.")]
    removed: Annotated[Number, about("Share of the squared distance removed in a fresh motion.")]
    expected_ratio: Annotated[Number, about("Expected rms error over that of the answer in the fresh motion.")]
    processor_s: Annotated[Number, about("Processor time.", "s")]


class BenchmarkJudged(Result, kw_only=True):
    """Judged answers and their summary."""

    summaries: Annotated[list[MethodSummary], about("Per set and method.")]
    judged: Annotated[list[JudgedAnswer], about("Per world and method.")]
    files: Annotated[Files | UnsetType, about("What was written, by judge.")] = UNSET
