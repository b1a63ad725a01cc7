"""Recordings: the one thing that the world, the wire and the mind exchange.

In: gfimu's files, and those of other loggers by a map of their columns (`importing`); references on clocks of their
own (`joining`).
Out: `Recording` with its array and times, and what is doubtful in it (`doubts`, `evidence`, `timing`).
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.recording.carried_array import array_difference, array_metadata
    from gfimu.recording.doubts.doubt import Doubt
    from gfimu.recording.doubts.judge import doubts_of, without_doubtful
    from gfimu.recording.doubts.rails import rails_of
    from gfimu.recording.doubts.samples import sample_doubts
    from gfimu.recording.doubts.stamps import stamp_doubts, steady_clock
    from gfimu.recording.evidence.reference_rate import odd_rates
    from gfimu.recording.formats import open_run
    from gfimu.recording.importing import inspect_file
    from gfimu.recording.importing.clock import increasing_times
    from gfimu.recording.importing.column_map import ColumnSpec, TextSpec
    from gfimu.recording.importing.dates import nanoseconds_of
    from gfimu.recording.importing.piece import nearest_rows
    from gfimu.recording.importing.readers import read_foreign
    from gfimu.recording.importing.readers.registry import format_of
    from gfimu.recording.importing.readers.text import table_of_text
    from gfimu.recording.joining import (
        ReferenceSeries,
        displaced_reference,
        join_reference,
        open_reference,
        own_alignment,
    )
    from gfimu.recording.mapped import mapped_recording
    from gfimu.recording.mimu4444 import is_mimu4444
    from gfimu.recording.reading import read_bytes
    from gfimu.recording.recording import Recording
    from gfimu.recording.rest import detect_rest, motion_statistic
    from gfimu.recording.tables.column_file import write_columns
    from gfimu.recording.timing.conversion_times import conversion_times
    from gfimu.recording.timing.reference_times import reference_on_rows, reference_series
    from gfimu.recording.units import factor_of
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
