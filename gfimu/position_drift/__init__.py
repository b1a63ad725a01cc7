"""Position drift: a budget in closed form and a Monte Carlo of the full navigation."""

from gfimu.motion.equivalent_errors import equivalent_p_bias, equivalent_rate_drift
from gfimu.position_drift.budget import TILT_LIMIT, DriftBudget, DriftTerm, drift_budget
from gfimu.position_drift.closed_forms import ErrorSources
from gfimu.position_drift.monte_carlo import monte_carlo_drift

__all__ = [
    "TILT_LIMIT",
    "DriftBudget",
    "DriftTerm",
    "ErrorSources",
    "drift_budget",
    "equivalent_p_bias",
    "equivalent_rate_drift",
    "monte_carlo_drift",
]
