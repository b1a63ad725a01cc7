"""Lower bounds on the error of the angular rate: of one sample (`sample`), over a run (`posterior`)."""

from __future__ import annotations

import importlib
from typing import Any

_HOME = {
    "alpha_std": "sample",
    "omega_products_jacobian": "sample",
    "posterior_rate_bound": "posterior",
    "rate_bound": "sample",
    "rate_bound_isotropic": "sample",
    "rate_information": "sample",
    "steady_rate_bound": "sample",
}


def __getattr__(name: str) -> Any:
    """Load a bound on first use: that over a run needs a compiler, which the others must not wait for."""
    if name not in _HOME:
        raise AttributeError(f"module 'gfimu.bounds' has no attribute {name!r}")
    return getattr(importlib.import_module(f"gfimu.bounds.{_HOME[name]}"), name)
