"""Recordings: the one thing that the world, the wire and the mind exchange.

In: gfimu's files, and those of other loggers by a map of their columns (`importing`); references on clocks of their
own (`joining`).
Out: `Recording` with its array and times, and what is doubtful in it (`checks`, `evidence`, `timing`).
"""

from gfimu.recording.recording import Recording

__all__ = ["Recording"]
