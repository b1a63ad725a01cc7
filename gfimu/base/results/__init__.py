"""What every result offers a notebook: a table, tables of other libraries, a picture, a rerun recording.

A result describes itself once, as columns, facts and panels; tables, pages and pictures of all results are made here.
"""

from gfimu.base.results.figure import drawn_chips, save_figure
from gfimu.base.results.html import result_html
from gfimu.base.results.panels import Panel, Series, axis_series, columns_of, one_row, text_column
from gfimu.base.results.result import PlottedResult, TableResult

__all__ = [
    "Panel",
    "PlottedResult",
    "Series",
    "TableResult",
    "axis_series",
    "columns_of",
    "drawn_chips",
    "one_row",
    "result_html",
    "save_figure",
    "text_column",
]
