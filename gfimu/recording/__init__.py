"""Recordings: the one thing that the world, the wire and the mind exchange.

In: gfimu's files, and those of other loggers by a map of their columns (`importing`); references on clocks of their
own (`joining`).
Out: `Recording` with its array and times, and what is doubtful in it (`checks`, `evidence`, `timing`).
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.recording.carried_array import array_difference as array_difference
    from gfimu.recording.checks import check_recording as check_recording
    from gfimu.recording.clipping import without_clipped as without_clipped
    from gfimu.recording.evidence.reference_rate import odd_rates as odd_rates
    from gfimu.recording.formats import open_run as open_run
    from gfimu.recording.importing import inspect_file as inspect_file
    from gfimu.recording.importing.clock import increasing_times as increasing_times
    from gfimu.recording.importing.column_map import ColumnSpec as ColumnSpec
    from gfimu.recording.importing.column_map import TextSpec as TextSpec
    from gfimu.recording.importing.dates import nanoseconds_of as nanoseconds_of
    from gfimu.recording.importing.guessing.likely_reference import likely_references as likely_references
    from gfimu.recording.importing.guessing.likely_reference import reference_remedy as reference_remedy
    from gfimu.recording.importing.guessing.times import RATES as RATES
    from gfimu.recording.importing.guessing.times import stated_rate as stated_rate
    from gfimu.recording.importing.notation import factor_of as factor_of
    from gfimu.recording.importing.oddities import oddities as oddities
    from gfimu.recording.importing.oddities import rails_of as rails_of
    from gfimu.recording.importing.piece import nearest_rows as nearest_rows
    from gfimu.recording.importing.raw_table import RawTable as RawTable
    from gfimu.recording.importing.readers import read_foreign as read_foreign
    from gfimu.recording.importing.readers.text import table_of_text as table_of_text
    from gfimu.recording.joining import displaced_reference as displaced_reference
    from gfimu.recording.mapped import mapped_recording as mapped_recording
    from gfimu.recording.mimu4444 import is_mimu4444 as is_mimu4444
    from gfimu.recording.recording import Recording as Recording
    from gfimu.recording.rest import detect_rest as detect_rest
    from gfimu.recording.rest import motion_statistic as motion_statistic
    from gfimu.recording.timing.conversion_times import conversion_times as conversion_times
    from gfimu.recording.timing.reference_times import reference_on_rows as reference_on_rows
    from gfimu.recording.timing.reference_times import reference_series as reference_series
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
