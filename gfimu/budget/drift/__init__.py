"""Position drift: a budget in closed form and a Monte Carlo of the full navigation."""

from gfimu.budget.drift.budget import TILT_LIMIT, DriftBudget, DriftTerm, drift_budget
from gfimu.budget.drift.closed_forms import ErrorSources
from gfimu.budget.drift.monte_carlo import monte_carlo_drift
from gfimu.motion.equivalent_errors import equivalent_p_bias, equivalent_rate_drift

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
