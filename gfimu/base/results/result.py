"""The classes that results inherit from: with a table, with a picture as well, and with a rig in 3-D."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, overload

from numpy.typing import NDArray

from gfimu.base.declared import Declared
from gfimu.base.optional_packages import require
from gfimu.base.results.html import result_html
from gfimu.base.results.panels import Panel

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import pyarrow as pa
    import rerun as rr
    from matplotlib.figure import Figure, SubFigure

    _Canvas = TypeVar("_Canvas", Figure, SubFigure)

__all__ = ["PlottedResult", "TableResult"]


class TableResult(ABC):
    """A result that shows itself in a notebook and hands its columns to pandas, polars and Arrow."""

    __slots__ = ()

    @abstractmethod
    def to_columns(self) -> Mapping[str, NDArray[Any]]:
        """Return the columns by name with unit."""

    def _table_metadata(self) -> Mapping[str, Any]:
        return getattr(self, "metadata", {})

    def to_pandas(self) -> pd.DataFrame:
        """Return the columns as a pandas table, with the metadata in ``attrs``.

        Raises
        ------
        MissingPackageError
            If pandas is not installed.
        """
        require("to_pandas", "pandas")
        import pandas as pd

        from gfimu.base.files.metadata import to_json

        table = pd.DataFrame(dict(self.to_columns()))
        table.attrs = json.loads(to_json(dict(self._table_metadata())))
        return table

    def to_polars(self) -> pl.DataFrame:
        """Return the columns as a polars table; polars keeps no metadata.

        Raises
        ------
        MissingPackageError
            If polars is not installed.
        """
        require("to_polars", "polars")
        import polars as pl

        return pl.DataFrame(self.to_arrow())

    def to_arrow(self) -> pa.Table:
        """Return the columns as a pyarrow table, with the metadata as JSON in its schema."""
        import pyarrow as pa

        from gfimu.base.files.metadata import schema_metadata

        columns = {name: pa.array(values) for name, values in self.to_columns().items()}
        return pa.table(columns, metadata=schema_metadata(self._table_metadata()))

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any:
        """Return the columns as an Arrow stream: ``polars.DataFrame(result)``, ``pyarrow.table(result)``."""
        return self.to_arrow().__arrow_c_stream__(requested_schema)

    def _heading(self) -> str:
        """Return what the result is, in a few words."""
        return type(self).__name__

    def _facts(self) -> Sequence[tuple[str, str]]:
        """Return what is true of the whole result: a word, and a value with its unit."""
        return self.facts() if isinstance(self, Declared) else ()

    def _notes(self) -> Sequence[str]:
        """Return sentences that belong to it: warnings, a verdict in words."""
        return ()

    def _shown(self) -> Mapping[str, NDArray[Any]] | None:
        """Return the columns of the notebook's table; None for samples, or where the facts suffice."""
        columns = self.to_columns()
        return None if "t_s" in columns else columns

    def _repr_html_(self) -> str:
        return result_html(self._heading(), self._facts(), self._shown(), self._notes())


class PlottedResult(TableResult):
    """A result with a picture: matplotlib's by `plot`, rerun's by `to_rerun` or `log`."""

    __slots__ = ()

    @abstractmethod
    def _panels(self) -> Sequence[Panel]:
        """Return what the picture shows."""

    @overload
    def plot(self, figure: None = None) -> Figure: ...

    @overload
    def plot(self, figure: _Canvas) -> _Canvas: ...

    def plot(self, figure: Figure | SubFigure | None = None) -> Figure | SubFigure:
        """Draw the result with matplotlib: units on the axes, bands and bars of ±2σ.

        Parameters
        ----------
        figure : Figure or SubFigure, optional
            Where to draw; by default a new figure. It is shown where it is the value of a notebook's cell, and by
            ``matplotlib.pyplot.show()`` in a script with a window.

        Returns
        -------
        Figure or SubFigure
            The figure, for ``savefig`` and changes.

        Raises
        ------
        MissingPackageError
            If matplotlib is not installed.
        """
        require("plot", "matplotlib")
        from gfimu.base.results.figure import drawn

        return drawn(self._panels(), figure)

    def to_picture(self, path: str | Path) -> None:
        """Write the picture of `plot` below the heading of the result, ``.png``, ``.svg`` or ``.pdf``.

        Raises
        ------
        MissingPackageError
            If matplotlib is not installed.
        InputError
            If the folder of the file can't be written to.
        """
        require("a picture", "matplotlib")
        from gfimu.base.results.figure import write_panels

        write_panels(path, self._heading(), self._panels())

    def log(self, stream: rr.RecordingStream, entity: str = "") -> None:
        """Log the facts and panels of the result to a rerun stream.

        Parameters
        ----------
        stream : rerun.RecordingStream
            Where to log.
        entity : str
            Path of an entity above what is logged; the name of the class by default.
        """
        require("a rerun recording", "rerun")
        from gfimu.base.results.stream import log_result

        log_result(stream, entity or type(self).__name__.lower(), self._heading(), self._facts(), self._panels())

    def to_rerun(self, path: str | Path) -> Path:
        """Write the result as a rerun recording, ``.rrd``, with a layout in which the viewer opens it.

        `gfimu.view` writes that of a run with its rig in 3-D.

        Parameters
        ----------
        path : str or Path
            File to write.

        Raises
        ------
        InputError
            If the name does not end in ``.rrd``, or its folder can't be written to.
        """
        require("a rerun recording", "rerun")
        from gfimu.base.results.stream import write_result

        return write_result(path, type(self).__name__.lower(), self._heading(), self._facts(), self._panels())
