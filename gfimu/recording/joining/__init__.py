"""Two files of two clocks: the offset and rate error between them, and one recording of both."""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.recording.joining.join import Joined, join_reference
    from gfimu.recording.joining.own_clock import displaced_reference, own_alignment
    from gfimu.recording.joining.reference_file import open_reference
    from gfimu.recording.joining.series import ReferenceSeries
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
