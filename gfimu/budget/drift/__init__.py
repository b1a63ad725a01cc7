"""Position drift: a budget in closed form and a Monte Carlo of the full navigation."""

from gfimu.budget.drift.budget import TILT_LIMIT, drift_budget
from gfimu.budget.drift.closed_forms import ErrorSources
from gfimu.motion.equivalent_errors import equivalent_rate_drift

__all__ = ["TILT_LIMIT", "ErrorSources", "drift_budget", "equivalent_rate_drift"]
