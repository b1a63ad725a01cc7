"""Combinations of sizes that the data can't determine.

On an upright table no reading depends on the height of a chip, nor at rest on a gain across gravity. Of a free body
nothing is known of the specific force, so that what all chips share passes for it: an offset, a displacement, a delay.
None of that is a list of special cases: the combinations are the eigenvectors of the normal equations, in units of the
prior, along which the data say less than the prior does.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from gfimu.array.array import AccelerometerArray
from gfimu.base.declared import Declared, figure
from gfimu.diagnosis.fit.gauss_newton import determined
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.screening import Screening, Signature

__all__ = ["Undetermined", "undetermined", "undetermined_sentence"]

_ALIKE = 0.15  # numerical: by which weights may differ that one word is enough for
_LISTED = 3  # numerical: combinations in a sentence


@dataclass(frozen=True)
class Undetermined(Declared):
    """A combination of the sizes of an effect that the data can't see."""

    effect: Annotated[str, figure("The effect.")]
    combination: Annotated[dict[str, float], figure("Weights by parameter, relative to the largest.")]

    @property
    def text(self) -> Annotated[str, figure("The combination in words.")]:
        """The combination in words."""
        keys = list(self.combination)
        if len(keys) == 1:
            return f"{self.effect} {keys[0]}"
        weights = np.array([*self.combination.values()])
        if np.ptp(weights) < _ALIKE:
            return f"{self.effect} {', '.join(keys)} by the same amount"
        return f"{self.effect} " + ", ".join(f"{key} × {weight:.2g}" for key, weight in self.combination.items())


def undetermined(
    screening: Screening, array: AccelerometerArray, least: float, only: Collection[str] | None = None
) -> tuple[Undetermined, ...]:
    """Return the combinations of the sizes of each effect without a shape that have less information than ``least``.

    ``only`` are the names of the effects to look at; by default all.
    """
    found: list[Undetermined] = []
    for signature in screening.signatures:
        if not signature.shape and (only is None or signature.family.name in only):
            found += _of_effect(signature, screening.gram, array, least)
    return tuple(found)


def _of_effect(
    signature: Signature, gram: NDArray[np.float64], array: AccelerometerArray, least: float
) -> list[Undetermined]:
    sizes = signature.family.sizes(array)
    mine = gram[np.ix_(signature.columns, signature.columns)]
    _, turn, seen = determined(mine, least)
    basis = turn[:, ~seen].T  # (d, k)
    if not len(basis):
        return []
    # Rows with one size each that no other row has: the plainest basis of the same space.
    _, _, order = qr(basis, pivoting=True)
    plain = np.linalg.solve(basis[:, order[: len(basis)]], basis)
    plain *= [size.prior_std for size in sizes]
    out = []
    for row in plain / plain[np.arange(len(plain)), np.argmax(np.abs(plain), axis=1)][:, None]:
        keep = np.abs(row) > Policy.small
        combination = {size.key: round(float(w), 3) for size, w, on in zip(sizes, row, keep, strict=True) if on}
        out.append(Undetermined(str(signature.family.name), combination))
    return out


def undetermined_sentence(combinations: tuple[Undetermined, ...]) -> str:
    """Return one sentence on what stays at zero because these data can't see it."""
    if len(combinations) == 1:
        return f"These data can't determine one combination, which stays at zero: {combinations[0].text}."
    # One of each effect first: they say most.
    first = list({combination.effect: combination for combination in reversed(combinations)}.values())[::-1][:_LISTED]
    named = "; ".join(one.text for one in first)
    return (
        f"These data can't determine {len(combinations)} combinations, which stay at zero with the standard "
        f"deviation of their prior, such as {named}."
    )
