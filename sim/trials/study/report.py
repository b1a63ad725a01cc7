"""Tables and figures of a study from its outcomes: rates with intervals, confusion, detection, reliability."""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.base.files.atomic_file import write_text
from sim.trials.study.figures import draw_confusion, draw_detection, draw_reliability
from sim.trials.study.outcome_file import keep_outcomes
from sim.trials.study.tally import LEAST_APART, LEAST_VISIBLE, Outcome, Tally, rate_with_interval, score, visible

__all__ = ["reliability", "summarise", "write_report"]

_REMARKS = "<!-- remarks, kept by the report -->"
_END_OF_REMARKS = "<!-- end of remarks -->"

_DRIVE_UNKNOWN = (0.0, 5.0, 7.0, 10.0, 15.0, 60.0, np.inf)


def _by(outcomes: Iterable[Outcome], *keys: str) -> dict[tuple[Any, ...], list[Outcome]]:
    groups: dict[tuple[Any, ...], list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        groups[tuple(outcome[key] for key in keys)].append(outcome)
    return dict(groups)


def _row(cells: Iterable[object]) -> str:
    return "| " + " | ".join(str(cell) for cell in cells) + " |\n"


def _table(header: Sequence[str], rows: Iterable[Iterable[object]]) -> str:
    return _row(header) + _row(["---"] * len(header)) + "".join(_row(row) for row in rows) + "\n"


def _quantile(values: NDArray[np.float64], q: float, form: str) -> str:
    return format(float(np.quantile(values, q)), form) if len(values) else "–"


def _overview(outcomes: Sequence[Outcome]) -> str:
    header = (
        "study",
        "worlds from",
        "hidden",
        "runs",
        "right alone %",
        "or one of an inseparable set %",
        "right in any set %",
        "wrong name %",
        "a set %",
        "nothing %",
        "unknown %",
        "crashed",
        "excess removed, median / 10th",
        "parameters within 3 std %",
        "CPU s, median / 90th",
    )
    rows = []
    for (study, source), group in sorted(_by(outcomes, "study", "source").items()):
        for hidden, part in sorted(_by([{**o, "hidden": len(o["effects"])} for o in group], "hidden").items()):
            tally = Tally(part)
            removed = Tally([o for o, s in zip(tally.outcomes, tally.scores, strict=True) if s["named"]]).numbers(
                "share_of_excess_removed"
            )
            z = tally.z()
            rows.append(
                (
                    study,
                    Path(source.partition(":")[0]).stem if ":" in source else source,
                    hidden[0],
                    len(tally),
                    *(tally.share(what) for what in ("exact", "fair", "within", "wrong", "set", "nothing", "unknown")),
                    sum(entry["error"] for entry in tally.scores),
                    f"{_quantile(removed, 0.5, '.4f')} / {_quantile(removed, 0.1, '.3f')}",
                    f"{100 * float(np.mean(z < 3)):.1f} of {len(z)}" if len(z) else "–",
                    " / ".join(_quantile(tally.numbers("processor_s"), q, ".1f") for q in (0.5, 0.9)),
                )
            )
    return _table(header, rows)


def _noise_levels(outcomes: Sequence[Outcome]) -> str:
    nulls = [outcome for outcome in outcomes if outcome["study"] == "nulls"]
    rows = []
    for (level, tacho), group in sorted(_by(nulls, "bias_instability_mg", "tacho_noise").items()):
        tally = Tally(group)
        loose = sum(bool(outcome["noise"].get("calibration_residue")) for outcome in group if "noise" in outcome)
        rows.append((level, tacho, len(tally), tally.share("named"), tally.share("unknown"), loose))
    header = (
        "bias instability, mg",
        "tachometer noise, rad/s",
        "runs",
        "named %",
        "unknown %",
        "calibration residue in",
    )
    return "## Nothing hidden\n\n" + _table(header, rows) if rows else ""


def _misses(outcomes: Sequence[Outcome]) -> str:
    inside = [outcome for outcome in outcomes if not outcome["without"] and outcome["study"] != "exotics"]
    single = [outcome for outcome in inside if len(outcome["effects"]) == 1]
    rows = []
    for (effect,), group in sorted(_by([{**o, "effect": o["effects"][0]} for o in single], "effect").items()):
        tally = Tally(group)
        other = Counter(
            f"{tally.words(outcome)} (d′ {outcome['size']:.0f})" if outcome["size"] else tally.words(outcome)
            for outcome, entry in zip(tally.outcomes, tally.scores, strict=True)
            if not entry["exact"]
        )
        named = "; ".join(f"{name} × {count}" if count > 1 else name for name, count in other.most_common())
        rows.append((f"`{effect}`", len(tally), tally.share("exact"), tally.share("within"), named))
    header = ("hidden", "runs", "right alone %", "right in the set %", "what was said otherwise")
    return _drive_unknown(single) + "## One effect hidden: what was said\n\n" + _table(header, rows) if rows else ""


def _drive_unknown(single: Sequence[Outcome]) -> str:
    """Tell what was said by the size that is left when the drive has to be found from the same data."""
    sized = [outcome for outcome in single if outcome.get("drive_unknown") is not None]
    rows = []
    for least, most in itertools.pairwise(_DRIVE_UNKNOWN):
        group = [outcome for outcome in sized if least <= outcome["drive_unknown"] < most]
        if group:
            tally = Tally(group)
            span = f"{least:g} to {most:g}" if np.isfinite(most) else f"above {least:g}"
            rows.append((span, len(group), *(tally.share(what) for what in ("exact", "fair", "within", "nothing"))))
    header = ("d′, drive unknown", "runs", "right alone %", "or an inseparable set %", "in any set %", "nothing %")
    return "## One effect hidden: size with the drive unknown\n\n" + _table(header, rows) if rows else ""


def _left_out(outcomes: Sequence[Outcome]) -> str:
    outside = [outcome for outcome in outcomes if outcome["without"] or outcome["study"] == "exotics"]
    rows = []
    for (effect,), group in sorted(_by([{**o, "effect": o["effects"][0]} for o in outside], "effect").items()):
        tally = Tally(group)
        said = Counter(tally.words(outcome) for outcome in tally.outcomes)
        rows.append(
            (f"`{effect}`", len(tally), tally.share("unknown"), "; ".join(f"{k} × {v}" for k, v in said.most_common()))
        )
    header = ("hidden, not in the library", "runs", "unknown %", "said")

    def left(outcome: Outcome) -> float:
        return min((outcome.get("left_by") or {"": 0.0}).values())

    def taken(least: float, most: float = np.inf) -> list[Outcome]:
        return [o for o in outside if o["without"] and least <= left(o) < most]

    groups = {
        "exotic": [o for o in outside if o["study"] == "exotics"],
        f"taken out, d′ > {2 * LEAST_APART:g} left by the best two others": [
            o for o in outside if o["without"] and (o.get("left_by_two") or 0.0) > 2 * LEAST_APART
        ],
        f"taken out, d′ > {2 * LEAST_APART:g} left by the best other effect": taken(2 * LEAST_APART),
        f"taken out, d′ {LEAST_APART:g} to {2 * LEAST_APART:g} left": taken(LEAST_APART, 2 * LEAST_APART),
        "taken out, confounded with one other effect": taken(0.0, LEAST_APART),
    }
    totals = [(f"**{name}**", len(group), Tally(group).share("unknown"), "") for name, group in groups.items() if group]
    return "## Outside the library\n\n" + _table(header, [*totals, *rows]) if rows else ""


def _several(outcomes: Sequence[Outcome]) -> str:
    """List each run with two or three hidden effects that was not named right alone."""
    rows = []
    for outcome in outcomes:
        tally = Tally([outcome])
        if outcome["study"] in {"pairs", "triples"} and not tally.scores[0]["exact"]:
            hidden = " + ".join(sorted(outcome["effects"]))
            rows.append((outcome["study"], f"{outcome['size']:.0f}", hidden, tally.words(outcome)))
    header = ("study", "d′ of each", "hidden", "said")
    return (
        "## Two and three effects hidden: what was not named right alone\n\n" + _table(header, sorted(rows))
        if rows
        else ""
    )


def _probabilities(outcomes: Sequence[Outcome]) -> str:
    bins = reliability(outcomes)
    if not bins:
        return ""
    causes = sum(count for _, _, count in bins)
    error = sum(count * abs(stated - right) for stated, right, count in bins) / causes
    rows = [
        (f"{stated:.3f}", "{:.3f} ({:.2f}–{:.2f})".format(*rate_with_interval(round(right * count), count)), count)
        for stated, right, count in bins
    ]
    return (
        "## Stated probabilities\n\n"
        + _table(("stated, mean of the bin", "observed, with its 95 % interval", "causes"), rows)
        + f"Expected calibration error, over all {causes} causes: {error:.3f}.\n\n"
    )


def _baselines(outcomes: Sequence[Outcome]) -> str:
    rows = []
    for (method, study), group in sorted(_by(outcomes, "method", "study").items()):
        tally = Tally(group)
        z = tally.z()
        rows.append(
            (
                method,
                study,
                len(tally),
                tally.share("exact"),
                tally.share("wrong"),
                f"{100 * float(np.mean(z < 1.96)):.0f} of {len(z)}" if len(z) else "–",
                _quantile(tally.numbers("processor_s"), 0.5, ".1f"),
            )
        )
    header = ("method", "study", "runs", "right alone %", "wrong name %", "95 % intervals cover %", "CPU s")
    return "## Against simpler methods, same recordings\n\n" + _table(header, rows) if rows else ""


def summarise(outcomes: Sequence[Outcome]) -> str:
    """Return the tables as Markdown."""
    seen = [outcome for outcome in outcomes if visible(outcome)]
    own = [outcome for outcome in seen if "method" not in outcome]
    rivals = [outcome for outcome in seen if "method" in outcome]
    shared = {(outcome["key"], outcome["source"]) for outcome in rivals}
    same = [{**outcome, "method": "gfimu"} for outcome in own if (outcome["key"], outcome["source"]) in shared]
    return (
        "## Overview\n\nRates in per cent with their 95 % intervals. "
        f"Left out: {len(outcomes) - len(seen)} runs in which what was drawn shows with d′ below {LEAST_VISIBLE:g} "
        "(a clipping level that is never reached, a weakly excited mode).\n\n"
        + _overview(own)
        + _noise_levels(own)
        + _misses(own)
        + _several(own)
        + _left_out(own)
        + _probabilities(own)
        + _baselines([*same, *rivals])
    )


def reliability(outcomes: Sequence[Outcome]) -> list[tuple[float, float, int]]:
    """Return stated probability, observed frequency and number of causes per bin of probability."""
    pairs = [
        (float(cause["probability"]), cause["effect"] in outcome["effects"])
        for outcome in outcomes
        if not outcome["without"] and outcome["study"] != "exotics"
        for cause in outcome["causes"]
    ]
    edges = np.array([0.0, 0.3, 0.5, 0.7, 0.9, 0.99, 1.0 + 1e-12])
    bins = []
    for low, high in itertools.pairwise(edges):
        inside = [(stated, right) for stated, right in pairs if low <= stated < high]
        if inside:
            stated, right = np.mean(np.array(inside, dtype=float), axis=0)
            bins.append((float(stated), float(right), len(inside)))
    return bins


def _remarks(page: Path) -> str:
    """Return what was written by hand into a page, blank lines around it; nothing where there is no page."""
    if not page.exists():
        return ""
    _, mark, after = page.read_text(encoding="utf-8").partition(_REMARKS)
    if not mark or _END_OF_REMARKS not in after:
        raise InputError(f"{page}: no marks around remarks, which would be lost; add {_REMARKS} and {_END_OF_REMARKS}")
    kept = after.partition(_END_OF_REMARKS)[0].strip("\n")
    return f"\n{kept}\n" if kept else ""


def write_report(outcomes: Sequence[Outcome], folder: str | Path) -> list[Path]:
    """Write ``diagnosis-study.md`` and its figures into a folder; return the files.

    Remarks that stand in the page between two marks, written by hand, are kept.

    Raises
    ------
    InputError
        If there is such a page without the marks.
    """
    place = Path(folder)
    remarks = _remarks(place / "diagnosis-study.md")
    own = [outcome for outcome in outcomes if "method" not in outcome and visible(outcome)]
    singles = [outcome for outcome in own if outcome["study"] == "singles"]
    figures: list[tuple[str, str, Path]] = []
    if singles:
        by_size = [
            (size, [score(outcome) for outcome in group])
            for (size,), group in sorted(_by(singles, "size").items())
            if size
        ]
        tally = Tally(singles)
        confusion = [(outcome["effects"][0], tally.words(outcome)) for outcome in singles]
        figures += [
            ("detection", "Right name against size", draw_detection(by_size, place / "figures/study_detection.png")),
            ("confusion", "Hidden against named", draw_confusion(confusion, place / "figures/study_confusion.png")),
        ]
    bins = reliability(own)
    if bins:
        figures.append(
            ("reliability", "Stated against observed", draw_reliability(bins, place / "figures/study_reliability.png"))
        )
    text = (
        "# Study of the diagnosis\n\n"
        "Hidden worlds are drawn from fixed seeds; the diagnosis is not given the noise levels. A size is "
        "d′ = √Σ(Δ/σ)² over all channels and the tachometer with the drive known. Made by\n\n"
        "```\npython -m sim.trials.study run STUDY ... --out outcomes\n"
        "python -m sim.trials.study report docs/accuracy/diagnosis-study.jsonl.xz outcomes --out docs/accuracy\n```\n\n"
        "Every outcome is in `diagnosis-study.jsonl.xz`; what is run again replaces what was there.\n\n"
        f"{_REMARKS}\n{remarks}\n{_END_OF_REMARKS}\n\n"
        + summarise(outcomes)
        + "".join(f"## {title}\n\n![{name}](figures/{path.name})\n\n" for name, title, path in figures)
    )
    write_text(place / "diagnosis-study.md", text.rstrip("\n") + "\n")
    kept = keep_outcomes(outcomes, place / "diagnosis-study.jsonl.xz")
    return [place / "diagnosis-study.md", kept, *(path for _, _, path in figures)]
