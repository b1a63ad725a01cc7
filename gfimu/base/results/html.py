"""The small table that a notebook shows in place of a result's one line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import printable

__all__ = ["MOST_ROWS", "result_html"]

MOST_ROWS = 24
"""Rows of a table that are shown; the others are for `to_pandas`."""

# No colour of ink or paper is set: the notebook's own hold, light or dark. Rules are half transparent for the same end.
_RULE = "1px solid rgba(128,128,128,0.45)"
_CELL = "padding:2px 12px 2px 0;text-align:{side};vertical-align:top;background:transparent"
_TABLE = "border-collapse:collapse;margin:4px 0 8px;font-size:0.95em"


def result_html(
    heading: str,
    facts: Sequence[tuple[str, str]],
    columns: Mapping[str, NDArray[Any]] | None,
    notes: Sequence[str] = (),
) -> str:
    """Return a heading, facts, a table of columns and notes as HTML; every text is escaped.

    Parameters
    ----------
    heading : str
        What the result is.
    facts : sequence of (str, str)
        What is true of it as a whole: a word and a value with its unit.
    columns : mapping of str to ndarray, or None
        Columns of a short table, by name with unit.
    notes : sequence of str
        Sentences below.
    """
    parts = [f'<div class="gfimu-result" style="overflow-x:auto"><strong>{escape(heading)}</strong>']
    if facts:
        rows = "".join(f"<tr>{_cell(word, scope='row')}{_cell(value)}</tr>" for word, value in facts)
        parts.append(f'<table style="{_TABLE}"><tbody>{rows}</tbody></table>')
    if columns:
        parts.append(_table(columns))
    parts += [f'<p style="margin:2px 0;max-width:60em">{escape(note)}</p>' for note in notes]
    return printable("".join([*parts, "</div>"]))


def _table(columns: Mapping[str, NDArray[Any]]) -> str:
    columns = {name: values for name, values in columns.items() if not _is_blank(values)}
    sides = {name: "right" if values.dtype.kind in "fiu" else "left" for name, values in columns.items()}
    head = "".join(_cell(name, scope="col", side=sides[name]) for name in columns)
    texts = {name: [_text(value) for value in values[:MOST_ROWS].tolist()] for name, values in columns.items()}
    body = "".join(
        "<tr>" + "".join(_cell(text, side=sides[name]) for name, text in zip(texts, row, strict=True)) + "</tr>"
        for row in zip(*texts.values(), strict=True)
    )
    more = max((len(values) for values in columns.values()), default=0) - MOST_ROWS
    if more > 0:
        body += (
            f'<tr><td colspan="{len(columns)}" style="opacity:0.75">… {more} more rows: to_pandas() has all</td></tr>'
        )
    return (
        f'<table style="{_TABLE}"><thead style="border-bottom:{_RULE}"><tr>{head}</tr></thead>'
        f"<tbody>{body}</tbody></table>"
    )


def _is_blank(values: NDArray[Any]) -> bool:
    """Whether a column holds empty texts only."""
    return bool(len(values)) and values.dtype.kind in "OU" and not any(values.tolist())


def _cell(text: str, *, scope: str = "", side: str = "left") -> str:
    style = _CELL.format(side=side) + (";font-variant-numeric:tabular-nums" if side == "right" else "")
    if scope:
        return f'<th scope="{scope}" style="{style};font-weight:600">{escape(text)}</th>'
    return f'<td style="{style}">{escape(text)}</td>'


def _text(value: object) -> str:
    """Return a value of a table in few characters; empty for what is missing."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return "" if np.isnan(value) else "∞" if value == np.inf else f"{value:.4g}"
    return "" if value is None else str(value)
