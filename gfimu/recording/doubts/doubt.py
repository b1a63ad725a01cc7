"""One thing that is wrong, or may be wrong, with a recording."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from gfimu.base.declared import Declared, figure

__all__ = ["Doubt", "rows_in_words"]

_LISTED = 6  # numerical: rows that a sentence lists


def _no_rows() -> NDArray[np.intp]:
    return np.empty(0, dtype=np.intp)


@dataclass(frozen=True, eq=False)
class Doubt(Declared):
    """Something wrong with a recording.

    Parameters
    ----------
    kind : str
        Of the times ``bursts``, ``gaps``, ``scatter``, ``time``; of the readings ``corrupt``, ``missing``, ``dead``,
        ``wrong_read``, ``spike``, ``frozen``, ``clipped``, ``noisy``, ``duplicate``; of their meaning ``unit``,
        ``chip_unit``, ``sign``, ``exchange``, ``array``, ``reference``, ``rest_bias``.
    text : str
        Cause and remedy, one line.
    refused : bool
        Whether the recording should not be used as it is.
    channels : tuple of str
        Channels, or references, that it is about.
    rows : ndarray of int, shape (k,)
        Rows that it is about, from 0; empty where it is about all.
    is_no_reading : bool
        Whether these channels hold no readings in these rows; results do without them.
    is_minor : bool
        Whether it is worth a line of a report on the recording and no warning.
    """

    kind: Annotated[str, figure("What kind of doubt it is.")]
    text: Annotated[str, figure("Cause and remedy.")]
    refused: bool = False
    channels: Annotated[tuple[str, ...], figure("Channels or references that it is about.")] = ()
    rows: Annotated[NDArray[np.intp], figure("Rows that it is about, from 0; empty: all.")] = field(
        default_factory=_no_rows
    )
    is_no_reading: Annotated[bool, figure("Whether results do without these readings.", key="left_out")] = False
    is_minor: bool = False

    @property
    def severity(self) -> Annotated[str, figure("How much it matters: refused, warning or note.", before="channels")]:
        """``refused``, ``warning`` or ``note``."""
        return "refused" if self.refused else "note" if self.is_minor else "warning"


def rows_in_words(rows: NDArray[np.intp]) -> str:
    """Return the numbers of some rows, counted from 1, for a sentence."""
    listed = ", ".join(str(row + 1) for row in rows[:_LISTED].tolist())
    more = f" and {len(rows) - _LISTED} more" if len(rows) > _LISTED else ""
    return f"row{'s' if len(rows) > 1 else ''} {listed}{more}"
