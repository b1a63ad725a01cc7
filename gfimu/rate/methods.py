"""All estimators of the angular rate behind one call.

=============  ==========================================  =======================  ==========================
method         uses                                        sign of ω                error in steady turning
=============  ==========================================  =======================  ==========================
``integrate``  α                                           from the start           grows with √t, and with
                                                                                    b t of what bias is left
``algebraic``  null space, sample by sample                by α, with probability   σ_α/|ω| × 1.0 … 1.22
``ml``         null space, sample by sample                by α, with probability   σ_α/|ω|
``filter``     α, null space, rest; samples so far         start, or manoeuvre      σ_α √(Δt/|ω|)
``smoother``   the same, all samples                       start, or manoeuvre      σ_α √(Δt/2|ω|)
``batch``      the same, adjusted until nothing changes    start, or manoeuvre      σ_α √(Δt/2|ω|)
=============  ==========================================  =======================  ==========================
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from gfimu.array.array import AccelerometerArray
from gfimu.rate.registry import RATE_METHODS, rate_method
from gfimu.rate.result import RateEstimate
from gfimu.rate.sensing import SensorErrors
from gfimu.rate.settings import FilterSettings

if TYPE_CHECKING:
    from gfimu.rate.path_start import PathStart
    from gfimu.rate.references import Measured

__all__ = ["RATE_METHODS", "estimate_rate"]


def estimate_rate(
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    *,
    method: str = "filter",
    settings: FilterSettings | None = None,
    gyro: ArrayLike | None = None,
    references: Sequence[Measured] = (),
    path: PathStart | None = None,
    progress: Callable[[float], object] | None = None,
) -> RateEstimate:
    """Estimate the angular rate of a recording.

    Parameters
    ----------
    array : AccelerometerArray
        The array, with c channels.
    t : array_like, shape (n,)
        Sample times, s.
    readings : array_like, shape (n, c)
        Specific force, m/s²; NaN where a channel is missing.
    errors : SensorErrors
        Errors of the sensors; `SensorErrors.from_parts` takes them from data sheets.
    method : str
        A key of `gfimu.rate.registry.RATE_METHODS`; see the module's table.
    settings : FilterSettings, optional
        Start of the run, quadrature, recognition of rest. The per-sample methods and the integration take their
        biases from a leading rest if the start is at rest.
    gyro : array_like, shape (n, 3), optional
        Gyro that ``filter``, ``smoother`` and ``batch`` fuse, rad/s; NaN where saturated.
    references : sequence of Measured, optional
        What else these use beside the readings: a tachometer, positions (`gfimu.rate.references`).
    path : PathStart, optional
        Where attitude, velocity and position start, for a method that follows them (`RateMethod.follows_path`).
    progress : callable, optional
        Called by ``filter``, ``smoother`` and ``batch`` with the share of the work done so far, 0 to 1.

    Raises
    ------
    InputError
        If the method is unknown, can't use references, or the data don't fit.
    GeometryError
        If the array can't see what the method needs.

    Examples
    --------
    >>> import gfimu
    >>> run = gfimu.simulate("paper_run", seed=1)
    >>> found = gfimu.estimate_rate(run.array, run.t_s, run.readings, gfimu.SensorErrors.from_parts(run.array, 100.0))
    >>> found.omega.shape
    (3000, 3)
    """
    chosen = rate_method(method)
    start = settings or FilterSettings()
    followed = {"path": path} if chosen.follows_path else {}
    if gyro is not None:
        from gfimu.rate.references import Reference  # compiles with the filter

        references = (*references, Reference.gyro(errors).measured(gyro, len(np.atleast_1d(np.asarray(t)))))
    if chosen.recursive:
        beside = {"references": references} if references else {}
        return chosen.solver(array, t, readings, errors, start, progress=progress, **beside, **followed)
    for one in references:
        chosen.refuse_references(one.reference.name)
    return chosen.solver(array, t, readings, errors, start, **followed)
