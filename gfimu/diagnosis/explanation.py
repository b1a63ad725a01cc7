"""What the search for causes ended with."""

from __future__ import annotations

from dataclasses import dataclass

from gfimu.diagnosis.fit import Fit
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.signatures import SignatureSet
from gfimu.world_model import Effect

__all__ = ["Explanation"]


@dataclass(frozen=True)
class Explanation:
    """What the search ended with.

    Parameters
    ----------
    fit : Fit
        The best set of causes.
    rivals : tuple of Fit
        Every other refined set, best first, under the same noise.
    nothing : Fit
        No cause at all, under the same noise.
    without : dict of str to Fit
        The best fit without each cause.
    segments : tuple of Segment
        The data with their drives at the best set.
    fixed : tuple of tuple of Effect
        Effects of each segment's run found beforehand (integrity).
    signatures : SignatureSet
        The last screening, about the best set.
    given_up : bool
        Whether so much is left that the set was neither pruned nor compared with others.
    beside_residue : Fit, optional
        What would be named if all numbers of the calibration were a little off, where that is about as probable.
    left_for : str
        What the search was left for as that is better and not looked for: "walk", "residue", or nothing.
    """

    fit: Fit
    rivals: tuple[Fit, ...]
    nothing: Fit
    without: dict[str, Fit]
    segments: tuple[Segment, ...]
    fixed: tuple[tuple[Effect, ...], ...]
    signatures: SignatureSet
    given_up: bool = False
    beside_residue: Fit | None = None
    left_for: str = ""
