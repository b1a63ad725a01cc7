"""Error budgets: what errors of parts, places and angles become in the result.

In: an array, standard deviations of its errors, a motion.
Out: drift of the position with time (`drift`), shares of each tolerance in the error of a motion (`tolerances`).
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.budget.drift.budget import motion_covariance
    from gfimu.budget.drift.closed_forms import position_error
    from gfimu.budget.drift.rest_windows import NoiseResponse, rest_drift
    from gfimu.budget.tolerances.budget import QUANTITIES
    from gfimu.budget.tolerances.words import pay_for, room_for
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
