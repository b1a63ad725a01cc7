"""Two files of two clocks: the offset and rate error between them, and one recording of both."""

from gfimu.recording.joining.join import Joined, join_reference
from gfimu.recording.joining.own_clock import displaced_reference
from gfimu.recording.joining.reference_file import ReferenceSeries, open_reference

__all__ = ["Joined", "ReferenceSeries", "displaced_reference", "join_reference", "open_reference"]
