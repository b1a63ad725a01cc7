"""Worlds of another generator: its function is asked for a run, which becomes a recording of the array."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.recording import Recording
from sim.trials.worlds.hidden import Measurement

__all__ = ["ElsewhereRun", "recorded_elsewhere"]


class ElsewhereRun(Protocol):
    """What a generator returns: columns by name with unit, what is hidden, and its d′, the drive known."""

    @property
    def columns(self) -> Mapping[str, Any]: ...  # noqa: D102
    @property
    def truth(self) -> Sequence[tuple[str, Mapping[str, Any]]]: ...  # noqa: D102
    @property
    def detectability(self) -> float: ...  # noqa: D102


def recorded_elsewhere(
    hide: Callable[..., ElsewhereRun],
    seed: int,
    effects: Sequence[str],
    size: float,
    array: AccelerometerArray,
    setting: Measurement,
) -> tuple[Recording, ElsewhereRun]:
    """Hide effects in a world of another generator and record it.

    Parameters
    ----------
    hide : callable
        The generator, called as ``hide(seed, effects, size, **measurement)`` with ``duration``, ``sample_rate``,
        ``bias_instability_m_s2`` and ``tacho_noise_rad_s``.
    seed : int
        Its seed.
    effects : sequence of str
        Names of what is hidden.
    size : float
        Size of each, d′.
    array : AccelerometerArray
        The array of the columns.
    setting : Measurement
        Length, rate and noise.
    """
    run = hide(
        seed,
        effects,
        size,
        duration=setting.duration,
        sample_rate=setting.sample_rate,
        bias_instability_m_s2=setting.bias_instability,
        tacho_noise_rad_s=setting.tacho_noise,
    )
    columns = {name: np.asarray(values) for name, values in run.columns.items()}
    readings = np.column_stack([columns.pop(f"{channel}_m_s2") for channel in array.channels])
    return Recording.from_arrays(columns.pop("t_s"), readings, array, reference=columns), run
