"""Recordings: the class, its files and formats, the array they carry, checks of the channels, rests."""

from gfimu.recording.recording import Recording

__all__ = ["Recording"]
