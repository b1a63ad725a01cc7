"""Scores of arrays side by side: what `gfimu.score` returns, and the tables that it prints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array_search.scoring import Score, ranking_remark, score_panels
from gfimu.base.declared import Declared, Table, cell, figure, table
from gfimu.base.errors import InputError
from gfimu.base.results import Panel, PlottedResult, Series
from gfimu.base.short_repr import joined
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.rate.axis.accuracy.bounds import AxisBounds
from gfimu.rate.health.protection import FaultProtection, LeastFaults, protection_remark

__all__ = ["Scores", "score_tables"]

_SHOWN = (
    "array",
    "channels",
    "condition_number",
    "gdop",
    "gdop_joint",
    "rate_bound_z_rad_s",
    "sigma_rate_filter_rad_s",
)
"""Columns of the notebook's table."""

_MG = 1e-3 * STANDARD_GRAVITY
_NAMED = 3
"""Arrays whose length units the note names one by one; more are put together by unit."""


@dataclass(frozen=True)
class Scores(Declared, PlottedResult):
    """Scores of arrays side by side, in the order in which the arrays were given; counts and iterates like a list.

    Examples
    --------
    >>> import gfimu
    >>> scores = gfimu.score(["cube12", "corners8"])
    >>> [f"{one.name} {one.gdop:.3f}" for one in scores.rigid]
    ['cube12 1.061', 'corners8 0.750']
    >>> scores.best.name
    'corners8'
    """

    scores: Annotated[
        tuple[Score | AxisBounds, ...],
        figure("Figures of merit of each array, or its bounds about its axis.", key="arrays"),
    ] = ()

    def __len__(self) -> int:
        return len(self.scores)

    def __iter__(self) -> Iterator[Score | AxisBounds]:
        return iter(self.scores)

    def __getitem__(self, place: int) -> Score | AxisBounds:
        return self.scores[place]

    def __repr__(self) -> str:
        figures = [f"{one.name} {one.gdop:.4g}" for one in self.rigid] + [one.array for one in self.about_axis]
        return joined(self, figures)

    @property
    def length_unit_m(
        self,
    ) -> Annotated[
        float | None, figure("Length that counts as 1; absent with --axis.", "m", absent=True, before="scores")
    ]:
        """Length that counts as 1 in the figures of the first array, m; None where all turn about an axis."""
        return self.rigid[0].length_unit_m if self.rigid else None

    @property
    def rigid(self) -> tuple[Score, ...]:
        """Scores of the arrays that see all six motions."""
        return tuple(one for one in self if isinstance(one, Score))

    @property
    def about_axis(self) -> tuple[AxisBounds, ...]:
        """Bounds of the arrays that were scored about an axis."""
        return tuple(one for one in self if isinstance(one, AxisBounds))

    @property
    def best(self) -> Score:
        """The score of least GDOP among the arrays that see all six motions.

        Raises
        ------
        InputError
            If none does.
        """
        if not self.rigid:
            raise InputError("no array here sees all six motions, so none has a GDOP; see about_axis")
        return min(self.rigid, key=lambda one: one.gdop)

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per array, with the columns of its own table; NaN where an array has no such figure."""
        rows = [one.to_columns() for one in self]
        names = list(dict.fromkeys(name for row in rows for name in row))
        return {name: np.concatenate([row.get(name, np.array([np.nan])) for row in rows]) for name in names}

    def shown(self) -> Iterator[Table | str]:
        """Yield the tables and sentences that people read."""
        if self.rigid:
            yield from score_tables(self.rigid)
            yield from _fault_tables({one.name: one.protection for one in self.rigid if one.protection is not None})
        if self.about_axis:
            yield from _axis_tables(self.about_axis)

    def _heading(self) -> str:
        return "Scores"

    def _facts(self) -> Sequence[tuple[str, str]]:
        return ()

    def _shown(self) -> dict[str, NDArray[Any]]:
        columns = self.to_columns()
        shown = _SHOWN if self.rigid else tuple(columns)
        return {name: columns[name] for name in shown if name in columns}

    def _notes(self) -> tuple[str, ...]:
        remark = ranking_remark(self.rigid)
        return (remark,) if remark else ()

    def _panels(self) -> list[Panel]:
        if self.rigid:
            return score_panels(self.rigid)
        names = tuple(one.array for one in self.about_axis)
        kinds = {
            "one sample": [one.sample_std for one in self.about_axis],
            "filter, settled": [one.filter_std for one in self.about_axis],
        }
        series = tuple(Series(label, np.array(values)) for label, values in kinds.items())
        return [Panel("bounds on the rate about the axis", "σ of the rate, rad/s", series, names, scale="zero")]


def score_tables(scores: Sequence[Score]) -> Iterator[Table | str]:
    """Yield the figures of merit of arrays as people read them."""
    first = scores[0]
    yield table(
        "Array geometries",
        scores,
        "name n_channels condition_number gdop gdop_joint contaminated null_space_rank",
        note=f"Lengths in units of {_units(scores)}. GDOP*: with ω unknown and no recursion (joint form). "
        "ω seen: products of ω that the null space of J sees.",
    )
    yield table(
        "Standard deviations, x y z",
        scores,
        "name sigma_alpha sigma_p rate_bound_rad_s",
        note="σ_α (per length unit) and σ_p for channels of standard deviation 1. σ_ω: least one sample can reach "
        f"(Cramér–Rao) at ω = ({', '.join(f'{one:.4g}' for one in first.omega_rad_s)}) rad/s and channel noise "
        f"{first.noise_m_s2:.4g} m/s²; —: one sample doesn't determine it.",
    )
    if remark := ranking_remark(scores):
        yield remark
    terms = [
        (score.name, name.replace("alpha", "α"), text)
        for score in scores
        for name, text in score.omega_squared_terms.items()
    ]
    if terms:
        yield Table("Products of ω left in the linear solution [α; p] = S a", ("array", "of", "terms"), terms)


def _units(scores: Sequence[Score]) -> str:
    """Return in words which length counts as 1."""
    units: dict[float, list[str]] = {}
    for score in scores:
        units.setdefault(score.length_unit_m, []).append(score.name)
    if len(units) == 1:
        return f"{next(iter(units)):g} m"
    if len(scores) <= _NAMED:
        return ", ".join(f"{score.length_unit_m:g} m ({score.name})" for score in scores)
    names = {unit: ", ".join(same) if len(same) < _NAMED else f"{len(same)} arrays" for unit, same in units.items()}
    return "each array's own: " + "; ".join(f"{unit:g} m for {names[unit]}" for unit in sorted(names))


def _fault_tables(found: Mapping[str, FaultProtection]) -> Iterator[Table | str]:
    """Yield the least fault of a channel that each array finds, and of each channel where that was asked for."""
    first = next(iter(found.values()))
    head = ("seen", "assigned", "seen, ω unknown", "assigned, ω unknown")
    yield Table(
        f"Least fault of a channel that is found within {first.duration_s:g} s, worst channel, mg",
        ("array", *head, "unseen error of α, rad/s²"),
        [(name, *_in_mg(one.worst), cell(one.worst.unseen_alpha_rad_s2, ".3g")) for name, one in found.items()],
        note=f"A constant fault, found with 95 % probability at {first.sample_rate_hz:g} Hz and channel noise "
        f"{first.noise_m_s2:.4g} m/s². Assigned: to its channel. ω unknown: by the parity space of single samples; "
        "else as a filter follows ω. Unseen error of α: by a fault that is just not seen. —: never.",
    )
    for name, protection in found.items():
        rows = [(one.channel, *_in_mg(one.least), one.rival or "—") for one in protection.channels or ()]
        if rows:
            yield Table(f"{name}: least fault of each channel, mg", ("channel", *head, "nearest channel"), rows)
    if remark := protection_remark(found):
        yield remark


def _in_mg(faults: LeastFaults) -> list[str]:
    figures = (
        faults.detected_m_s2,
        faults.isolated_m_s2,
        faults.detected_without_rate_m_s2,
        faults.isolated_without_rate_m_s2,
    )
    return [cell(one / _MG, ".2f") for one in figures]


def _axis_tables(bounds: Sequence[AxisBounds]) -> Iterator[Table | str]:
    """Yield the bounds of rotations about an axis, and what an estimate reaches."""
    first = bounds[0]
    yield table(
        f"Rotation about one known axis at {first.rate_rad_s:.4g} rad/s: bounds with an exact mounting",
        bounds,
        "array hub acceleration_std square_std sample_std filter_std",
        note="—: not observable. A filter is at this bound with biases known, white noise and any motion.",
    )
    predicted = [(one, one.predicted) for one in bounds if one.predicted is not None]
    if not predicted:
        return
    run = predicted[0][1].run
    hub = f", acceleration of a free hub {run.hub_std_m_s2:g} m/s²" if any(one.hub == "free" for one in bounds) else ""
    yield Table(
        f"What gfimu estimate reaches at {first.rate_rad_s:.4g} rad/s, in a run of {run.duration_s:g} s from rest",
        ("array", "inclination, rad", "σ_Ω by noise, rad/s", "by the mounting, rad/s", "σ_Ω, rad/s"),
        [
            (
                one.array,
                cell(found.inclination_rad, ".3g"),
                cell(found.noise_std, ".3g"),
                "exact" if one.axis.uncertainty.exact else cell(found.mounting_std, ".3g"),
                cell(found.std, ".3g"),
            )
            for one, found in predicted
        ],
        note="Gravity, which turns in an inclined body, counts too; the uncertain constants of the mounting are "
        f"estimated in that run. Change of α of density {run.jerk_rad2_s5:g} rad²/s⁵{hub}.",
    )
    for one, found in predicted:
        if found.undetermined:
            yield f"{one.array}: such a run does not determine {'; '.join(found.undetermined)}."
