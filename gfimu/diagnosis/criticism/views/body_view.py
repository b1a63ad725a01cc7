"""A run of a free body as pictures and reports show it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.terms.hand.noise import BodyNoise
from gfimu.diagnosis.terms.hand.posterior import HandPosterior
from gfimu.motion.attitude import from_rotation, integrate_attitude, to_rotation

__all__ = ["body_noise_floor", "body_view"]

_SLOW_SHARE = 0.6  # numerical: of bias instability, about the mean of a run of a minute, by its spectrum


def body_view(before: HandPosterior, after: HandPosterior) -> RunView:
    """Collect a run: the motion, as far as the gyro doesn't hold it, is fitted before and after alike."""
    stretch, levels = after.stretch, after.levels
    run = stretch.run
    measured = np.where(run.valid, run.readings, 0.0)
    rate, acceleration = after.drive.spin.rate_at()
    speed = np.linalg.norm(rate, axis=1)
    return RunView(
        run.name,
        run.t,
        run.readings,
        run.valid & stretch.use[:, None] & stretch.alive,
        measured - before.without_motion,
        measured - after.without_motion,
        np.linalg.norm(run.gyro, axis=1),
        speed,
        speed,
        np.full(len(run.t), np.nan),
        speed,
        np.linalg.norm(acceleration, axis=1),
        run.temperature,
        np.where(stretch.alive, levels.white[:-1], levels.typical),
        _attitude(after, rate),
    )


def _attitude(at: HandPosterior, rate: NDArray[np.float64]) -> NDArray[np.float64]:
    """Integrate the rate from the run's first rest, or its start, with gravity along z there; shape (n, 4)."""
    run, rest = at.stretch.run, np.flatnonzero(at.stretch.run.rest)
    up = at.drive.spin.force[rest[0] if len(rest) else 0]
    turned = to_rotation(integrate_attitude(run.t, rate))
    here = turned[int(rest[0]) if len(rest) else 0]
    level, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [here.apply(up)])
    return from_rotation(level * turned)


def body_noise_floor(stretch: BodyStretch, levels: BodyNoise) -> float:
    """Rms of the sensors' own noise in a residual whose specific force is fitted, m/s²."""
    power = np.mean(levels.white[:-1][stretch.alive] ** 2) + _SLOW_SHARE * levels.instability**2
    return float(np.sqrt(power * (1.0 - 3.0 / stretch.alive.sum())))
