"""A diagnosis as a terminal shows it: what was compared, causes, error before and after, what lost, what to do next."""

from __future__ import annotations

from collections.abc import Iterator

from gfimu.base.declared import Table
from gfimu.diagnosis.report.plain_words import (
    gain_rows,
    next_steps,
    odds,
    parameter_texts,
    parameter_units,
    percent,
    story,
    summary,
    three_digits,
)
from gfimu.diagnosis.verdict.verdict import Diagnosis

__all__ = ["diagnosis_tables"]


def diagnosis_tables(found: Diagnosis) -> Iterator[Table | str]:
    """Yield the tables and sentences below the headline."""
    yield story(found)
    if found.causes:
        header = ("cause", "what is so in the world", "probability")
        yield Table(f"Verdict: {found.verdict.replace('_', ' ')}", header, _cause_rows(found), left=2)
    yield _errors(found)
    if found.rivals:
        listed = found.rivals[:5]  # numerical: rows of the table
        rivals = [(" + ".join(one.effects) or "nothing", one.why, odds(one.log_odds)) for one in listed]
        yield Table("Other explanations, and why they lost", ("explanation", "why it lost", "odds"), rivals, left=2)
    for step in next_steps(found):
        yield f"next: {step}"


def _cause_rows(found: Diagnosis) -> list[tuple[str, str, str]]:
    rows = []
    for cause in found.causes:
        texts = parameter_texts(cause, parameter_units(found, cause))
        texts = [text for text in texts if text.significant] or texts
        rows += [(cause.effect, summary(found, cause), percent(cause.probability))]
        rows += [(f"  {one.name}", f"{one.value}{f' = {one.familiar}' if one.familiar else ''}", "") for one in texts]
    return rows


def _errors(found: Diagnosis) -> Table:
    residual, gain = found.residual, found.gain
    before, after = (f"{three_digits(one)} m/s²" for one in (residual.rms_before, residual.rms_after))
    rows = [("prediction error, rms", before, after)]
    rows += [(f"validation data: {what}", first, then) for what, first, then in gain_rows(found)]
    share = percent(gain.share_of_excess_removed)
    note = f"the sensors' own noise: {three_digits(residual.noise_floor)} m/s²"
    if share != "–":
        note += f"; on validation data ({gain.held_out}) {share} of the error beyond noise is gone"
    return Table("Error before and after", ("", "before", "after"), rows, note)
