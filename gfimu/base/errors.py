"""The errors and warnings a user can cause: each is one line that names the file or value and the remedy."""

from __future__ import annotations

import difflib
import os
import re
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

__all__ = [
    "CorruptValueWarning",
    "GeometryError",
    "GfimuError",
    "GfimuWarning",
    "InputError",
    "MissingPackageError",
    "OmittedFileWarning",
    "RecordingWarning",
    "UnitError",
    "WriteError",
    "check_name",
    "did_you_mean",
    "naming",
    "nearest_name",
    "one_line",
    "printable",
    "system_errors",
    "unknown_name",
    "warn",
]

_PACKAGES = ("gfimu", "sim", "firmware_bridge")
_LONGEST = 2000  # numerical: characters of a message
_BREAKS = re.compile("[ \t]*[\n\r\v\f\x1c-\x1e\x85\u2028\u2029]+[ \t]*|\t")
_CONTROL = re.compile(  # categories Cc, Cf, Cs, Zl and Zp of Unicode, without tab and line feed
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\xad\u0600-\u0605\u061c\u06dd\u070f\u180e\u200b-\u200f\u2028-\u202e\u2060-\u206f"
    "\ud800-\udfff\ufeff\ufff9-\ufffb\U000e0000-\U000e007f]"
)
_SHORTEST = 3  # numerical: letters of a name's beginning that say which one is meant
_ALIKE = 0.75  # numerical: of difflib; by choice, so that cube13 is near cube12 and nonsense near nothing


class GfimuError(Exception):
    """Base of every error that a user's input or environment can cause; commands print it as one line.

    Examples
    --------
    >>> import gfimu
    >>> try:
    ...     gfimu.score("cube13")
    ... except gfimu.GfimuError as error:
    ...     print(str(error).partition(";")[0])
    unknown array 'cube13'
    """

    def __str__(self) -> str:
        """Return the message as one line, the middle left out where what it quotes is very long."""
        text = one_line(super().__str__())
        return text if len(text) <= _LONGEST else f"{text[: _LONGEST // 2]} … {text[-_LONGEST // 2 :]}"


class InputError(GfimuError, ValueError):
    """A file or value that can't be used as given; commands end with exit code 2."""


class MissingPackageError(InputError, ImportError):
    """A package that gfimu runs without is needed and not installed; the message holds the command to install it."""


class WriteError(GfimuError, OSError):
    """A file that could not be written, on a full disk say; what stood in its place is as it was."""

    def __init__(self, path: object, error: OSError) -> None:
        reason = os.strerror(error.errno) if error.errno else str(error).partition("\n")[0]
        super().__init__(f"{path}: not written: {reason}; free space there, or choose another place")
        self.errno = error.errno


class UnitError(InputError):
    """Data in a unit other than the one the operation needs."""


class GeometryError(InputError):
    """A sensor geometry that can't see the motions asked for."""


class GfimuWarning(UserWarning):
    """Something that a user should know, though the work goes on; commands print it as one line."""


class OmittedFileWarning(GfimuWarning):
    """A file of a result is not written, as a package is not installed; the message holds the command to install it."""


class RecordingWarning(GfimuWarning):
    """A finding about a recording that its user should know, though the recording can be used."""


class CorruptValueWarning(RecordingWarning):
    """A recording has values that can't be measurements; they were left out."""


def printable(text: str) -> str:
    """Return a text in which what steers a terminal, or turns the reading direction, is escaped; lines stay lines."""
    return _CONTROL.sub(
        lambda found: f"\\u{ord(found[0]):04x}" if found[0] <= "\uffff" else f"\\U{ord(found[0]):08x}", text
    )


def one_line(text: str) -> str:
    """Return a text as `printable`, in one line."""
    return printable(_BREAKS.sub(" ", text))


@contextmanager
def naming(source: str) -> Iterator[None]:
    """Put the name of a file in front of the message of an `InputError` that does not have it; nothing if empty."""
    try:
        yield
    except InputError as error:
        if not source or source in str(error):
            raise
        raise type(error)(f"{source}: {error}") from None


@contextmanager
def system_errors(source: object, remedy: str = "check the path") -> Iterator[None]:
    """Turn an error of the system on a file or port into an `InputError` of one line with the remedy."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{source}: {error.strerror or error}; {remedy}") from None


def warn(text: str, category: type[GfimuWarning] = RecordingWarning) -> None:
    """Warn of something at the line outside of these packages that called them: the one that the user can change."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] in _PACKAGES:
        level, frame = level + 1, frame.f_back
    warnings.warn(text, category, stacklevel=level)


def check_name(kind: str, name: str, valid: Iterable[str]) -> None:
    """Refuse a name that is not in a list; ``kind`` is what it names."""
    if name not in valid:
        raise unknown_name(kind, name, valid)


def unknown_name(kind: str, name: str, valid: Iterable[str]) -> InputError:
    """Build the error for a name that is not in a list, with the list and the nearest name."""
    names = sorted(valid)
    return InputError(f"unknown {kind} {name!r}; valid: {', '.join(names)}{did_you_mean(name, names)}")


def did_you_mean(name: str, valid: Iterable[str], alike: float = _ALIKE) -> str:
    """Return the end of a message on a wrong name: the one of a list that was probably meant; empty where none is."""
    near = nearest_name(name, valid, alike)
    return f"; did you mean {near!r}?" if near else ""


def nearest_name(name: str, valid: Iterable[str], alike: float = _ALIKE) -> str | None:
    """Return the name of a list that a wrong one was probably meant to be; None where none is near.

    Case, and a dash for an underscore, count for nothing. Names are near from a ratio ``alike`` of `difflib` on; else
    the one that begins with what was given is, if it is the only one.
    """

    def plainly(text: str) -> str:
        return text.casefold().replace("-", "_")

    meant = {plainly(one): one for one in valid}
    given = plainly(name)
    near = difflib.get_close_matches(given, meant, 1, alike)
    longer = [one for one in meant if len(given) >= _SHORTEST and one.startswith(given)]
    if not near and len(longer) == 1:
        near = longer
    return meant[near[0]] if near else None
