"""Isolated wrong or missing values of a series at rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError

__all__ = ["filled"]


def filled(series):
    return series, 1.0
