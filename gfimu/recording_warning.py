"""What a reader of recordings warns of; commands print each such warning as one line."""

from __future__ import annotations

__all__ = ["CorruptValueWarning", "RecordingWarning"]


class RecordingWarning(UserWarning):
    """Something about a recording that a user should know, though it can be used."""


class CorruptValueWarning(RecordingWarning):
    """Values of a recording that can be no measurement were left out."""
