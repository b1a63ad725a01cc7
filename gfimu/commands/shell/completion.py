"""The values that a shell offers for arguments and options: names of shipped files, effects, methods and fixed words.

Each function returns names with a description, which may be empty. Where none fits, the shell offers file names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

__all__ = [
    "Offer",
    "arrays",
    "beginning",
    "effects",
    "frames",
    "maps",
    "objectives",
    "parts",
    "scenarios",
    "shown",
    "twins",
]

Values = list[tuple[str, str]]

_UNKNOWN = "unknown"  # stands in the catalogue for what no effect explains; no run can be designed for it


@dataclass(frozen=True)
class Offer:
    """A word that a shell offers, with its description."""

    value: str
    help: str = ""
    type: str = "plain"


def _models(kind: str) -> Callable[[str], Values]:
    """Return the function that offers the files of a kind that come with gfimu."""

    def offer(incomplete: str) -> Values:
        from gfimu.base.files.model_files import list_models

        return beginning(incomplete, list_models(kind))

    return offer


arrays, parts, maps = _models("arrays"), _models("parts"), _models("maps")
scenarios, twins, _frames = _models("scenarios"), _models("twins"), _models("frames")


def frames(incomplete: str) -> Values:
    """Offer the frame formats that come with gfimu, and those that are built in."""
    return [*beginning(incomplete, ("lpc1768", "mimu4444")), *_frames(incomplete)]


def effects(incomplete: str) -> Values:
    """Offer the effects of the library; those of other packages are not offered, as this would load them."""
    return [one for one in _catalogued(incomplete) if one[0] != _UNKNOWN]


def objectives(incomplete: str) -> Values:
    """Offer what `gfimu optimize` can make small."""
    from gfimu.array_search.objectives import OBJECTIVES

    return beginning(incomplete, OBJECTIVES)


def shown(incomplete: str) -> Values:
    """Offer all that `gfimu show` prints by name."""
    kinds = (arrays, parts, maps, twins, scenarios, _frames, _catalogued)
    return [name for offer in kinds for name in offer(incomplete)]


def _catalogued(incomplete: str) -> Values:
    from gfimu.model.effect_catalogue import effect_catalogue

    return beginning(incomplete, effect_catalogue())


def beginning(incomplete: str, names: Iterable[str]) -> Values:
    """Offer those of some names that begin so."""
    return [(name, "") for name in names if name.startswith(incomplete)]
