"""What every result offers a notebook: a table, tables of other libraries, a picture, a rerun recording.

A result describes itself once, as columns, facts and panels; tables, pages and pictures of all results are made here.
"""

from gfimu.results.html import result_html
from gfimu.results.panels import Panel, Series, axis_series, text_column
from gfimu.results.result import PlottedResult, TableResult

__all__ = ["Panel", "PlottedResult", "Series", "TableResult", "axis_series", "result_html", "text_column"]
