"""MuJoCo's system identification (``mujoco.sysid``), given the name: it fits sizes and names nothing by itself.

Its optimiser, weights and intervals; the predictions are those of the twin, which agree with MuJoCo to 1e-9 m/s².
"""

from __future__ import annotations

from contextlib import redirect_stdout
from io import StringIO
from typing import Any

import numpy as np

from gfimu.base.errors import InputError
from sim.effects import EFFECTS, Effect, make_effect
from sim.trials.benchmark.library import KnownDrive, stated_parameters
from sim.trials.benchmark.truth_file import fixed_world
from sim.trials.benchmark.world import Task

__all__ = ["answer", "identify"]

_HALF_WIDTH = 1.96  # of a 95 % interval, in standard deviations


def answer(task: Task) -> dict[str, Any]:
    """Fit a single hidden effect of the library, given its name, place and shape; other worlds are not for it."""
    truth = fixed_world(task.world).truth
    if not truth.hidden:
        return {"verdict": "nothing_found"}
    if len(truth.hidden) > 1 or truth.hidden[0][0] not in EFFECTS:
        return {"verdict": "unknown"}
    effect = make_effect(*truth.hidden[0])
    places = np.flatnonzero(effect.size_values(task.twin.array))
    given = {key: {"value": value} for key, value in effect.parameters.items()}
    if len(places):
        sizes, stds = np.zeros((2, len(effect.sizes(task.twin.array))))
        sizes[places], stds[places] = identify(task, effect, places)
        found = stated_parameters(type(effect), task.twin.array, sizes, np.diag(stds**2), effect.shape_values())
        given |= {key: one for key, one in found.items() if "std" in one}
    return {"verdict": "explained", "causes": [{"effect": effect.name, "parameters": given}]}


def identify(task: Any, effect: Effect, places: Any) -> tuple[Any, Any]:
    """Fit some sizes of an effect, the indices ``places``; returns estimates and standard deviations."""
    from mujoco import sysid

    if not hasattr(sysid, "optimize"):
        raise InputError('MuJoCo\'s system identification is not installed: pip install "mujoco[sysid]"')
    array, shape = task.twin.array, effect.shape_values()
    measured, drive = task.recording.for_array(array), KnownDrive(task.recording, task.twin)
    priors = np.array([size.prior_std for size in effect.sizes(array)])

    def residual(x: Any, parameters: Any) -> tuple[list[Any], None, None]:
        columns = []
        for free in np.reshape(x, (len(places), -1)).T:
            values = np.zeros(len(priors))
            values[places] = free * priors[places]
            left = drive.readings(type(effect).from_sizes(array, values, shape)) - measured
            columns.append(sysid.normalize_residual(left, measured).ravel())
        return [np.array(columns).T if np.ndim(x) > 1 else columns[0]], None, None

    sizes = sysid.ParameterDict()
    for place in places:  # in units of the prior, for the optimiser's sake
        sizes.add(sysid.Parameter(str(place), 0.0, -1e3, 1e3))
    with redirect_stdout(StringIO()):  # its optimiser prints each iteration
        fitted, result = sysid.optimize(sizes, residual, verbose=False, max_iters=20)
    final, *_ = residual(fitted.as_vector(), fitted)
    _, half_widths = sysid.calculate_intervals(final, np.asarray(result.jac))
    return fitted.as_vector() * priors[places], np.asarray(half_widths) / _HALF_WIDTH * priors[places]
