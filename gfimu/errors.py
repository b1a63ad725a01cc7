"""The errors a user can cause: each is one line that names the file or value and the remedy."""

from __future__ import annotations

from collections.abc import Iterable

__all__ = ["CorruptValueWarning", "GeometryError", "GfimuError", "InputError", "UnitError", "unknown_name"]


class GfimuError(Exception):
    """Base of every error that a user's input or environment can cause; commands print it as one line."""


class InputError(GfimuError, ValueError):
    """A file or value that can't be used as given; commands end with exit code 2."""


class UnitError(InputError):
    """Data in a unit other than the one the operation needs."""


class GeometryError(InputError):
    """A sensor geometry that can't see the motions asked for."""


class CorruptValueWarning(UserWarning):
    """Values of a recording that can be no measurement were left out; commands print it as one line."""


def unknown_name(kind: str, name: str, valid: Iterable[str]) -> InputError:
    """Build the error for a name that is not in a list, with the list."""
    return InputError(f"unknown {kind} {name!r}; valid: {', '.join(sorted(valid))}")
